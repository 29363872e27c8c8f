"""What every controller has: functions that depend on nothing but their arguments, and predefined data.

Source: ABB RAPID reference manual, functions, data types speeddata and zonedata. Optional arguments (``\\Rx:=5``) are
Python keyword arguments; a function that does not know one of them has no value.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType

from postproc.rapid.data import pose
from postproc.rapid.data.records import Vec3
from postproc.rapid.data.values import Data, as_pose, as_type, to_pose, to_quat
from postproc.rapid.syntax.tokens import word_set
from postproc.rapid.unknown import Kind, Unknown

MOST_LETTERS = 80  # of a string (ABB RAPID reference manual, data type ``string``)


def offs(target: Data, x: float, y: float, z: float) -> Data:
    """Offs: the robtarget moved by (x, y, z) [mm] along the axes of the object frame, with unchanged orientation."""
    return (pose.add(target[0], (x, y, z)), *target[1:])


def rel_tool(target: Data, x: float, y: float, z: float, *, rx: float = 0.0, ry: float = 0.0, rz: float = 0.0) -> Data:
    """RelTool: the robtarget moved by (x, y, z) [mm], then turned by ``Rx Ry Rz`` [deg], all in its own tool axes."""
    rot = to_quat(target[1])
    turn = pose.quat_mult(pose.quat_mult(pose.about(0, rx), pose.about(1, ry)), pose.about(2, rz))
    return (pose.add(target[0], pose.rotate(rot, (x, y, z))), pose.quat_mult(rot, turn), *target[2:])


def orobt(target: Data, displacement: Data, inpdisp: bool = False, ineoffs: bool = False) -> Data:
    r"""ORobT: the robtarget in the object frame that results from a target under a program displacement.

    Args:
        displacement: the ``progdisp`` in force (``C_PROGDISP``), which is no argument in RAPID; only its pose is used.
        inpdisp: ``\InPDisp`` stands in the call: the target is returned unchanged.
        ineoffs: ``\InEOffs`` stands in the call; it is ignored.
    """
    if inpdisp:
        return target
    return (*as_pose(pose.pose_mult(to_pose(displacement[0]), to_pose(target[:2]))), *target[2:])


def def_frame(p1: Data, p2: Data, p3: Data, origin: float = 1.0) -> Data:
    """DefFrame: the pose of the frame through three robtargets: origin in ``p1``, x to ``p2``, ``p3`` on the +y side.

    ``origin`` 2 puts the origin in ``p2``, 3 on the x axis where the y axis passes through ``p3``.
    """
    return as_pose(pose.frame_of_points(p1[0], p2[0], p3[0], int(origin)))


def def_dframe(*points: Data) -> Data:
    """DefDFrame: the pose that displaces three robtargets onto three others; arguments are the old, then the new."""
    old1, old2, old3, new1, new2, new3 = (point[0] for point in points)
    old, new = pose.frame_of_points(old1, old2, old3), pose.frame_of_points(new1, new2, new3)
    return as_pose(pose.pose_mult(new, pose.pose_inv(old)))


def pose_vect(frame: Data, place: Data) -> Data:
    """PoseVect: coordinates [mm] of a position, stated in ``frame``, in the frame in which ``frame`` is stated."""
    origin = to_pose(frame)
    return pose.add(origin.trans, pose.rotate(origin.rot, place))


def euler(rot: Data, x: bool = False, y: bool = False, z: bool = False) -> float:
    """EulerZYX: the angle [deg] about the axis whose option is set; about z if neither ``x`` nor ``y`` is."""
    return pose.euler_zyx(to_quat(rot))[0 if x else 1 if y else 2]


def shortened(value: float, decimals: float, nearest: bool) -> float:
    """The value with a number of decimals: rounded half away from zero (Round) if ``nearest``, else cut off (Trunc)."""
    scale = 10.0 ** int(decimals)
    return math.copysign(math.floor(abs(value) * scale + (0.5 if nearest else 0.0)) / scale, value)


def dimension(array: Data, level: float) -> float:
    """Dim: number of elements of an array along dimension ``level``, counted from 1."""
    for _ in range(int(level) - 1):
        array = array[0]
    return float(len(array))


def string_part(text: Data, position: float, length: float) -> str:
    """StrPart: ``length`` characters of the text from ``position`` on, counted from 1.

    Raises:
        ValueError: the part reaches beyond the text.
    """
    begin = int(position) - 1
    if begin < 0 or length < 0 or begin + int(length) > len(text):
        raise ValueError("the part leaves the string")
    return text[begin : begin + int(length)]


def integer_text(value: Data) -> str:
    """ValToStr of a whole number below 1e6, as digits without decimals.

    Raises:
        ValueError: it is any other value: how many digits are written then differs between controllers.
    """
    if isinstance(value, bool) or not isinstance(value, float) or value != int(value) or abs(value) >= 1e6:
        raise ValueError("not a whole number")
    return str(int(value))


def number_text(value: float, decimals: float) -> str:
    """NumToStr: the number in decimal notation with so many decimals.

    Raises:
        ValueError: there are more decimals than a string holds.
    """
    if decimals > MOST_LETTERS:
        raise ValueError("more decimals than a string holds")
    return f"{value:.{int(decimals)}f}"


def magnitude(v: Vec3) -> float:
    """VectMagn: the Euclidean length of a vector, in its unit."""
    return math.sqrt(pose.dot(v, v))


# Result type and function by lower-case name.
FUNCTIONS: Mapping[str, tuple[str, Callable[..., Data]]] = {
    "offs": ("robtarget", offs),
    "reltool": ("robtarget", rel_tool),
    "orobt": ("robtarget", orobt),
    "posemult": ("pose", lambda a, b: as_pose(pose.pose_mult(to_pose(a), to_pose(b)))),
    "poseinv": ("pose", lambda a: as_pose(pose.pose_inv(to_pose(a)))),
    "posevect": ("pos", pose_vect),
    "defframe": ("pose", def_frame),
    "defdframe": ("pose", def_dframe),
    "orientzyx": ("orient", pose.orient_zyx),
    "eulerzyx": ("num", euler),
    "norient": ("orient", pose.normalise),
    "distance": ("num", lambda a, b: magnitude(pose.subtract(a, b))),
    "vectmagn": ("num", magnitude),
    "dotprod": ("num", pose.dot),
    "sqrt": ("num", math.sqrt),
    "sin": ("num", lambda x: math.sin(math.radians(x))),
    "cos": ("num", lambda x: math.cos(math.radians(x))),
    "tan": ("num", lambda x: math.tan(math.radians(x))),
    "asin": ("num", lambda x: math.degrees(math.asin(x))),
    "acos": ("num", lambda x: math.degrees(math.acos(x))),
    "atan": ("num", lambda x: math.degrees(math.atan(x))),
    "atan2": ("num", lambda y, x: math.degrees(math.atan2(y, x))),
    "abs": ("num", abs),
    "exp": ("num", math.exp),
    "pow": ("num", math.pow),
    "round": ("num", lambda x, dec=0.0: shortened(x, dec, True)),
    "trunc": ("num", lambda x, dec=0.0: shortened(x, dec, False)),
    "dim": ("num", dimension),
    "strlen": ("num", lambda s: float(len(s))),
    "strpart": ("string", string_part),
    "numtostr": ("string", number_text),
    "valtostr": ("string", integer_text),
    "numtodnum": ("dnum", float),
    "dnumtonum": ("num", float),
}

# Functions whose result only the running controller has (ABB RAPID reference manual, functions); all of them only read
# their arguments, except ``GetNextSym``.
RUN_TIME = word_set("""
    ainput aoutput cdate cjointt clkread corrread cpos crobt cspeedoverride ctime ctool cwobj dinput doutput
    eventtype exechandler execlevel filesize filetime fssize getmaxnumberofcyclicbool getmecunitname
    getmodalpayloadmode getnextsym getserviceinfo getsysinfo gettaskname gettime ginput ginputdnum goutput
    goutputdnum indinpos indspeed iounitstate isfile isleadthrough ismechunitactive isstopmoveact isstoppos
    isstopstateevent issyncmoveon issysid maxextlinearspeed maxextreorientspeed maxrobreorientspeed maxrobspeed
    modexist motionplannerno nonmotionmode opmode paridposvalid paridrobvalid pathlengthget pathlevel
    pathrecvalidbwd pathrecvalidfwd pfrestart poserror ppmovedinmanmode progmemfree readbin readmotor readnum
    readstr readstrbin readvar reltime remainingretries rmqgetslotname robname robos runmode socketgetstatus
    socketpeek stcalcforce stcalctorque stiscalib stisclosed stisindgun stisopen taskisactive taskisexecuting
    taskrunmec taskrunrob tasksinsync testdi testsignread textget texttabfreetouse texttabget uialphaentry
    uiclientexist uidnumentry uidnumtune uilistview uimessagebox uinumentry uinumtune validio
    """)


def call(name: str, arguments: Iterable[Data], options: Mapping[str, Data]) -> tuple[str, Data]:
    """Evaluate a built-in function of ``FUNCTIONS`` and return the result's type name and its value.

    Args:
        name: in lower case.
        options: values of the optional arguments by lower-case name; True for one without a value.

    Raises:
        Unknown: the function has no value for these arguments.
    """
    kind, function = FUNCTIONS[name]
    try:
        if kind == "num" and name != "dnumtonum":
            arguments = [as_type(argument, "num") for argument in arguments]
        return kind, function(*arguments, **options)
    except (TypeError, ValueError, IndexError, KeyError, ArithmeticError) as error:
        raise Unknown(Kind.UNDEFINED, name) from error


def unknown(name: str) -> Unknown:
    """The exception for a call of a function outside ``FUNCTIONS``: known only at run time, or not known at all."""
    return Unknown(Kind.RUN_TIME_FUNCTION if name.lower() in RUN_TIME else Kind.UNKNOWN_FUNCTION, name)


SPEEDS = (
    5, 10, 20, 30, 40, 50, 60, 80, 100, 150, 200, 300, 400, 500, 600, 800, 1000, 1500, 2000, 2500, 3000, 4000, 5000,
    6000, 7000,
)  # fmt: skip
EXTERNAL = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
# pzone_tcp, pzone_ori and pzone_eax [mm], zone_ori [deg], zone_leax [mm], zone_reax [deg]
ZONES = {
    "z0": (0.3, 0.3, 0.3, 0.03, 0.3, 0.03),
    "z1": (1.0, 1.0, 1.0, 0.1, 1.0, 0.1),
    "z5": (5.0, 8.0, 8.0, 0.8, 8.0, 0.8),
    "z10": (10.0, 15.0, 15.0, 1.5, 15.0, 1.5),
    "z15": (15.0, 23.0, 23.0, 2.3, 23.0, 2.3),
    "z20": (20.0, 30.0, 30.0, 3.0, 30.0, 3.0),
    "z30": (30.0, 45.0, 45.0, 4.5, 45.0, 4.5),
    "z40": (40.0, 60.0, 60.0, 6.0, 60.0, 6.0),
    "z50": (50.0, 75.0, 75.0, 7.5, 75.0, 7.5),
    "z60": (60.0, 90.0, 90.0, 9.0, 90.0, 9.0),
    "z80": (80.0, 120.0, 120.0, 12.0, 120.0, 12.0),
    "z100": (100.0, 150.0, 150.0, 15.0, 150.0, 15.0),
    "z150": (150.0, 225.0, 225.0, 23.0, 225.0, 23.0),
    "z200": (200.0, 300.0, 300.0, 30.0, 300.0, 30.0),
}
VMAX = 7000.0  # the robot's own maximum lies below; the timing is bounded by the joints anyway

_NULL = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
_LOAD0 = (0.001, (0.0, 0.0, 0.001), (1.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0)

# Type and value by lower-case name.
PREDEFINED = MappingProxyType(
    {
        **{f"v{v}": ("speeddata", (float(v), 500.0, 5000.0, 1000.0)) for v in SPEEDS},
        # The speed of external axes alone: the TCP is as fast as they let it.
        **{f"vlin{v}": ("speeddata", (VMAX, 500.0, float(v), 1000.0)) for v in EXTERNAL[3:]},
        **{f"vrot{v}": ("speeddata", (VMAX, 500.0, 5000.0, float(v))) for v in EXTERNAL[:7]},
        "vmax": ("speeddata", (VMAX, 500.0, 5000.0, 1000.0)),
        "fine": ("zonedata", (True, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
        **{name: ("zonedata", (False, *zone)) for name, zone in ZONES.items()},
        "tool0": ("tooldata", (True, _NULL, _LOAD0)),
        "wobj0": ("wobjdata", (False, True, "", *(_NULL, _NULL))),
        "load0": ("loaddata", _LOAD0),
        "pi": ("num", 3.141592653589793),
    }
)
