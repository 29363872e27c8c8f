"""Commands on models: `fit`, `compare`, `diagnose`, `add`, `predict`, `plan`; common: `model_options`."""
