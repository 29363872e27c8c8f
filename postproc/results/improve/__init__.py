"""What is said of models and measurements.

A file each: `fit`, `comparison`, `diagnosis` with its `sentences`, `addition` of effects, `plan` of poses to measure
next, `first_plan` without a table, `touchups`.
"""
