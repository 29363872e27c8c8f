"""How the pose and the loads of the deflected arm answer to small changes.

`places` where effects act, `sensitivity` of the pose to them and to parameters, `tangent` (how loads and displacements
answer to each other), `stiffness` and natural frequencies.
"""
