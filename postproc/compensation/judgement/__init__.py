"""What came out of a compensation.

`outcomes` of every statement, `seams`; `figures` before and after, `accuracy` (what is expected on the arm) and for it
`type_scatter` (arms that nobody measured), `doubts` (corrections too large to be believed, limits of the joints,
targets that look jogged with this arm).
"""
