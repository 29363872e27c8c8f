"""What a program names and its files do not say: each name is reported once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from postproc.diagnostics import Diagnostic, Matter, Severity, Source, Span
from postproc.rapid.data.builtins import PREDEFINED
from postproc.rapid.data.events import Argument, MotionEvent, MotionStatement
from postproc.rapid.data.records import SpeedData
from postproc.rapid.data.values import Data, to_zone
from postproc.rapid.program.program import Program
from postproc.rapid.program.spelling import if_not, meant_data, meant_name
from postproc.rapid.unknown import Invalid, Unknown

UNKNOWN_SPEED = SpeedData(100.0)
UNKNOWN_ZONE = to_zone(PREDEFINED["z50"][1])

# State that is not known and what is taken for it: it tells the timing, or which posture of the arm is meant.
_ASSUMED: Mapping[str, str] = {
    "@velset": "full speed is taken",
    "@conf_l": "targets are taken in the configuration that they state",
    "@conf_j": "targets are taken in the configuration that they state",
}

_ARGUMENT_WORDS: Mapping[str, str] = {"tool": "tool", "\\wobj": "work object", "to": "target", "via": "target"}
_TYPES: Mapping[str, frozenset[str]] = {
    "tool": frozenset({"tooldata"}),
    "work object": frozenset({"wobjdata"}),
    "target": frozenset({"robtarget", "jointtarget"}),
}
_RECORDS = frozenset({"robtarget", "jointtarget", "tooldata", "wobjdata", "loaddata", "speeddata", "zonedata"})
MOST_ROUTINES_NAMED = 3  # routines in one finding
_POSE_DATA = frozenset({"tool", "work object"})  # without these nothing about the pose is known


class Missing:
    """Collects findings about names without a value, along a program."""

    def __init__(self, program: Program, diagnostics: list[Diagnostic]) -> None:
        """Collect findings of a program in ``diagnostics``, with nothing reported yet."""
        self.program = program
        self.diagnostics = diagnostics
        self.reported: set[str] = set()

    def explain(
        self, error: Unknown, argument: Argument | None, statement: MotionStatement, findings: list[Diagnostic]
    ) -> None:
        """Report why an argument has no value if users can help it: an undeclared name, or numbers that are refused.

        Args:
            error: why it has no value; findings: gets the finding, beside ``diagnostics``.
        """
        if argument is None:
            return
        missing = None if error.missing is None else error.missing.lower()
        named = missing in (None, argument.text.split("{")[0].strip().lower())
        what = _ARGUMENT_WORDS.get(argument.role, "data") if named else "data"  # else it stands inside of what is named
        if error.missing is not None and self.is_news(error.missing):
            place = statement.module, statement.routine
            meant = meant_data(self.program, error.missing, _TYPES.get(what, frozenset()), *place)
            self._report(undeclared(what, error.missing, statement.source, argument.span, meant), findings)
        elif isinstance(error, Invalid):
            self._say_refused(error, argument, statement, findings)

    def is_news(self, name: str) -> bool:
        """Whether this name (any case) has not been reported before; it counts as reported afterwards."""
        news = name.lower() not in self.reported
        self.reported.add(name.lower())
        return news

    def _say_refused(
        self, error: Invalid, argument: Argument, statement: MotionStatement, findings: list[Diagnostic]
    ) -> None:
        """Report RAP024 once for numbers that the controller refuses, at the declaration or the statement.

        Args:
            error: why it refuses them; findings: gets the finding, beside ``diagnostics``.
        """
        name = argument.text.split("{")[0].strip()
        declaration = self.program.declaration(name, statement.module, statement.routine)
        if declaration.type not in _RECORDS if declaration is not None else not argument.text.startswith("["):
            return  # worked out, or of a type that does not belong here
        source, span = statement.source, argument.span
        if declaration is not None and declaration.init is not None:
            source, span = declaration.source, declaration.span
        if f"{source.path} {span}" in self.reported:
            return
        self.reported.add(f"{source.path} {span}")
        what = f"`{declaration.name}`: " if declaration is not None else ""
        help_ = "the controller refuses these numbers: look for a typing error"
        self._report(Diagnostic("RAP024", "error", f"{what}{error.reason}", source, span, help_), findings)

    def say_untimed(self, error: Unknown, argument: Argument, source: Source, findings: list[Diagnostic]) -> None:
        """Report RAP021 once for a speed or zone that is not known and the value that is taken instead.

        The targets do not depend on it, only the timing of the motion.

        Args:
            error: why it is not known; findings: gets the finding, beside ``diagnostics``.
        """
        if not self.is_news(f"{argument.role} {argument.text}"):
            return
        as_if = "the speed of its statement" if argument.role == "weld" else f"{UNKNOWN_SPEED.v_tcp:g} mm/s"
        what, as_if = ("zone", "z50") if argument.role == "zone" else ("speed", as_if)
        text = f"the {what} that `{argument.text}` states is not known ({error.reason}); it is taken as {as_if}"
        help_ = "give the file that declares it: inertia and the cycle time depend on it, gravity and forces do not"
        if error.missing is not None:
            help_ = if_not(meant_name(error.missing, (d.name for d in self.program.declarations)), help_)
        name = argument.text if error.missing is None else error.missing
        untold = Diagnostic("RAP021", "warning", text, source, argument.span, help_, Matter.UNDECLARED, name)
        self._report(untold, findings)

    def say_assumed(self, state: Mapping[str, Data], statement: MotionStatement, findings: list[Diagnostic]) -> None:
        """Report RAP022 once for VelSet, ConfL and ConfJ if their state is not known, with what is taken instead.

        Args:
            state: values by ``@`` key; findings: gets the findings, beside ``diagnostics``.
        """
        for key, assumed in _ASSUMED.items():
            value = state.get(key)
            if isinstance(value, Unknown) and key not in self.reported:
                self.reported.add(key)
                text = f"{value.reason}, from here on: {assumed}"
                self._report(Diagnostic("RAP022", "info", text, statement.source, statement.span), findings)

    def _report(self, finding: Diagnostic, findings: list[Diagnostic]) -> None:
        """Add a finding to those of the statement (``findings``) and to those of the program (``diagnostics``)."""
        findings.append(finding)
        self.diagnostics.append(finding)


def shown_to_users(walked: Iterable[Diagnostic], events: Sequence[MotionEvent]) -> list[Diagnostic]:
    """The findings with all RAP031 about routines in no file replaced by one, or none if no event has assumed values.

    Args:
        walked: findings of a program that was followed; events: its events.
    """
    unseen = [d for d in walked if d.matter is Matter.UNSEEN]
    shown = [d for d in walked if d not in unseen]
    assumed = len([event for event in events if event.assumed])
    if not unseen or not assumed:
        return shown
    named = ", ".join(f"`{d.name}`" for d in unseen[:MOST_ROUTINES_NAMED])
    others = f" and {len(unseen) - MOST_ROUTINES_NAMED} more" if len(unseen) > MOST_ROUTINES_NAMED else ""
    text = (
        f"{named}{others} {'is' if len(unseen) == 1 else 'are'} in none of the files: what such routines may write is"
    )
    text += f" taken to be as it was, in {assumed} executions of motion statements"
    help_ = "give the files that define them (`--with FILE`); they are taken not to move the arm"
    return [*shown, Diagnostic("RAP031", "info", text, unseen[0].source, unseen[0].span, help_)]


def undeclared(what: str, name: str, source: Source, span: Span, meant: str) -> Diagnostic:
    """The finding RAP020 for a name whose value stands in none of the files.

    Args:
        what: kind of data (tool, work object, target, data); an error for the first two, else a warning.
        meant: "did you mean" question for a misspelt name, or empty.
    """
    severity: Severity = "error" if what in _POSE_DATA else "warning"  # other data leaves single statements alone
    give = (
        f"give the file that declares `{name}` too (`--with FILE`), often user.sys, CalibData.mod or another task's; "
    )
    kind = {"tool": "tooldata", "work object": "wobjdata", "target": "robtarget"}.get(what, "TYPE")
    give += f"or write a file that declares it, as the pendant shows it: `PERS {kind} {name}:=..;`"
    text = f"the {what} `{name}` has no value in these files"
    return Diagnostic("RAP020", severity, text, source, span, if_not(meant, give), Matter.UNDECLARED, name)
