"""One self-contained HTML page from any result.

A page each: `compensation`, `batch`, `comparison`, `diagnosis`, `addition`; `inspection` lists what a program moves.
They are put together by `page` (sections, tables) from `residuals`, `parameters`, `charts` and `figures`, drawn by
`svg`; `document` makes plain JSON of a result, `sarif` a log of findings for other tools.
"""
