"""RAPID text from corrected programs, through Jinja templates.

`module` writes targets and statements into a program (`numbers` as RAPID writes them, `lines` as they stand there,
`templates`), `header` what was done above them. `seam` makes a weld module of `seampoints`, `measuring` one that visits
poses.
"""
