<<<<<<< HEAD
"""Commands on models: `fit`, `compare`, `diagnose`, `add`, `predict`, `plan`, `first_plan`; common: `model_options`."""
=======
"""Commands on models: `fit`, `compare`, `diagnose`, `add`, `predict`, `plan`, `touchups`; common: `model_options`."""
>>>>>>> main
