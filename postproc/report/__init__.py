"""One self-contained HTML page from any result.

A page each: `compensation`, `batch`, `comparison`, `diagnosis`, `addition`, `difference`; `certificate` is one to
print and sign. `inspection` lists what a program moves. They are put together by `page` (sections, tables) from
`residuals`, `laws`, `steps`, `parameters` and `charts`, the path in space from `path` and `chain` with `columns` of
numbers, drawn by `svg`; `document` makes plain JSON of a result, `sarif` a log of findings for other tools.
"""
