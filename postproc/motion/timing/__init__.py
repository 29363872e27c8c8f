"""A path in time.

`spline` over the path, `effort` of the drives along it, `fastest` on a grid (toppra, through `constraints`, or
`reachability` where toppra is not installed), `timelaw` (made jerk-limited), `jerk_limited` (checked against every
limit, of the corrected motion, too), `trajectory` (speeds and accelerations at the samples; long programs in legs),
`sustained` (accelerations that last).
"""
