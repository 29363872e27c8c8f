"""The library of physical effects: one file each, with its equation, source, ordinary size, and what tells it apart.

Where things stand: `instrument_frame`, `tool_frame`, `joint_offset`, `link_geometry`. Elasticity: `joint_compliance`,
`nonlinear_compliance`, `link_compliance`, `bearing_tilt`, `base_compliance`. Gears: `backlash`, `transmission_error`,
`joint_error_map`, `wrist_coupling`, `servo_lag`. Loads: `arm_load`, `payload_error`, `gravity_compensator`, and hoses,
`dress_pack`. Warmth and time: `thermal_growth`, `thermal_joint_drift`, `frame_drift`. Data: `session`, `outlier`.
"""
