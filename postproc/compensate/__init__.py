"""The inverse of the model along a path, where to add targets, and the proof."""
