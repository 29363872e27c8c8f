"""Measurement tables: reading, units, frames, repeats, ISO 9283 figures.

What was measured: `measurements` in SI, `observations` (kinds of measured numbers and their units), and `kinds` of
readings in place of positions. From files: `read`.
What is likely wrong, and the noise that repeats tell: `checks`, by `alignment` of points and arm and the `consensus` of
rows on it. Sizes of `errors`, accuracy and repeatability, and when chance is ruled out. Records of a moving arm:
`trajectory`. Targets that were taught anew, and a table of them: `touchups`.
"""
