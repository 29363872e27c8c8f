"""Measurement tables: reading, units, frames, repeats, ISO 9283 figures."""
