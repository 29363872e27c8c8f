"""Every effect of the library passes the kit, and every check of the kit catches an effect made to fail it."""

import importlib.util
import textwrap

import numpy as np
import pytest

from postproc.diagnostics import PostprocError
from postproc.effects.base import Effect, State, param
from postproc.effects.conformance.declaration import declaration
from postproc.effects.conformance.kit import check_effect
from postproc.effects.conformance.trial import contribution, sensitivity
from postproc.effects.example import example_arm, example_state
from postproc.effects.loading import load_effect_file
from postproc.effects.registry import BUILT_IN
from postproc.model.arm import Model
from postproc.model.equilibrium import predict
from tests.build import refused
from tests.cost import operations

HEAD = """\
import numpy as np
from postproc.effects.base import Array, Displacement, Effect, Load, param, structure


"""
GOOD = '''\
class GearStep(Effect, reads=("q",)):
    """Joint 2 jumps beyond an angle. Source: own measurements."""

    step_rad: float = param(unit="rad", low=-0.01, high=0.01, typical=1e-4)

    def displacement(self, state):
        dq = np.zeros((len(state), 6))
        dq[:, 1] = self.step_rad * (state.q[:, 1] > 0.4)
        return dq
'''


@pytest.fixture
def effect_file(tmp_path):
    def write(text):
        path = tmp_path / "my_effects.py"
        path.write_text(HEAD + textwrap.dedent(text))
        return path

    return write


@pytest.mark.parametrize(
    ("unit", "reads", "instead"),
    [
        ("deg", "", "`rad` in place of `deg`"),
        ("rad/Nm", "", "`N m` in place of `Nm`"),
        ("rad/degC", "temperature", "`K` in place of `degC`"),
        ("bananas", "humidity", "units are those of the SI"),
        ("rad/%", "humidity", None),
        ("N/(rad/s)", "", None),
        ("1/(N m^2)", "", None),
    ],
)
def test_units_are_those_of_the_si(unit, reads, instead):
    class Broken(Effect, reads=("q", *([reads] if reads else []))):
        """Broken."""

        step: float = param(unit=unit)

    found = [d for d in declaration(Broken) if d.code == "EFF002"]
    assert len(found) == (instead is not None)
    assert all(instead in d.help for d in found)


@pytest.mark.parametrize("cls", BUILT_IN, ids=lambda c: c.key)
def test_library(cls):
    assert check_effect(cls) == []


def test_a_users_effect_of_nine_lines_passes(effect_file):
    (cls,) = load_effect_file(effect_file(GOOD))
    assert (cls.key, cls.title) == ("gear_step", "Joint 2 jumps beyond an angle.")
    assert check_effect(cls) == []


def body(text, head='class Broken(Effect):\n    """A broken effect."""\n\n'):
    return head + textwrap.indent(textwrap.dedent(text), "    ")


STEP = 'step_rad: Array = param(unit="rad", shape=(6,), typical=1e-4)\n'


