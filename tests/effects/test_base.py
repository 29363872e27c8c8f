"""What the base class promises to the rest of the package."""

import pickle

import numpy as np
import pytest

from postproc.effects.asking import displacement_of, load_of
from postproc.effects.base import Array, Displacement, Effect, State, by_joint, param, structure
from postproc.effects.conformance.example import example_state
from postproc.effects.library.joints.backlash import Backlash
from postproc.effects.registry import BUILT_IN
from tests.build import refused


class Wobble(Effect, reads=("q", "humidity", "load")):
    """A made-up effect with every kind of declaration."""

    bend_m: Array = param(unit="m", shape=("term", 3), low=-1.0, high=1.0, typical=1e-3, labels=("x", "y", "z"))
    gain_rad: float = param(unit="rad", low=0.0, high=2.0, typical=0.1)
    knee_Nm: Array = param(unit="N m", shape=(2,), low=1.0, high=(10.0, 20.0), null=5.0, amplitude=False)
    term: tuple[int, ...] = structure((3, 5), low=1, high=9)
    law: str = structure("tanh", choices=("tanh", "cubic"))

    def displacement(self, state):
        return self.gain_rad * state.q


def test_declaration_becomes_vector_names_bounds_and_scale():
    effect = Wobble(gain_rad=0.5)
    low, high = effect.bounds()
    bends = [f"bend_m[{term},{axis}]" for term in (1, 2) for axis in "xyz"]
    assert effect.names() == (*bends, "gain_rad", "knee_Nm[1]", "knee_Nm[2]")
    assert effect.vector().tolist() == [0] * 6 + [0.5, 5, 5]
    assert (low.tolist(), high.tolist()) == ([-1] * 6 + [0, 1, 1], [1] * 6 + [2, 10, 20])
    assert effect.scale().tolist() == [1e-3] * 6 + [0.1, 1, 1]
    assert effect.amplitudes().tolist() == [True] * 7 + [False] * 2


def test_vector_round_trip_keeps_shapes_and_structure():
    again = Wobble.null(term=(1, 2, 4), law="cubic").with_vector(np.arange(12.0))
    assert again.vector().tolist() == list(range(12))
    assert again.bend_m.shape == (3, 3) and again.law == "cubic" and again.term == (1, 2, 4)


@pytest.mark.parametrize(
    ("parameters", "null"), [({}, True), ({"knee_Nm": [7.0, 8.0]}, True), ({"gain_rad": 1e-9}, False)]
)
def test_null_ignores_parameters_that_only_form_the_effect(parameters, null):
    assert Wobble(**parameters).is_null == null
    assert Wobble(**parameters).null_vector().tolist() == [0] * 7 + parameters.get("knee_Nm", [5, 5])


def test_effect_is_frozen_down_to_its_arrays():
    with pytest.raises(AttributeError):
        Wobble().gain_rad = 1.0
    with pytest.raises(ValueError, match="read-only"):
        Wobble().knee_Nm[0] = 3.0


def test_file_round_trip():
    table = Wobble(gain_rad=0.25, term=(2,), bend_m=[[1e-3, 0, 0]]).to_file()
    assert table == {"term": [2], "law": "tanh", "bend_m": [[1e-3, 0, 0]], "gain_rad": 0.25, "knee_Nm": [5.0, 5.0]}
    assert Wobble.from_file(table).to_file() == table


ALLOWED = "allowed: `term`, `law`, `bend_m`, `gain_rad`, `knee_Nm`"
KNEE, BEND = "give a list of 2 numbers [N m]", "give a list of 2 x 3 numbers [m]"
GAIN = "`gain_rad` of `wobble` is not one number [rad]"


