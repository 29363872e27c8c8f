"""``postproc predict``: where a model says the TCP is."""

from __future__ import annotations

from postproc.cli.improve.model_options import ArmOptions, TableOptions, opened
from postproc.cli.options import ArmFile, Flag, Output
from postproc.cli.output import write
from postproc.cli.printing import say, show
from postproc.cli.progress import watching


def run(
    model: ArmFile,
    data: str,
    /,
    *,
    arm_options: ArmOptions = ArmOptions(),
    output: Output = None,
    place: Flag = False,
    table: TableOptions = TableOptions(),
) -> int:
    """Predict the TCP in the instrument's frame for every row of a table.

    Args:
        data: table with commanded poses (CSV); - reads stdin.
        output: CSV file to write: pose_id,x_mm,y_mm,z_mm,sigma_mm,sigma_measured_mm, one row per input row, same
            order; sigma_mm is of the pose, sigma_measured_mm of a measurement of it. Default: stdout.
        place: the instrument was set up anew: the rows of the table that hold a measured position place it.
    """
    import numpy as np

    from postproc.identification.predict import predict_rows

    arm, rows = opened(model, [data], arm_options, table, output)
    with watching(f"predicting {len(rows)} rows"):
        prediction = predict_rows(arm, rows, place)
    show(prediction.diagnostics)
    write(output, prediction.as_csv())
    if output is not None:
        known = prediction.sigma[np.isfinite(prediction.sigma)]
        sure = f"; standard deviation {1e3 * known.max():.3f} mm per axis at most" if len(known) else ""
        say(f"{len(prediction.sigma)} position{'s' * (len(prediction.sigma) != 1)} in the instrument's frame{sure}")
    return 0
