"""Every effect of the library passes the kit, and every check of the kit catches an effect made to fail it."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from postproc.effects.base import State
from postproc.effects.conformance.example import example_arm, example_state
from postproc.effects.conformance.kit import check_effect, contribution
from postproc.effects.loading import load_effect_file
from postproc.effects.registry import BUILT_IN, effect_library
from postproc.model.arm import Model
from postproc.model.equilibrium import predict
from tests.build import refused
from tests.cost import operations

CORPUS = (Path(__file__).parent / "broken.txt").read_text(encoding="utf-8").partition("\n\n")[2]
ROWS = [line for line in CORPUS.splitlines() if line and not line.startswith("#")]
HEAD = """\
import numpy as np
from postproc.effects.base import Array, Displacement, Effect, JointBasis, Load, param


"""
STEP = 'step_rad: Array = param(unit="rad", shape=(6,), typical=1e-4)'
EXPECTED = re.compile(r"(?:(EFF\d+)(?::(\d+))?)?( warning)? ?(.*?)(?: \| (.*))?")


def effect_file(path: Path, row: str) -> Path:
    """A file with an effect that has, in place of the usual, what a row of the corpus says: parameters on line 8 .."""
    keywords, parameters, methods, statements = [], [], [], []
    for part in row.split(" / "):
        declared, keyword = "= param(" in part, re.match(r"(reads|linear)=", part)
        method = part.startswith("def ")
        where = keywords if keyword else parameters if declared else methods if method else statements
        where += [part] if part not in ("no docstring", "pass") else []
    title = [] if "no docstring" in row else ['    """Broken."""', ""]
    parameters = parameters or ([] if row == "pass" else [STEP])
    if statements or not methods:
        lines = statements or [f"return {'0' if row == 'pass' else 'self.step_rad'} * state.q"]
        methods.append("def displacement(self, state):\n" + "\n".join(f"        {line}" for line in lines))
    text = [f"class Broken({', '.join(['Effect', *keywords])}):", *title]
    text += [*(f"    {p}" for p in parameters), "", *(f"    {m}" for m in methods)]
    path.write_text(HEAD + "\n".join(text) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("row", ROWS)
def test_the_kit_says_what_is_wrong_where_and_what_to_write(row, tmp_path):
    written, _, expected = row.rpartition(" =>")
    code, line, warning, message, help_ = EXPECTED.fullmatch(expected.strip()).groups()
    path = effect_file(tmp_path / "my_effects.py", written)
    if warning or not code:
        found = [d for cls in load_effect_file(path) for d in check_effect(cls)]
    else:
        found = list(refused(lambda: load_effect_file(path)))
    if not code:
        assert found == []
        return
    assert [(d.code, d.severity) for d in found] == [(code, "warning" if warning else "error")]
    assert message in found[0].message and (help_ or "") in found[0].help
    assert line is None or found[0].place.startswith(f"{path}:{line}:")


@pytest.mark.parametrize("cls", BUILT_IN, ids=lambda c: c.key)
def test_the_library_passes_the_kit(cls):
    assert check_effect(cls) == []


@pytest.mark.parametrize("cls", BUILT_IN, ids=lambda c: c.key)
def test_columns_of_an_effect_are_central_differences_of_what_it_gives(cls):
    """Where an effect states its columns; and at ordinary sizes nothing is so curved that a fit could not follow."""
    state = example_state(30)
    for form in cls.variants(state)[:4]:
        x, scale = (
            np.where(form.effect.amplitudes(), 0.3 * form.effect.scale(), form.effect.vector()),
            form.effect.scale(),
        )
        basis = form.effect.joint_basis(state)
        for i in np.flatnonzero(form.refit):
            step = np.where(np.arange(len(x)) == i, 1e-4 * scale, 0.0)
            wide, near = (
                contribution(form.effect.with_vector(x + k * step), state)
                - contribution(form.effect.with_vector(x - k * step), state)
                for k in (1, 0.1)
            )
            largest = np.abs(wide).max()
            np.testing.assert_allclose(10 * near, wide, rtol=1e-5, atol=1e-6 * largest)
            if basis is not None:
                dense = np.zeros(wide.shape)
                dense[:, basis.joint[i]] = basis.values[:, i] * 2e-4 * scale[i]
                np.testing.assert_allclose(dense, wide, rtol=1e-5, atol=1e-7 * largest)


def test_lists_do_wherever_arrays_do(tmp_path):
    path = tmp_path / "lists.py"
    path.write_text(
        HEAD
        + '''class Lists(Effect):
    """A pull and a shift, as lists."""

    a_m: float = param(unit="m", typical=1e-4)
    b_Nm: float = param(unit="N m", typical=10)

    def displacement(self, state):
        d = (self.a_m * np.sin(state.q)).tolist()
        return Displacement(joint=d, body={3: d}, tool=d, instrument=d)

    def load(self, state):
        d = (self.b_Nm * np.sin(state.q)).tolist()
        return Load(joint=d, body={3: d})
''',
        encoding="utf-8",
    )
    (cls,) = load_effect_file(path)
    state = State(q=example_state(3).q)
    moved = predict(Model(example_arm(), (cls(a_m=1e-4, b_Nm=10.0),)), state) - predict(Model(example_arm()), state)
    assert np.abs(moved[:, :3, 3]).max() > 1e-4


def test_error_map_of_306_columns_on_12000_rows_is_cheap():
    state, effect = example_state(12000), effect_library()["joint_error_map"](order=25)
    assert effect.joint_basis(state).values.shape == (12000, 306)
    assert operations(lambda: effect.joint_basis(state)) < 1000


def test_importing_the_registry_needs_numpy_alone():
    code = (
        "import sys, postproc.effects.registry, postproc.effects.conformance.kit\n"
        "print([m for m in ('scipy', 'pinocchio', 'toppra', 'pydantic') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
