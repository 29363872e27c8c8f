"""What every effect must pass before any command uses it, asked by ``check_effect(cls)``.

`kit` checks it on the arm and the states of `example`; `table` has the code, the message and the help of every
finding, and what an exception means.
"""

from postproc.effects.conformance.kit import check_effect as check_effect
