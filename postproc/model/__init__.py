"""The arm as it really is: robot plus effects, its elastic equilibrium, stiffness and predicted poses.

`arm` is the value, `file` reads it and `rewrite` writes it, `doubts` says what no arm can be. `equilibrium` predicts:
`loads` on the `chain` of bodies (weights by pinocchio, `multibody`) and the `deflection` of all effects in turn.
`derivatives` say how that answers to small changes; `uncertainty` of a prediction (`packed` in a model file), what of
it no row has told (`undetermined`), `scatter` of arms about an estimated stiffness; `controller_part` is what a
controller corrects by itself, `from_controller` the model that its configuration gives. `reference`: where external
axes put the arm; `ordered`: channels that follow the rows in their order.
"""
