"""Reads the RAPID language; knows nothing about robots.

Data flows down this list; no folder imports one that stands after it.

- `unknown`: the value of what the text alone does not give.
- `syntax`: tokens, expressions, statements, modules; byte spans and edits.
- `data`: RAPID's own records and values, their algebra, motion statements and events.
- `program`: the files of one task: scopes, signatures, who reads and writes what.
- `evaluation`: the value of an expression; the data that holds at a moment.
- `motions`: motion events: targets, settings, where the arm comes from.
- `execution`: the abstract interpreter that follows a program in the order in which it runs.
- `diff`: two programs compared by meaning.
"""
