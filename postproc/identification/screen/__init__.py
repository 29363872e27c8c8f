"""Effects that may be missing, as columns of a linear problem: `forms`, each effect a `candidate`.

The best `composition` of an effect's forms, what only forms it moved to where it explains most by `nonlinear`.
"""
