"""Commands on models: `fit`, `compare`, `diagnose`, `add`, `predict`, `plan`; `asked` is what they have in common."""
