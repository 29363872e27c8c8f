"""What the tasks of one controller share: PERS data of one name and type is one object in all of them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence

from postproc.diagnostics import Source
from postproc.rapid.syntax.modules import parse
from postproc.rapid.syntax.nodes import Declaration, Module

_OPEN = re.compile(rb"(?i)\bPERS\s[^:;]{0,500}+;")  # a declaration without a value
_END = len(b"ENDMODULE")


def lent_values(sources: Sequence[Source], others: Callable[[], Iterable[Source]]) -> list[Source]:
    """Data that a task declares without a value, as other tasks declare it.

    Args:
        sources: all files of the task; others: reads those of the other tasks, which is done only where it may help.

    Returns:
        these files with everything else blanked out, so that places in them stay what they are.
    """
    if not any(_OPEN.search(source.data) for source in sources):
        return []
    own = [d for source in sources for _, d in _shared(source)]
    lacking = {_name(d) for d in own} - {_name(d) for d in own if d.init is not None}
    found = []
    for source in others() if lacking else ():
        given = [(module, d) for module, d in _shared(source) if d.init is not None and _name(d) in lacking]
        blank = bytearray(re.sub(rb"[^\r\n]", b" ", source.data))
        for module, declared in given:
            for begin, end in (module.head, declared.span, (module.span[1] - _END, module.span[1])):
                blank[begin:end] = source.data[begin:end]
            lacking.discard(_name(declared))
        if given:
            found.append(Source(source.path, bytes(blank), lent=True))
    return found


def _shared(source: Source) -> Iterator[tuple[Module, Declaration]]:
    for module in parse(source)[0]:
        yield from ((module, d) for d in module.declarations if d.storage == "PERS" and not d.scope)


def _name(declared: Declaration) -> tuple[str, str]:
    return declared.name.lower(), declared.type
