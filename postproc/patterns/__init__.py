"""Patterns of the channels without a physical name: what a residual follows, and where.

A channel, and text over a state: `signals`; curves of one in one table, and how each is looked at closer: `curves`.
A pattern is a product of curves, and many at once are a block: `formula`. Signals beside the channels: what the rows
before have left (`memory`), what the tool and the footing feel (`tool_frame_forces`), what the instrument reads
(`instrument_model`). All of them, with what may switch them: `dictionary`;
what they pay for their number, and where they make sense: `pattern_prior`. Screened at places of the arm, and told:
`place`, `screening`, `suspects`.
"""
