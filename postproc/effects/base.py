"""The class that every physical effect is derived from.

An effect is a frozen value: its fields are its present parameters, a fit returns a new one. What a user writes:

    class GearStep(Effect, reads=("q",)):
        '''Joint 2 jumps beyond an angle. Source: own measurements.'''

        step_rad: float = param(unit="rad", low=-0.01, high=0.01, typical=1e-4)

        def displacement(self, state):
            dq = np.zeros((len(state), 6))
            dq[:, 1] = self.step_rad * (state.q[:, 1] > 0.4)
            return dq

`asking` is how the rest of the package asks: it fills in what an effect leaves out.
"""

from __future__ import annotations

import dataclasses
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Self, TypeVar, dataclass_transform

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.channels.expression import Channel, channel, follows_order, with_sources
from postproc.channels.sight import Site
from postproc.channels.state import State
from postproc.diagnostics import PostprocError
from postproc.effects.contract import Displacement, Load
from postproc.effects.files import FieldProblem, check_table, restore
from postproc.effects.parameters import META, XYZ, Layout, Parameter, Structure, broadcast, layout_of, param, structure
from postproc.effects.roles import FRAME_ROLES, Role
from postproc.effects.run_time import RunTimeTables
from postproc.robot.arm import Robot

__all__ = [
    "FILLED_BY_MODEL",
    "XYZ",
    "Array",
    "Displacement",
    "Effect",
    "JointBasis",
    "Load",
    "State",
    "Variant",
    "by_joint",
    "param",
    "structure",
    "variant",
]

T = TypeVar("T")
FILLED_BY_MODEL = ("load", "pose", "robot")


@dataclass(frozen=True, slots=True)
class JointBasis:
    """Columns of a linear effect whose every parameter moves one joint: dq[:, joint[k]] += values[:, k] * x[k].

    Args:
        joint: (p,) joint index from 0; values: (n, p) [rad per unit of the parameter].
    """

    joint: NDArray[np.int_]
    values: Array


