"""Controllers that correct a part of the arm's error by themselves: a plant and a controller in plain numpy.

The plant has joint offsets, springs, its weight, a tool and a force. The controller finds joints for which its own part
of that reaches what it is told, and commands them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from postproc.compensation.conversion import Conversion
from postproc.effects.library.joints.joint_offset import JointOffset
from postproc.model.file import default_model
from tests import build
from tests.independent import arm as A
from tests.independent import inverse as I
from tests.independent import paths as P
from tests.independent import rapid as R
from tests.independent.verify import _distance, align

ARM = A.irb4600()
SPRINGS = A.joint_springs(A.TABLE_2)
OFFSET = np.array([0.3, -0.2, 0.25, 0.4, -0.3, 0.5]) * 1e-3
PROGRAM = f"""MODULE M
  PERS tooldata t:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0,0,0]];
  CONST robtarget a:=[[1100,-200,700],[0,0,1,0],[-1,0,-1,0],{build.AXES}];
  CONST robtarget b:=[[1150,250,750],[0,0,1,0],[0,-1,0,0],{build.AXES}];
  PROC main()
    MoveAbsJ [[-10,20,15,5,50,-10],{build.AXES}],v200,fine,t;
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
        commanded = T
        for _ in range(6):
            commanded = commanded @ np.linalg.inv(self.there(q, m)) @ T
            q = I.follow(ARM, commanded @ np.linalg.inv(m.tool), q[0])
        return q


def controller(*parts: str) -> Controller:
    arm = ARM if "gravity" in parts else replace(ARM, mass=0 * ARM.mass)
    force = np.array(build.FORCE) if "force" in parts else np.zeros(3)
    return Controller(OFFSET * ("geometry" in parts), arm, "tool" in parts, force)


PLANT = controller("geometry", "gravity", "tool", "force")


def deviation(text: str, brain: Controller) -> float:
    """Largest distance [mm] of the real TCP from the lines of the original between its targets.

    The first move goes to joint angles.
    """
    (old, _), (new, _) = R.motions(PROGRAM), R.motions(text)
    match = align(old, new, ARM)
    assert match is not None and new[0].q is not None
    goal = [i for i in range(1, len(old)) for _ in range(match[i - 1] + 1, match[i] + 1)]
    q, before, far = new[0].q, brain.there(new[0].q[None], new[0])[0], 0.0
    for i, m in zip(goal, new[1:], strict=True):
        T = P.line(before, m.goal, np.linspace(0, 1, 60))
        nominal = I.follow(ARM, T @ np.linalg.inv(m.tool), q)
        assert nominal is not None and tuple(I.confdata(ARM, nominal[-1])[0]) == tuple(m.conf)
        if i > 1:
            real = PLANT.there(brain.command(T, m, nominal), m)[:, :3, 3]
            far = max(far, float(_distance(old[i - 1].goal, old[i], real).max()))
        q, before = nominal[-1], m.goal
    return 1e3 * far


def convert(*already: str) -> Conversion:
    shipped = default_model()
    model = shipped.with_effects(*shipped.effects, JointOffset(offset_rad=OFFSET))
    return build.convert(PROGRAM, model, already=already)


@pytest.mark.parametrize(
    "parts",
    [(), ("geometry", "gravity"), ("geometry",), ("gravity", "tool"), ("geometry", "gravity", "force")],
    ids=lambda parts: ",".join(parts) or "nothing",
)
def test_what_the_controller_leaves_is_corrected(parts: tuple[str, ...]) -> None:
    """What it corrects by itself is not corrected once more: without it the written program is far off."""
    conversion = convert(*parts)
    text = build.written(conversion)
    before, after = (deviation(of, controller(*parts)) for of in (PROGRAM, text))
    assert conversion.report["max_error_before_mm"] > before - 0.02  # a line from joint angles counts, too
    assert after < 0.01 < before
    assert conversion.report["already"] == list(parts)
    assert (f"the controller corrects by itself: {', '.join(parts)}" in text) == bool(parts)
    if parts in ((), ("geometry", "gravity")):
        assert deviation(text, controller(*(() if parts else ("geometry", "gravity")))) > 0.5


def test_where_it_corrects_everything_nothing_is_changed() -> None:
    conversion = convert("geometry", "gravity", "force", "tool")
    assert conversion.report["max_error_before_mm"] < 1e-4
    assert deviation(build.written(conversion), PLANT) < 1e-3


@pytest.mark.parametrize(
    ("parts", "help_"),
    [(("gravety",), "did you mean `gravity`?"), (("tool", "inertia"), "write `gravity,inertia`")],
)
def test_parts_that_no_controller_has_are_refused(parts: tuple[str, ...], help_: str) -> None:
    (finding,) = build.refused(lambda: convert(*parts))
    assert (finding.code, finding.help) == ("MOD012", help_)


def test_of_a_deflection_that_the_controller_corrects_whole_no_share_remains() -> None:
    for parts, known in (((), False), (("geometry", "gravity", "force", "tool", "inertia"), True)):
        conversion = build.convert(PROGRAM, default_model(), already=parts)
        assert (conversion.report["expected_remaining_fraction"] is None) == known
        assert (conversion.report["expected_on_arm_mm"] is None) == known
        assert "CMP027" not in {d.code for d in conversion.diagnostics}
