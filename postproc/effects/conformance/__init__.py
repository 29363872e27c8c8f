"""What every effect must pass before any command uses it, asked by ``check_effect(cls)``.

`kit` tries it, after its `declaration`, at small and large values by `trial`; `failures` says what an exception means.
"""

from postproc.effects.conformance.kit import check_effect as check_effect
