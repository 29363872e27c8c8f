"""What pages draw, as numbers and as inline SVG.

`path` has what is drawn of a program, `steps` of a model from the base to the last effect, `residuals`, `laws` and
`parameters` of a fit, `postures` of an arm on a sheet, `differences` of two programs. Charts are drawn in `charts`;
numbers and arms are carried in `columns`.
"""
