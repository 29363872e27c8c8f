"""What the real arm does along a program's path.

`timeline` is when the arm is where (with its natural `periods`); `motion` joins
both with tool, payload, wrench and approach.
"""
