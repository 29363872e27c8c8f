"""What remains without a name as an effect of the user's own: the diagnosis gives its shape, the user its cause."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from string import ascii_lowercase

import numpy as np

from postproc.diagnostics import Diagnostic
from postproc.effects.parameters import unit_suffix
from postproc.effects.registry import effect_library
from postproc.identification.diagnosis import Diagnosis, suspect_size
from postproc.patterns.instrument_model import SEEN, WAYS, Sight
from postproc.patterns.pattern_prior import FRAMES, LOADED, off_everywhere
from postproc.patterns.signals import Draft, Way, channels_read, text_of
from postproc.patterns.suspects import Suspect
from postproc.patterns.tool_frame_forces import LEAN, LEANS
from postproc.render.templates import environment, fill, load_template

FRAME = FRAMES[0].partition(", ")[2]
_PLACE = re.compile(
    rf"(joint|base|body|tool|instrument)(?: (\d))?(?:, (?:({FRAME}|as it leans|shifted|turned|{'|'.join(WAYS)})$|.*))?"
)
"""A part of the arm or the instrument, and how it moves, if not in every direction."""


@dataclass(frozen=True)
class _Term:
    """One pattern at one place of the arm, as it is written into an effect file.

    Args:
        name: of the parameter with its size.
        said: its sentence in the documentation.
        law: Python expression of the pattern.
        place: part of the arm or instrument; axes: index or slice of its components, as Python text.
        unit: of the parameter.
        wide: the expression fills several components.
        size: typical size in that unit.
        along: Python expression of the direction, empty if the components are free.
        body: index of the body whose load it adds to, 0 for none.
    """

    name: str
    said: str
    law: str
    place: str
    axes: str
    unit: str
    wide: bool
    size: float
    along: str = ""
    body: int = 0

    @property
    def typical(self) -> str:
        """The typical size, as one digit with exponent."""
        return f"{self.size:.0e}"

    @property
    def bound(self) -> str:
        """The bound of the parameter, 100 times the typical size, as one digit with exponent."""
        return f"{100 * self.size:.0e}"


def effect_file(found: Diagnosis, name: str, data: str) -> tuple[str, str | None]:
    """Key and Python text of an effect with the shape of the error that a diagnosis leaves unexplained.

    The text is None if no pattern of the error can be computed from a single pose.

    Args:
        found: the diagnosis, whose suspects give the shape.
        name: of the file, from which the key is made.
        data: name of the measurement table, for the documentation of the effect.
    """
    words = [w for w in re.split(r"\W+|_", name.lower()) if w[:1].isalpha()] or ["own"]
    words = ["own", *words] if "_".join(words) in effect_library() else words
    # Where a pose does not tell the first, what it tells most of the same place instead, without what stands beside it.
    some = [s for s in found.suspects if s.drafts and s.where == found.suspects[0].where]
    if not some:
        return "_".join(words), None
    first = found.suspects[0]
    told = [first, *(s for s in found.beside if s.drafts)] if first.drafts else [max(some, key=lambda s: s.share)]
    first = told[0]
    ways = _names(draft for suspect in told for draft in suspect.drafts)
    own = {way: f"self.{name}" for way, name in ways.items()}
    every = (term for n, suspect in enumerate(told) for term in _terms(found, suspect, str(n + 1) if n else "", own))
    # What a place is off in every pose is one number, whatever else moves it.
    terms = list({(term.law, term.place, term.axes, term.along, term.body): term for term in every}.values())
    sight = Sight.of(found.searched.problem.rest).code if any(SEEN in t.law + t.along for t in terms) else ""
    places = tuple(dict.fromkeys(term.place for term in terms if not term.body))
    loads = [term for term in terms if term.unit == "kg"]
    bodies = ", ".join(f"{p.removeprefix('body_')}: {p}" for p in places if p.startswith("body"))
    laws = (*(term.law + term.along for term in terms), sight)
    reads = dict.fromkeys([*(name for law in laws for name in channels_read(law)), *["pose"] * bool(loads)])
    title = f"{first.where} follows {' and '.join(first.channels)}: {first.pattern}"
    values = {
        "name": "".join(word.capitalize() for word in words),
        "title": _inside(title[0].upper() + title[1:]),
        "data": _inside(data),
        "reads": ", ".join(json.dumps(name, ensure_ascii=False) for name in reads),
        "seen": f"{SEEN} = {sight}" if sight else "",
        "terms": terms,
        "ways": ways,
        "edges": any(way.kind == "edge" for way in ways),
        "arrays": any(term.wide for term in terms),
        "places": places,
        "loads": loads,
        "moved": ", ".join([f"{p}={p}" for p in places if p[:4] != "body"] + [f"body={{{bodies}}}"] * bool(bodies)),
    }
    return "_".join(words), fill(load_template(environment(), "effect.py.j2"), values) + "\n"


def _names(drafts: Iterable[Draft]) -> dict[Way, str]:
    """Parameter names for the numbers in drafted expressions that a fit may change, such as the place of an edge."""
    found: dict[Way, str] = {}
    count = Counter[str]()
    for way in dict.fromkeys(part for draft in drafts for part in draft if isinstance(part, Way)):
        count[way.kind] += 1
        found[way] = way.kind + (str(count[way.kind]) if count[way.kind] > 1 else "") + unit_suffix(way.unit)
    return found


def _inside(text: str) -> str:
    """The text escaped for use inside a docstring."""
    return text.replace("\\", "\\\\").replace('"' * 3, "'" * 3)


def nothing_to_draft(found: Diagnosis) -> Diagnostic:
    """DAT028 (info): no effect file is written, with the reason from the diagnosis."""
    help_ = "write it by hand: `postproc explain DAT028` shows how"
    if not found.suspects:
        why, help_ = "nothing remains that follows a channel", "see what the verdict says"
    else:
        why = f"`{found.suspects[0].pattern}` is nothing that a single pose tells"
    return Diagnostic("DAT028", "info", f"no effect was drafted: {why}", help=help_)


def _terms(found: Diagnosis, suspect: Suspect, number: str, names: Mapping[Way, str]) -> Iterator[_Term]:
    """The terms of one suspect (a pattern at one place of the arm) in the effect file.

    For the end of a casting they include the constant part, which no base frame takes up.

    Args:
        found: the diagnosis with the suspect.
        number: text put behind the names of its parameters.
        names: parameter names of the numbers that a fit may change.
    """
    where = _PLACE.fullmatch(suspect.where)
    assert where is not None
    kind, index, how = where[1], int(where[2] or 0), where[3]
    along, reading = WAYS.get(how or "", ("", ""))
    # Of each part the unit, the axes, how it moves if that is one number, and which of the sizes are its own.
    parts = [("rad", "3:", "", slice(3, 6)), ("m", ":3", "", slice(0, 3))]
    if how == LEANS.partition(", ")[2]:
        to = f"({LEAN} * [1.0, 1.0, 0.0] / np.maximum(np.hypot(*{LEAN}[:, :2].T), 1e-9)[:, None])"
        parts = [("rad", "3:", to, slice(0, 1)), ("m", ":3", f"np.cross({to}, [0.0, 0.0, 1.0])", slice(1, 2))]
    elif kind == "joint":
        parts = [("rad", str(index - 1), "", slice(1))]
    elif along:
        parts = [(reading, ":3", along, slice(1))]
    elif how != FRAME:
        turned = how == "turned" or (kind in ("base", "body") and how is None)
        parts = [("rad", "3:", "", slice(None)) if turned else ("m", ":3", "", slice(None))]
    loaded = LOADED.get(suspect.where, 0)
    if loaded:
        parts = [("kg", "0", "", slice(0, 1)), ("kg m", "1:", "", slice(1, 4))]
    place = f"body_{index}" if kind in ("base", "body") else kind
    sizes = np.abs(suspect_size(found.searched, suspect)).reshape(suspect.place.shape[2], -1)
    said = f"{suspect.where}, {' and '.join(suspect.channels)}: {suspect.pattern}."
    for unit, axes, along, own in parts:
        size = float(np.abs(suspect.values).max() * sizes[own].max())
        for part, draft in enumerate(suspect.drafts):
            name = f"size{number}" + (f"_{ascii_lowercase[part]}" if len(suspect.drafts) > 1 else "")
            name += f"_{unit.replace(' ', '')}" if unit != "1" else ""
            wide = kind != "joint" and not along and unit != "kg"
            yield _Term(name, said, text_of(draft, names), place, axes, unit, wide, size, along, loaded)
        if off_everywhere(suspect.where):
            everywhere = "np.ones(len(state))"
            yield _Term(f"always{number}_{unit}", "In every pose.", everywhere, place, axes, unit, True, size)
