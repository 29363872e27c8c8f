"""Commands on models: `fit`, `compare`, `diagnose`, `add`, `predict`, `plan`, `first_plan`, `touchups`.

Common to them: `model_options`; `for_programs`: programs that a plan is for.
"""
