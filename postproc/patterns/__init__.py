"""Patterns of the channels without a physical name: what a residual follows, and where.

A channel, and a formula of it (values, words and code; families worked out at once): `signals`, `formula`.
Shapes of one channel, where it breaks, of few values, periodic, of two, of the rows before, as the tool feels them, as
the instrument sees: `shapes`, `breaks`, `levels`, `cycles`, `pairs`, `memory`, `felt`, `sight`. All of them, with what
may switch them: `every`; what they pay for their number, and where they make sense: `odds`; moves that are smooth
everywhere: `fields`. Tried at places of the arm, priced, several side by side, told: `place`, `tried`, `chains`,
`suspects`.
"""
