"""Where effects are found, and what is said when they are not."""

import pickle
import subprocess
import sys
from importlib.metadata import EntryPoint

import numpy as np
import pytest

from postproc.diagnostics import PostprocError
from postproc.effects import registry
from postproc.effects.base import Effect, param
from postproc.effects.findings import origin
from postproc.effects.library.joints.backlash import Backlash
from postproc.effects.loading import load_effect_file
from postproc.effects.registry import BUILT_IN, effect_library, find_effect
from tests.build import refused

KEYS = [
    "instrument_frame",
    "tool_frame",
    "joint_offset",
    "link_geometry",
    "joint_compliance",
    "nonlinear_compliance",
    "backlash",
    "transmission_error",
    "joint_error_map",
    "arm_load",
    "gravity_compensator",
    "payload_error",
    "dress_pack",
    "thermal_growth",
    "thermal_joint_drift",
    "base_compliance",
    "bearing_tilt",
    "link_compliance",
    "servo_lag",
    "wrist_coupling",
    "frame_drift",
    "external_axis_frame",
    "external_axis_error",
    "external_axis_compliance",
    "session",
    "outlier",
]

STEP = '''\
import numpy as np
from postproc.effects.base import Effect, param


class GearStep(Effect, reads=("q",)):
    """Joint 2 jumps beyond an angle. Source: own measurements."""

    step_rad: float = param(unit="rad", low=-0.01, high=0.01, typical=1e-4)

    def displacement(self, state):
        dq = np.zeros((len(state), 6))
        dq[:, 1] = self.step_rad * (state.q[:, 1] > 0.4)
        return dq
'''


@pytest.fixture
def step_file(tmp_path):
    path = tmp_path / "gear_step.py"
    path.write_text(STEP)
    return path


def test_library_holds_every_canonical_key():
    assert list(effect_library()) == KEYS


@pytest.mark.parametrize("cls", BUILT_IN, ids=lambda c: c.key)
def test_docstrings_say_equation_source_and_size_and_confusions_name_known_keys(cls):
    for word in ("Equation", "Source:", "Typical size"):
        assert word in cls.__doc__
    assert cls.confused_with and set(cls.confused_with) <= set(KEYS) - {cls.key}


def test_file_of_the_user_joins_the_library(step_file):
    library = effect_library([step_file, step_file])
    assert list(library) == [*KEYS, "gear_step"]
    assert origin(library["gear_step"]) == f"{step_file}:5"


def test_the_same_file_gives_the_same_classes_and_an_edited_one_new_classes(step_file):
    (first,) = load_effect_file(step_file)
    assert load_effect_file(step_file) == (first,)
    step_file.write_text(STEP.replace("> 0.4", "> 0.5"))
    assert load_effect_file(step_file) != (first,)


def test_imported_effects_are_not_taken_for_the_files_own(step_file):
    step_file.write_text(
        STEP.replace("import numpy", "from postproc.effects.library.joints.backlash import Backlash\nimport numpy")
    )
    assert [c.key for c in load_effect_file(step_file)] == ["gear_step"]


def test_a_taken_key_names_both_places(step_file, tmp_path):
    other = tmp_path / "other.py"
    other.write_text(STEP)
    (found,) = refused(lambda: effect_library([step_file, other]))
    assert (found.code, found.place) == ("EFF007", f"{other}:5:1")
    assert found.message == f"the key `gear_step` is taken twice: {step_file}:5 and {other}:5"