@pytest.mark.parametrize(
    ("code", "line", "text", "says"),
    [
        ("EFF006", 5, body(STEP + "def displacement(self, state): return self.step_rad * state.q\n", "class Broken(Effect):\n"), "`Broken` has no docstring"),
        ("EFF002", 8, body("step_rad: Array = param(shape=(6,))\ndef displacement(self, state): return self.step_rad * state.q\n"), "the parameter `step_rad` of `broken` has no unit"),
        ("EFF002", 8, body('step_cm: float = param(unit="cm", typical=0.1)\ndef displacement(self, state): return self.step_cm * state.q\n'), "the unit `cm` of `step_cm` of `broken` is not of the SI"),
        ("EFF016", 8, body('step_rad: float = param(unit="rad", low="-0.01")\ndef displacement(self, state): return self.step_rad * state.q\n'), "the bounds of `step_rad` of `broken` are no numbers"),
        ("EFF016", 8, body('step_rad: float = param(unit="rad", low=1.0)\ndef displacement(self, state): return self.step_rad * state.q\n'), "the bounds of `step_rad` of `broken` leave out its null value"),
        ("EFF016", 5, body("def displacement(self, state): return 0 * state.q\n"), "`broken` has no parameters"),
        ("EFF016", 8, body('k_rad: float = param(unit="rad", low=-0.5, high=0.5)\ndef displacement(self, state): return self.k_rad * state.q\n'), "the typical size of `k_rad` of `broken` lies beyond its bounds"),
        ("EFF016", 5, body(STEP + "def displacement(self, state): return self.step_rad * state.q\n", 'class Broken(Effect, reads=("Q1",)):\n    """Broken."""\n'), "`broken` reads `Q1`, which would be a column"),
        ("EFF016", 5, body(STEP + "def displacement(self, state): return self.step_rad * state.q\n", 'class Broken(Effect, reads=("dir2",)):\n    """Broken."""\n'), "`broken` reads `dir2`, which would be a column"),
        ("EFF016", 5, body(STEP + "def displacement(self, state): return self.step_rad * state.q\n", 'class Broken(Effect, reads=("channels",)):\n    """Broken."""\n'), "`broken` reads `channels`"),
        ("EFF005", 9, body(STEP + 'def displacement(self, state): return self.step_rad * state.channels["rail_m"]\n'), "`displacement` of `broken` fails: KeyError"),
        ("EFF014", 5, body(STEP), "`broken` has neither `displacement` nor `load`"),
        ("EFF003", 9, body(STEP + "def displacement(self, state): return self.step_rad[0] * state.q[:, 0]\n"), "`displacement` of `broken` gives shape (240,) for 240 states"),
        ("EFF003", 9, body(STEP + "def displacement(self, state): return self.step_rad / 0.0 * state.q\n"), "`displacement` of `broken` gives numbers that are not finite"),
        ("EFF003", 9, body(STEP + "def displacement(self, state): return Displacement(body={7: self.step_rad * state.q})\n"), "`displacement` of `broken` names body 7"),
        ("EFF003", 9, body(STEP + "def load(self, state): return Load(joint=self.step_rad[:3] * state.q[:, :3])\n"), "`load` of `broken` gives shape (240, 3) for 240 states"),
        ("EFF003", 9, body(STEP + "def displacement(self, state): self.step_rad * state.q\n"), "`displacement` of `broken` gives nothing"),
        ("EFF005", 9, body(STEP + "def displacement(self, state): raise SystemExit(3)\n"), "`displacement` of `broken` fails: SystemExit: 3"),
        ("EFF004", 9, body(STEP + "def displacement(self, state): return self.step_rad * state.q + 1e-5\n"), "`broken` does not vanish at its null parameters: 1e-05 is left"),
        ("EFF005", 10, body(STEP + "def displacement(self, state):\n    return self.step * state.q\n"), "`displacement` of `broken` fails: AttributeError: 'Broken' object has no attribute 'step'"),
        ("EFF005", 9, body(STEP + "def displacement(self, state): return self.step_rad * state.temperature[:, None]\n"), "`displacement` of `broken` fails: TypeError: 'NoneType' object is not subscriptable"),
        ("EFF009", 9, body(STEP + "def displacement(self, state): return self.step_rad * (state.q - state.q.mean(axis=0))\n"), "a row of `broken` depends on the other rows"),
        ("EFF010", 10, body(STEP + "def displacement(self, state):\n    state.q[:, 1] += self.step_rad[1]\n    return self.step_rad * state.q\n"), "`broken` writes into the state"),
        ("EFF011", 5, body(STEP + "def displacement(self, state): return self.step_rad * state.q * self.noise()\ndef noise(self):\n    Broken.count = getattr(Broken, 'count', 0) + 1\n    return 1.0 + 1e-12 * Broken.count\n"), "`broken` gives another answer the second time"),
        ("EFF012", 5, body(STEP + "def displacement(self, state): return self.step_rad**2 * state.q\n"), "`broken` says it is linear in its amplitudes and is not"),
        ("EFF014", 5, body(STEP + "def displacement(self, state):\n    dq = self.step_rad * state.q\n    dq[:, 4] = 0.0\n    return dq\n"), "`step_rad[5]` of `broken` changes nothing on a rich set of poses"),
        ("EFF014", 5, body('a_rad: float = param(unit="rad")\nb_rad: float = param(unit="rad")\ndef displacement(self, state): return (self.a_rad + 2 * self.b_rad) * state.q\n'), "the 2 parameters of `broken` (all) repeat each other"),
    ],
)  # fmt: skip
def test_the_kit_catches(effect_file, code, line, text, says):
    with pytest.raises(PostprocError) as error:
        load_effect_file(effect_file(text))
    (found,) = error.value.diagnostics
    assert (found.code, found.severity) == (code, "error")
    assert says in found.message
    assert found.place.rsplit(":", 2)[1] == str(line)
    assert found.source.path.endswith("my_effects.py")


