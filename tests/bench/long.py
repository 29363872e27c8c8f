"""One long program: ``python -m tests.bench.long [--most 200000]``: time and memory against the number of targets."""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import time

from tests.batch.folders import AXES, TOOL

PER_ROW = 50


def program(targets: int) -> bytes:
    """A plate that is welded to and fro: rows of 50 targets, 4 mm apart."""
    lines = ["MODULE Long", f"  {TOOL}", "  PROC main()"]
    for i in range(targets):
        row, column = divmod(i, PER_ROW)
        column = PER_ROW - 1 - column if row % 2 else column
        x, y = 1150 + 1.5 * (row % 100), 100 + 4 * column
        z = 880 + 0.5 * (row // 100)
        instruction = "MoveJ" if i == 0 else "MoveL"
        pose = f"[[{x:.2f},{y:.2f},{z:.2f}],[0.092296,0.701057,0.701057,-0.092296],[0,-1,1,0],{AXES}]"
        lines.append(f"    {instruction} {pose},v50,{'fine' if column in (0, PER_ROW - 1) else 'z1'},tTorch;")
    return "\n".join([*lines, "  ENDPROC", "ENDMODULE", ""]).encode()


def measure(targets: int) -> None:
    from postproc.compensate.options import Options
    from postproc.convert import compensate_program
    from postproc.diagnostics import Source
    from postproc.model.file import default_model

    source, model = Source("long.mod", program(targets)), default_model()
    begin = time.process_time()  # the machine may be busy with other things
    done = compensate_program(source, model, Options())
    seconds = time.process_time() - begin
    megabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(
        f"{targets:8,} targets: {seconds:7.1f} s, {1e3 * seconds / targets:6.3f} ms each, {megabytes:6.0f} MB, "
        f"exit {done.exit_code}, {done.summary}",
        flush=True,
    )


def main(argv: list[str] | None = None) -> int:
    o = argparse.ArgumentParser()
    o.add_argument("--most", type=int, default=200_000)
    o.add_argument("--one", type=int)
    a = o.parse_args(argv)
    if a.one:
        measure(a.one)
        return 0
    for part in (8, 4, 2, 1):  # a process each: memory is measured as its peak
        subprocess.run([sys.executable, "-m", "tests.bench.long", "--one", str(a.most // part)], check=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
