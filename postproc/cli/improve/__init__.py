"""Commands on models: `fit`, `compare`, `diagnose`, `add`, `predict`, `plan`, `first_plan`, `touchups`.

Common to them: `model_options`; `fitted_arm`: what a fit is of; `for_programs`: what a plan is for.
"""
