"""What tests of every room ask of the product in the same way."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import pytest

from postproc.diagnostics import Diagnostic, PostprocError


def refused(call: Callable[[], object]) -> Sequence[Diagnostic]:
    """Findings of what must be refused."""
    with pytest.raises(PostprocError) as caught:
        call()
    return caught.value.diagnostics
