"""What a shop without a tracker can measure, simulated, fitted and judged: ``python -m tests.bench.shop``.

`arms` draws arms of known truth and the postures in which they touch something, `sets` what is read of them, `refit` fits
the true structure by plain numpy, `judge` fits as a user would and compares on unseen poses, `real` derives readings of a
shop from the measured tables of real arms, `slips` reads planned set-ups with a slip of the pen.
"""
