"""RAPID text from corrected programs, through Jinja templates.

`module` writes targets and statements into a program (`text`: numbers and lines as RAPID writes them; `templates`),
`header` what was done above them. `seam` makes a weld module of `seampoints`, `measuring` one that visits poses.
"""
