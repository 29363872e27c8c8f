"""Channels of a table that the standard layout does not know: numbers, words, and the order of the rows."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.measure.read import columns as names
from postproc.measure.read.lookup import Table
from postproc.measure.read.values import fitting

MOST_LEVELS = 12
"""A column of more different words holds names or remarks, one of more numbers a quantity."""


def channels_of(table: Table) -> dict[str, Array]:
    """Return the channels (n,) of the table's own columns, by name; what is left out is reported (DAT015).

    A column of numbers without gaps is one channel, by its name. A column of at most 12 words is one for each word,
    ``column=word``: 1 where the word stands, else 0.
    """
    channels: dict[str, Array] = {}
    header, cells = table.cells.header, table.cells
    _report_orientations(table)
    for name, mapped in table.place.items():
        if name in names.STANDARD:
            continue
        levels = _levels(table, name, mapped.name)
        column = None if levels else table.column(name)
        channels |= levels if column is None else {name: column}
    taken = {header[cells.at(mapped.name)] for mapped in table.place.values()}
    taken |= {header[cells.at(mapped.minus)] for mapped in table.place.values() if mapped.minus is not None}
    taken |= table.layout.orientation_columns
    for name in header:
        if name in taken or not name:
            continue
        near = names.nearest(name)
        if near is not None and near not in table.place:
            table.say("DAT015", "warning", f"column `{name}` is no standard column", f"did you mean `{near}`?")
        values = cells.numbers(name, [])
        if re.fullmatch(r"q[7-9]_(deg|rad)", name.lower()) and np.nanstd(values) > 0:
            what = f"column `{name}` is a channel like others: an arm has six joints here"
            table.say("DAT015", "warning", what, "an external axis that moves needs poses at one place of it for a fit")
        if fitting(cells.units[cells.at(name)], "kg") and "payload_kg" not in table.place:
            what = f"column `{name}` holds masses, and no payload is read from it"
            table.say("DAT015", "warning", what, f'if it is what hangs on the flange: payload_kg = "{name}"')
        if names.EXPANDED.fullmatch(name) and "sigma_mm" not in table.place:
            what = f"column `{name}` looks like an expanded uncertainty and is not read as the instrument's noise"
            stated = cells.units[cells.at(name)]
            unit = stated if fitting(stated, "mm") else "mm"
            meant = f'sigma_mm = {{ name = "{name}", unit = "{unit}", factor = 0.5 }}'
            table.say("DAT015", "info", what, f"with a coverage factor of 2 (95 %), a column map reads it: {meant}")
        if np.isfinite(values).all():
            channels[name] = values
        elif levels := _levels(table, name, name):
            channels |= levels
        else:
            what, help_ = "empty cells", "a channel needs a number in every row"
            if table.has_words(name):
                what = f"more than {MOST_LEVELS} different words"
                help_ = "names of poses belong into `pose_id`, those of sessions into `session`"
            table.say("DAT015", "info", f"column `{name}` holds {what} and is not used", help_)
    return channels


def _report_orientations(table: Table) -> None:
    """Report columns that look like an orientation where none is read (DAT015)."""
    if table.layout.orientation is not None or "qw" in table.place:
        return
    plain = {re.sub(r"[\[(].*", "", name).strip().lower(): name for name in table.cells.header}
    for parts, form in names.TURN_COLUMNS.items():
        if set(parts) <= plain.keys():
            theirs = [plain[part] for part in parts]
            listed = ", ".join(f"`{name}`" for name in theirs)
            what = f"columns {listed} look like an orientation and are not read as one"
            help_ = f'a column map reads it: [orientation] with columns = {theirs} and form = "{form}"'
            table.say("DAT015", "info", what, help_)


def _levels(table: Table, name: str, theirs: str | int) -> dict[str, Array]:
    """Return channels (n,) ``name=word`` of a column of at most 12 words, 1 where the word stands; empty for others.

    Args:
        name: of the channel; theirs: header or number of the column in the table.
    """
    words = np.array(table.cells.text(theirs))  # "none" is a word among others here
    levels = list(dict.fromkeys(words[words != ""].tolist()))
    if len(levels) > MOST_LEVELS or not table.has_words(theirs):
        return {}
    if len(set(words.tolist())) > 1:
        listed = ", ".join(f"`{name}={level}`" for level in levels)
        message = f"column `{table.cells.header[table.cells.at(theirs)]}` holds words: {listed} are channels"
        table.say("DAT015", "info", message, "1 where the word stands and 0 elsewhere")
    return {f"{name}={level}": (words == level).astype(float) for level in levels}


def row_order(state: State, labels: Sequence[str] = ()) -> dict[str, Array]:
    """Return {``row``: (n,) number of each row in the order of measuring}, in place of times that were not recorded.

    Names of poses that end in a number and rise along the rows (``P12``) give it, so that gaps count. Empty where the
    table has a column ``row`` itself.

    Args:
        state: has the channels of the table; labels: names of the poses.
    """
    if "row" in state.channels:
        return {}
    numbers = pose_numbers(labels)
    return {"row": np.arange(1.0, len(state) + 1) if numbers is None else numbers}


def pose_numbers(labels: Sequence[str]) -> Array | None:
    """Return (n,) numbers at the end of the names of poses (``P12``) if they rise along all rows; else None."""
    parts = [re.fullmatch(r"(.*?)(\d{1,9})", label) for label in labels]
    if not parts or len({part and part[1] for part in parts}) > 1 or None in parts:
        return None
    numbers = np.array([float(part[2]) for part in parts if part])
    return numbers if (np.diff(numbers) > 0).all() else None
