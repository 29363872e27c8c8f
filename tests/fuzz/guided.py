"""Coverage-guided fuzzing: ``python -m tests.fuzz.guided [KIND] [libFuzzer options]``, KIND program, model or table.

Needs ``pip install atheris`` (Linux). Starts from the seeds of the mutational fuzzer in a folder of its own; every
libFuzzer option may follow, ``-runs=100000 -max_total_time=60`` for a bounded run.
"""

from __future__ import annotations

import os

os.environ.update({"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"})

import sys
import tempfile
from pathlib import Path
from random import Random

import atheris

with atheris.instrument_imports(include=["postproc"]):
    from tests.fuzz import checks, seeds


def main(arguments: list[str]) -> None:
    kind = arguments[1] if len(arguments) > 1 and not arguments[1].startswith("-") else "program"
    options = [argument for argument in arguments[1:] if argument != kind]
    model = checks.shipped_model()
    check, mutator = {
        "program": (checks.check_program, seeds.program_mutator),
        "model": (checks.check_model, seeds.model_mutator),
        "table": (lambda data: checks.check_table(data, model), seeds.table_mutator),
    }[kind]
    with tempfile.TemporaryDirectory() as folder:
        for number, tokens in enumerate(mutator(Random(0)).seeds):
            (Path(folder) / str(number)).write_bytes(b"".join(tokens))

        def one_input(data: bytes) -> None:
            check(data)

        atheris.Setup([arguments[0], "-max_len=8000", "-timeout=20", *options, folder], one_input)
        atheris.Fuzz()


if __name__ == "__main__":
    main(sys.argv)
