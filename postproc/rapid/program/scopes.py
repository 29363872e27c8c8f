"""Names of one task: its data, types and routines as the controller resolves them."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

from postproc.diagnostics import Diagnostic, Severity, did_you_mean
from postproc.rapid.syntax.nodes import Declaration, Module, Routine, RoutineParameter

Typed = TypeVar("Typed", Declaration, RoutineParameter, Routine)


def without_aliases(modules: list[Module]) -> list[Module]:
    """The modules with every type that an ALIAS defines replaced by the type for which it stands."""
    aliases = {r.name: r.fields[0][1] for m in modules for r in m.records if r.fields and not r.fields[0][0]}
    if not aliases:
        return modules

    def meant(item: Typed) -> Typed:
        """The item with the original type in place of an alias."""
        return replace(item, type=aliases.get(item.type.lower(), item.type))

    return [
        replace(
            module,
            records=tuple(
                replace(r, fields=tuple((name, aliases.get(kind, kind)) for name, kind in r.fields))
                for r in module.records
                if r.name not in aliases
            ),
            declarations=tuple(map(meant, module.declarations)),
            routines=tuple(
                replace(
                    meant(r), parameters=tuple(map(meant, r.parameters)), declarations=tuple(map(meant, r.declarations))
                )
                for r in module.routines
            ),
        )
        for module in modules
    ]


def is_shared(declared: Declaration) -> bool:
    """Whether data is one object in all tasks of a controller that declare its name and type: global PERS data.

    ``TASK PERS`` data is seen by all modules of its task, and by no other task (ABB PC SDK, enumeration ``Scope``).
    """
    return declared.storage == "PERS" and not declared.scope and not declared.routine


def shared_name(declared: Declaration) -> tuple[str, str]:
    """Name and type of data, both in lower case, by which tasks share it."""
    return declared.name.lower(), declared.type.lower()


def all_declarations(modules: Sequence[Module]) -> Iterator[Declaration]:
    """Data of modules and routines, in text order."""
    for module in modules:
        yield from module.declarations
        for routine in module.routines:
            yield from routine.declarations


def declared_names(modules: Sequence[Module], diagnostics: list[Diagnostic]) -> dict[str, Declaration]:
    """Declarations by lower-case key, ``module.routine.name`` or ``module..name``; those not LOCAL also by ``..name``.

    Args:
        diagnostics: receives a finding RAP012 for each name that is declared twice.
    """
    names: dict[str, Declaration] = {}
    declarations = list(all_declarations(modules))
    valued = {shared_name(d): d for d in declarations if is_shared(d) and d.init is not None}
    for declared in declarations:
        declaration = declared
        if is_shared(declared) and declared.init is None:
            declaration = valued.get(shared_name(declared), declared)  # only one of the tasks need give a value
        if not declared.routine and declaration.scope != "LOCAL":
            first = names.setdefault(f"..{declared.name.lower()}", declaration)
            read_only = first.source.read_only or declared.source.read_only
            one_object = read_only and is_shared(first) and is_shared(declared)
            if first is not declaration and first.module.lower() != declared.module.lower() and not one_object:
                diagnostics.append(
                    Diagnostic(
                        "RAP012", "warning", f"`{declaration.name}` is declared in `{first.module}` too",
                        declaration.source, declaration.span, "give the files of one task only, each once",
                    )
                )  # fmt: skip
        known = names.setdefault(declared.key, declaration)
        if known is not declaration and known.source is declared.source:
            text = f"`{declared.name}` is declared twice in `{declared.routine or declared.module}`"
            help_ = "the controller does not load such a module: give one of them another name"
            other = _value_text(known) != _value_text(declared)  # then nobody knows which of the two is meant
            severity: Severity = "error" if other else "warning"
            diagnostics.append(Diagnostic("RAP012", severity, text, declared.source, declared.span, help_))
    return names


def check_taught(taught: Collection[str], names: Mapping[str, Declaration]) -> Iterator[Diagnostic]:
    """Report RAP034 for each name stated by ``--taught`` that no module declares with a value.

    Args:
        taught: names as the user states them; names: declarations by key.
    """
    known = {d.name.lower(): d for d in names.values() if not d.routine} if taught else {}
    for name in dict.fromkeys(taught):
        declared = known.get(name.lower())
        if declared is not None and declared.init is not None:
            continue
        text, near = "has no value in the files", ""
        if declared is None:
            text = "is declared in none of the files"
            near = did_you_mean(name, [d.name for d in known.values()]) or did_you_mean(name.lower(), known)
        help_ = near or "give the file that declares it with a value, or leave it out"
        yield Diagnostic("RAP034", "warning", f"`{name}`, which is to be taught, {text}", help=help_)


def named_routines(modules: Sequence[Module]) -> dict[tuple[str, str], Routine]:
    """Routines by lower-case (module, name); those that are not LOCAL also by ("", name)."""
    routines: dict[tuple[str, str], Routine] = {}
    for module in modules:
        for routine in module.routines:
            name = routine.name.lower()
            routines.setdefault((module.name.lower(), name), routine)
            if not routine.local:
                routines.setdefault(("", name), routine)
    return routines


def _value_text(declaration: Declaration) -> bytes:
    """The text of the declared value as it is written, empty if there is none."""
    return b"" if declaration.init is None else declaration.source.data[slice(*declaration.init)]
