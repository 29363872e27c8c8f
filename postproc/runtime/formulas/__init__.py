"""The correction of a target as formulas: in RAPID for the controller, in numpy for its proof.

`laws` what the effects of the model do; `curves` functions as tables; `tape` formulas for RAPID and for numpy;
`formula` the correction of a target; `fitted` what is no closed form; `correction` all of it from a model.
"""
