"""What stands around an arm: tracks, gantries, positioners.

`cell` is what carries arm and work; `mechanical_units` reads it from a controller's configuration, `cell_file` from a
TOML file; `station` is an arm in it.
"""
