"""Commands on models: `fit`, `compare`, `diagnose`, `add`, `predict`, `plan`."""
