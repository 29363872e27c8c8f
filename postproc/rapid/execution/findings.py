"""What is said about a program while all its ways are followed; each finding once."""

from __future__ import annotations

from postproc.diagnostics import Diagnostic, Matter, Source, Span
from postproc.rapid.data.values import Data
from postproc.rapid.evaluation.accessor import Accessor
from postproc.rapid.evaluation.evaluate import names_in
from postproc.rapid.evaluation.memory import Memory, Reference
from postproc.rapid.evaluation.teaching import Teaching
from postproc.rapid.execution.path_splitting import Place
from postproc.rapid.motions.missing import Missing, undeclared
from postproc.rapid.program.arguments import argument_name, read_arguments
from postproc.rapid.program.program import Program
from postproc.rapid.program.signatures import MOVE, meant_instruction
from postproc.rapid.program.spelling import if_not, meant_name, meant_routine
from postproc.rapid.syntax.nodes import Declaration, Statement
from postproc.rapid.syntax.tokens import identifiers
from postproc.rapid.unknown import Unknown, without_causes


class WalkFindings:
    """Collects the findings of one walk.

    Args:
        all: the findings in the order in which they are made.
    """

    def __init__(self, program: Program, data: Accessor) -> None:
        """Start without findings; ``data`` evaluates the text of the program."""
        self.program, self.data = program, data
        self.teaching = Teaching(program.taught)
        self.all: list[Diagnostic] = []
        self._reported: set[tuple[str, str]] = set()
        self._named: set[str] = set()  # routines in none of the files
        self._branches: set[Place] = set()

    def once(self, finding: Diagnostic) -> None:
        """Add a finding unless one with the same code and message was added before."""
        if (finding.code, finding.message) not in self._reported:
            self._reported.add((finding.code, finding.message))
            self.all.append(finding)

    def too_long(self, source: Source) -> None:
        """Report RAP033 at a file: not all of the program is followed."""
        text, help_ = "the program is too long to be followed to its end", "choose the routine to start with"
        self.once(Diagnostic("RAP033", "warning", text, source, None, help_))

    def late(self, statement: Statement, source: Source) -> None:
        """Report RAP032 at a call by a text (``%name%``, ``CallByVar``) whose routine is not known."""
        text = "which routine is called here is known only at run time"
        help_ = "the routines it may call are followed on their own"
        self.once(Diagnostic("RAP032", "warning", text, source, statement.span, help_))

    def unseen(self, statement: Statement, arguments: int, source: Source) -> None:
        """Report RAP031 at a call of a routine in none of the files, once per routine; it is taken not to move the arm.

        Args:
            arguments: how many the call has; by them a misspelt motion instruction is recognised.
        """
        span = statement.span[0], statement.span[0] + len(statement.word)
        name = source.data[slice(*span)].decode("latin-1")
        if name in self._named:
            return
        self._named.add(name)
        instruction = meant_instruction(statement.word) if arguments >= len(MOVE) else ""
        meant = f"did you mean `{instruction}`?" if instruction else meant_routine(self.program, name)
        help_ = if_not(meant, "give the file that defines it too if it moves the arm or sets a load")
        text = f"the routine `{name}` is called, is in none of the files, and is taken not to move the arm"
        if meant:
            self.once(Diagnostic("RAP031", "warning", text, source, span, help_))
        else:
            self.once(Diagnostic("RAP031", "info", text, source, span, help_, Matter.UNSEEN, name))

    def undeclared_state(self, data: Data, source: Source, missing: Missing) -> None:
        """Report, once per name, a name declared nowhere if that is why a load or displacement is unknown.

        Args:
            data: the load, displacement or the like; source: file of the statement that sets it.
            missing: knows the names that have been reported.
        """
        if isinstance(data, Unknown) and data.missing and data.span and missing.is_news(data.missing):
            meant = meant_name(data.missing, (d.name for d in self.program.declarations))
            self.all.append(undeclared("data", data.missing, source, data.span, meant))

    def relied_on(self, statement: Statement, memory: Memory) -> None:
        """Report RAP036 for PERS data in a branch's conditions which nothing in these files writes, once per branch.

        Only branches that move the arm or write data count.

        Args:
            statement: IF or TEST.
        """
        routine = memory.frame.routine
        place = routine.source.path, statement.span[0]
        if place in self._branches or not memory.changes.of_one(statement, routine):
            return
        self._branches.add(place)
        for span in (*statement.parts, *(span for branch in statement.branches for span in branch.conditions)):
            try:
                names = names_in(self.data.tree(span, memory)) - memory.frame.bindings.keys()
            except Unknown:
                continue
            for declaration in filter(None, map(memory.find, sorted(names))):
                if declaration.storage == "PERS" and memory.is_initial(declaration):
                    text = f"`{declaration.name}` decides here: it is followed with its value in the file"
                    help_ = "give the file that writes it (`--with FILE`) if there is one"
                    self.once(Diagnostic("RAP036", "info", text, routine.source, span, help_))

    # -- data named by --taught ----------------------------------------------------------------------------------------

    def taught_moves(self, statement: Statement, memory: Memory) -> None:
        """Report RAP035 if a statement changes ``--taught`` data relative to itself, as in ``p.x:=p.x+1``."""
        source = memory.frame.routine.source
        self.teaching.place = (source, statement.span)
        if statement.kind == "assign":
            name, words = statement.word, identifiers(source.data[slice(*statement.parts[1])])
        elif statement.kind == "call" and statement.word in ("incr", "decr", "add"):
            pieces = read_arguments(source.data, statement.span[0] + len(statement.word), statement.span[1])
            name = argument_name(source.data, pieces[0][1]) if pieces else ""
            words = {name}
        else:
            return
        bound = memory.frame.bindings.get(name)
        declaration = bound.declaration if isinstance(bound, Reference) else memory.find(name)
        if declaration is None or name not in words or not self.teaching.covers(declaration):
            return
        same = False
        if statement.kind == "assign":
            now, data = (
                without_causes(self.data.value_or_not(span, memory.trial_copy()))[0] for span in statement.parts
            )
            same = now == data
        if not same:
            self._moved(declaration, source, statement.span)

    def taught_ends(self, memory: Memory) -> None:
        """Report RAP035 for ``--taught`` data whose value at the end of a run is not the one in its file.

        The next run begins with that value.

        Args:
            memory: at the end of the run.
        """
        moved = self.teaching.kept & self.teaching.moved.keys()  # moved, and taken as unchanged in a loop or jump
        for key, data in memory.changed.items():
            declaration = self.program.names.get(key)
            if declaration is None or key not in self.teaching.moved:
                continue
            if self.teaching.away(memory.declared(declaration).data, data):
                moved.add(key)
        for key in sorted(moved):
            self._moved(*self.teaching.moved[key])

    def _moved(self, declaration: Declaration, source: Source, span: Span) -> None:
        """Report RAP035 at a span: the program changes ``--taught`` data, so that its value in the file is not used."""
        name = declaration.name
        text = f"`{name}`, which is to be taught, is moved by the program"
        help_ = f"leave `--taught {name}` out, and set it from a CONST before the first motion"
        self.once(Diagnostic("RAP035", "error", text, source, span, help_, Matter.TAUGHT_MOVED, name))
