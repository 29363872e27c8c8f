"""The library of physical effects, one file each, and the contract they share.

The contract: `base` (the class), `contract` (state, load, displacement), `parameters` (unit, bounds, ordinary size),
`forms` (what a diagnosis tries), `sums` (effects of several terms), `asking` (how the rest of the package asks),
`similarity` (sizes on other arms), `geometry` (points, axes and weights that effects need), `registry` (which there
are), `files` (in a model file).
A user's own: `loading` runs the file; `conformance` tries it with `declaration`, `trial` and `example`, and says what
is wrong with `failures` and `findings`.

Where things stand: `instrument_frame`, `tool_frame`, `joint_offset`, `link_geometry`. Elasticity: `joint_compliance`,
`nonlinear_compliance`, `link_compliance`, `bearing_tilt`, `base_compliance`. Gears: `backlash`, `transmission_error`,
`joint_error_map`, `wrist_coupling`, `servo_lag`. Loads: `arm_load`, `payload_error`, `gravity_compensator`, and hoses,
`dress_pack`. Warmth and time: `thermal_growth`, `thermal_joint_drift`, `frame_drift`. Data: `session`, `outlier`.
"""
