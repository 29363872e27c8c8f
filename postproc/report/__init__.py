"""One self-contained HTML page from any result; ``templates/report`` has what draws it.

A page each: `compensation`, `batch`, `comparison`, `diagnosis`, `addition`, `difference`; `certificate` is to be
signed, `inspection` lists what a program moves, in which `postures`. `page` puts sections and tables together,
`parameters` is one of them, `drawing` has the pictures. `document` makes plain JSON of a result, `sarif` a log of
findings for other tools.
"""
