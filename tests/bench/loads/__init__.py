"""What a fitted model says of forces that its table did not have: ``python -m tests.bench.loads``.

`arms` reads an arm's file as data, `sets` draws measured tables of arms of known truth, `judge` fits them as a user would
and compares the change of the TCP under loads, `walk` does so for the commands of the README.
"""
