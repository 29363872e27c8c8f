"""The library of physical effects: one file each, with its equation, source, ordinary size, and what tells it apart.

They stand by where they act: `joints`, `structure` (bodies and what carries them), `loads`, `cell` (external axes),
`frames` (where instrument and tool are, and what is said about the data). `curve`: a law without a name.
"""
