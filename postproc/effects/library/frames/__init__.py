"""Where the instrument and the tool are, how that creeps, and what is said about the data.

`instrument_frame`, `tool_frame`, `reflector` (several points of one tool), `frame_drift`, `work_object`; findings
about rows: `session`, `outlier`.
"""
