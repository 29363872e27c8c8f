"""What the real arm does along a program's path.

`timeline` is when the arm is where; `motion` joins it with tool, payload, wrench and approach.
"""
