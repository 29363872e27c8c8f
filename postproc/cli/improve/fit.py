"""``postproc fit``: the model of an arm from measured poses."""

from __future__ import annotations

from collections.abc import Set
from pathlib import Path
from typing import TYPE_CHECKING

from postproc import BASE
from postproc.cli.improve.fitted_arm import FittedArm
from postproc.cli.improve.model_options import ArmOptions, MeasuredOptions
from postproc.cli.inputs import assumed, say_uses, short_names
from postproc.cli.options import CheckFlag, Output, ReportFile, Tables, TextFlag
from postproc.cli.output import check_outputs, present, write_model
from postproc.cli.printing import say, show
from postproc.cli.progress import watching
from postproc.diagnostics import Diagnostic, PostprocError, joined

if TYPE_CHECKING:
    from postproc.effects.base import Effect
    from postproc.estimation.fitted import Fit

NO_FRAME = 1e-3
"""Error [m] beyond which a fit without one of the frames is told so; far beyond it nothing is written."""


def run(
    *data: Tables,
    stated: FittedArm = FittedArm(),
    output: Output = None,
    table: MeasuredOptions = MeasuredOptions(),
    report: ReportFile = None,
    json: CheckFlag = False,
    text: TextFlag = False,
) -> int:
    """Fit the model of an arm to measured poses.

    Args:
        output: model file to write. Default: stdout, and nowhere with --json.
        json: print the postproc/fit/1 document.
    """
    from postproc.effects.roles import FRAME_ROLES
    from postproc.estimation.contradictions import contradictions
    from postproc.estimation.recorded import no_farther_than_nominal, recorded_model, silent
    from postproc.identification.add import fit_effects
    from postproc.results.improve.fit import fit_document

    arm, robot_from = stated.completed(data[0])
    check_outputs((*data, *table.inputs, arm.robot, arm.cell), output, report)
    model = arm.model()
    words, classes = _effects(",".join(BASE) if arm.effects is None else arm.effects)
    say(f"{assumed(model.robot.name, [c.key for c in classes], table.sigma)}; {robot_from}")
    measured = table.read(data, model)
    if arm.effects is None and measured.T_frame_object is not None:
        stays = FRAME_ROLES if measured.state.session is None else FRAME_ROLES[1:]
        classes = [cls for cls in classes if cls.role not in stays]
        say(f"the table states the tool and where the work is: fitted are {', '.join(cls.key for cls in classes)}")
    with watching("fitting") as watch:
        fit = fit_effects(model, measured, classes, noise=table.sigma, watch=watch)
        if arm.effects is None and measured.readings is not None and (nothing := silent(fit)):
            say(f"the rows say nothing of {joined([f'`{key}`' for key in nothing])}: left out; `--effects` names more")
            classes = [c for c in classes if c.key not in nothing]
            fit = fit_effects(model, measured, classes, noise=table.sigma, watch=watch)
    _check_frames(fit, {cls.key for cls in classes})
    against = contradictions(fit)
    show(finding for finding in against if finding not in measured.diagnostics)
    no_farther_than_nominal(fit)
    write_model(output, recorded_model(fit), silent=json)
    present(fit_document(short_names(*data), fit), report, json=json, text=text, on_stderr=output is None)
    if not json and output is not None and not against:  # else the findings say what to do
        arm_options = ArmOptions(effects=tuple(Path(word) for word in words if word.endswith(".py")))
        tables = (*data, *table.words(), *arm_options.words())
        say_uses(output, tables, arm_options.words(), correct_first=measured.readings is not None)
    return 0


def _effects(effects: str) -> tuple[list[str], list[type[Effect]]]:
    """Return the words of ``--effects`` and the effect classes they name, each once; CLI011 for none."""
    from postproc.effects.loading import load_effect_file
    from postproc.effects.registry import effect_library, find_effect

    words = [word.strip() for word in effects.split(",") if word.strip()]
    if not words:
        help_ = f"write `--effects {','.join(BASE)}`"
        raise PostprocError.of("CLI011", "no effect is named", help=help_)
    classes: list[type[Effect]] = []
    for word in words:
        classes += load_effect_file(word) if word.endswith(".py") else [find_effect(word, effect_library())]
    return words, list(dict.fromkeys(classes))


def _check_frames(fit: Fit, fitted_effects: Set[str]) -> None:
    """Report DAT030 where a fit without instrument or tool frame misses points by over 1 mm per axis.

    Raises:
        PostprocError: DAT030 where it misses them by over `MISMATCH_M`.
    """
    from postproc.effects.registry import effect_in_role
    from postproc.effects.roles import FRAME_ROLES
    from postproc.measure.checks.readings import MISMATCH_M

    omitted = [f"`{key}`" for key in (effect_in_role(role).key for role in FRAME_ROLES) if key not in fitted_effects]
    if not omitted or fit.rms < NO_FRAME:
        return
    message = f"without {' and '.join(omitted)} the model misses the points by {1e3 * fit.rms:.1f} mm per axis"
    mismatch = fit.rms > MISMATCH_M
    finding = Diagnostic("DAT030", "error" if mismatch else "warning", message, help="name them among the effects")
    if mismatch:
        raise PostprocError(finding)
    show([finding])
