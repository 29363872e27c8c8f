"""Corrected programs whose targets a person teaches anew: in another posture, with another tilt, at other external axes.

``python -m tests.worlds.taught [-v] [FAMILY..]`` prints a table. `programs` generates programs, `anew` the targets as
they are taught in another world, `follow` the postures of both programs there, by an inverse in plain numpy, and where
the real arm goes.
"""