@pytest.mark.parametrize(
    ("code", "line", "helps"),
    [
        ("EFF005", "return self.step_rad * (state.q > limit)", "define it above the class"),
        ("EFF005", "return {'joint': self.step_rad * state.q}", "give one array (n, 6) of joint angles"),
        ("EFF005", "return Displacement(self.step_rad * state.q, state.q)", "name the parts: Displacement(joint=.., "),
        ("EFF003", "return Displacement(body={'3': self.step_rad * state.q})", "bodies are the numbers 0 to 6"),
        ("EFF005", "return self.stepp_rad * state.q", "did you mean `step_rad`?"),
        ("EFF005", "return self.step_rad * state.tmperature", "did you mean `temperature`?"),
        ("EFF005", "return self.step_rad * state.q[:, 6:7][:, 3]", "counting starts at 0"),
        ("EFF005", "return state.q + state.q[:, 1]", "one joint of it, state.q[:, 1], is (n,)"),
        ("EFF003", "return np.sqrt(-np.abs(state.q))", "roots and logarithms of negative numbers"),
        ("EFF014", "return self.step_rad * (state.q > 20)", "the limit (rad, m)"),
        ("EFF005", "return state.q if state.q > 0.4 else self.step_rad", "np.where("),
        ("EFF005", "import math; return self.step_rad * math.sin(state.q)", "np.sin(x)"),
        ("EFF005", "return Displacement(joints=state.q)", "Displacement has joint, body, tool and instrument"),
        ("EFF005", "return state.q, 0", "give one array (n, 6)"),
        ("EFF005", "return self.step_rad * state.q / (1 // 0)", "keep clear of zero"),
        ("EFF005", "import no_such_package", "install that package"),
        ("EFF005", "self.found = 1", "an effect is a value"),
        ("EFF005", "return self.displacement(state)", "it calls itself"),
        ("EFF005", "return self.step_rad * state.q * 1j", "angles and lengths are real numbers"),
        ("EFF005", "return self.step_rad * np.sign(state.joint_load[:, 1:2])", 'reads=("q", "load"))'),
        ("EFF005", "raise OSError('no such table')", "`from postproc.effects.example import example_state`"),
    ],
)
def test_an_error_of_an_effect_says_what_to_do(effect_file, code, line, helps):
    (found,) = refused(
        lambda: load_effect_file(effect_file(body(STEP + f"def displacement(self, state):\n    {line}\n")))
    )
    assert found.code == code
    assert helps in found.help


BASIS = """def joint_basis(self, state):
    from postproc.effects.base import JointBasis
    return JointBasis(np.arange(6), state.q)
def displacement(self, state): return -self.step_rad * state.q
"""
DAMP = body(
    STEP + 'def displacement(self, state): return self.step_rad * state.channels["humidity"][:, None]\n',
    'class Damp(Effect, reads=("humidity",)):\n    """Swells."""\n',
)
NESTED = "def make():\n" + textwrap.indent(GOOD, "    ") + "    return GearStep\n\n\nGearStep = make()\n"


def test_own_columns_of_the_table_are_channels(effect_file):
    (cls,) = load_effect_file(effect_file(DAMP))
    assert cls.reads == ("humidity",)


@pytest.mark.parametrize(
    ("code", "text", "says", "helps"),
    [
        ("EFF005", DAMP.replace('channels["humidity"]', "humidity"), "", 'a column of the table is `state.channels["humidity"]`'),
        ("EFF005", DAMP.replace('channels["humidity"]', "aproach").replace("humidity", "aproach"), "", 'did you mean `approach`? a column of the table is `state.channels["aproach"]`'),
        ("EFF014", body(STEP + "def displacment(self, state): return self.step_rad * state.q\n"), "", "`displacment`: did you mean `displacement`?"),
        ("EFF013", NESTED, "", "define the class at the top level of its file"),
        ("EFF012", body(STEP + BASIS), "`basis` and `displacement` of `broken` disagree", ""),
        ("EFF003", body(STEP + "def load(self, state): return self.step_rad * state.q\n"), "`load` of `broken` gives ndarray", "Load(joint=..)"),
        ("EFF005", body(STEP + "def displacement(self): return self.step_rad\n"), "takes 1 positional argument", "def displacement(self, state)"),
        ("EFF016", body('step_rad: float = param(unit="rad", low="a")\ndef displacement(self, state): return self.step_rad * state.q\n'), "are no numbers", "SI units"),
    ],
)  # fmt: skip
def test_a_wrong_declaration_says_what_to_write(effect_file, code, text, says, helps):
    (found,) = refused(lambda: load_effect_file(effect_file(text)))
    assert found.code == code
    assert says in found.message
    assert helps in found.help


def test_a_length_may_stand_for_a_shape(effect_file):
    (cls,) = load_effect_file(
        effect_file(body(STEP.replace("(6,)", "6") + "def displacement(self, state): return self.step_rad * state.q\n"))
    )
    assert cls.null().names() == tuple(f"step_rad[{j}]" for j in range(1, 7))


def test_a_nonlinear_effect_says_so(effect_file):
    text = body(
        STEP + "def displacement(self, state): return self.step_rad**2 * state.q\n",
        'class Broken(Effect, linear=False):\n    """Quadratic."""\n',
    )
    (cls,) = load_effect_file(effect_file(text))
    assert cls.linear is False


ANGLE = '    angle_rad: float = param(unit="rad", null=0.4, amplitude=False)\n\n'


