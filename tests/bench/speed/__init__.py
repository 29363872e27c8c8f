"""Speed and memory in one table from one run: ``python -m tests.bench.speed``, or ``make bench``.

`figures` measures, beside `peers` that solve the same; `table` holds the values, prints and compares them.
"""
