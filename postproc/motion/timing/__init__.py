"""A path in time.

`legs` (long programs in parts), `spline` over the path, `grid` and `fastest` (toppra, through `constraints`),
`timelaw` (made jerk-limited), `jerk_limited` (checked against every limit), `trajectory` (speeds and accelerations at
the samples), `sustained` (accelerations that last), `inertia` (joint torques), `limits` of the corrected motion.
"""
