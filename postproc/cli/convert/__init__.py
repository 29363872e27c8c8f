"""Commands on programs: `compensate` (`finish`), `inspect`, `batch` (`batch_lines`), `seam`, `diff`, `runtime`."""
