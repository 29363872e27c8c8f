"""Commands to look things up: `effects`, `robots`, `explain`."""
