"""Where the instrument and the tool are, how that creeps, and what is said about the data.

`instrument_frame`, `tool_frame`, `reflector` (several points of one tool), `setup` (where tips, planes, anchors and
gauges stand), `work_object` (where work stands), `frame_drift`; findings about rows: `session`, `outlier`.
"""
