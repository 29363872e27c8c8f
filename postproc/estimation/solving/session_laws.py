"""Laws in the order of rows, or in the time, of one measuring session: they say nothing of another one."""

from __future__ import annotations

import hashlib

import numpy as np

from postproc.diagnostics import Diagnostic, PostprocError
from postproc.measure.measurements import Measurements
from postproc.measure.read.terms import accepted
from postproc.model.arm import Model

CLOCK_COLUMNS = {"row": "row", "time": "time_s"}
"""Channels that begin anew with every session, and their columns."""


def session_laws(model: Model, data: Measurements) -> list[Diagnostic]:
    """Return DAT034 for effects of the row or time of a session, on a table that the model was not fitted to.

    Rows of another table are other rows. Times may continue those of the fit, which is a warning; where some lie beyond
    them by more than a tenth of their range, it is another session.

    Raises:
        PostprocError: DAT034 where such an effect would be applied, unless the user accepts it.
    """
    findings = []
    for effect in model.effects:
        clocks = [clock for clock in CLOCK_COLUMNS if effect.follows(clock) and data.state.channel(clock) is not None]
        if effect.is_null or effect.key == "outlier" or _fitted_to(model, data):
            continue
        for clock in clocks:
            foreign = _beyond_times(model, data) if clock == "time" else data.counted
            column = CLOCK_COLUMNS[clock]
            message = f"`{effect.key}` follows `{column}` of the table that it was fitted to, and this is another"
            if clock == "time":
                message += ": its times lie beyond those" if foreign else ", whose times may be of the same session"
            help_ = "take the effect out of the model, or fit it to this session"
            findings.append(Diagnostic("DAT034", "error" if foreign else "warning", message, data.source, help=help_))
    findings = accepted(findings, data.accepted)
    if any(one.severity == "error" for one in findings):
        raise PostprocError(findings)
    return findings


def _fitted_to(model: Model, data: Measurements) -> bool:
    """Return whether the model was fitted to all files of the data; True where the data has no file."""
    hashes = model.fit.get("data_sha256", [])
    known = [hashes] if isinstance(hashes, str) else list(hashes)
    return all(hashlib.sha256(source.data).hexdigest() in known for source in data.sources)


def _beyond_times(model: Model, data: Measurements) -> bool:
    """Return whether some times lie over a tenth of the fit's range outside it; True where the fit has no times."""
    span, time = model.fit.get("range", {}).get("time"), data.state.time
    if span is None or time is None:
        return span is None
    slack = 0.1 * (span[1] - span[0])
    return bool(np.nanmin(time) < span[0] - slack or np.nanmax(time) > span[1] + slack)
