"""Channels of a table that the standard layout does not know: numbers, words, and the order of the rows."""

from __future__ import annotations

import re
from collections.abc import Sequence
from json import dumps

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.diagnostics import Severity
from postproc.measure.read import columns as names
from postproc.measure.read.lookup import Table
from postproc.measure.read.values import fitting

MOST_LEVELS = 12
"""A column of more different words holds names or remarks, one of more numbers a quantity."""

KNOWN_NAME, EXPANDED = "by the name", "an expanded uncertainty, with a coverage factor of 2"


def channels_of(table: Table) -> dict[str, Array]:
    """Return the channels (n,) of the table's own columns, by name; what is left out is reported (DAT015).

    A column of numbers without gaps is one channel, by its name. A column of at most 12 words is one for each word,
    ``column=word``: 1 where the word stands, else 0.
    """
    channels: dict[str, Array] = {}
    header, cells = table.cells.header, table.cells
    for name, mapped in table.place.items():
        if name in names.STANDARD:
            continue
        levels = _levels(table, name, mapped.name)
        column = None if levels else table.column(name)
        channels |= levels if column is None else {name: column}
    taken = {header[cells.at(mapped.name)] for mapped in table.place.values()}
    taken |= {header[cells.at(mapped.minus)] for mapped in table.place.values() if mapped.minus is not None}
    taken |= table.layout.orientation_columns
    free = [name for name in dict.fromkeys(header) if name and name not in taken]
    possible = _possible(table, free)
    for name in free:
        values = cells.numbers(name, [])
        if re.fullmatch(r"q[7-9]_(deg|rad)", name.lower()) and np.nanstd(values) > 0:
            what = f"column `{name}` is a channel like others: an arm has six joints here"
            table.say("DAT015", "warning", what, "an external axis that moves needs poses at one place of it for a fit")
        if np.isfinite(values).all():
            channels[name] = values
        elif possible.get(name) in names.TEXT_COLUMNS:
            continue
        elif levels := _levels(table, name, name):
            channels |= levels
        elif name not in possible:
            what, help_ = "empty cells", "a channel needs a number in every row"
            if table.has_words(name):
                what = f"more than {MOST_LEVELS} different words"
                help_ = "names of poses belong into `pose_id`, those of sessions into `session`"
            table.say("DAT015", "info", f"column `{name}` holds {what} and is not used", help_)
    return channels


def _possible(table: Table, free: Sequence[str]) -> dict[str, str]:
    """Return which standard columns others may be; they are reported together, with one column map (DAT015).

    Args:
        free: headers that are not read yet.
    """
    cells = table.cells
    lines: dict[str, str] = {}  # of the map, by standard column
    possible: dict[str, str] = {}
    by_reason: dict[str, list[str]] = {}
    for name in free:
        unit = cells.units[cells.at(name)]
        column, reason, factor = names.named(name), KNOWN_NAME, ""
        if near := names.nearest(name):
            column, reason = near, "misspelt"
        elif fitting(unit, "kg"):
            column, reason = "payload_kg", "masses, if they hang on the flange"
        elif names.EXPANDED.fullmatch(name):
            column, reason, factor = "sigma_mm", EXPANDED, ", factor = 0.5"
        if not column or column in table.place or column in lines:
            continue
        other = fitting(unit, names.unit_of(column)) and unit != names.unit_of(column)
        extra, theirs = (f", unit = {dumps(unit)}" if other else "") + factor, dumps(name, ensure_ascii=False)
        lines[column] = f"{column} = {{ name = {theirs}{extra} }}" if extra else f"{column} = {theirs}"
        by_reason.setdefault(reason, []).append(name)
        possible[name] = column
    severity: Severity = "info" if by_reason.keys() <= {KNOWN_NAME, EXPANDED} else "warning"
    texts = ["[columns]", *lines.values()] if lines else []
    if (turned := _possible_orientation(table)) is not None:
        by_reason["an orientation"], form = turned
        texts += ["[orientation]", f"columns = {dumps(turned[0], ensure_ascii=False)}", f'form = "{form}"']
    if texts:
        groups = (f"{', '.join(f'`{name}`' for name in group)} ({reason})" for reason, group in by_reason.items())
        help_ = "if they are, give a column map (`--columns FILE.toml`) with the lines:\n" + "\n".join(texts)
        what = f"columns may be standard ones and are not read as such: {', '.join(groups)}"
        table.say("DAT015", severity, what, help_)
    return possible


def _possible_orientation(table: Table) -> tuple[list[str], str] | None:
    """Return columns that look like an orientation where none is read, and their usual form; None without them."""
    if table.layout.orientation is not None or "qw" in table.place:
        return None
    plain = {re.sub(r"[\[(].*", "", name).strip().lower(): name for name in table.cells.header}
    for parts, form in names.TURN_COLUMNS.items():
        if set(parts) <= plain.keys():
            return [plain[part] for part in parts], form
    return None


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
