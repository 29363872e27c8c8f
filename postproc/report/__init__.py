"""One self-contained HTML page from any result.

A page each: `compensation`, `batch`, `comparison`, `diagnosis`, `addition`, `difference`; `inspection` lists what a
program moves, `certificate` is to print and sign. They are put together by `page` (sections, tables, figures) from
`path` (a program's way), `laws` and `steps` (what a model has learned), `residuals` and `parameters`; `charts` are
drawn by `svg`, `chain` is the arm and `columns` are numbers for the page's own script. `document` makes plain JSON of a
result, `sarif` a log of findings for other tools.
"""
