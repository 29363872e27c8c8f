"""The written module, run by the package's interpreter and compared with the model.

`calculation` runs functions for numbers; `calls` asks the function as a controller does; `check` compares its
corrections with the exact ones, at targets and between them.
"""