@pytest.mark.parametrize(
    ("table", "code", "message", "help"),
    [
        ({"gain_radd": 1}, "EFF021", "`wobble` has no parameter `gain_radd`", "did you mean `gain_rad`?"),
        ({"zzz": 1}, "EFF021", "`wobble` has no parameter `zzz`", ALLOWED),
        ({"knee_Nm": [1, 2, 3]}, "EFF022", "`knee_Nm` of `wobble` has 3 numbers", KNEE),
        ({"knee_Nm": [[1], [2]]}, "EFF022", "`knee_Nm` of `wobble` has 2 x 1 numbers", KNEE),
        ({"knee_Nm": 4}, "EFF022", "`knee_Nm` of `wobble` is a single number", KNEE),
        ({"bend_m": [[1, 2, 3], [1, 2]]}, "EFF022", "`bend_m` of `wobble` has rows of different lengths", BEND),
        ({"gain_rad": "0.1"}, "EFF023", GAIN, "write one number [rad]"),
        ({"gain_rad": True}, "EFF023", GAIN, "write one number [rad]"),
        ({"gain_rad": 10**400}, "EFF023", GAIN, "write one number [rad]"),
        ({"law": "linear"}, "EFF023", "`law` of `wobble` is not one of its choices", 'allowed: "tanh", "cubic"'),
        ({"term": 3}, "EFF023", "`term` of `wobble` is not a list of numbers", "write a list of numbers"),
        ({"term": [1.5]}, "EFF023", "`term` of `wobble` is not a whole number", "write it without a decimal point"),
        ({"term": [12]}, "EFF024", "`term` of `wobble` is 12", "allowed: 1 to 9"),
        ({"gain_rad": 3.0}, "EFF024", "`gain_rad` of `wobble` is 3 rad", "allowed: 0 to 2 rad"),
        ({"gain_rad": float("nan")}, "EFF024", "`gain_rad` of `wobble` is nan rad", "allowed: 0 to 2 rad"),
    ],
)
def test_wrong_tables_are_named(table, code, message, help):
    (problem,) = Wobble.problems(table)
    assert (problem.code, problem.message, problem.help) == (code, message, help)
    assert problem.field == next(iter(table))
    assert refused(lambda: Wobble.from_file(table))[0].code == code


def test_unrecorded_channels_give_nothing_instead_of_an_error():
    """What the model fills in, such as loads, does not count."""
    effect, bare = Wobble(gain_rad=1.0), State(q=np.ones((3, 6)))
    recorded = bare.with_(channels={"humidity": np.zeros(3)}, joint_load=np.zeros((3, 6)))
    assert (Wobble().missing(bare), Wobble().missing(recorded)) == (("humidity",), ())
    assert displacement_of(effect, bare) == Displacement()
    assert np.all(displacement_of(effect, recorded).joint == 1.0)


@pytest.mark.parametrize("cls", BUILT_IN, ids=lambda c: c.key)
def test_every_form_of_the_library_is_silent_on_a_bare_state_and_survives_a_file_and_a_pickle(cls):
    bare, effect = State(q=np.zeros((2, 6))), cls.null()
    ordinary = effect.with_vector(np.where(effect.amplitudes(), effect.scale(), effect.vector()))
    displacement_of(ordinary, bare)
    load_of(ordinary, bare)
    for form in cls.variants(example_state(300))[:20]:
        table = form.effect.to_file()
        assert cls.problems(table) == []
        assert cls.from_file(table).to_file() == pickle.loads(pickle.dumps(form.effect)).to_file() == table
        assert form.free.shape == form.refit.shape == form.effect.vector().shape
        assert form.effect.is_null and np.all(form.refit[form.free])


def test_derived_classes_keep_what_they_do_not_state():
    class Slop(Backlash):
        """Backlash under another name."""

    assert (Slop.key, Slop.reads, Slop.confused_with) == ("slop", ("approach",), Backlash.confused_with)


def test_forms_by_joint_screen_amplitudes_and_refit_what_forms_them():
    forms = by_joint(Backlash())
    assert [f.label for f in forms] == ["all joints", *(f"joint {j}" for j in range(1, 7))]
    assert [f.count for f in forms] == [6, 1, 1, 1, 1, 1, 1]
    assert forms[3].free.tolist() == [False, False, True, False, False, False]


@pytest.mark.parametrize(("sessions", "missing"), [(None, True), ([0.0, 0.0], True), ([0.0, 1.0], False)])
def test_one_session_shows_no_step(sessions, missing):
    (cls,) = (c for c in BUILT_IN if c.key == "session")
    state = State(q=np.zeros((2, 6)), session=None if sessions is None else np.array(sessions))
    assert cls.null().missing(state) == (("session",) if missing else ())
