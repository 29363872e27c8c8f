"""Two programs compared by meaning.

`pairing` pairs motion statements and what stands between them; `compare` finds each `difference`.
"""
