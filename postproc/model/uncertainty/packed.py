"""A correlation matrix as text of a model file."""

from __future__ import annotations

import zlib
from base64 import b64decode, b64encode
from functools import lru_cache
from textwrap import wrap

import numpy as np

from postproc.arrays import Array

PACKING_STEP = 2.0**-8
"""Step of the written numbers of 1,000 parameters, in conditional standard deviations; finer with fewer parameters."""
LEAST_VARIANCE = 1e-14  # eigenvalue of a correlation matrix below which double precision tells nothing
PACKED_WIDTH = 120  # characters of a line


def pack_correlation(correlation: Array) -> str:
    """Return a correlation matrix (p, p) as lines of text: base64 of compressed whole numbers.

    With C = L L^T, L lower triangular, row i of L is written in steps of (p / 1000)^2 2^-8 / sqrt((C^-1)_ii), a part of
    the standard deviation of parameter i given all others, which is the least that any combination with it shows. So
    every combination of parameters keeps its standard deviation, well determined ones too: within 5 % of 1,000
    parameters in the worst direction, some 0.01 % in a prediction, and closer with fewer. The numbers are those of L,
    row by row, n as 2 n or -2 n - 1, eight bytes each, all lowest bytes first.

    Args:
        correlation: (p, p) positive semidefinite, ones on its diagonal.
    """
    count = len(correlation)
    size, turned = np.linalg.eigh(correlation)
    size = np.maximum(size, LEAST_VARIANCE)
    lower = np.linalg.qr((turned * np.sqrt(size)).T)[1].T
    conditional = 1.0 / np.sqrt((turned**2 / size).sum(axis=1))
    numbers = np.rint(lower / (PACKING_STEP * (count / 1000) ** 2 * conditional[:, None])).astype(np.int64)
    signed = numbers[np.tril_indices(count)]
    planes = ((signed << 1) ^ (signed >> 63)).astype("<u8").view(np.uint8).reshape(-1, 8).T
    return "\n".join(wrap(b64encode(zlib.compress(planes.tobytes(), 9)).decode(), PACKED_WIDTH))


@lru_cache(maxsize=4)
def unpack_correlation(text: str, count: int) -> Array:
    """Return the correlation matrix (p, p), which cannot be written to, of a text by `pack_correlation`.

    The scale of a row of L does not matter, since a parameter is correlated with itself by 1.

    Args:
        count: p.

    Raises:
        ValueError: the text is not that of p parameters.
    """
    expected = 8 * (count * (count + 1) // 2)
    reader = zlib.decompressobj()
    try:
        data = reader.decompress(b64decode("".join(text.split()), validate=True), expected + 1)
    except (ValueError, zlib.error) as error:
        raise ValueError("the text is not base64 of compressed numbers") from error
    if len(data) != expected or not reader.eof:
        raise ValueError(f"the text is not that of {count} parameters")
    unsigned = np.frombuffer(data, np.uint8).reshape(8, -1).T.copy().view("<u8")[:, 0]
    lower = np.zeros((count, count))
    lower[np.tril_indices(count)] = (unsigned >> 1).astype(np.int64) ^ -(unsigned & 1).astype(np.int64)
    length = np.linalg.norm(lower, axis=1)
    if not length.all():
        raise ValueError("a parameter varies with none, not even itself")
    lower /= length[:, None]
    correlation = np.asarray(lower @ lower.T)
    correlation.setflags(write=False)
    return correlation
