"""How good a diagnosis is, counted: ``python -m tests.bench.diagnosis``, which writes docs/scorecard.md.

`sets`: measured tables of known truth from the independent arm; `regions`: those with a part of the joint space not
measured; `in_order`: those in which earlier rows count. `judge`: one set, diagnosed and judged; `addition`: one set after
`fit`, `diagnose` and `add`; `octants`: real tables with an octant held out, after the same. `baselines`: other methods on
the same sets. `rules`: the search with a rule of its own switched off. `card`: the figures as a page.
"""
