"""From which motion statement the arm always comes: the one that stands directly before, in the same statement list.

    MoveL p10,v100,z1,tT;
    SetDO doLamp,1;
    MoveL p20,v100,z1,tT;

Whoever starts the routine, by whatever branch or loop, the third statement begins where the first one has led. So does
the first statement of a branch whose IF or TEST stands directly behind a motion.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

from postproc.rapid.data.events import MotionStatement, StatementKey
from postproc.rapid.program.arguments import BY_REFERENCE
from postproc.rapid.program.instructions import READ_ONLY
from postproc.rapid.program.program import Program, statements_in
from postproc.rapid.program.statement_effects import UNSEEN
from postproc.rapid.program.write_effects import WriteEffects
from postproc.rapid.syntax.nodes import Routine, Statement
from postproc.rapid.syntax.tokens import identifiers, word_set

ELSEWHERE = "the statement of the motion before does not stand directly before it: the arm may come from elsewhere"
OTHER_FRAME = "its line begins in another work object or tool, or at joint angles"
INTERRUPTED = "a trap, or what a motion starts, may move the arm or its frame at any moment"
RESUMED = "an error handler may go on behind it with `TRYNEXT`, or move the arm before `RETRY`"
MAY_CHANGE = "where its line begins, or its frame, may be written at any moment"

# Instructions that may stand between two motions: they change neither where the arm is nor its path.
_BETWEEN = READ_ONLY - word_set("clearpath storepath restopath startmove stopmove")
# What these may set: how a line is driven, not where it is.
_DRIVING = frozenset({"@velset", "@accset", "@singarea", "@conf_l", "@conf_j", "@gripload"})
_ASTRAY = frozenset({"@moves", UNSEEN, "@pdisp", "@eoffs", "@units"})


class Predecessors:
    """Tells whether the arm always comes to a motion statement from the same one, and finds its place unchanged.

    Args:
        changes: write effects of the program.
    """

    def __init__(self, program: Program, changes: WriteEffects) -> None:
        self.program, self.changes = program, changes

    def why_not(self, statement: MotionStatement, before: MotionStatement) -> str:
        """Why the arm may come to a line or arc from elsewhere than from the goal of ``before``; empty if it may not.

        Args:
            before: the motion statement that comes before it on the way that is followed.
        """
        routine = self.program.routine(statement.routine, statement.module)
        if routine is None or self._directly_before.get(statement.key) != before.key:
            return ELSEWHERE
        if not self.changes.interrupting.isdisjoint(_ASTRAY):
            return INTERRUPTED
        if self._goes_on_behind_errors(routine):
            return RESUMED
        here, there = ([_text(s, "tool"), _text(s, "\\wobj") or "wobj0"] for s in (statement, before))
        if here != there or before.signature.jointed:
            return OTHER_FRAME
        names = identifiers(" ".join([_text(before, "to"), *here]).encode("latin-1"))
        return "" if all(self._stays(name, routine) for name in names) else MAY_CHANGE

    @cached_property
    def _directly_before(self) -> Mapping[StatementKey, StatementKey]:
        """By key of a motion statement, the key of the one directly before it, where nothing between matters."""
        found: dict[StatementKey, StatementKey] = {}
        for routine in self.program.all_routines():
            for body in (routine.body, *routine.handlers):
                self._read(body, routine, None, found)
        return found

    def _read(
        self,
        body: Sequence[Statement],
        routine: Routine,
        before: MotionStatement | None,
        found: dict[StatementKey, StatementKey],
    ) -> None:
        """Add to ``found`` what stands directly before the motion statements of a list and of those inside it.

        Args:
            before: the motion directly before the IF or TEST whose branch the list is.
        """
        changes = self.changes
        for statement in body:
            motion = self.program.motion(routine.source, statement)
            functions = changes.direct.functions(statement, routine)
            if functions.keys or changes.through(functions, routine):
                before = None
            for branch in statement.branches:
                self._read(branch.body, routine, before if statement.kind in ("if", "test") else None, found)
            if motion is None:
                before = before if self._may_stand_between(statement, routine) else None
                continue
            if before is not None:
                found[motion.key] = before.key
            # A search ends where it finds something; a procedure that a motion starts may write.
            plain = changes.of_one(statement, routine) == {"@moves"} and not motion.signature.results
            before = motion if plain and motion.interpolation != "none" else None

    def _may_stand_between(self, statement: Statement, routine: Routine) -> bool:
        """Whether a statement is an instruction that neither moves the arm nor writes what a line depends on."""
        if statement.kind != "call" or statement.word not in _BETWEEN:
            return False
        own = self.changes.direct.own(statement, routine)
        return not own.calls and self.changes.of_one(statement, routine) <= _DRIVING

    def _goes_on_behind_errors(self, routine: Routine) -> bool:
        """Whether a handler of a routine may pass over the statement that failed, or repeat it from elsewhere.

        An error without a handler is raised again where the routine was called (Basic Characteristics RAPID, 8.1), and
        leaves the routine.
        """
        data, handlers = routine.source.data, routine.handlers
        words = [data[slice(*s.span)].lower() for body in handlers for s in statements_in(body) if s.kind == "leave"]
        if any(word.startswith(b"trynext") for word in words):
            return True
        retries = any(word.startswith(b"retry") for word in words)
        return retries and any(not self.changes.of(body, routine).isdisjoint(_ASTRAY) for body in handlers)

    def _stays(self, name: str, routine: Routine) -> bool:
        """Whether nothing writes, at any moment, to what a name means in a routine.

        Args:
            name: in lower case.
        """
        parameter = next((p for p in routine.parameters if p.name == name), None)
        if parameter is not None:
            return parameter.mode not in BY_REFERENCE or not self.changes.volatile
        declared = self.program.declaration(name, routine.module, routine.name)
        if declared is None or declared.storage == "CONST":
            return True
        return not self.changes.may_be_written_any_time(declared.key)


def _text(statement: MotionStatement, role: str) -> str:
    """The text of an argument without white space, in lower case; empty if the statement has none of that role."""
    argument = statement.argument(role)
    return "" if argument is None else "".join(argument.text.lower().split())
