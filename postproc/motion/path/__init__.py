"""The way of every move.

`moves` come from events with `places` (of external axes) and `postures` (joint angles, at goals and on the way;
`arrivals`: where nobody monitors the configuration);
`nominal_arm` is what a program asks (CalcRobT); `refusals` say what is wrong with them. `curves` are lines, arcs and
joint moves, with axes 4 to 6 under SingArea, `corners` the zones of fly-by points as blends, `samples` dense
samples along both.
"""
