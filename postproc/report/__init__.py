"""What draws any result, from its `blocks`: as JSON, as text on a `terminal`, as one self-contained HTML `page`.

`sarif` makes a log of findings for other tools; `drawing` has the pictures.
"""
