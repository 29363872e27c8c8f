"""Two programs compared by meaning.

`pairing` pairs motion statements and what stands between them; `compare` finds each `difference`;
`files` compares two versions of a file, and `paths` has where both lead the TCP.
"""
