"""The ways that a program may take, whatever its data are: a data-flow analysis on the text.

``graph`` draws the flow of control of each routine, ``constants`` decides what only constants of the text decide,
``states`` are sets of arrivals, ``arrivals`` finds after which motion statements each of them may run.
"""
