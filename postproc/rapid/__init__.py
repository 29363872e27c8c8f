"""Reads the RAPID language; knows nothing about robots.

Text: `tokens`, `patterns` (pieces larger than a token) and `cursor` serve `statements` and `parse`, which make `syntax`
of a file; `expressions` are read into `trees`, targets written as numbers by `literals` and `spans`.

A program: `program` holds the files of one task and resolves `names`; `motion` reads a motion statement by the
`signatures` of its instruction; `predefined` is what every controller has (v100, z10, tool0), `lent` what other tasks
declare; `uses` says where data is used, `changes` what a piece of program may write, `called` what functions do there.

Values: `records` (what a robtarget or tooldata is) and `values` (how it is computed with); `evaluate` and `functions`
(Offs, RelTool ..) with `pose`; `declared` is what a declaration says, `memory` what holds at a moment, `assign` and
`accessor` write and read it, `state` is what instructions set (GripLoad, PDispSet, ConfL ..).

Followed as it runs: `walk` starts routines, `execution` runs statements, `calls` binds parameters, `flow` branches,
`choices` are branches that only set data, `loops` and `jumps` (GOTO) repeat; `ways` knows where the arm may come from.
`recorder` and `repeats` make `events` of motions, one by one in `steps`: their `targets`, `settings` (tool, speed,
zone, weld), `terms` (numbers they go with), and what is wrong with them: `missing`, `rough`.

For the rooms below: `units` (metres and matrices), `world` (frames seen from the base), `edits` (bytes that change),
`diff` with `align`, `difference` and `wording` (two programs compared by meaning).
"""
