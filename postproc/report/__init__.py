"""What draws any result, from its `blocks`: as JSON, as text on a `terminal`, as one self-contained HTML `page`.

`document` makes plain JSON of values, `sarif` a log of findings for other tools; `drawing` has the pictures.
"""
