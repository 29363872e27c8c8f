"""What the arm should be told, so that it goes where the program said.

`inverse` is the inverse of the model at poses, `curve` along every move. `fewest_targets` finds where a move needs
added targets, `jumps` where the correction jumps on its way. `applicable` is the
part of a model that holds for a program. `rigid_shift`: what a work object holds that this arm has taught. `deviation`:
how far the real arm is from the curves.
"""
