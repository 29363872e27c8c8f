"""RAPID values: single precision numbers, records as lists, predefined data.

A ``num`` is a Python float that holds an IEEE 754 single (K3, "Basic elements": num is single precision), a ``dnum`` a
``Dnum``. Records and arrays are lists; their types say what the places mean. Lengths are millimetres as in the text.
"""

from __future__ import annotations

import math
from ctypes import c_float
from functools import cache
from typing import Any

import numpy as np

from tests.worlds.geometry import Array, matrix_of_quaternion, quaternion_of_matrix


class Fault(Exception):
    """The program does what the language forbids, or what this interpreter does not know."""


class Ended(Exception):
    """EXIT, or an error nobody handles: the program stops."""


class RapidError(Exception):
    """An error of the running program; ``left`` is the routine whose handler has had it."""

    def __init__(self, number: float, left: object = None) -> None:
        self.number, self.left = number, left


class Dnum(float):
    """A number of double precision."""


def single(x: float) -> float:
    return c_float(x).value


def clone(value: Any) -> Any:
    """A copy of lists in lists."""
    return [clone(v) for v in value] if isinstance(value, list) else value


RECORDS: dict[str, list[tuple[str, str]]] = {
    "pos": [("x", "num"), ("y", "num"), ("z", "num")],
    "orient": [(f"q{i}", "num") for i in (1, 2, 3, 4)],
    "pose": [("trans", "pos"), ("rot", "orient")],
    "confdata": [("cf1", "num"), ("cf4", "num"), ("cf6", "num"), ("cfx", "num")],
    "extjoint": [(f"eax_{c}", "num") for c in "abcdef"],
    "robtarget": [("trans", "pos"), ("rot", "orient"), ("robconf", "confdata"), ("extax", "extjoint")],
    "robjoint": [(f"rax_{i}", "num") for i in range(1, 7)],
    "jointtarget": [("robax", "robjoint"), ("extax", "extjoint")],
    "loaddata": [("mass", "num"), ("cog", "pos"), ("aom", "orient"), ("ix", "num"), ("iy", "num"), ("iz", "num")],
    "tooldata": [("robhold", "bool"), ("tframe", "pose"), ("tload", "loaddata")],
    "wobjdata": [("robhold", "bool"), ("ufprog", "bool"), ("ufmec", "string"), ("uframe", "pose"), ("oframe", "pose")],
    "speeddata": [("v_tcp", "num"), ("v_ori", "num"), ("v_leax", "num"), ("v_reax", "num")],
    "zonedata": [("finep", "bool"), *((n, "num") for n in ("pzone_tcp", "pzone_ori", "pzone_eax", "zone_ori", "zone_leax", "zone_reax"))],
    "progdisp": [("pdisp", "pose"), ("eoffs", "extjoint")],
}  # fmt: skip
NUMBERS = frozenset({"num", "intnum", "errnum", "clock", "btnres", "dionum", "tpnum", "symnum", "opnum"})
ALIASES = {"errnum": "num", "intnum": "num"}


def default(type_: str, records: dict[str, list[tuple[str, str]]]) -> Any:
    """What data holds without an initial value: 0, FALSE, "", component by component."""
    if type_ in records:
        return [default(t, records) for _, t in records[type_]]
    if type_ == "bool":
        return False
    if type_ == "string":
        return ""
    return Dnum(0.0) if type_ == "dnum" else 0.0


def convert(value: Any, type_: str, records: dict[str, list[tuple[str, str]]]) -> Any:
    """The value as data of that type holds it: a copy, each number in the precision of its place; ``*`` an array of it."""
    if type_[:1] == "*":
        return [convert(v, type_[1:], records) for v in value]
    if isinstance(value, list):
        if type_ in records:
            parts = records[type_]
            if len(parts) != len(value):
                raise Fault(f"{len(value)} parts where {type_} has {len(parts)}")
            return [convert(v, t, records) for v, (_, t) in zip(value, parts, strict=True)]
        return [convert(v, type_, records) for v in value]
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return clone(value)
    return Dnum(value) if type_ == "dnum" else single(value)


