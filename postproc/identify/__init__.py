"""Compare, diagnose, add, predict, and the design of the next measurement."""
