"""The concrete follower: one way through a program, in a world that answers every question.

It shares expressions, memory and calls with the abstract interpreter; branches, loops, jumps and what is not known are
decided here by the world.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from postproc.rapid.data.events import Argument, MotionStatement, StatementKey
from postproc.rapid.data.records import JointTarget, Pose, RobTarget, ToolData, WobjData
from postproc.rapid.data.values import to_tool, to_wobj
from postproc.rapid.evaluation.call_binding import passed_on, unbound_frame
from postproc.rapid.evaluation.memory import Binding, Memory
from postproc.rapid.evaluation.state import AT_START
from postproc.rapid.execution.calls import AddedMotions
from postproc.rapid.execution.flow import Flow
from postproc.rapid.execution.worlds import World, WorldDeclared, WorldMemory
from postproc.rapid.program.instructions import KNOWN, MOVING
from postproc.rapid.program.late_binding import LateCall
from postproc.rapid.program.program import Program
from postproc.rapid.program.statement_effects import StatementEffect
from postproc.rapid.program.write_effects import WriteEffects
from postproc.rapid.syntax.nodes import Routine, Statement
from postproc.rapid.unknown import Unknown, without_causes

MOST_MOTIONS = 3_000  # of one world that are looked at
MOST_STATEMENTS = 30_000
INTERRUPTED = 0.05  # of all motions are followed by a given trap
MOVED, CALLED = 0.3, 0.4  # of the calls of code in none of the files move the arm, call a procedure of these files


class _Stop(Exception):
    """The program ends: at EXIT, at an error, or because enough of it has been followed."""


@dataclass(frozen=True, slots=True)
class WorldMotion:
    """One motion of a program that is followed in a ``World``; a target or frame without value there is None.

    Goals are in the object frame, before the program displacement.

    Args:
        begins: where the arm stands before it, if something else than the motion before has brought it there.
    """

    statement: MotionStatement
    target: RobTarget | JointTarget | None
    via: RobTarget | None
    tool: ToolData | None
    wobj: WobjData | None
    displacement: Pose
    begins: RobTarget | None = None


def follow(
    program: Program,
    entry: str | None,
    world: World,
    ordinals: Mapping[StatementKey, int],
    changes: WriteEffects | None = None,
    added: AddedMotions | None = None,
) -> list[WorldMotion]:
    """The motions that a program makes in a world, which draws at random, repeatably, all that the text leaves open.

    It starts at its entry (main if None), then at each procedure that the pendant or code outside the files may start.

    Args:
        entry: name of the routine that runs first.
        ordinals: numbers of the motion statements that the original program has; others (added ones) cost no steps, and
            no trap runs behind them.
        changes: write effects of the program, worked out if None.
        added: routines that the original does not have, in which statements cost no steps.
    """
    follower = _Follower(program, world, ordinals, changes, added)
    chosen = program.routine("main" if entry is None else entry)
    started = [r for r in program.all_routines() if _runs_alone(r)]
    if chosen is not None:
        started = [chosen, *(r for r in started if r is not chosen and not r.local)]
    for routine in started:
        memory = follower.memory(routine)
        follower.adrift = True
        try:
            follower.enter(routine, memory)
        except _Stop:
            continue
        except RecursionError:
            break
    return follower.motions


def _runs_alone(routine: Routine) -> bool:
    """Whether something outside the program may start a routine: a procedure without parameters, not read-only."""
    return routine.kind == "PROC" and not routine.parameters and not routine.source.read_only


class _Follower(Flow):
    """Follows one way through a program in which a world decides every condition, input and interrupt at random."""

    def __init__(
        self,
        program: Program,
        world: World,
        ordinals: Mapping[StatementKey, int],
        changes: WriteEffects | None,
        added: AddedMotions | None,
    ) -> None:
        """Set up the walk of a program in a world, with nothing executed yet.

        Args:
            ordinals: numbers of the original's motion statements by key; others cost no steps.
            changes: write effects of the program, worked out if None.
            added: routines that the original does not have.
        """
        super().__init__(program, changes, added, world)
        self.world = world
        self.ordinals = ordinals
        self.constants = WorldDeclared(program, world, self.changes.may_be_written)
        self.motions: list[WorldMotion] = []
        self.traps = [r for r in program.all_routines() if r.kind == "TRAP"]
        self.interrupted = False
        self.adrift = False  # the arm has been moved from where the last motion left it
        self.callable = [
            r for r in program.all_routines() if _runs_alone(r) and not r.local and r.name.lower() != "main"
        ]
        self.calling = False  # from code in none of the files
        self.count = self.own = 0

    def memory(self, routine: Routine) -> WorldMemory:
        """New memory for a routine that is started from outside the program, not called.

        The state is that at program start. Parameters are unbound: the world draws each value when it is first read.
        It varies the declared value of PERS data that the program may write, as the last run may have left it.
        """
        frame = unbound_frame(routine)
        for parameter in routine.parameters:
            frame.bindings.pop(parameter.name)
        state = dict(AT_START)
        return WorldMemory(self.program, self.changes, self.constants, frame, self.function, state, world=self.world)

    # -- statements ----------------------------------------------------------------------------------------------------

    def statement(self, statement: Statement, memory: Memory) -> bool:
        """Run one statement on ``memory``; False if it leaves its body.

        Raises:
            _Stop: it ends the program, or ``MOST_STATEMENTS`` have been run.
        """
        self.count += memory.frame.routine.key not in self.added.routines and not self.moves(statement, memory)
        if self.count > MOST_STATEMENTS or statement.kind == "leave":
            raise _Stop
        return super().statement(statement, memory)

    def moves(self, statement: Statement, memory: Memory) -> bool:
        """Whether a statement of the routine that runs is itself a motion instruction; calls of routines are not."""
        return statement.kind == "call" and self.program.motion(memory.frame.routine.source, statement) is not None

    def forget_written(self, statement: Statement, functions: StatementEffect, memory: Memory) -> None:
        """Mark data as written once more that functions in no file may write; the program's own functions are run."""
        if not self.moves(statement, memory):
            self.forget_unseen(functions, memory)

    def unknown_turns(
        self, loop: Statement, memory: Memory, bindings: dict[str, Binding], certain: bool = False
    ) -> None:
        """Do nothing: more than ``MAX_TURNS`` turns of a loop are skipped in a world."""

    def while_loop(self, loop: Statement, memory: Memory) -> bool:
        """Run a WHILE loop as long as the world says that its condition holds; False if its body is left.

        Raises:
            _Stop: ``MOST_STATEMENTS`` have been run.
        """
        while not loop.parts or self.truth(loop.parts[0], memory):
            self.count += 1
            if self.count > MOST_STATEMENTS:
                raise _Stop
            if not self.body(loop.branches[0].body, memory):
                return False
        return True

    # -- motions -------------------------------------------------------------------------------------------------------

    def move(self, motion: MotionStatement, memory: Memory) -> None:
        """Record a motion, then run the procedure that it starts and the traps that interrupt the program behind it.

        Raises:
            _Stop: ``MOST_MOTIONS`` motions of the original program are recorded.
        """
        if motion.key in self.ordinals:
            # Added statements do not count: the written program goes as far as the original.
            self.count, self.own = self.count + 1, self.own + 1
            if self.own > MOST_MOTIONS:
                raise _Stop
        arguments = {argument.role: argument for argument in motion.arguments}
        target = self.place(motion, "to", memory, motion.signature.jointed)
        via = self.place(motion, "via", memory)
        tool, wobj = self.frames(arguments.get("tool"), arguments.get("\\wobj"), memory)
        displacement = without_causes(memory.changed.get("@pdisp", Pose()))[0]
        displacement = displacement if isinstance(displacement, Pose) else Pose()
        begins = None
        if self.adrift and motion.interpolation != "none":
            self.adrift = False
            begins = self.world.beside(target) if isinstance(target, RobTarget) else None
        assert not isinstance(via, JointTarget)
        self.motions.append(WorldMotion(motion, target, via, tool, wobj, displacement, begins))
        self.search(motion, memory)
        procedure = arguments.get("procedure")
        if procedure is not None:
            name = without_causes(self.data.value_or_not(procedure.span, memory))[0]
            self.run(str(name).rpartition(":")[2], memory)
        if motion.key in self.ordinals and not self.interrupted:
            self.interrupt(self.ordinals[motion.key], memory)

    def place(
        self, motion: MotionStatement, role: str, memory: Memory, jointed: bool = False
    ) -> RobTarget | JointTarget | None:
        """The target of the argument with this role; None if there is no such argument or it has no value.

        Args:
            jointed: the argument is a jointtarget.
        """
        if role not in motion.roles:
            return None
        read = self.maker.targets.jointtarget if jointed else self.maker.targets.robtarget
        target, _ = read(motion.source, motion.span_of(role), memory)
        return None if isinstance(target, Unknown) else target

    def frames(
        self, tool: Argument | None, wobj: Argument | None, memory: Memory
    ) -> tuple[ToolData | None, WobjData | None]:
        """Tool and work object of a motion, tool0 or wobj0 without argument; both None if one has no value."""
        try:
            held = ToolData() if tool is None else to_tool(tool.text, self.data.value(tool.span, memory))
            given = wobj is not None and passed_on(wobj.span, memory)
            frame = to_wobj(wobj.text, self.data.value(wobj.span, memory)) if wobj is not None and given else WobjData()
        except Unknown:
            return None, None
        return held, frame

    def run(self, name: str, memory: Memory) -> None:
        """Run the procedure of this name without arguments, if the program has one."""
        routine = self.program.routine(name, memory.frame.routine.module)
        if routine is not None:
            self.call_routine(routine, (), memory)

    def from_elsewhere(self, statement: Statement, arguments: int, memory: Memory) -> None:
        """Carry out an instruction, or a routine in no file, which may move the arm or call procedures of the files.

        Args:
            arguments: how many arguments the call has.
        """
        super().from_elsewhere(statement, arguments, memory)
        if statement.word not in KNOWN:
            self.unseen(statement.word, memory)
        elif statement.word in MOVING:
            self.adrift = True

    def late_bound(self, call: LateCall, statement: Statement, memory: Memory) -> Routine | None:
        """The routine that a call by name means; None if it is in no file: the world then draws what the call does."""
        routine = super().late_bound(call, statement, memory)
        if routine is None:
            self.unseen("%", memory)
        return routine

    def unseen(self, name: str, memory: Memory) -> None:
        """Draw what code in no file does: it moves the arm in 30 % of calls and runs a procedure of the files in 40 %.

        Args:
            name: of the code, by which the world draws. A procedure that such code runs does not run another one so.
        """
        drawn = self.world.next(f"unseen {name}")
        chance = drawn.random()
        self.adrift = self.adrift or chance < MOVED
        if chance > 1 - CALLED and self.callable and not self.calling:
            self.calling = True
            self.call_routine(drawn.choice(self.callable), (), memory)
            self.calling = False

    def interrupt(self, ordinal: int, memory: Memory) -> None:
        """Run each trap routine behind a motion with probability ``INTERRUPTED`` (5 %), drawn by the world.

        Args:
            ordinal: number of the motion statement in the original program, by which the world draws.
        """
        for trap in self.traps:
            if self.world.next(f"{trap.key} behind {ordinal}").random() < INTERRUPTED:
                self.interrupted = True
                self.call_routine(trap, (), memory)
                self.interrupted = False
