"""The judge itself, on many programs: relative corrections pass in every world, absolute ones do not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.worlds.alignment import names_in
from tests.worlds.checking import seed_of, tasks
from tests.worlds.compare import Outcome, compare_worlds
from tests.worlds.interpreter import Interpreter, load
from tests.worlds.motions import ROLES
from tests.worlds.syntax import Arg, Expr, Module, Statement, annotations, children, number
from tests.worlds.world import World, five

TASKS = tasks()
SIZE = 0.62
"""Length of the offsets below [mm]."""


def positional(*values: Expr) -> tuple[Arg, ...]:
    return tuple(Arg("pos", "", v) for v in values)


def num(x: float) -> Expr:
    return ("num", repr(x)) if x >= 0 else ("un", "-", ("num", repr(-x)))


def blocks(statements: list[Statement]) -> list[list[Statement]]:
    return [statements, *(b for s in statements for inner in children(s) for b in blocks(inner))]


def motions(modules: list[Module]) -> list[Statement]:
    return [s for m in modules for r in m.routines for s in r.flat if s.kind == "call" and s.parts["name"] in ROLES]


def targets(s: Statement) -> list[int]:
    """Places of targets and circle points among the arguments of a motion."""
    roles = iter(ROLES[s.parts["name"]])
    named = [next(roles) if a.kind in ("pos", "named") else "" for a in s.parts["args"]]
    return [i for i, role in enumerate(named) if role in ("to", "cir")]


def wrapped(modules: list[Module]) -> None:
    """Every target X becomes RelTool(X, ..): what is known before the program runs does not matter."""
    for s in motions(modules):
        if not s.parts["name"].startswith("search"):
            arguments = list(s.parts["args"])
            for i in targets(s):
                arguments[i] = Arg(
                    "pos", "", ("call", "reltool", positional(arguments[i].value, num(0.5), num(-0.3), num(0.2)), ())
                )
            s.parts["args"] = tuple(arguments)
            s.words += " corrected"


def middle(p: Expr, q: Expr) -> Expr:
    """A target between two others, as an expression of both."""

    def of(e: Expr, *parts: str) -> Expr:
        return (*e[:-1], (*e[-1], *(("part", x) for x in parts)))

    half = [("bin", "/", ("bin", "+", of(p, "trans", c), of(q, "trans", c)), ("num", "2")) for c in "xyz"]
    return ("agg", (("agg", tuple(half)), of(q, "rot"), of(q, "robconf"), of(q, "extax")))


def divided(modules: list[Module]) -> int:
    """Adds the middle of every line between two motions that stand side by side and use the same frames; how many."""
    added = 0
    traps = [s for m in modules for r in m.routines if r.kind == "trap" for s in r.flat]
    unsteady = {s.parts["target"][1] for s in traps if s.kind == "assign"}
    unsteady |= {r.name for m in modules for r in m.routines}  # functions, which must run as often as before
    for m in modules:
        for r in m.routines:
            for block in blocks(r.body):
                for k in reversed(range(1, len(block))):
                    made = between(block[k - 1], block[k], unsteady)
                    if made is not None:
                        block.insert(k, made)
                        added += 1
            r.flat.clear()
            number(r)
    return added


def between(a: Statement, b: Statement, unsteady: set[str]) -> Statement | None:
    """A motion to the middle, None where it would not be: a trap may write one end between the two motions, a function counts."""
    for s in (a, b):
        if s.kind != "call" or s.parts["name"] not in ("movel", "arcl", "movej"):
            return None
    if b.parts["name"] == "movej":
        return None
    p, q = (s.parts["args"][targets(s)[0]].value for s in (a, b))
    frames = [
        [
            x
            for x in s.parts["args"]
            if x.name == "wobj" or (x.value and x.value[0] == "ref" and x.value[1].startswith("t"))
        ]
        for s in (a, b)
    ]
    if frames[0] != frames[1] or p[0] not in ("ref", "call") or q[0] not in ("ref", "call"):
        return None
    if any(e[0] == "call" and e[1] not in ("offs", "reltool") for e in (p, q)):
        return None
    if names_in((p, q)) & unsteady or any(x.name == "t" for x in b.parts["args"]):
        return None
    arguments = list(b.parts["args"])
    arguments[targets(b)[0]] = Arg("pos", "", middle(p, q))
    arguments = [Arg("pos", "", ("ref", "z1", ())) if x.value == ("ref", "fine", ()) else x for x in arguments]
    return Statement("call", b.line, {"name": b.parts["name"], "args": tuple(arguments)}, b.words + " added")


def baked(modules: list[Module], nominal: Interpreter) -> None:
    """Every target becomes the numbers that it had when its motion ran first in the nominal world."""
    import numpy as np

    from tests.worlds.values import matrix_pose

    first = {e.identity: e for e in reversed(nominal.events) if e.motion}
    for m in modules:
        for r in m.routines:
            for s in r.flat:
                e = first.get((m.name, r.name, s.index))
                if e is None or e.values["family"] not in "LJ" or s.parts["name"].startswith("search"):
                    continue
                p = matrix_pose(np.linalg.inv(e.values["frame"]) @ e.values["goal"])
                numbers = [*p, e.values["conf"], e.values["extax"]]
                literal = ("agg", tuple(("agg", tuple(num(v) for v in part)) for part in numbers))
                arguments = list(s.parts["args"])
                arguments[targets(s)[0]] = Arg("pos", "", literal)
                s.parts["args"] = tuple(arguments)
                s.words += " baked"


def read(paths: list[Path]) -> tuple[list[str], list[World]]:
    texts = [p.read_text("latin-1") for p in paths]
    says = {k: v for t in texts for k, v in annotations(t).items()}
    return texts, five(seed_of(paths[0].stem), says)


def faults(outcomes: list[Outcome]) -> list[Any]:
    return [(o.world, f) for o in outcomes for f in o.faults]


@pytest.mark.parametrize("paths", TASKS[1::2], ids=[t[0].stem for t in TASKS[1::2]])
def test_relative_corrections_pass(paths: list[Path]) -> None:
    """Added targets that are expressions of both ends, and offsets around whatever stands there."""
    texts, worlds = read(paths)
    original = load(texts)
    assert faults([compare_worlds(original, load(texts), 0.0, worlds[4])]) == []
    corrected = load(texts)
    divided(corrected)
    assert faults([compare_worlds(original, corrected, 0.02, w) for w in (worlds[0], worlds[4])]) == []
    corrected = load(texts)
    wrapped(corrected)
    # a position that is read back after a correction carries it on, and the next correction is put on top
    assert faults([compare_worlds(original, corrected, 3 * SIZE, w) for w in (worlds[1], *worlds[3:])]) == []


def test_absolute_targets_do_not_pass() -> None:
    """Numbers in place of names differ as soon as a target is touched up; in most programs also with other data."""
    touched = other = 0
    some = TASKS[::2]
    for paths in some:
        texts, worlds = read(paths)
        original = load(texts)
        nominal = Interpreter(original, worlds[0])
        nominal.run()
        corrected = load(texts)
        baked(corrected, nominal)
        found = [bool(compare_worlds(original, corrected, 2.0, w).faults) for w in worlds]
        touched += found[3]
        other += found[1] or found[2]
    assert touched >= 0.9 * len(some)
    assert other >= 0.5 * len(some)


def test_middles_are_added_in_many_programs() -> None:
    """The added targets of the test above are there."""
    assert sum(bool(divided(load(read(paths)[0]))) for paths in TASKS) >= 0.4 * len(TASKS)
