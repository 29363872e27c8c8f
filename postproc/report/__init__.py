"""One self-contained HTML page from any result; ``templates/report`` has what draws it.

A page each: `compensation`, `batch`, `comparison`, `diagnosis`, `addition`, `difference`; `certificate` is to be
signed, `inspection` lists what a program moves. `page` puts sections and tables together: `path` has what is drawn of
a program, `steps` of a model from the base to the last effect, `residuals`, `laws` and `parameters` of a fit; `charts`
are drawn by `svg`, numbers carried in `columns`, arms as their `chain`. `document` makes plain JSON of a result,
`sarif` a log of findings for other tools.
"""
