"""What the real arm does along a program's path.

`samples` of the programmed curves; `timeline` is when the arm is where (with its natural `periods`); `motion` joins
both with tool, payload, wrench and approach.
"""
