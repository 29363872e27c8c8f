"""What came out of a compensation.

`outcomes` of every statement, `seams`, `transitions`; `figures` before and after, `dynamics` (limits of the joints),
`accuracy` (what the model itself is sure of), `belief` (corrections too large to be believed), `provenance` (targets
that look jogged with this arm).
"""
