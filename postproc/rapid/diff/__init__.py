"""Two programs compared by meaning.

`pairing` pairs motion statements and what stands between them; `compare` finds each `difference`;
`paths` has where both lead the TCP.
"""
