"""Values of RAPID data: nested tuples with a type name, and their conversion to the records.

Layouts: ABB RAPID reference manual, data types.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from struct import Struct

from postproc.rapid.data.events import ByValueArgument
from postproc.rapid.data.pose import normalise
from postproc.rapid.data.records import (
    NO_AXIS,
    Ax6,
    JointTarget,
    LoadData,
    Pose,
    Quat,
    RobTarget,
    SpeedData,
    ToolData,
    Vec3,
    WobjData,
    ZoneData,
)
from postproc.rapid.syntax.nodes import Module
from postproc.rapid.unknown import Causes, Invalid, Kind, Unknown
from postproc.rapid.unknown import Data as Data


@dataclass(slots=True, unsafe_hash=True)  # frozen it would take seven times as long to make
class Value:
    """Data with its type, never changed; ``type`` is empty where it is not known, ``rank`` counts array dimensions.

    ``assumed`` says why it is not certain, if it is not: it is then the last value seen in the text.

    ``declaration`` and ``at`` say which declared data (and which part of it: indices of array elements and places of
    components, from 1) this is an unchanged copy of, ``handed`` which argument of a call.
    """

    data: Data
    type: str = ""
    rank: int = 0
    declaration: str | None = None
    at: tuple[int, ...] = ()
    handed: ByValueArgument | None = None
    assumed: Causes = ()  # why it is not certain


_SINGLE = Struct("f")


def single(number: float) -> float:
    """The number rounded to single precision, as a ``num`` is stored.

    Raises:
        OverflowError: it is too large.
    """
    rounded: float = _SINGLE.unpack(_SINGLE.pack(number))[0]
    return rounded


def as_type(data: Data, kind: str) -> Data:
    """Round a number to single precision if ``kind`` is ``num``; every other value is returned unchanged."""
    return single(data) if kind == "num" and isinstance(data, float) else data


def rounded(data: Data) -> Data:
    """Round every number of a value, nested tuples included, to single precision, as a ``num`` is stored."""
    return tuple(map(rounded, data)) if isinstance(data, tuple) else single(data)


MOST_QUARTERS = 4000  # no axis turns a thousand times

MOST_OFF_UNIT = 0.1  # of the length of a quaternion: beyond that it is no rounding

Fields = tuple[tuple[str, str], ...]


def _fields(text: str) -> Fields:
    """Fields (name, type) of a record from text such as ``"num x y z; bool on"``: type, then the names that have it."""
    return tuple(
        (name, kind) for kind, _, names in (p.partition(" ") for p in text.split("; ")) for name in names.split()
    )


RECORDS: Mapping[str, Fields] = {
    "pos": _fields("num x y z"),
    "orient": _fields("num q1 q2 q3 q4"),
    "pose": _fields("pos trans; orient rot"),
    "confdata": _fields("num cf1 cf4 cf6 cfx"),
    "extjoint": _fields("num eax_a eax_b eax_c eax_d eax_e eax_f"),
    "robjoint": _fields("num rax_1 rax_2 rax_3 rax_4 rax_5 rax_6"),
    "robtarget": _fields("pos trans; orient rot; confdata robconf; extjoint extax"),
    "jointtarget": _fields("robjoint robax; extjoint extax"),
    "progdisp": _fields("pose pdisp; extjoint eoffs"),
    "loaddata": _fields("num mass; pos cog; orient aom; num ix iy iz"),
    "tooldata": _fields("bool robhold; pose tframe; loaddata tload"),
    "wobjdata": _fields("bool robhold ufprog; string ufmec; pose uframe oframe"),
    "speeddata": _fields("num v_tcp v_ori v_leax v_reax"),
    "zonedata": _fields("bool finep; num pzone_tcp pzone_ori pzone_eax zone_ori zone_leax zone_reax"),
    "welddata": _fields("num weld_speed org_weld_speed; arcdata main_arc org_arc"),
}


def known_records(modules: Iterable[Module]) -> Mapping[str, Fields]:
    """Fields (name, type) of record types by lower-case type name: those that every controller or a module defines."""
    return {**RECORDS, **{r.name.lower(): r.fields for module in modules for r in module.records}}


MOST_PARTS = 10_000  # of a record, with the records in it
MOST_LEVELS = 10  # of records inside one another


def zero(kind: str, records: Mapping[str, Fields]) -> Data:
    """Value of data declared without an initial value: 0, FALSE, the empty string, or a record of these.

    Args:
        kind: type name; records: fields of the record types by name.

    Raises:
        Unknown: the record has more than ``MOST_PARTS`` parts or contains itself.
    """
    if kind in records:
        if _parts_of(kind, records, MOST_LEVELS) > MOST_PARTS:
            raise Unknown(Kind.TOO_LARGE, kind)
        return tuple(zero(field, records) for _, field in records[kind])
    return {"bool": False, "string": ""}.get(kind, 0.0)


def _parts_of(kind: str, records: Mapping[str, Fields], levels: int) -> int:
    """How many numbers, texts and truth values a type holds; some number above ``MOST_PARTS`` if there are more.

    Args:
        levels: how many records inside one another are counted; deeper ones count as too many.
    """
    if kind not in records or levels == 0:
        return 1 if kind not in records else MOST_PARTS + 1
    count = 1
    for _, field in records[kind]:
        count += _parts_of(field, records, levels - 1)
        if count > MOST_PARTS:
            break
    return count


def _number(data: Data) -> float:
    """Data as a finite float; raises Unknown if it is a truth value, text, record or not finite."""
    if isinstance(data, bool) or not isinstance(data, (int, float)) or not math.isfinite(data):
        raise Unknown(Kind.NUMBER_EXPECTED)
    return float(data)


def _numbers(data: Data, count: int) -> tuple[float, ...]:
    """Data as a tuple of exactly ``count`` finite numbers; raises Unknown (Invalid for another count) if it is none."""
    if not isinstance(data, tuple) or len(data) != count:
        raise Invalid(Kind.NUMBERS_EXPECTED, str(count))
    if set(map(type, data)) == {float} and math.isfinite(sum(data)):
        return data
    return tuple(_number(item) for item in data)


def _vector(data: Data) -> Vec3:
    """Data as three finite numbers (x, y, z); raises Unknown if it is anything else."""
    x, y, z = _numbers(data, 3)
    return (x, y, z)


def to_quat(data: Data) -> Quat:
    """Unit quaternion, scalar first, of an ``orient``; lengths within ``MOST_OFF_UNIT`` of 1 are scaled to 1.

    Raises:
        Unknown: all numbers are 0 (the position was never taught); Invalid if the length is farther from 1.
    """
    a, b, c, d = _numbers(data, 4)
    length = math.hypot(a, b, c, d)
    if abs(length - 1.0) > MOST_OFF_UNIT:
        if length == 0.0:
            raise Unknown(Kind.NEVER_TAUGHT)
        raise Invalid(Kind.NOT_UNIT, f"{length:.3g}")
    return normalise((a, b, c, d))


def _ax6(data: Data) -> Ax6:
    """Six axis values [deg or mm]; whatever exceeds 0.99 * 9E9 becomes exactly ``NO_AXIS``, an unused axis."""
    # In single precision 9E9 is a little less.
    a, b, c, d, e, f = (NO_AXIS if value > 0.99 * NO_AXIS else value for value in _numbers(data, 6))
    return (a, b, c, d, e, f)


def _parts(data: Data, count: int, kind: str) -> tuple[Data, ...]:
    """The data itself if it is a record of ``count`` parts; else raises Invalid, which names the type ``kind``."""
    if not isinstance(data, tuple) or len(data) != count:
        raise Invalid(Kind.NOT_A, kind)
    return data


def to_pose(data: Data) -> Pose:
    """Convert data of type ``pose`` [mm]; raises Unknown if it is none."""
    trans, rot = _parts(data, 2, "pose")
    return Pose(_vector(trans), to_quat(rot))


def to_robtarget(data: Data) -> RobTarget:
    """Convert data of type ``robtarget`` [mm, deg]; raises Unknown if it is none."""
    trans, rot, conf, extax = _parts(data, 4, "robtarget")
    return RobTarget(_vector(trans), to_quat(rot), to_conf(_numbers(conf, 4)), _ax6(extax))


def to_conf(numbers: Sequence[float]) -> tuple[int, int, int, int]:
    """Configuration numbers cf1, cf4, cf6 and cfx rounded to integers.

    Raises:
        Unknown: one of them is larger than ``MOST_QUARTERS`` quarter turns.
    """
    a, b, c, d = map(round, numbers)
    if max(map(abs, (a, b, c, d))) > MOST_QUARTERS:
        raise Unknown(Kind.CONFIGURATION)
    return a, b, c, d


def to_jointtarget(data: Data) -> JointTarget:
    """Convert data of type ``jointtarget`` [deg, mm]; raises Unknown if it is none."""
    robax, extax = _parts(data, 2, "jointtarget")
    return JointTarget(_ax6(robax), _ax6(extax))


def to_load(data: Data) -> LoadData:
    """Convert data of type ``loaddata`` [kg, mm, kg m^2]; raises Unknown if it is none."""
    mass, cog, aom, ix, iy, iz = _parts(data, 6, "loaddata")
    aom = aom if any(_numbers(aom, 4)) else (1.0, 0.0, 0.0, 0.0)  # an unset aom means the tool's own axes
    return LoadData(_number(mass), _vector(cog), to_quat(aom), (_number(ix), _number(iy), _number(iz)))


def to_tool(name: str, data: Data) -> ToolData:
    """Convert data of type ``tooldata`` to a tool of this name; raises Unknown if it is none."""
    robhold, frame, load = _parts(data, 3, "tooldata")
    return ToolData(name, bool(robhold), _frame(frame), to_load(load))


def to_wobj(name: str, data: Data) -> WobjData:
    """Convert data of type ``wobjdata`` to a work object of this name; raises Unknown if it is none."""
    robhold, ufprog, ufmec, uframe, oframe = _parts(data, 5, "wobjdata")
    return WobjData(name, bool(robhold), bool(ufprog), str(ufmec), _frame(uframe), _frame(oframe))


def _frame(data: Data) -> Pose:
    """Pose ([mm], unit quaternion) of the frame of a tool or a work object.

    Raises:
        Invalid: it is no pose, or its quaternion is [0,0,0,0], which in a robtarget only means "not taught yet".
    """
    _, rot = _parts(data, 2, "pose")
    if not any(_numbers(rot, 4)):
        raise Invalid(Kind.NO_FRAME)
    return to_pose(data)


def to_speed(data: Data) -> SpeedData:
    """Convert data of type ``speeddata`` [mm/s, deg/s]; raises Unknown if it is none."""
    v_tcp, v_ori, v_leax, v_reax = _numbers(data, 4)
    return SpeedData(v_tcp, v_ori, v_leax, v_reax)


def to_zone(data: Data) -> ZoneData:
    """Convert data of type ``zonedata`` [mm, deg]; raises Unknown if it is none."""
    finep, *sizes = _parts(data, 7, "zonedata")
    a, b, c, d, e, f = _numbers(tuple(sizes), 6)
    return ZoneData(bool(finep), a, b, c, d, e, f)


def as_pose(pose: Pose) -> Data:
    """Convert a pose to data of type ``pose``: the tuple (trans, rot)."""
    return (pose.trans, pose.rot)
