"""Commands to look things up: `effects`, `robots`, `schema` (of `schemas`), `explain`."""
