"""Two programs compared by meaning.

`pairing` pairs motion statements, `align` what stands between them; `compare` finds each `difference`, `words` that of
other statements.
"""
