"""Results as JSON documents: plain values, NaN never appears."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any


def plain(value: Any) -> Any:
    """Convert nested mappings, sequences and arrays to plain Python values; NaN and infinity become None."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):  # numpy arrays and scalars
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def attributes(value: object, *names: str) -> dict[str, Any]:
    """Return some attributes of a value by name, as an entry of a document or a part of one."""
    return {name: getattr(value, name) for name in names}
