"""Paths, timing with toppra, inertial torques, jerk-limited smoothing with ruckig.

From events to moves: `moves`, with `postures` (joint angles of goals), `mounts` (who holds tool and work), `refusals`,
`reach` and `weights` (what is wrong with them), `findings`; `values` are moves, paths and trajectories.
Their way: `curves` (lines, arcs, joint moves), `corners` (zones of fly-by points as blends), `path` (samples).
In time: `legs` (long programs in parts), `spline` over the path, `grid` and `fastest` (toppra, through `constraints`),
`timelaw` (made jerk-limited), `timing` (checked against every limit), `trajectory` (speeds and accelerations at the
samples), `sustained` (accelerations that last), `inertia` (joint torques), `limits` of the corrected motion.
`smoothing`: jumps of a correction as transitions (ruckig).
"""
