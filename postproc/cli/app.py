"""The command line: which commands there are. Each is imported only when it runs."""

from __future__ import annotations

import gc
import os
import sys
from io import TextIOWrapper

from cyclopts import App, Group, Parameter

from postproc import __version__
from postproc.cli.options import GROUPS
from postproc.cli.run import run
from postproc.process import COLLECT, THREADS

CONVERT = Group("Convert programs", sort_key=1)
IMPROVE = Group("Improve the model", sort_key=2)
LOOK_UP = Group("Look up", sort_key=3)
FOLDERS = {CONVERT: "convert", IMPROVE: "improve", LOOK_UP: "look_up"}

EXIT_CODES = (
    "Exit codes: 0 done; 1 findings, would change or not safe to compensate; 2 bad usage or bad input; "
    "70 internal error. With `--verbose` every finding is printed, else those that are alike are counted."
)

COMMANDS = (
    ("compensate", CONVERT, "Correct a program so that the real arm goes where the program says."),
    ("inspect", CONVERT, "List what a program moves, where, and what would be left alone and why."),
    ("batch", CONVERT, "Convert a folder, a controller backup or the tasks of a jobs file."),
    ("seam", CONVERT, "Make a compensated weld module out of seam points."),
    ("diff", CONVERT, "Compare two programs, folders or backups by meaning."),
    ("fit", IMPROVE, "Fit the model of an arm to measured poses."),
    ("compare", IMPROVE, "Compare a model with measurements: where does it fail?"),
    ("diagnose", IMPROVE, "Find which physical effect a model lacks, with evidence."),
    ("add", IMPROVE, "Add effects to a model, refit, and show how far the error falls."),
    ("predict", IMPROVE, "Predict the TCP for every row of a table."),
    ("plan", IMPROVE, "Choose the poses to measure next, and write a program that visits them."),
    ("touchups", IMPROVE, "Make a measurement table of the targets that were touched up."),
    ("explain", LOOK_UP, "Explain a diagnostic by its code, RAP012."),
    ("schema", LOOK_UP, "Print the JSON Schema of a kind of file, for editors."),
)
GROUPED = (
    ("runtime", CONVERT, "A module that corrects targets on the controller."),
    ("effects", LOOK_UP, "The library of physical effects, and your own."),
    ("robots", LOOK_UP, "The arms in the library."),
)
ACTIONS = (
    ("runtime", "write", "Write a module with a function that corrects targets that exist only at run time."),
    ("runtime", "check", "Run a written module and compare it with the exact correction of a model."),
    ("effects", "list", "List the effects by key."),
    ("effects", "show", "Show an effect: equation, source, parameters, what it is confused with."),
    ("effects", "check", "Check the effects of a Python file; its code is run."),
    ("robots", "list", "List the arms."),
    ("robots", "show", "Show an arm's numbers, each with its source."),
)
"""Commands that consist of actions, and these."""
EXAMPLES = {
    "compensate": "compensate hull_seam.mod --robot irb4600_60_205 -o out/hull_seam.mod",
    "inspect": "inspect hull_seam.mod --robot irb4600_60_205",
    "batch": "batch BACKUP -o out --workers 4 --report out/batch.html",
    "seam": "seam seam.csv --robot irb4600_60_205 --with cell_data.sys --tool tTorch --wobj wPanel -o Hull_12.mod",
    "diff": "diff approved/hull_seam.mod out/hull_seam.mod --tolerance 0.01",
    "fit": "fit tracker.csv --robot irb4600_60_205 -o cell.toml",
    "compare": "compare cell.toml tracker.csv --report compare.html",
    "diagnose": "diagnose cell.toml tracker.csv --report diagnose.html",
    "add": "add cell.toml backlash --data tracker.csv -o better.toml",
    "predict": "predict cell.toml poses.csv -o predicted.csv",
    "plan": "plan cell.toml tracker.csv -n 30 -o poses.csv --rapid measure.mod",
    "touchups": "touchups seam_drawn.mod seam_touched.mod --robot irb4600_60_205 -o touchups.csv",
    "explain": "explain RAP020",
    "schema": "schema model > model.schema.json",
    "runtime write": "runtime write --robot irb4600_60_205 --load 30,0,0,120 -o ppModel.sys",
    "runtime check": "runtime check ppModel.sys --robot irb4600_60_205 --targets 200",
    "effects list": "effects list",
    "effects show": "effects show backlash",
    "effects check": "effects check gear_step.py",
    "robots list": "robots list",
    "robots show": "robots show irb4600_60_205",
}
"""One for each command, as it can be typed beside files of these names."""


def _epilogue(command: str) -> str:
    """Return the end of a command's help: its example and the exit codes."""
    return f"Example: postproc {EXAMPLES[command]}\n\n{EXIT_CODES}"


def build() -> App:
    """Return the command-line application; command modules are imported only when they run."""
    app = App(
        name="postproc",
        help="Correct ABB RAPID programs with a model of the real robot, and improve that model from measurements.",
        version=f"postproc {__version__}",
        version_format="plaintext",
        help_format="plaintext",
        help_epilogue=_epilogue("compensate"),
        default_parameter=Parameter(negative=()),
        group_commands=LOOK_UP,
        group_parameters=GROUPS["Common"],
        print_error=False,
        exit_on_error=False,
        suppress_keyboard_interrupt=False,
        result_action="return_value",
    )
    for name, group, text in COMMANDS:
        place, epilogue = f"postproc.cli.{FOLDERS[group]}.{name}", _epilogue(name)
        app.command(f"{place}:run", name=name, group=group, help=text, help_epilogue=epilogue)
    inner = Group("Commands")
    for name, group, text in GROUPED:
        actions = [(action, action_text) for owner, action, action_text in ACTIONS if owner == name]
        epilogue = _epilogue(f"{name} {actions[0][0]}")
        part = App(name=name, help=text, group=group, group_commands=inner, help_epilogue=epilogue)
        for action, action_text in actions:
            place = f"postproc.cli.{FOLDERS[group]}.{name}:{'list_' if action == 'list' else action}"
            part.command(place, name=action, help=action_text, help_epilogue=_epilogue(f"{name} {action}"))
        app.command(part)
    app.register_install_completion_command(group=LOOK_UP, help="Let the shell complete commands and options.")
    return app


def main() -> None:
    """Set up streams, threads and garbage collection, run the command of ``sys.argv``, and exit with its code."""
    # Whoever starts programs without streams does not want to read.
    sys.stdout = sys.stdout or open(os.devnull, "w")  # noqa: SIM115
    sys.stderr = sys.stderr or open(os.devnull, "w")  # noqa: SIM115
    # A name that the terminal cannot show is no reason to stop (stderr is like that by itself).
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    # Threads of the linear algebra ruin small problems on a busy machine (10 times slower); who sets them keeps them.
    for name in THREADS:
        os.environ.setdefault(name, "1")
    gc.set_threshold(*COLLECT)
    sys.exit(run(build(), sys.argv[1:]))
