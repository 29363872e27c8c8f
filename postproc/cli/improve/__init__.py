"""Commands on models: `fit`, `compare`, `diagnose`, `add`, `predict`, `plan`, `first_plan`; common: `model_options`."""
