"""What the arm should be told, so that it goes where the program said.

`inverse` is the inverse of the model at poses, `curve` along every move. `placement` and `fewest_targets` find where a
move needs added targets, `reversals` where lost motion makes the correction jump and `abrupt` where a law of the
user's does, `circles` which arcs would suffer. `applicable` is the part of a model that holds for a program.
`rigid_shift`: what a work object holds that this arm has taught. `deviation`: how far the real arm is from the curves.
"""
