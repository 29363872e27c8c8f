"""The ways that a program may take, whatever its data are: a data-flow analysis on the text.

``constants`` decides what only constants of the text decide, ``steps`` says what one statement does, ``graph`` draws
the flow of control of each routine, ``states`` are sets of arrivals,
``arrivals`` finds after which motions each may run.
"""
