"""What a fit is worth beyond its rows.

What free functions of the channels still find in a residual: `residual_split`. Where no row is near: `regions`, by what
the model lacks there (`lacking`).
"""