@dataclass_transform(frozen_default=True, kw_only_default=True, eq_default=False)
class Effect:
    """A physical effect: parameters with units, and a load, a displacement, or both.

    Class keywords:
        reads: channels of the state it needs: q, v, a, approach, temperature, time, payload, wrench, session, a column
            by its name, one derived from it (`channels.expression`); or filled in by the model: load, pose, robot.
        linear: loads and displacement are linear in all amplitudes.
        key: canonical name; the class name in lower case with underscores where none is given.
        confused_with: key of another effect to the measurement that tells the two apart.
        about_data: a finding about the measurements, not a property of the arm.
        after: key of an effect that a diagnosis names before this one where both are missing.
        unlikely: 2 log of the prior odds against it; infinite where a diagnosis does not name it at all.
        role: what it is to the rest of the package (`Role`), where that is more than one effect among others.

    What is not given is taken from the class it derives from.
    """

    key: ClassVar[str]
    title: ClassVar[str]
    reads: ClassVar[tuple[str, ...]] = ("q",)
    linear: ClassVar[bool] = True
    confused_with: ClassVar[Mapping[str, str]] = {}
    about_data: ClassVar[bool] = False
    after: ClassVar[str] = ""
    unlikely: ClassVar[float] = 0.0
    role: ClassVar[Role | None] = None
    _parameters: ClassVar[dict[str, Parameter]] = {}
    _structures: ClassVar[dict[str, Structure]] = {}

    def __init_subclass__(
        cls,
        *,
        reads: Sequence[str] | None = None,
        linear: bool | None = None,
        key: str = "",
        confused_with: Mapping[str, str] | None = None,
        about_data: bool | None = None,
        after: str | None = None,
        unlikely: float | None = None,
        role: Role | None = None,
    ) -> None:
        """Make the class a frozen dataclass; keywords not given are taken from the base class."""
        super().__init_subclass__()
        # dataclass() invents a docstring where there is none, so the title is taken before it runs.
        doc = cls.__dict__.get("__doc__") or ""
        cls.title = doc.strip().split("\n")[0].partition(" Source:")[0]
        cls.key = key or re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", cls.__name__).lower()
        cls.reads = cls.reads if reads is None else with_sources((reads,) if isinstance(reads, str) else reads)
        plain = {"linear": linear, "about_data": about_data, "after": after, "unlikely": unlikely, "role": role}
        for name, value in plain.items():
            setattr(cls, name, getattr(cls, name) if value is None else value)
        cls.confused_with = cls.confused_with if confused_with is None else dict(confused_with)
        dataclass(frozen=True, eq=False, kw_only=True)(cls)
        cls._parameters, cls._structures = _declared(cls, Parameter), _declared(cls, Structure)

    def __post_init__(self) -> None:
        """Check and broadcast the parameters: None becomes the null value, arrays become read-only, lists tuples."""
        for name in self.structures():
            value = getattr(self, name)
            if isinstance(value, (list, np.ndarray)):
                object.__setattr__(self, name, tuple(np.asarray(value).tolist()))
        for name, meta in self.parameters().items():
            value, shape = getattr(self, name), self.shape(name)
            array = broadcast(meta.null if value is None else value, shape).copy()
            array.setflags(write=False)
            object.__setattr__(self, name, float(array) if shape == () else array)

    def displacement(self, state: State) -> Displacement | Array | None:
        """Return where the effect moves the arm: a `Displacement`, or only joint angles (n, 6) [rad]; None for nothing.

        Needed where `joint_basis` returns None. It is called only where every channel that it reads was recorded.
        """
        columns = self.joint_basis(state)
        if columns is None:
            return None
        x = self.vector()
        by_joint = np.zeros((len(x), 6))
        by_joint[np.arange(len(x)), columns.joint] = x
        return np.asarray(columns.values @ by_joint)

    def load(self, state: State) -> Load | None:
        """Return the forces that the effect adds; None for nothing."""
        return None

    @classmethod
    def loads(cls, some: Sequence[Self], state: State) -> Load | None:
        """Return the loads of m effects side by side, (n, 6, m) a part; None where `load` is to be called for each.

        They differ in parameters alone. A search evaluates hundreds; an override must give what `load` gives.
        """
        return None

    def joint_basis(self, state: State) -> JointBasis | None:
        """Return joint angles per unit of each parameter, in place of writing `displacement`; None by default."""
        return None

    def run_time_tables(self) -> RunTimeTables | None:
        """Return what the effect puts into the tables of the run-time function; None if that is found by evaluating it.

        Needed where loads depend on the stated payload or join two bodies; equal to what `load` and `displacement`
        give.
        """
        return None

    def roughness(self) -> Array | None:
        """Return weights w (p,) of the penalty |w x|^2 that keeps a free function x smooth; None for other effects."""
        return None

    def unlimited(self) -> Self:
        """Return the effect without the limits of its fitted range, to tell how uncertain predictions beyond it are."""
        return self

    def symbols(self) -> Iterator[str]:
        """Yield its law in symbols with the present parameters; nothing where its docstring states the equation."""
        yield from ()

    def undecided(self) -> Iterator[tuple[Self, Self]]:
        """Yield pairs of the effect at both ends of a structural number that the data leaves open; by default none."""
        yield from ()

    def resolutions(self, state: State) -> tuple[tuple[Self, ...], ...]:
        """Return versions of a free function in series from fine to coarse, for a fit to choose; else itself alone."""
        return ((self,),)

    @classmethod
    def parameters(cls) -> dict[str, Parameter]:
        """Return the declared parameters by name, in the order of the vector."""
        return cls._parameters

    @classmethod
    def structures(cls) -> dict[str, Structure]:
        """Return the declared structural choices by name."""
        return cls._structures

    def shape(self, name: str) -> tuple[int, ...]:
        """Return the shape of the parameter of this name, with lengths that its declaration takes from structures."""
        every = ((getattr(self, word) if isinstance(word, str) else word) for word in self.parameters()[name].shape)
        return tuple(len(value) if isinstance(value, tuple) else int(value) for value in every)

    @classmethod
    def null(cls, **structures: Any) -> Self:
        """Return the effect with these structural choices, its parameters at the values at which it does nothing."""
        return cls(**structures)

    def vector(self) -> Array:
        """Return all parameters (p,) in the order of declaration, arrays row by row."""
        return np.concatenate([np.zeros(0), *(np.ravel(getattr(self, name)) for name in self.parameters())])

    def with_vector(self, x: Array) -> Self:
        """Return the effect with the parameters x (p,)."""
        new = object.__new__(type(self))
        new.__dict__.update({name: getattr(self, name) for name in (*self.structures(), "layout")})
        for name, (part, shape) in zip(self.parameters(), self.layout.parts, strict=True):
            array = np.array(x[part], dtype=float).reshape(shape)
            array.setflags(write=False)
            new.__dict__[name] = float(array) if shape == () else array
        return new

    def names(self) -> tuple[str, ...]:
        """Return the names (p,) of the vector's entries, such as ``half_gap_rad[2]``, with indices from 1."""
        result: list[str] = []
        for name, meta in self.parameters().items():
            for index in np.ndindex(self.shape(name)):
                words = [str(i + 1) for i in index]
                if meta.labels and words:
                    words[-1] = meta.labels[index[-1]]
                result.append(f"{name}[{','.join(words)}]" if words else name)
        return tuple(result)

    @property
    def external_axes(self) -> tuple[str, ...]:
        """Letters (a to f) of the external axes whose errors the effect describes; empty if of none."""
        return ()

    @property
    def label(self) -> str:
        """Name of this form of the effect in a diagnosis where a fit has chosen the form; else empty."""
        return ""

    @cached_property
    def layout(self) -> Layout:
        """Declared bounds, sizes and null values of every entry of the vector."""
        return layout_of(type(self), tuple(map(self.shape, self.parameters())))  # type: ignore[arg-type]

    def bounds(self) -> tuple[Array, Array]:
        """Return the lowest and the highest values of the parameters, (p,) each."""
        return self.layout.low, self.layout.high

    def scale(self) -> Array:
        """Return the ordinary size (p,) of every parameter."""
        return self.layout.typical

    def null_vector(self) -> Array:
        """Return the parameters (p,) at which the effect vanishes; those that are no amplitudes stay as they are."""
        return np.where(self.layout.amplitude, self.layout.null, self.vector())

    def amplitudes(self) -> NDArray[np.bool_]:
        """Return (p,) True for amplitudes, False for parameters that only form the effect."""
        return self.layout.amplitude

    @property
    def is_frame(self) -> bool:
        """Whether it is the constant frame of the instrument or of the tool."""
        return self.role in FRAME_ROLES

    @property
    def is_null(self) -> bool:
        """Whether all parameters are where the effect vanishes."""
        return bool(np.all(self.vector() == self.null_vector()))

    def impossible(self, robot: Robot, effects: Mapping[str, Effect]) -> NDArray[np.bool_]:
        """Return (p,) present values that no arm can have, which a diagnosis keeps at null; ``effects``: by key."""
        return np.zeros(len(self.layout.null), dtype=bool)

    @classmethod
    def problems(cls, table: Mapping[str, Any]) -> list[FieldProblem]:
        """Return what is wrong with the effect's table ``[effects.KEY]`` of a model file."""
        return check_table(cls, table)

    @classmethod
    def from_file(cls, table: Mapping[str, Any]) -> Self:
        """Build the effect from its table ``[effects.KEY]`` of a model file.

        Raises:
            PostprocError: EFF021 to EFF024, an unknown key, or a value of the wrong length, type or size.
        """
        if problems := cls.problems(table):
            raise PostprocError([p.diagnostic() for p in problems])
        return cls(**table)

    def to_file(self) -> dict[str, Any]:
        """Return plain numbers, words and lists for ``[effects.KEY]`` of a model file."""
        values = {name: getattr(self, name) for name in (*self.structures(), *self.parameters())}
        return {n: np.asarray(v).tolist() if isinstance(v, (np.ndarray, tuple)) else v for n, v in values.items()}

    def missing(self, state: State) -> tuple[str, ...]:
        """Return the channels that the effect reads and nobody recorded; those the model fills in do not count."""
        known = [n for n in self.reads if n in FILLED_BY_MODEL or follows_order(n)]
        return tuple(n for n in self.reads if n not in known and state.channel(n) is None)

    @property
    def site(self) -> Site:
        """Where the measured point is on the tool, and where the instrument stands, for channels that ask it."""
        return Site()

    @property
    def ordered_channels(self) -> tuple[Channel, ...]:
        """The channels it reads that follow the rows in their order, such as ``lag(temperature, 2640 s)``."""
        return tuple(channel(name) for name in self.reads if follows_order(name))

    def follows(self, name: str) -> bool:
        """Return whether the law follows a column itself, and not only channels that are derived by it."""
        return name in self.reads and not any(name in c.reads for c in self.ordered_channels)

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Return the forms to try on these states; ``current`` is the effect that the model has already, or None."""
        return (variant(cls.null() if current is None else current),)

    def relatives(self, state: State, label: str) -> tuple[Variant, ...]:
        """Return forms that a diagnosis tries only after it has chosen this one, named ``label``; by default none."""
        return ()

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the effect with the file of its class, from which another process can load it."""
        module = sys.modules.get(type(self).__module__)
        fields = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}  # type: ignore[arg-type]
        return restore, (type(self).__module__, getattr(module, "__file__", None), type(self).__qualname__, fields)


