"""What is said of programs.

A file each: `conversion` of a program with its `figures`, its `conclusion`, what a `requirement` lacks and
`work_objects` that are shifted; `inspection`, `difference` of programs and of folders.
"""
