"""Which files run together, on which arm, and what stands near them: for one program as for a whole backup.

`task`: a task and its arm. `discover`: tasks in a folder, and that of one module. `lists`: which modules a controller
loads. `nearby`: files that declare what a program lacks. `contradictions`: what settings say against a controller.
"""
