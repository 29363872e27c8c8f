"""Where effects are found, and what is said when they are not."""

import pickle
import subprocess
import sys
from importlib.metadata import EntryPoint

import numpy as np
import pytest

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
    "work_object",
    "reflector",
    "setup",
    "outlier",
    "curve",
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
TWICE = STEP + "\n\n" + STEP[STEP.index("class") :]
DOES_NOT_RUN = "the effect file does not run: "


@pytest.fixture
def effect_file(tmp_path):
    def write(text, name="gear_step.py"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_library_holds_every_canonical_key():
    assert list(effect_library()) == KEYS


@pytest.mark.parametrize("cls", BUILT_IN, ids=lambda c: c.key)
def test_docstrings_say_equation_source_and_size_and_confusions_name_known_keys(cls):
    assert all(word in cls.__doc__ for word in ("Equation", "Source:", "Typical size"))
    assert cls.confused_with and set(cls.confused_with) <= set(KEYS) - {cls.key}


def test_file_of_the_user_joins_the_library_without_the_effects_that_it_imports(effect_file, capsys):
    """What the file prints is not a result."""
    imported = "from postproc.effects.library.joints.backlash import Backlash\nprint('hi')\n"
    path = effect_file(imported + STEP)
    library = effect_library([path, path])
    assert list(library) == [*KEYS, "gear_step"]
    assert origin(library["gear_step"]) == f"{path}:7"
    assert capsys.readouterr() == ("", "hi\n")


def test_the_same_file_gives_the_same_classes_and_an_edited_one_new_classes(effect_file):
    (first,) = load_effect_file(effect_file(STEP))
    assert load_effect_file(effect_file(STEP)) == (first,)
    assert load_effect_file(effect_file(STEP.replace("> 0.4", "> 0.5"))) != (first,)


def test_effects_of_a_file_travel_to_another_process(effect_file, tmp_path):
    (cls,) = load_effect_file(effect_file(STEP))
    parcel = tmp_path / "effect.pickle"
    parcel.write_bytes(pickle.dumps(cls(step_rad=3e-4)))
    code = f"import pickle; print(pickle.load(open({str(parcel)!r}, 'rb')).to_file())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "{'step_rad': 0.0003}"


def test_a_taken_key_names_both_places(effect_file):
    first, second = effect_file(STEP), effect_file(STEP, "other.py")
    (found,) = refused(lambda: effect_library([first, second]))
    assert (found.code, found.place) == ("EFF007", f"{second}:5:1")
    assert found.message == f"the key `gear_step` is taken twice: {first}:5 and {second}:5"
    shipped = effect_file(STEP.replace("GearStep(Effect", 'GearStep(Effect, key="backlash"'))
    assert refused(lambda: effect_library([shipped]))[0].message.startswith("the key `backlash` is taken twice")


@pytest.mark.parametrize(
    ("text", "code", "place", "message"),
    [
        ("x = 1\n", "EFF008", "", "the file defines no effect"),
        (TWICE, "EFF007", ":16:1", "the class `GearStep` is defined twice"),
        ("x = 1\ny = x +\n", "EFF001", ":2:1", DOES_NOT_RUN + "SyntaxError: invalid syntax"),
        ("import sys\nsys.exit(3)\n", "EFF001", ":2:1", DOES_NOT_RUN + "SystemExit: 3"),
        ("x = 1\n\nprint(y)\n", "EFF001", ":3:1", DOES_NOT_RUN + "NameError: name 'y' is not defined"),
        ("import nowhere_at_all\n", "EFF001", ":1:1", DOES_NOT_RUN + "ModuleNotFoundError: No module named"),
        (STEP.replace("(unit", "(units"), "EFF001", ":8:5", DOES_NOT_RUN + "TypeError: param() got an unexpected"),
        (STEP.replace("rad: float", "rad"), "EFF001", ":5:1", DOES_NOT_RUN + "TypeError: 'step_rad' is a field but"),
    ],
)
def test_files_that_do_not_load(effect_file, text, code, place, message):
    path = effect_file(text)
    (found,) = refused(lambda: load_effect_file(path))
    assert (found.code, found.place) == (code, f"{path}{place}")
    assert found.message.startswith(message)


def test_a_file_that_is_not_there_or_no_python_file(effect_file, tmp_path):
    assert refused(lambda: load_effect_file(tmp_path / "none.py"))[0].code == "EFF001"
    (found,) = refused(lambda: load_effect_file(effect_file(STEP, "effect.txt")))
    assert (found.code, found.message) == ("EFF001", "an effect file must end in `.py`")


def test_unknown_keys_get_near_ones():
    (found,) = refused(lambda: find_effect("joint_complience", effect_library()))
    assert (found.code, found.message) == ("EFF020", "there is no effect `joint_complience`")
    assert found.help.startswith("did you mean `joint_compliance`")
    assert find_effect("backlash", effect_library()) is Backlash


class Rattle(Effect):
    """Comes from an installed package."""

    size_rad: float = param(unit="rad", typical=1e-4)

    def displacement(self, state):
        return self.size_rad * np.sin(9 * state.q)


class Rattler(Rattle):
    """Raises."""

    def displacement(self, state):
        raise ValueError("no data for joint 6")


Taken = type("Taken", (Rattle,), {"__doc__": "Has a taken key.", "__module__": "rattling_package"}, key="backlash")


@pytest.fixture
def installed(monkeypatch):
    """Makes an entry point of an installed package that is this module."""

    def declare(value):
        monkeypatch.setitem(sys.modules, "rattling_package", sys.modules[__name__])
        monkeypatch.setattr(registry, "entry_points", lambda group: [EntryPoint("rattle", value, group)])

    return declare


@pytest.mark.parametrize("value", ["rattling_package:Rattle", "rattling_package"])
def test_effects_of_an_installed_package_join_the_library(installed, value):
    """An entry point names a class, or a module of which those are left out that fail a check."""
    installed(value)
    library = effect_library()
    assert library["rattle"] is Rattle and "rattler" not in library


@pytest.mark.parametrize(
    ("value", "code", "message"),
    [
        ("rattling_package:Missing", "EFF001", "the entry point `rattle` (rattling_package:Missing) does not load"),
        ("rattling_package:Rattler", "EFF005", "no data for joint 6"),
        ("rattling_package:Taken", "EFF007", "the key `backlash` is taken twice"),
    ],
)
def test_a_broken_package_stops_only_who_asks_for_it(installed, value, code, message):
    installed(value)
    library = effect_library()
    assert list(library) == KEYS and library["backlash"] is Backlash
    unknown, warning, *_ = refused(lambda: find_effect("rattler", library))
    assert unknown.code == "EFF020" and unknown.help.startswith("a package of effects is broken")
    assert (warning.code, warning.severity) == (code, "warning") and message in warning.message
