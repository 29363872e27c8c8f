"""The arm as it really is: robot plus effects, its elastic equilibrium, stiffness and predicted poses.

`arm` is the value and where external axes put it, `file` reads it and `rewrite` writes it, `doubts` says what no arm
can be. `equilibrium` predicts: `loads` on the `chain` of bodies and the `deflection` of all effects in turn; those of
the links come from pinocchio (`pinocchio_bodies`), or from the recursion of `multibody`. `derivatives` say how that
answers to small changes; `uncertainty` says how far all that can be trusted; `controller` is what a controller
corrects by itself, and the model that its configuration gives; `ordered`: channels that follow the rows in their order.
"""
