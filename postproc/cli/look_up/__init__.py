"""Commands to look things up: `effects`, `robots`, `schema`, `explain`."""
