"""What a model says that no arm can be."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from postproc.diagnostics import Diagnostic
from postproc.model.arm import Model


def doubts(model: Model) -> Iterator[Diagnostic]:
    """MOD005 for values that no arm has beside what else the model says: a link that weighs less than nothing.

    Signs that are wrong by themselves are outside the bounds of the parameter: no model holds them.
    """
    beside = {effect.key: effect for effect in model.effects}
    for key, effect in beside.items():
        none = effect.impossible(model.robot, beside)
        if none.any():
            entry = f"{effect.names()[int(np.argmax(none))]} = {effect.vector()[none][0]:g}"
            help_ = f"check signs and units (`postproc effects show {key}`); a fit that came to this misses a load: "
            yield Diagnostic("MOD005", "error", f"no arm has `{entry}` of `{key}`", help=help_ + "`diagnose`")
