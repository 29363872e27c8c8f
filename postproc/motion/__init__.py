"""Paths, timing with toppra, inertial torques, jerk-limited smoothing with ruckig."""
