"""How far a model can be trusted.

`prediction`: covariance of the parameters, as `packed` in a file, and what stays unexplained; `field`: where measured
rows tell of what the arm lacks; `undetermined`: what no row has told; `scatter` of arms about an estimated stiffness.
"""
