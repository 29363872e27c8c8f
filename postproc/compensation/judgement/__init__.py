"""What came out of a compensation.

`outcomes` of every statement, `seams`; `figures` before and after, `accuracy` (what is expected on the arm, and of that
what arms of a type leave, `type_scatter`), `doubts` (corrections too large to be believed, limits of the joints,
targets that look jogged with this arm).
"""
