"""One arm as its maker describes it: nominal kinematics, inverse kinematics with confdata, limits, link inertias.

`arm` is the value; `catalogue` reads it from the library or a file, `urdf` from a URDF. `type_names` are what
controllers call arms, `controller` reads a controller's configuration; `cells` are what carries arm and work.
`kinematics` goes forward, with `pose` for poses as arrays; backward: `configuration` (whether there is a closed form,
and confdata), `closed_form` (all eight branches), `inverse` (the branch that confdata means, and why there is none),
`track` (along a path).
"""
