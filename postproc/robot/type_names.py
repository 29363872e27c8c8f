"""What ABB controllers call an arm, and which arm of the library that is.

A configuration (MOC.cfg) says ``ROB1_4600_2.55_40``: robot number, model, reach [m], payload [kg], sometimes an option
before the reach (``LeanID``) and a type letter at the end, which leaves the kinematics as they are. Decimals vary
(``1.9``, ``1.90``) and reaches are rounded (``0.8`` for 0.81 m), so names are compared as numbers. A display name says
``IRB 4600-40/2.55 Type C``: payload before reach. An option is another arm: LeanID wrists are 150 mm longer.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from difflib import SequenceMatcher
from functools import cache
from pathlib import Path

ARMS = Path(__file__).parent / "arms"
SAME_REACH = 0.0201
"""Reaches [m] that differ by no more are one: 0.8 is written for 0.81, 0.6 for 0.58."""
_TYPE = re.compile(
    r"(?:ROB\d*|IRB)_(?P<model>\d+[A-Z]{0,3})(?:_(?P<option>[A-Z]\w*?))?_(?P<reach>\d+(?:\.\d+)?)"
    r"_(?P<payload>\d+(?:\.\d+)?)(?:_TYPE[A-Z])?",
    re.IGNORECASE,
)
_DISPLAYED = re.compile(
    r"(?:ABB\s+)?(?:IRB\s*)?(?P<model>\d+[A-Z]{0,3})(?:\s+(?P<option>LeanID|Inv))?-(?P<payload>\d+(?:\.\d+)?)"
    r"/(?P<reach>\d+(?:\.\d+)?)(?:\s+Type\s+[A-Z])?",
    re.IGNORECASE,
)


@dataclass(frozen=True, slots=True)
class TypeName:
    """An arm as its name states it: model with letters in upper case, option, reach [m], payload [kg]."""

    model: str
    option: str
    reach: float
    payload: float

    def is_same_arm(self, other: TypeName) -> bool:
        """Tell whether model, option and payload are equal and the reaches differ by at most 20 mm."""
        return ((self.model, self.option, self.payload) == (other.model, other.option, other.payload)) and abs(
            self.reach - other.reach
        ) <= SAME_REACH

    def __str__(self) -> str:
        """Return model, option, reach and payload joined by underscores."""
        return "_".join(filter(None, (self.model, self.option, f"{self.reach:g}", f"{self.payload:g}")))


def parse_type_name(text: str) -> TypeName | None:
    """Parse a controller's type name or a display name; None where it is neither.

    >>> parse_type_name("ROB2_1200_0.9_5_TypeB")
    TypeName(model='1200', option='', reach=0.9, payload=5.0)
    >>> parse_type_name("IRB 1600ID-4/1.5") == parse_type_name("ROB1_1600ID_1.50_4")
    True
    """
    match = _TYPE.fullmatch(text.strip()) or _DISPLAYED.fullmatch(text.strip())
    if match is None:
        return None
    option = (match["option"] or "").upper()
    return TypeName(match["model"].upper(), option, float(match["reach"]), float(match["payload"]))


def library_name(type_: str) -> str | None:
    """Return the library's name of an arm that a controller calls ``ROB1_4600_2.55_40``; None where it has no such arm.

    >>> library_name("ROB2_4600_2.05_60"), library_name("ROB1_6700_LeanID_2.65_220")
    ('irb4600_60_205', None)
    """
    parsed = parse_type_name(type_)
    for name, types in _library().items():
        if type_.strip().upper() in (written.upper() for written in types):
            return name
        if parsed is not None and any(parsed.is_same_arm(known) for known in map(parse_type_name, types) if known):
            return name
    return None


def nearest_names(type_: str, count: int = 3) -> list[str]:
    """Return names of library arms of the same model whose types are most alike in spelling, the most alike first.

    Reach, payload and options vary within a model; the digits of another model (140, 14000) are another machine, with
    other axes. A text that is no type name is compared with all.
    """
    wanted, model = _bare(type_), _model(type_)

    def likeness(name: str) -> float:
        """Return the likeness, 0 to 1, of the wanted type to the most similar one of an arm."""
        return max(SequenceMatcher(None, wanted, _bare(known)).ratio() for known in _library()[name])

    of_model = [name for name, types in _library().items() if model in (None, *map(_model, types))]
    return sorted(of_model, key=lambda name: (-likeness(name), name))[:count]


def _model(type_: str) -> str | None:
    """Return the model number (three to five digits) in a type name, which need not be parsable; None without."""
    match = re.search(r"(?<!\d)\d{3,5}(?!\d)", type_.strip())
    return match and match[0]


def _bare(type_: str) -> str:
    """Return a type name without its start ``ROB1_``, in upper case; one that can be parsed in a uniform spelling."""
    parsed = parse_type_name(type_)
    return str(parsed) if parsed is not None else re.sub(r"^ROB\d*_", "", type_.strip().upper())


@cache
def _library() -> Mapping[str, tuple[str, ...]]:
    """Return the controller's type names of every arm of the library that has any, by library name."""
    library = {}
    for path in sorted(ARMS.glob("*.toml")):
        types = tomllib.loads(path.read_text("utf-8")).get("controller", {}).get("types", ())
        if types:
            library[path.stem] = tuple(types)
    return library
