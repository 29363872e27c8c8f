"""What a program names and its files do not say: each name is reported once."""

from __future__ import annotations

from collections.abc import Mapping

from postproc.diagnostics import Diagnostic, Severity, Source, Span
from postproc.rapid.events import Argument, MotionStatement
from postproc.rapid.records import SpeedData
from postproc.rapid.values import Data, NotKnown

UNKNOWN_SPEED = SpeedData(100.0)

# State that is not known and what is taken for it: it tells the timing, or which posture of the arm is meant.
_ASSUMED: Mapping[str, tuple[str, str]] = {
    "@velset": ("VelSet", "full speed is taken"),
    "@conf_l": ("ConfL", "targets are taken in the configuration that they state"),
    "@conf_j": ("ConfJ", "targets are taken in the configuration that they state"),
}


class Missing:
    """Collects findings about names without a value, along a program."""

    def __init__(self, diagnostics: list[Diagnostic]) -> None:
        self.diagnostics = diagnostics
        self.reported: set[str] = set()

    def explain(self, error: NotKnown, argument: Argument | None, source: Source, found: list[Diagnostic]) -> str:
        """The reason why an event is left alone."""
        if error.missing is not None and argument is not None and error.missing not in self.reported:
            self.reported.add(error.missing)
            what = {"tool": "tool", "\\wobj": "work object", "to": "target", "via": "target"}.get(argument.role, "data")
            name = argument.text if argument.text.lower() == error.missing else error.missing
            self._report(undeclared(what, name, source, argument.span), found)
        return error.reason

    def say_untimed(self, error: NotKnown, argument: Argument, source: Source, found: list[Diagnostic]) -> None:
        """A speed that is not known: how fast the arm moves is a guess, where it goes is not."""
        key = f"speed {argument.text.lower()}"
        if key in self.reported:
            return
        self.reported.add(key)
        as_if = "the speed of its statement" if argument.role == "weld" else f"{UNKNOWN_SPEED.v_tcp:g} mm/s"
        text = f"the speed that `{argument.text}` states is not known ({error.reason}); it is taken as {as_if}"
        help_ = "give the file that declares it: inertia and the cycle time depend on it, gravity and forces do not"
        self._report(Diagnostic("RAP021", "warning", text, source, argument.span, help_), found)

    def say_assumed(self, state: Mapping[str, Data], statement: MotionStatement, found: list[Diagnostic]) -> None:
        """What is taken for state that is not known and that no target depends on."""
        for key, (instruction, assumed) in _ASSUMED.items():
            value = state.get(key)
            if isinstance(value, NotKnown) and key not in self.reported:
                self.reported.add(key)
                text = f"what {instruction} has set is not known from here on ({value.reason}): {assumed}"
                self._report(Diagnostic("RAP022", "info", text, statement.source, statement.span), found)

    def _report(self, finding: Diagnostic, found: list[Diagnostic]) -> None:
        found.append(finding)
        self.diagnostics.append(finding)


def undeclared(what: str, name: str, source: Source, span: Span) -> Diagnostic:
    """A name whose value stands in none of the files."""
    # Without tool or work object nothing about the pose is known; other data leaves single statements alone.
    severity: Severity = "error" if what in ("tool", "work object") else "warning"
    return Diagnostic(
        "RAP020", severity, f"the {what} `{name}` has no value in these files", source, span,
        f"give the file that declares `{name}` too, often a system module such as user.sys or CalibData.mod",
    )  # fmt: skip