@pytest.mark.parametrize(
    ("code", "text", "says"),
    [
        ("EFF017", GOOD.replace("step_rad", "step"), "rename it to `step_rad`"),
        ("EFF014", GOOD.replace("    def displacement", ANGLE + "    def displacement").replace("> 0.4", "> self.angle_rad"), "`angle_rad` of `gear_step` changes nothing on a rich set of poses"),
        ("EFF016", GOOD.replace('"q",', '"q", "humidty"'), "`gear_step` reads the column `humidty` and does not use it"),
        ("EFF018", GOOD.replace("= self.step_rad", "= 1000 * self.step_rad"), "`gear_step` turns something by 0.1 rad"),
        ("EFF018", GOOD.replace(", typical=1e-4", "").replace("-0.01, high=0.01", "-1, high=1"), "`gear_step` turns something by 1 rad"),
        ("EFF018", body('a_m: float = param(unit="m", typical=1e-4)\ndef displacement(self, state): return Displacement(tool=1e3 * self.a_m * np.sin(state.q) * [1, 0, 0, 0, 0, 0])\n'), "`broken` moves something by 0.1 m"),
        ("EFF018", body('pull_N: float = param(unit="N", typical=100)\ndef load(self, state): return Load(body={3: 1e3 * self.pull_N * np.sin(state.q)})\n'), "`broken` pulls with 1e+05 N"),
        ("EFF018", body('k_Nm: float = param(unit="N m", typical=100)\ndef load(self, state): return Load(joint=1e3 * self.k_Nm * np.sin(state.q))\n'), "`broken` turns with 1e+05 N m"),
    ],
)  # fmt: skip
def test_what_is_hardly_meant_is_a_warning(effect_file, code, text, says):
    (cls,) = load_effect_file(effect_file(text))
    (found,) = check_effect(cls)
    assert (found.code, found.severity) == (code, "warning")
    assert says in f"{found.message} {found.help}"


def test_lists_do_wherever_arrays_do(effect_file):
    text = """\
    class Lists(Effect):
        '''A pull and a shift, as lists.'''

        a_m: float = param(unit="m", typical=1e-4)
        b_Nm: float = param(unit="N m", typical=10)

        def displacement(self, state):
            d = (self.a_m * np.sin(state.q)).tolist()
            return Displacement(joint=d, body={3: d}, tool=d, instrument=d)

        def load(self, state):
            d = (self.b_Nm * np.sin(state.q)).tolist()
            return Load(joint=d, body={3: d})
    """
    (cls,) = load_effect_file(effect_file(text))
    model, q = Model(example_arm(), (cls(a_m=1e-4, b_Nm=10.0),)), example_state(3).q
    moved = predict(model, State(q=q)) - predict(Model(example_arm()), State(q=q))
    assert np.abs(moved[:, :3, 3]).max() > 1e-4


@pytest.mark.parametrize("cls", BUILT_IN, ids=lambda c: c.key)
def test_derivatives_against_central_differences(cls):
    """Columns by parameter (by basis where there is one) against differences of the whole contribution."""
    state = example_state(30)
    for form in cls.variants(state)[:4]:
        effect = form.effect
        sized = effect.with_vector(np.where(effect.amplitudes(), 0.3 * effect.scale(), effect.vector()))
        freed = np.flatnonzero(form.refit)
        step = 1e-5 * sized.scale()
        for column, i in zip(sensitivity(sized, state, freed).T, freed, strict=True):
            up, down = (sized.with_vector(sized.vector() + s * step * (np.arange(len(step)) == i)) for s in (1, -1))
            whole = (contribution(up, state) - contribution(down, state)) / 2e-5
            exact = whole[:, :6] if effect.joint_basis(state) is not None else whole
            dense = column if effect.joint_basis(state) is None else spread_over_joints(effect, state, column, i)
            np.testing.assert_allclose(dense, exact.ravel(), rtol=1e-5, atol=1e-7 * np.abs(whole).max())


def spread_over_joints(effect, state, column, i):
    dense = np.zeros((len(state), 6))
    dense[:, effect.joint_basis(state).joint[i]] = column
    return dense.ravel()


def test_error_map_of_306_columns_on_12000_rows_is_cheap():
    state = example_state(12000)
    (cls,) = (c for c in BUILT_IN if c.key == "joint_error_map")
    effect = cls(order=25)
    assert effect.joint_basis(state).values.shape == (12000, 306)
    assert operations(lambda: effect.joint_basis(state)) < 1000


def test_importing_the_registry_needs_numpy_alone():
    import subprocess
    import sys

    code = (
        "import sys, postproc.effects.registry, postproc.effects.conformance.kit\n"
        "print([m for m in ('scipy', 'pinocchio', 'toppra', 'pydantic') if m in sys.modules])"
    )
    assert importlib.util.find_spec("scipy") is not None
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
