"""Commands on programs: `compensate` (`finish`), `inspect`, `batch`, `seam`, `runtime` (`made_for`), `diff`."""
