"""The function of a module called for one target after another, as a controller with the nominal arm runs it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from postproc.arrays import Array, invert
from postproc.compensation.correction.inverse import command, rigid
from postproc.diagnostics import PostprocError, Source
from postproc.model.arm import Model
from postproc.rapid.data.arm import Situation
from postproc.rapid.data.records import NO_AXES, JointTarget, LoadData, RobTarget, ToolData
from postproc.rapid.data.values import Data, rounded, to_robtarget
from postproc.rapid.motions.units import matrix_pose, pose_matrix, tool_matrix
from postproc.rapid.unknown import Kind, Unknown
from postproc.robot.configuration import confdata
from postproc.robot.inverse import nearest_solution
from postproc.robot.kinematics import forward
from postproc.runtime.proof.calculation import Calculation, RapidError


def _caller() -> Source:
    """A RAPID module that calls the correcting functions with all options, in one procedure each."""
    lines = ["MODULE ppCaller", *(f"  VAR robtarget {name};" for name in ("ppPoint", "ppEnd", "ppAnswer"))]
    load = "[0.001,[0,0,0.001],[1,0,0,0],0,0,0]"
    lines += [f"  PERS tooldata ppTool:=[TRUE,[[0,0,0],[1,0,0,0]],{load}];", f"  PERS loaddata ppLoad:={load};"]
    for weld, load_stated, circle in product((False, True), repeat=3):
        function = "ppCorrectedCirc(ppPoint,ppEnd" if circle else "ppCorrected(ppPoint"
        options = "\\Weld" * weld + "\\TLoad:=ppLoad" * load_stated
        call = f"    ppAnswer:={function},ppTool{options});"
        lines += [f"  PROC {_procedure(weld, load_stated, circle)}()", call, "  ENDPROC"]
    return Source("ppCaller.mod", "\n".join([*lines, "ENDMODULE", ""]).encode())


def _procedure(weld: bool, load: bool, circle: bool) -> str:
    """Return the name of the procedure in `_caller` for these options of the call, such as ``ppWeldLoadCircle``."""
    return f"pp{'Weld' * weld}{'Load' * load}{'Circle' if circle else 'Target'}"


REACHED_M = 1e-6
NOT_HANDLED = -1
"""In place of `ppReason` where an error leaves the function."""


@dataclass(frozen=True)
class FunctionCall:
    """The arguments of one call of the correcting function; work objects stand in the base.

    Args:
        q: (6,) nominal joint angles at the target [rad], or at the circle point if there is an ``end``.
        tool: with its load.
        payload: what is gripped.
        weld: whether `Weld` is given.
        end: (6,) joint angles at the end of the arc [rad].
        load: `TLoad`, None for none.
    """

    q: Array
    tool: ToolData
    payload: LoadData = LoadData()
    weld: bool = False
    end: Array | None = None
    load: LoadData | None = None


@dataclass(frozen=True)
class Answer:
    """Result of one call: target, its pose T_base_tcp (4, 4) [m], `ppReason`, and the number of statements run."""

    target: RobTarget
    pose: Array
    reason: int
    steps: int


class Caller:
    """A run-time module with the nominal arm of a controller, whose function can be called.

    Raises:
        PostprocError: RUN003, the module holds what is not calculated here.
    """

    def __init__(self, module: Source, model: Model) -> None:
        self.arm = _Arm(model)
        self.run = Calculation([module, _caller()], self.arm)
        if self.run.declaration("ppReason") is None:
            text = "there is no data `ppReason` in the module"
            raise PostprocError.of("RUN003", text, module, help="check modules that `postproc runtime write` wrote")

    def stated(self, name: str) -> Array:
        """(3,) value of the module's data of that name, such as ``ppForce``; zeros if it has none."""
        return np.array(self.run.get(name) or (0.0, 0.0, 0.0), dtype=float)

    def call(self, request: FunctionCall) -> Answer:
        """Call the correcting function once; an unhandled error gives ``NOT_HANDLED`` and the target unchanged."""
        run, tool = self.run, request.tool
        frame = rounded((tool.tframe.trans, tool.tframe.rot))
        run.set("ppTool", (tool.robhold, frame, _load(tool.tload)))
        run.set("ppPayload", _load(request.payload))
        if request.load is not None:
            run.set("ppLoad", _load(request.load))
        run.set("ppPoint", point := self.arm.data(request.q, tool))
        if request.end is not None:
            run.set("ppEnd", self.arm.data(request.end, tool))
        run.set("ppAnswer", point)
        self.arm.near = request.q
        try:
            steps = run.run(_procedure(request.weld, request.load is not None, request.end is not None))
            reason = round(run.get("ppReason"))
        except RapidError:
            steps, reason = 0, NOT_HANDLED
        target = to_robtarget(run.get("ppAnswer"))
        return Answer(target, pose_matrix(target.trans, target.rot), reason, steps)


def _load(load: LoadData) -> Data:
    """Load data as the interpreter's value, in single precision, without moments of inertia."""
    return rounded((load.mass, load.cog, (1.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0))


class _Arm:
    """The nominal arm for CalcJointT and CalcRobT; solutions are the nearest to joint angles ``near`` (6,) [rad]."""

    def __init__(self, model: Model) -> None:
        self.model = rigid(model)
        self.near = np.zeros(6)

    def data(self, q: Array, tool: ToolData) -> Data:
        """The robtarget of joint angles (6,) [rad] as the interpreter's value, in single precision."""
        place = self._place(q, tool)
        return rounded((place.trans, place.rot, tuple(map(float, place.robconf)), place.extax))

    def _place(self, q: Array, tool: ToolData) -> RobTarget:
        """The robtarget of joint angles (6,) [rad], without external axes."""
        robot = self.model.robot
        pose = matrix_pose(forward(robot, q[None])[0] @ tool_matrix(tool))
        a, b, c, d = confdata(robot, q[None])[0].tolist() if robot.opw is not None else (0, 0, 0, 0)
        return RobTarget(pose.trans, pose.rot, (a, b, c, d), NO_AXES)

    def _solved(self, T_base_tcp: Array, T_flange_tcp: Array) -> Array:
        """Joint angles (6,) [rad] nearest to ``near`` that reach a TCP pose with a tool, (4, 4) each; else NaN."""
        if self.model.robot.opw is not None:
            return nearest_solution(self.model.robot, T_base_tcp @ invert(T_flange_tcp), self.near)
        nominal = command(self.model, self.model.state(self.near[None], T_flange_tcp=T_flange_tcp), T_base_tcp[None])
        return np.asarray(np.where(nominal.residual_m[0] <= REACHED_M, nominal.q[0], np.nan))

    def target(self, joints: JointTarget, situation: Situation) -> RobTarget:
        """The robtarget of joint angles, as CalcRobT computes it with the tool of the situation."""
        return self._place(np.radians(joints.robax), situation.tool)

    def joints(self, target: RobTarget, situation: Situation) -> JointTarget:
        """The jointtarget of a robtarget, as CalcJointT computes it with the tool of the situation.

        Raises:
            Unknown: the pose is out of reach or beyond a joint limit.
        """
        q = self._solved(pose_matrix(target.trans, target.rot), tool_matrix(situation.tool))
        if not ((q >= self.model.robot.lower) & (q <= self.model.robot.upper)).all():
            raise Unknown(Kind.UNDEFINED, "CalcJointT")
        a, b, c, d, e, f = np.degrees(q).tolist()
        return JointTarget((a, b, c, d, e, f), target.extax)
