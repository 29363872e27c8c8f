"""Paths, timing with toppra, inertial torques, jerk-limited smoothing with ruckig.

`path`: from events to moves and their dense samples. `timing`: speeds and accelerations at the samples. `values` are
moves, `mounts` say who holds tool and work, `findings` are placed at targets. `postures`: what
is tight in them. `inertia`: torques of a moving arm. `smoothing`: jumps of a correction as transitions (ruckig).
"""
