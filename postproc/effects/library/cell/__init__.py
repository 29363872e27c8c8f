"""Tracks, gantries and positioners: where their axes stand and go, and how they lean under loads.

Each effect is an `axis_motion` of its own axes: `external_axis_error`, `external_axis_frame`,
`external_axis_compliance`.
"""
