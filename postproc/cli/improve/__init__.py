"""Commands on models: `fit`, `compare`, `diagnose`, `add`, `predict`, `plan`, `touchups`; common: `model_options`."""