def test_a_key_of_the_library_cannot_be_taken(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(STEP.replace("GearStep(Effect", 'GearStep(Effect, key="backlash"'))
    with pytest.raises(PostprocError, match="the key `backlash` is taken twice"):
        effect_library([path])


@pytest.mark.parametrize(
    ("text", "code", "place", "message"),
    [
        ("x = 1\n", "EFF008", "", "the file defines no effect"),
        ("x = 1\ny = x +\n", "EFF001", ":2:1", "the effect file does not run: SyntaxError: invalid syntax"),
        ("import sys\nsys.exit(3)\n", "EFF001", ":2:1", "the effect file does not run: SystemExit: 3"),
        (STEP + "\n\n" + STEP[STEP.index("class") :], "EFF007", ":16:1", "the class `GearStep` is defined twice"),
        ("x = 1\n\nprint(y)\n", "EFF001", ":3:1", "the effect file does not run: NameError: name 'y' is not defined"),
        ("import nowhere_at_all\n", "EFF001", ":1:1", "the effect file does not run: ModuleNotFoundError: No module named 'nowhere_at_all'"),
        (STEP.replace("param(unit", "param(units"), "EFF001", ":8:5", "the effect file does not run: TypeError: param() got an unexpected keyword argument 'units'. Did you mean 'unit'?"),
        (STEP.replace("step_rad: float", "step_rad"), "EFF001", ":5:1", "the effect file does not run: TypeError: 'step_rad' is a field but has no type annotation"),
    ],
)  # fmt: skip
def test_files_that_do_not_load(tmp_path, text, code, place, message):
    path = tmp_path / "mine.py"
    path.write_text(text)
    (found,) = refused(lambda: load_effect_file(path))
    assert (found.code, found.place) == (code, f"{path}{place}")
    assert found.message.split(". Did")[0] == message.split(". Did")[0]


def test_a_file_that_is_not_there(tmp_path):
    assert refused(lambda: load_effect_file(tmp_path / "none.py"))[0].code == "EFF001"
    with pytest.raises(PostprocError) as error:
        path = tmp_path / "effect.txt"
        path.write_text(STEP)
        load_effect_file(path)
    assert error.value.diagnostics[0].message == "an effect file must end in `.py`"


def test_unknown_keys_get_near_ones():
    (found,) = refused(lambda: find_effect("joint_complience", effect_library()))
    assert (found.code, found.message) == ("EFF020", "there is no effect `joint_complience`")
    assert found.help.startswith("did you mean `joint_compliance`")
    assert find_effect("backlash", effect_library()).key == "backlash"


class Rattle(Effect):
    """Comes from an installed package."""

    size_rad: float = param(unit="rad")

    def displacement(self, state):
        dq = np.zeros((len(state), 6))
        dq[:, 1] = self.size_rad * np.sin(9 * state.q[:, 1])
        return dq


class Rattler(Effect, reads=("q",)):
    """Raises."""

    size_rad: float = param(unit="rad")

    def displacement(self, state):
        raise ValueError("no data for joint 6")


def test_entry_points_of_installed_packages(monkeypatch):
    def declared(value):
        monkeypatch.setattr(registry, "entry_points", lambda group: [EntryPoint("rattle", value, group)])

    monkeypatch.setitem(sys.modules, "rattling_package", sys.modules[__name__])
    declared("rattling_package:Rattle")
    assert effect_library()["rattle"] is Rattle
    declared("rattling_package")
    assert effect_library()["rattle"] is Rattle


@pytest.mark.parametrize(
    ("value", "code", "said"),
    [
        ("rattling_package:Missing", "EFF001", "the entry point `rattle` (rattling_package:Missing) does not load"),
        ("rattling_package:Rattler", "EFF005", "no data for joint 6"),
        ("rattling_package:Taken", "EFF007", "the key `backlash` is taken twice"),
    ],
)
def test_a_broken_package_stops_only_who_asks_for_it(monkeypatch, value, code, said):
    taken = type("Taken", (Rattle,), {"__doc__": "Has a taken key.", "__module__": __name__}, key="backlash")
    monkeypatch.setattr(sys.modules[__name__], "Taken", taken, raising=False)
    monkeypatch.setitem(sys.modules, "rattling_package", sys.modules[__name__])
    monkeypatch.setattr(registry, "entry_points", lambda group: [EntryPoint("rattle", value, group)])
    library = effect_library()
    assert list(library) == [cls.key for cls in registry.BUILT_IN]
    assert library["backlash"] is Backlash
    unknown, *rest = refused(lambda: find_effect("rattler", library))
    assert unknown.code == "EFF020"
    assert unknown.help.startswith("a package of effects is broken")
    assert [(d.code, d.severity) for d in rest[:1]] == [(code, "warning")]
    assert said in rest[0].message


def test_what_an_effect_file_prints_is_not_a_result(step_file, capsys):
    step_file.write_text("print('hi')\n" + step_file.read_text(encoding="utf-8"), encoding="utf-8")
    load_effect_file(step_file)
    assert capsys.readouterr() == ("", "hi\n")


def test_effects_of_a_file_travel_to_another_process(step_file, tmp_path):
    (cls,) = load_effect_file(step_file)
    parcel = tmp_path / "effect.pickle"
    parcel.write_bytes(pickle.dumps(cls(step_rad=3e-4)))
    code = f"import pickle; print(pickle.load(open({str(parcel)!r}, 'rb')).to_file())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "{'step_rad': 0.0003}"
