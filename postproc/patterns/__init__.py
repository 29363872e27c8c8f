"""Patterns of the channels without a physical name: what a residual follows, and where.

A channel, and a formula of it (values, words and code; families worked out at once): `signals`, `formula`.
Shapes of one channel, where it breaks, of few values, periodic, of two, of the rows before: `shapes`, `change_points`,
`levels`, `harmonics`, `pairs`, `hysteresis_and_lag`. As the tool and the footing feel forces, as the instrument sees:
`tool_frame_forces`, `instrument_model`. All of them, with what may switch them: `dictionary`; what they pay for their
number, and where they make sense: `pattern_prior`; moves that are smooth everywhere: `fields`. Screened at places of
the arm, several side by side, told: `place`, `screening`, `change_point_sets`, `suspects`.
"""