@dataclass(frozen=True, slots=True)
class Variant:
    """One form of an effect that a diagnosis tries.

    Args:
        effect: the effect with null amplitudes and starting values for what only forms it.
        free: (p,) which entries of ``effect.vector()`` enter linearly and are screened.
        refit: (p,) which entries a full fit of this form moves (those of ``free`` and the forming ones).
        label: what tells it from the other forms, such as ``joint 3, order 12``.
        odds: how ordinary this form is beside the others of the effect, in any unit.
    """

    effect: Effect
    free: NDArray[np.bool_]
    refit: NDArray[np.bool_]
    label: str = ""
    odds: float = 1.0

    @property
    def count(self) -> int:
        """Number of parameters that this form frees: those screened, and those that only form the effect."""
        return int((self.free | (self.refit & ~self.effect.amplitudes())).sum())


def variant(
    effect: Effect, label: str = "", free: NDArray[np.bool_] | None = None, refit: Any = None, odds: float = 1.0
) -> Variant:
    """Return a form to try, see `Variant`; without masks (p,) all amplitudes are free and everything is refitted."""
    free = effect.amplitudes() if free is None else free
    everything = free | ~effect.amplitudes() if refit is None else refit
    return Variant(effect, free, np.asarray(everything, dtype=bool), label, odds)


def by_joint(effect: Effect) -> tuple[Variant, ...]:
    """Return the forms of an effect with one amplitude a joint: all joints at once, then each joint alone."""
    amplitudes = effect.amplitudes()
    joint = np.array([name.rpartition("[")[2].rstrip("]") for name in effect.names()])
    single = [variant(effect, f"joint {j}", (joint == str(j)) & amplitudes, joint == str(j)) for j in range(1, 7)]
    return (variant(effect, "all joints"), *single)


def _declared(cls: type[Effect], kind: type[T]) -> dict[str, T]:
    """Return the declarations of one kind, `Parameter` or `Structure`, in the fields of a class, by name."""
    every: tuple[dataclasses.Field[Any], ...] = dataclasses.fields(cls)  # type: ignore[arg-type]
    return {f.name: f.metadata[META] for f in every if isinstance(f.metadata.get(META), kind)}
