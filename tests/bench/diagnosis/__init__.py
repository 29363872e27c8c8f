"""How good a diagnosis is, counted: ``python -m tests.bench.diagnosis``, which writes docs/scorecard.md.

`sets`: measured tables of known truth from the independent arm; `regions`: those with a part of the joint space not
measured. `judge`: one set, diagnosed and judged; `addition`: one set after `fit`, `diagnose` and `add`. `baselines`: other
methods on the same sets. `rules`: the search with a rule of its own switched off. `card`: the figures as a page.
"""
