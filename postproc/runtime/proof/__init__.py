"""The written module, run in single precision and compared with the model.

`lanes` values of many targets at once; `execution` runs the module on them; `check` compares its corrections with the
exact ones; `chord` says what is left between targets.
"""
