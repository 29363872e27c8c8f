"""Controllers that correct a part of the arm's error by themselves: a plant and a controller in plain numpy.

The plant has joint offsets, springs, its weight, a tool and a force. The controller finds joints for which its own part
of that reaches what it is told, and commands them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from postproc.compensation.conversion import Conversion
from postproc.compensation.options import Options
from postproc.diagnostics import PostprocError, Source
from postproc.effects.library.joints.joint_offset import JointOffset
from postproc.model.arm import Model
from postproc.model.file import default_model
from postproc.runtime.passes import correct_program
from tests.independent import arm as A
from tests.independent import inverse as I
from tests.independent import paths as P
from tests.independent import rapid as R
from tests.independent.verify import _distance, align

ARM = A.irb4600()
SPRINGS = A.joint_springs(A.TABLE_2)
OFFSET = np.array([0.3, -0.2, 0.25, 0.4, -0.3, 0.5]) * 1e-3
FORCE = (200.0, -200.0, -200.0)
E9 = "[9E9,9E9,9E9,9E9,9E9,9E9]"
PROGRAM = f"""MODULE M
  PERS tooldata t:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0,0,0]];
  CONST robtarget a:=[[1100,-200,700],[0,0,1,0],[-1,0,-1,0],{E9}];
  CONST robtarget b:=[[1150,250,750],[0,0,1,0],[0,-1,0,0],{E9}];
  PROC main()
    MoveAbsJ [[-10,20,15,5,50,-10],{E9}],v200,fine,t;
    MoveL a,v100,fine,t;
    MoveL b,v100,fine,t;
    MoveL Offs(b,-150,0,60),v100,fine,t;
  ENDPROC
ENDMODULE
"""


@dataclass(frozen=True)
class Controller:
    """What it knows: offsets of the joints, whether links weigh, whether the tool does, the force."""

    offset: np.ndarray
    arm: A.Arm
    tool: bool
    force: np.ndarray

    def there(self, q: np.ndarray, m: R.Motion) -> np.ndarray:
        """(n, 4, 4) where it believes the TCP to be."""
        load = A.Load(m.mass if self.tool else 0.0, m.center, self.force)
        return A.equilibrium(self.arm, q + self.offset, m.tool, load, SPRINGS).frames.tcp

    def command(self, T: np.ndarray, m: R.Motion, q: np.ndarray) -> np.ndarray:
        """(n, 6) joints for poses T (n, 4, 4), from nominal ones."""
        told = T
        for _ in range(6):
            told = told @ np.linalg.inv(self.there(q, m)) @ T
            q = I.follow(ARM, told @ np.linalg.inv(m.tool), q[0])
        return q


def controller(*parts: str) -> Controller:
    arm = ARM if "gravity" in parts else replace(ARM, mass=0 * ARM.mass)
    force = np.array(FORCE) if "force" in parts else np.zeros(3)
    return Controller(OFFSET * ("geometry" in parts), arm, "tool" in parts, force)


PLANT = controller("geometry", "gravity", "tool", "force")


def ways(text: str, brain: Controller) -> tuple[list[R.Motion], list[np.ndarray]]:
    """Positions (n, 3) of the real TCP along every move, the first of which goes to joint angles."""
    moves, _ = R.motions(text)
    assert moves[0].q is not None
    q, before, found = moves[0].q, brain.there(moves[0].q[None], moves[0])[0], [np.zeros((0, 3))]
    for m in moves[1:]:
        T = P.line(before, m.goal, np.linspace(0, 1, 60))
        nominal = I.follow(ARM, T @ np.linalg.inv(m.tool), q)
        assert nominal is not None and tuple(I.confdata(ARM, nominal[-1])[0]) == tuple(m.conf)
        found.append(PLANT.there(brain.command(T, m, nominal), m)[:, :3, 3])
        q, before = nominal[-1], m.goal
    return moves, found


def deviation(text: str, brain: Controller) -> float:
    """Largest distance [mm] from the lines of the original between its targets."""
    old, _ = R.motions(PROGRAM)
    new, went = ways(text, brain)
    match = align(old, new, ARM)
    assert match is not None
    far = [
        _distance(old[i - 1].goal, m, went[k]).max()
        for i, m in enumerate(old)
        if i > 1
        for k in range(match[i - 1] + 1, match[i] + 1)
    ]
    return 1e3 * float(max(far))


@pytest.fixture(scope="module")
def model() -> Model:
    shipped = default_model()
    return shipped.with_effects(*shipped.effects, JointOffset(offset_rad=OFFSET))


def convert(model: Model, *already: str) -> Conversion:
    near = {"tolerance_m": 1e-5, "air_tolerance_m": 1e-5}
    options = Options(**near, force=FORCE, inertia=False, already=already)
    return correct_program(Source("m.mod", PROGRAM.encode()), model, options)


@pytest.mark.parametrize(
    "parts",
    [(), ("geometry", "gravity"), ("geometry",), ("gravity", "tool"), ("geometry", "gravity", "force")],
    ids=lambda parts: ",".join(parts) or "nothing",
)
def test_what_the_controller_leaves_is_corrected(model: Model, parts: tuple[str, ...]) -> None:
    found = convert(model, *parts)
    assert found.output is not None
    before, after = (deviation(text, controller(*parts)) for text in (PROGRAM, found.output.decode()))
    assert found.report["max_error_before_mm"] > before - 0.02  # a line from joint angles counts, too
    assert after < 0.01 < before
    assert found.report["already"] == list(parts)
    head = f"the controller corrects by itself: {', '.join(parts)}"
    assert (head in found.output.decode()) == bool(parts)


def test_what_the_controller_corrects_is_not_corrected_once_more(model: Model) -> None:
    """The plain correction under such a controller doubles what it has; a wrong statement shows as much."""
    text = convert(model).output
    assert text is not None and deviation(text.decode(), controller("geometry", "gravity")) > 0.5
    stated = convert(model, "geometry", "gravity").output
    assert stated is not None and deviation(stated.decode(), controller()) > 0.5


def test_where_it_corrects_everything_nothing_is_changed(model: Model) -> None:
    found = convert(model, "geometry", "gravity", "force", "tool")
    assert found.output is not None and found.report["max_error_before_mm"] < 1e-4
    assert deviation(found.output.decode(), PLANT) < 1e-3


@pytest.mark.parametrize(
    ("parts", "help_"),
    [(("gravety",), "did you mean `gravity`?"), (("tool", "inertia"), "write `gravity,inertia`")],
)
def test_parts_that_no_controller_has_are_refused(model: Model, parts: tuple[str, ...], help_: str) -> None:
    with pytest.raises(PostprocError) as stop:
        convert(model, *parts)
    (finding,) = stop.value.diagnostics
    assert (finding.code, finding.help) == ("MOD012", help_)
