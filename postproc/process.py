"""How a process works: threads of the linear algebra, how often Python looks for garbage, what imports are put off."""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from threading import RLock
from types import ModuleType
from typing import Any, cast

# The names that numpy's libraries read when they are first loaded.
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
COLLECT = (200_000, 20, 20)
"""Thresholds: a long program is a million objects that live to the end; a menu of many parts took twice its time."""
SPARED_OF_NUMPY = ("f2py", "testing", "ma")
SPARED_OF_SCIPY = ("scipy.constants", "scipy.linalg", "scipy.spatial", "scipy.spatial.transform")
_RUNNING = RLock()  # one thread runs a package that was put off


@contextmanager
def seldom_collecting() -> Iterator[None]:
    """Set the thresholds of garbage collection to ``COLLECT`` in a ``with`` block, and restore them after it."""
    before = gc.get_threshold()
    gc.set_threshold(*COLLECT)
    try:
        yield
    finally:
        gc.set_threshold(*before)


class _LatePackage(ModuleType):
    """A package whose modules can be imported by themselves, and which is run when anything else of it is asked for.

    ``importlib.util.LazyLoader`` would run it for its path, hence with each of its modules.
    """

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        self._run()
        return getattr(self, name)

    def __dir__(self) -> list[str]:
        self._run()
        return dir(self)

    def _run(self) -> None:
        with _RUNNING:
            if type(self) is _LatePackage:
                self.__class__ = cast(Any, ModuleType)
                assert self.__spec__ is not None and self.__spec__.loader is not None
                self.__spec__.loader.exec_module(self)


def spare_scipy() -> None:
    """Import what a conversion needs of scipy, and put off the rest until it is asked for: a fifth of a second.

    scipy.spatial loads searches for neighbours and hulls, and the solvers and special functions that these need, before
    its rotations. scipy also takes over all names of numpy (`from numpy import *`), and numpy loads its parts for
    Fortran and tests when they are asked for. Whoever asks for any of it later gets it as always.
    """
    import numpy

    for name in SPARED_OF_SCIPY:
        if name not in sys.modules:
            parent, _, child = name.rpartition(".")
            spec = find_spec(name)
            assert spec is not None and spec.submodule_search_locations is not None
            package = _LatePackage(name)
            package.__spec__, package.__loader__, package.__file__ = spec, spec.loader, spec.origin
            package.__path__, package.__package__ = spec.submodule_search_locations, name
            sys.modules[name] = package
            setattr(sys.modules[parent], child, package)
    vars(sys.modules["scipy.constants"]).setdefault("golden", (1 + 5**0.5) / 2)  # all that rotations take of it
    absent = [name for name in SPARED_OF_NUMPY if name not in vars(numpy)]
    vars(numpy).update(dict.fromkeys(absent))
    try:
        for module, name in (("_rotation", "Rotation"), ("_rotation", "Slerp"), ("_rigid_transform", "RigidTransform")):
            value = getattr(import_module(f"scipy.spatial.transform.{module}"), name)
            vars(sys.modules["scipy.spatial.transform"]).setdefault(name, value)
    except ImportError:  # other versions of scipy have other modules: they are loaded in full when they are asked for
        for name in SPARED_OF_SCIPY:
            if type(sys.modules[name]) is _LatePackage:
                parent, _, child = name.rpartition(".")
                del sys.modules[name]
                vars(sys.modules.get(parent, sys.modules["scipy"])).pop(child, None)
    finally:
        for name in absent:
            if vars(numpy)[name] is None:
                delattr(numpy, name)


class _LateName:
    """A class or function of a module that is imported when the name is first used."""

    def __init__(self, module: str, name: str) -> None:
        self._place = module, name

    def _value(self) -> Any:
        module, name = self._place
        return getattr(import_module(module), name)

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        return self._value()(*arguments, **named)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._value(), name)


class _LateModule(ModuleType):
    """A module of which every name is a ``_LateName``."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return _LateName(self.__name__, name)


@contextmanager
def putting_off(*names: str) -> Iterator[None]:
    """Context in which a library is imported without these modules, packages first, which it uses at most later.

    What it takes from them is imported when it is first called. Modules that are loaded already are left as they are.
    """
    spared = {name: _LateModule(name) for name in names if name not in sys.modules}
    for name, module in spared.items():
        parent, _, child = name.rpartition(".")
        if parent in spared:
            setattr(spared[parent], child, module)
    sys.modules.update(spared)
    try:
        yield
    finally:
        for name in spared:
            del sys.modules[name]
