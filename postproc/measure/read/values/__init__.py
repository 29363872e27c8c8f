"""Single values as tables write them: `numbers`, `times`, `units`, `turns` (orientations)."""