def singles(values: Any) -> list[float]:
    return [single(v) for v in values]


def pose_matrix(p: list[Any]) -> Array:
    """(4, 4) of a pose or robtarget [mm]."""
    t = np.eye(4)
    t[:3, :3] = matrix_of_quaternion(p[1])
    t[:3, 3] = p[0]
    return t


def matrix_pose(t: Array) -> list[Any]:
    return [singles(t[:3, 3]), singles(quaternion_of_matrix(t[:3, :3]))]


def euler(rx: float, ry: float, rz: float) -> Array:
    """(3, 3) of turns about x, then the new y, then the new z [deg] (RelTool: \\Rx, \\Ry, \\Rz in this order)."""
    r = np.eye(3)
    for axis, angle in enumerate((rx, ry, rz)):
        c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        i, j = (axis + 1) % 3, (axis + 2) % 3
        step = np.eye(3)
        step[i, i] = step[j, j] = c
        step[i, j], step[j, i] = -s, s
        r = r @ step
    return r


def orient_zyx(z: float, y: float, x: float) -> list[float]:
    """Rz Ry Rx: OrientZYX (manual: rotations about z, the new y, the new x)."""
    return singles(quaternion_of_matrix(euler(0, 0, z) @ euler(0, y, 0) @ euler(x, 0, 0)))


NO_TURN = [1.0, 0.0, 0.0, 0.0]
_ZONES = (0, 1, 5, 10, 15, 20, 30, 40, 50, 60, 80, 100, 150, 200)
_SPEEDS = (5, 10, 20, 30, 40, 50, 60, 80, 100, 150, 200, 300, 400, 500, 600, 800, *range(1000, 8000, 500))


@cache
def predefined() -> dict[str, tuple[str, Any]]:
    """Name to (type, value) of the data that every system has."""
    zero = [[0.0, 0.0, 0.0], list(NO_TURN)]
    load = [single(0.001), [0.0, 0.0, single(0.001)], list(NO_TURN), 0.0, 0.0, 0.0]
    names: dict[str, tuple[str, Any]] = {f"v{v}": ("speeddata", [float(v), 500.0, 5000.0, 1000.0]) for v in _SPEEDS}
    names["vmax"] = ("speeddata", [7000.0, 500.0, 5000.0, 1000.0])
    for z in _ZONES:
        r = 0.3 if z == 0 else float(z)
        names[f"z{z}"] = ("zonedata", [False, *singles([r, r * 1.5, r * 1.5, r * 0.15, r * 1.5, r * 0.15])])
    names["fine"] = ("zonedata", [True, *[0.0] * 6])
    names["load0"] = ("loaddata", load)
    names["tool0"] = ("tooldata", [True, clone(zero), load])
    names["wobj0"] = ("wobjdata", [False, True, "", clone(zero), clone(zero)])
    names["pi"] = ("num", single(math.pi))
    constants = {"low": 0, "high": 1, "edge": 2, "single": 1, "op_auto": 1, "stempty": 0}
    keywords = "btnok btnabrtrytrgn btnokcancel btnyesno icon_info iconinfo iconwarning resok rescancel resyes resno"
    errors = "err_whlsearch err_wait_maxtime err_maxint err_divzero err_refunkprc err_signsupsearch err_path_stop"
    more = (
        "err_strtooling err_norununit err_tp_maxtime err_awunkerr err_outofbnd err_strtoolng err_argname err_sym_access"
    )
    for i, name in enumerate(f"{errors} {more}".split()):
        constants[name] = 1000 + i
    for i, name in enumerate(keywords.split()):
        constants[name] = i
    names |= {name: ("num", float(v)) for name, v in constants.items()}
    return names
