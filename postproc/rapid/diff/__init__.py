"""Two programs compared by meaning.

`align` pairs statements, `compare` finds each `difference`, `words` says it.
"""
