"""The concrete follower: one way through a program, in a world that answers every question.

Conditions that no data decides, inputs, interrupts and code in none of the files are drawn at random by the world.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from postproc.diagnostics import Span
from postproc.rapid.data.events import Argument, MotionStatement, StatementKey
from postproc.rapid.data.records import JointTarget, Pose, RobTarget, ToolData, WobjData
from postproc.rapid.data.values import to_tool, to_wobj
from postproc.rapid.evaluation.call_binding import passed_on, unbound_frame
from postproc.rapid.evaluation.memory import NOWHERE, Memory
from postproc.rapid.evaluation.state import AT_START
from postproc.rapid.execution.interpreter import AddedMotions
from postproc.rapid.execution.one_way import OneWay, Stopped
from postproc.rapid.execution.worlds import World, WorldDeclared, WorldMemory
from postproc.rapid.motions.targets import Targets
from postproc.rapid.program.program import Program
from postproc.rapid.program.statement_effects import StatementEffect
from postproc.rapid.program.write_effects import WriteEffects
from postproc.rapid.syntax.nodes import Routine, Statement
from postproc.rapid.unknown import Unknown, without_causes

MOST_MOTIONS = 3_000  # of one world that are looked at
MOST_STATEMENTS = 30_000
INTERRUPTED = 0.05  # of all motions are followed by a given trap
MOVED, CALLED = 0.3, 0.4  # of the calls of code in none of the files move the arm, call a procedure of these files


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

    It starts at its entry, then at each procedure that the pendant or code outside the files may start.

    Args:
        entry: name of the routine that runs first; main if None.
        ordinals: number of each motion statement of the original program, by its key; others (added ones) cost no
            steps, and no trap runs behind them.
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
        try:
            follower.enter(routine, memory)
        except Stopped:
            continue
        except RecursionError:
            break
    return follower.motions


def _runs_alone(routine: Routine) -> bool:
    """Whether something outside the program may start a routine: a procedure without parameters, not read-only."""
    return routine.kind == "PROC" and not routine.parameters and not routine.source.read_only


class _Follower(OneWay):
    """Follows one way through a program in which a world decides every condition, input and interrupt at random.

    Args:
        motions: the motions made so far, in order; own: how many of them the original program has too.
        interrupted: a trap is running; calling: code in none of the files is running a procedure of the files.
    """

    most = MOST_STATEMENTS

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
        super().__init__(program, changes, added)
        self.world = world
        self.ordinals = ordinals
        self.constants = WorldDeclared(program, world, self.changes.may_be_written)
        self.targets = Targets(rooted=False)
        self.motions: list[WorldMotion] = []
        self.traps = [r for r in program.all_routines() if r.kind == "TRAP"]
        self.callable = [
            r for r in program.all_routines() if _runs_alone(r) and not r.local and r.name.lower() != "main"
        ]
        self.interrupted = self.calling = False
        self.own = 0

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
        """Run one statement on ``memory``; False if it leaves the body in which it stands.

        Raises:
            Stopped: it ends the program, or ``MOST_STATEMENTS`` have been run.
        """
        if memory.frame.routine.key not in self.added.routines and not self.moves(statement, memory):
            self.spend()
        if statement.kind == "leave":
            raise Stopped
        return super().statement(statement, memory)

    def moves(self, statement: Statement, memory: Memory) -> bool:
        """Whether a statement of the routine that runs is itself a motion instruction; calls of routines are not."""
        return statement.kind == "call" and self.program.motion(memory.frame.routine.source, statement) is not None

    def forget_written(self, statement: Statement, functions: StatementEffect, memory: Memory) -> None:
        """Mark data as written once more that functions in no file may write; not in motion statements.

        The program's own functions are run instead.

        Args:
            functions: effect of the functions in the statement's expressions.
        """
        if not self.moves(statement, memory):
            super().forget_written(statement, functions, memory)

    def asked(self, condition: Span, memory: Memory) -> bool:
        """Whether a condition holds that no data decides: drawn with even odds, anew each time it is asked for.

        The draw depends on the routine and the text of the condition.
        """
        routine = memory.frame.routine
        words = routine.source.data[slice(*condition)].decode("latin-1")
        return self.world.next(f"{routine.key} {words}").random() < 0.5

    # -- motions -------------------------------------------------------------------------------------------------------

    def move(self, motion: MotionStatement, memory: Memory) -> None:
        """Record a motion, then run the procedure that it starts and the traps that interrupt the program behind it.

        Raises:
            Stopped: ``MOST_MOTIONS`` motions of the original program are recorded.
        """
        if motion.key in self.ordinals:
            # Added statements do not count: the written program goes as far as the original.
            self.spend()
            self.own += 1
            if self.own > MOST_MOTIONS:
                raise Stopped
        arguments = {argument.role: argument for argument in motion.arguments}
        target = self.place(motion, "to", memory, motion.signature.jointed)
        via = self.place(motion, "via", memory)
        tool, wobj = self.frames(arguments.get("tool"), arguments.get("\\wobj"), memory)
        displacement = without_causes(memory.changed.get("@pdisp", Pose()))[0]
        displacement = displacement if isinstance(displacement, Pose) else Pose()
        begins = None
        if NOWHERE in memory.ends and motion.interpolation != "none":
            memory.ends = frozenset()
            begins = self.world.beside(target) if isinstance(target, RobTarget) else None
        assert not isinstance(via, JointTarget)
        self.motions.append(WorldMotion(motion, target, via, tool, wobj, displacement, begins))
        super().move(motion, memory)
        procedure = arguments.get("procedure")
        if procedure is not None:
            name = without_causes(self.data.value_or_not(procedure.span, memory))[0]
            routine = self.program.routine(str(name).rpartition(":")[2], memory.frame.routine.module)
            if routine is not None:
                self.call_routine(routine, (), memory)
        if motion.key in self.ordinals and not self.interrupted:
            self.interrupt(self.ordinals[motion.key], memory)

    def place(
        self, motion: MotionStatement, role: str, memory: Memory, jointed: bool = False
    ) -> RobTarget | JointTarget | None:
        """The target in the argument with this role; None if there is no such argument or it has no value.

        Args:
            role: ``to`` or ``via``; jointed: the argument is a jointtarget.
        """
        if role not in motion.roles:
            return None
        read = self.targets.jointtarget if jointed else self.targets.robtarget
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

    def run_unseen(self, statement: Statement, arguments: int | None, memory: Memory) -> None:
        """Draw what code in no file does: in 30 % of calls it moves the arm, in 40 % it runs a procedure of the files.

        The draw depends on the name that is called. Such a procedure is not run while another one runs for that reason.

        Args:
            statement: the call; arguments: how many it has, None if a text names the routine.
        """
        drawn = self.world.next(f"unseen {'%' if arguments is None else statement.word}")
        chance = drawn.random()
        if chance < MOVED:
            memory.doubt()
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
