"""Built-in functions that depend on nothing but their arguments (ABB RAPID reference manual, functions)."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping

from postproc.rapid.pose import (
    about,
    add,
    dot,
    euler_zyx,
    frame_of_points,
    normalise,
    orient_zyx,
    pose_inv,
    pose_mult,
    quat_mult,
    rotate,
    subtract,
)
from postproc.rapid.values import Data, NotKnown, as_pose, to_pose, to_quat

Options = Mapping[str, Data]
Function = Callable[[tuple[Data, ...], Options], Data]


def offs(arguments: tuple[Data, ...], options: Options) -> Data:
    """Offs: displacement in the object frame, orientation unchanged."""
    target, x, y, z = arguments
    return (add(target[0], (x, y, z)), *target[1:])


def rel_tool(arguments: tuple[Data, ...], options: Options) -> Data:
    r"""RelTool: displacement, then ``Rx Ry Rz``, all in the tool frame of the target."""
    target, x, y, z = arguments
    rot = to_quat(target[1])
    turn = quat_mult(
        quat_mult(about(0, options.get("rx", 0.0)), about(1, options.get("ry", 0.0))), about(2, options.get("rz", 0.0))
    )
    return (add(target[0], rotate(rot, (x, y, z))), quat_mult(rot, turn), *target[2:])


def orobt(arguments: tuple[Data, ...], options: Options) -> Data:
    """ORobT: a place under a program displacement (the second argument), in the object frame."""
    target, displacement = arguments
    if "inpdisp" in options:
        return target
    return (*as_pose(pose_mult(to_pose(displacement[0]), to_pose(target[:2]))), *target[2:])


def def_frame(arguments: tuple[Data, ...], options: Options) -> Data:
    p1, p2, p3 = arguments
    return as_pose(frame_of_points(p1[0], p2[0], p3[0], int(options.get("origin", 1))))


def def_dframe(arguments: tuple[Data, ...], options: Options) -> Data:
    """DefDFrame: the displacement that carries three old points onto three new ones."""
    old1, old2, old3, new1, new2, new3 = (point[0] for point in arguments)
    old, new = frame_of_points(old1, old2, old3), frame_of_points(new1, new2, new3)
    return as_pose(pose_mult(new, pose_inv(old)))


def pose_vect(arguments: tuple[Data, ...], options: Options) -> Data:
    pose = to_pose(arguments[0])
    return add(pose.trans, rotate(pose.rot, arguments[1]))


def euler(arguments: tuple[Data, ...], options: Options) -> Data:
    x, y, z = euler_zyx(to_quat(arguments[0]))
    return x if "x" in options else y if "y" in options else z


def shortened(value: float, decimals: float, up: bool) -> float:
    """Round (half away from zero) or Trunc to a number of decimals."""
    scale = 10.0 ** int(decimals)
    return math.copysign(math.floor(abs(value) * scale + (0.5 if up else 0.0)) / scale, value)


def dimension(arguments: tuple[Data, ...], options: Options) -> Data:
    array, level = arguments
    for _ in range(int(level) - 1):
        array = array[0]
    return float(len(array))


def string_part(text: Data, position: float, length: float) -> str:
    """StrPart: characters from a position on, counted from 1."""
    begin = int(position) - 1
    if begin < 0 or length < 0 or begin + int(length) > len(text):
        raise ValueError("the part leaves the string")
    return text[begin : begin + int(length)]


def whole_text(value: Data) -> str:
    """ValToStr of a whole number; how many digits of another are written differs between controllers."""
    if isinstance(value, bool) or not isinstance(value, float) or value != int(value) or abs(value) >= 1e6:
        raise ValueError("not a whole number")
    return str(int(value))


def _plain(function: Callable[..., Data]) -> Function:
    return lambda arguments, options: function(*arguments)


def _mult(a: Data, b: Data) -> Data:
    return as_pose(pose_mult(to_pose(a), to_pose(b)))


def _inv(a: Data) -> Data:
    return as_pose(pose_inv(to_pose(a)))


def _distance(a: Data, b: Data) -> float:
    difference = subtract(a, b)
    return math.sqrt(dot(difference, difference))


# Result type and function by lower-case name.
FUNCTIONS: Mapping[str, tuple[str, Function]] = {
    "offs": ("robtarget", offs),
    "reltool": ("robtarget", rel_tool),
    "orobt": ("robtarget", orobt),
    "posemult": ("pose", _plain(_mult)),
    "poseinv": ("pose", _plain(_inv)),
    "posevect": ("pos", pose_vect),
    "defframe": ("pose", def_frame),
    "defdframe": ("pose", def_dframe),
    "orientzyx": ("orient", _plain(orient_zyx)),
    "eulerzyx": ("num", euler),
    "norient": ("orient", _plain(normalise)),
    "distance": ("num", _plain(_distance)),
    "vectmagn": ("num", _plain(lambda v: math.sqrt(dot(v, v)))),
    "dotprod": ("num", _plain(dot)),
    "sqrt": ("num", _plain(math.sqrt)),
    "sin": ("num", _plain(lambda x: math.sin(math.radians(x)))),
    "cos": ("num", _plain(lambda x: math.cos(math.radians(x)))),
    "tan": ("num", _plain(lambda x: math.tan(math.radians(x)))),
    "asin": ("num", _plain(lambda x: math.degrees(math.asin(x)))),
    "acos": ("num", _plain(lambda x: math.degrees(math.acos(x)))),
    "atan": ("num", _plain(lambda x: math.degrees(math.atan(x)))),
    "atan2": ("num", _plain(lambda y, x: math.degrees(math.atan2(y, x)))),
    "abs": ("num", _plain(abs)),
    "exp": ("num", _plain(math.exp)),
    "pow": ("num", _plain(math.pow)),
    "round": ("num", lambda a, o: shortened(a[0], o.get("dec", 0.0), True)),
    "trunc": ("num", lambda a, o: shortened(a[0], o.get("dec", 0.0), False)),
    "dim": ("num", dimension),
    "strlen": ("num", _plain(lambda s: float(len(s)))),
    "strpart": ("string", _plain(string_part)),
    "numtostr": ("string", _plain(lambda x, decimals: f"{x:.{int(decimals)}f}")),
    "valtostr": ("string", _plain(whole_text)),
    "numtodnum": ("dnum", _plain(float)),
    "dnumtonum": ("num", _plain(float)),
}

RUN_TIME = frozenset(
    re.findall(
        r"\w+",
        """
    ainput aoutput cdate cjointt clkread cpos crobt ctime ctool cwobj dinput doutput getnextsym gettime ginput goutput
    isstoppos poserror reltime testdi
    """,
    )
)


def call(name: str, arguments: tuple[Data, ...], options: Options) -> tuple[str, Data]:
    """Result type and value of one of ``FUNCTIONS``.

    Raises:
        NotKnown: it has no value for these arguments.
    """
    kind, function = FUNCTIONS[name]
    try:
        return kind, function(arguments, options)
    except (TypeError, ValueError, IndexError, KeyError, ArithmeticError) as error:
        raise NotKnown(f"`{name}` has no value for these arguments") from error


def unknown(name: str) -> NotKnown:
    """Why a function that is none of ``FUNCTIONS`` has no value."""
    what = "known only at run time" if name.lower() in RUN_TIME else "a function this version does not know"
    if name.lower() in ("calcrobt", "calcjointt"):
        what = "worked out by the controller: a place and the joint angles there are not turned into one another here"
    return NotKnown(f"`{name}` is {what}")
