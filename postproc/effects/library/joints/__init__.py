"""Gears, drives and encoders: what makes a joint turn by another angle than the one that was asked for.

Constant: `joint_offset`. Elastic: `joint_compliance`, `nonlinear_compliance`. Of angle and motion: `backlash`,
`transmission_error`, `joint_error_map`, `wrist_coupling`, `servo_lag`. Of warmth: `thermal_joint_drift`.
"""
