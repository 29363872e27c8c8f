"""What came out of a compensation.

`outcomes` of every statement, `seams`; `figures` before and after, `accuracy` (what the model itself is sure of),
`doubts` (corrections too large to be believed, limits of the joints, targets that look jogged with this arm).
"""
