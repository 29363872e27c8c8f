"""Fit, compare, diagnose, and the design of the next measurement."""
