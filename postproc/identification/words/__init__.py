"""What a diagnosis says: its `sentences`, and `text` and JSON of it."""
