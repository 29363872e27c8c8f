"""What a fit says: `record` (JSON, cautions), `text`, `findings` on the data, and the `wording` of numbers."""
