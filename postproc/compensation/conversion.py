"""A conversion: a draft until its text is written, what the proof of that has shown, and what comes out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from postproc.compensation.correction.deviation import Deviation
from postproc.compensation.correction.rigid_shift import RigidShift, remainder_unknown
from postproc.compensation.judgement.accuracy import Accuracy, Expected, on_arm_mm
from postproc.compensation.judgement.figures import PathFigures, PlaceFigures
from postproc.compensation.judgement.seams import Seam
from postproc.compensation.options import Options
from postproc.compensation.path.motion import Motion
from postproc.compensation.plan import CorrectionPlan
from postproc.compensation.text.values import StatementOutcome
from postproc.diagnostics import Diagnostic, has_errors
from postproc.model.arm import Model
from postproc.model.uncertainty.scatter import Scatter
from postproc.motion.timing.jerk_limited import LimitReport
from postproc.numbers import SHARE_DECIMALS, decimals_of, mm
from postproc.rapid.data.events import MotionEvent, StatementKey
from postproc.rapid.program.program import Program
from postproc.rapid.syntax.spans import Edit


class Refused(Exception):
    """Ends a conversion with findings: an error forbids it, or nothing in the program moves the arm (exit code 0)."""

    def __init__(self, *findings: Diagnostic, exit_code: int = 1) -> None:
        self.findings, self.exit_code = findings, exit_code


@dataclass(frozen=True)
class Draft:
    """The program, its motions, and the model of the arm as far as it holds for them; then the plan and the text.

    Args:
        events: the motions in order of execution.
        findings: of all steps so far.
        measured: findings at data that the program itself measures, by key of the data.
        served: statements that another pass corrects where changed numbers do not: their targets count as corrected.
        excluded: statements that changed numbers must not correct, with the reason.
        unsure: statements whose targets count as unknown where the arm cannot run what the files say.
        motion: path and timing; None before they are read, or where no target is known before the program runs.
        shifts: how much of the correction in each work object is one rigid motion.
        expected: to remain on the arm, once the correction is known.
        plan: which targets are changed and added; None where nothing is known of the motion.
        edits, texts: of each file, by path, the edits without header, and the bytes with these edits.
        remedy: what would correct targets that are known only at run time, in words; empty where nothing is known.
    """

    program: Program
    events: list[MotionEvent]
    model: Model
    options: Options
    findings: tuple[Diagnostic, ...] = ()
    measured: Mapping[str, Diagnostic] = field(default_factory=dict)
    served: frozenset[StatementKey] = frozenset()
    excluded: Mapping[StatementKey, str] = field(default_factory=dict)
    unsure: frozenset[StatementKey] = frozenset()
    motion: Motion | None = None
    shifts: tuple[RigidShift, ...] = ()
    expected: Expected = Expected()
    plan: CorrectionPlan | None = None
    edits: Mapping[str, Sequence[Edit]] = field(default_factory=dict)
    texts: Mapping[str, bytes] = field(default_factory=dict)
    remedy: str = ""

    def not_corrected(self) -> list[StatementKey]:
        """Keys of motion statements that changed numbers do not correct, and neither scope nor their seam leaves."""
        keys = [s.key for s in self.program.statements]
        if self.plan is None:
            return keys
        corrected = {move.event.statement.key for move in self.plan.motion.moves} - self.plan.uncorrected.keys()
        settled = corrected | self.plan.unasked | self.plan.seam_mates
        return [key for key in keys if key not in settled]

    def with_findings(self, findings: Sequence[Diagnostic], exit_code: int = 1) -> Draft:
        """The draft with the findings of a further step.

        Raises:
            Refused: an error is among them; the command ends with this exit code.
        """
        if has_errors(findings):
            raise Refused(*self.findings, *findings, exit_code=exit_code)
        return replace(self, findings=(*self.findings, *findings))


@dataclass(frozen=True, slots=True)
class RunTimeFigures:
    """What is known of the function that corrects targets while the program runs; templates of the header read it.

    Args:
        mode: the option, where-needed or all. module: its name. statements: that call it.
        loads: number of `GripLoad` statements behind which it gets the payload.
        known_targets: of these statements, known before the program runs; max_known_error_mm: there, None without any.
        region_targets: drawn from the region of the function; max_region_error_mm: there.
        max_chord_error_mm: in the middle of lines of ``chord_length_mm`` between corrected ends;
        max_chord_error_mm_per_m2: the same for the square of their length.
        cost: of one call, for people.
    """

    mode: str
    module: str
    statements: int
    loads: int
    known_targets: int
    max_known_error_mm: float | None
    region_targets: int
    max_region_error_mm: float
    max_chord_error_mm: float
    chord_length_mm: float
    max_chord_error_mm_per_m2: float
    cost: str


@dataclass(frozen=True, slots=True, kw_only=True)
class JudgedProgram:
    """What is known of a corrected program; where no target is known before it runs nothing is measured.

    Args:
        options: by which it was converted. outcomes: of every motion statement.
        lines: number of lines and arcs; unmeasured: of those whose deviation is in no figure.
        unproved: corrected statements of which not all runs could be followed or measured.
        plan, before, after: what was decided, and the deviation along the way; None where nothing could be measured.
        seams, figures: deviations by seam, and largest ones.
        shifts: how much of the correction in each work object is one rigid motion.
        drawn: the figures measured from the path as programmed, where such a motion is left out; else None.
        accuracy: expected at the targets, None if the model was not fitted; limits: use of the joints' limits.
        scatter: of arms of the type, where the stiffness is that of the type, else None.
        run_time: of what is corrected on the controller, None for nothing.
    """

    options: Options
    outcomes: tuple[StatementOutcome, ...]
    lines: int
    unmeasured: int
    unproved: int = 0
    plan: CorrectionPlan | None = None
    before: Deviation | None = None
    after: Deviation | None = None
    seams: Sequence[Seam] = ()
    figures: PathFigures = PathFigures()
    shifts: tuple[RigidShift, ...] = ()
    drawn: PathFigures | None = None
    accuracy: Accuracy | None = None
    limits: LimitReport | None = None
    scatter: Scatter | None = None
    run_time: RunTimeFigures | None = None

    @property
    def air_tolerance_m(self) -> float:
        """The largest tolerance of all moves [m]."""
        return self.options.air_tolerance_m if self.plan is None else float(self.plan.path_tolerance.max())

    @property
    def expected_on_arm_mm(self) -> list[float] | None:
        """95 % interval of the largest deviation on the arm [mm] where it welds, else along lines and arcs.

        It is that of `on_arm_mm`; None where neither the scatter of the type nor the error of a fitted model is known,
        where nothing could be measured, or what remains beside a taught work object is not told (`remainder_unknown`).
        """
        return self.expected_mm(self.places[0]) if self.places else None

    @property
    def places(self) -> tuple[PlaceFigures, ...]:
        """The figures by place, the one that counts most first; none where nothing could be measured."""
        return () if self.lines == self.unmeasured else self.figures.places

    def expected_mm(self, place: PlaceFigures) -> list[float] | None:
        """The interval of `expected_on_arm_mm` for one place or seam; e is that of the worst target of its kind."""
        if (self.scatter is None and self.accuracy is None) or remainder_unknown(self.shifts):
            return None
        shares = (0.0, 0.0) if self.scatter is None else self.scatter.of_estimate
        errors = (0.0, 0.0)
        if self.accuracy is not None:
            errors = self.accuracy.interval if place.place in ("weld", "path") else self.accuracy.interval_in_air
        return on_arm_mm(place.after, place.before, shares, errors)

    @property
    def guess(self) -> bool:
        """Whether what is expected on the arm is a guess: the program leaves the measured range of a fitted model."""
        return self.accuracy is not None and bool(self.accuracy.beyond)

    @property
    def decimals(self) -> int:
        """Decimals of lengths in millimetres, from the tolerance."""
        return decimals_of(mm(self.options.tolerance_m, 5))

    def figure_values(self) -> list[dict[str, Any]]:
        """The entries of ``figures`` of the ``postproc/compensate/1`` document, the place that counts most first."""
        return [
            {
                "place": place.place,
                "before_mm": mm(place.before, 5),
                "after_mm": mm(place.after, 5),
                "tolerance_mm": None if place.tolerance is None else mm(place.tolerance, 5),
                "expected_on_arm_mm": self.expected_mm(place),
                "line": place.line,
            }
            for place in self.places
        ]

    def remaining_values(self) -> dict[str, list[float] | float | None]:
        """The entries of documents on the share of the deflection that is expected to remain."""
        shares = (None, None) if self.scatter is None else (self.scatter.remaining, self.scatter.after_gauge)
        now, then = (share and [round(x, SHARE_DECIMALS) for x in share] for share in shares)
        return {
            "expected_remaining_fraction": now,
            "expected_remaining_fraction_after_gauge": then,
            "gauge_load_kg": None if self.scatter is None else self.scatter.gauge_load,
        }

    @property
    def added(self) -> int:
        """Number of targets in between."""
        return 0 if self.plan is None else len(self.plan.insertions)

    @property
    def uncorrected(self) -> int:
        """Number of statements with a target that stay uncorrected."""
        kept = (o.statement.interpolation for o in self.outcomes if o.status == "skipped")
        return sum(kind not in ("none", "absjoint") for kind in kept)


@dataclass(frozen=True)
class Conversion:
    """Result of one conversion.

    Args:
        outputs: path of each source to its corrected bytes, those of the source where nothing moves the arm; empty
            where the program is not safe to compensate.
        diagnostics: all findings; exit_code: 0, 1 not safe, 2 bad input.
        judged: what is known of the corrected program; model: of the real arm, as far as it holds here; both None where
            nothing was converted.
        module: with the function for run time, None where nothing uses it.
        report: the ``postproc/compensate/1`` document.
    """

    outputs: Mapping[str, bytes]
    diagnostics: tuple[Diagnostic, ...]
    exit_code: int = 0
    judged: JudgedProgram | None = None
    model: Model | None = None
    module: bytes | None = None
    report: dict[str, Any] = field(default_factory=dict)

    @property
    def output(self) -> bytes | None:
        """The corrected bytes of the first file, None if there is none."""
        return next(iter(self.outputs.values()), None)

    @property
    def outcomes(self) -> tuple[StatementOutcome, ...]:
        """What became of every motion statement; none where nothing was converted."""
        return () if self.judged is None else self.judged.outcomes

    @property
    def plan(self) -> CorrectionPlan | None:
        """What was decided; None where nothing could be measured."""
        return None if self.judged is None else self.judged.plan
