"""Kernels as plain Python, for a process that asks so little of them that loading Numba would take longer.

The formulas are those of the files, and so is the order of their sums; only a compiler may contract a product and a sum
into one rounding, and divide by zero without a word. What is asked of many points belongs to compiled kernels.
"""

import sys
from importlib.machinery import ModuleSpec
from types import ModuleType, SimpleNamespace


def leave_out_numba() -> bool:
    """Lets kernels that are imported from now on be plain, unless Numba is loaded already; whether they are."""
    return isinstance(sys.modules.setdefault("numba", _InNumbasPlace("numba")), _InNumbasPlace)


class _InNumbasPlace(ModuleType):
    """What kernels import of Numba, where nothing is compiled."""

    def __init__(self, name: str):
        super().__init__(name, self.__doc__)
        self.__spec__ = ModuleSpec(name, None)
        self.njit, self.config = _njit, SimpleNamespace(DISABLE_JIT=True)
        for kind in ("boolean", "float64", "int64", "types", "void"):
            setattr(self, kind, _Type())


class _Type:
    """A type, or a signature made of types, that is not looked at."""

    def __getattr__(self, name: str) -> "_Type":
        if name.startswith("__"):
            raise AttributeError(name)
        return self

    def __getitem__(self, at) -> "_Type":
        return self

    def __call__(self, *of) -> "_Type":
        return self


def _njit(*given, **options):
    """The function itself, however Numba would have compiled it."""
    return given[0] if given and callable(given[0]) and not isinstance(given[0], _Type) else _itself


def _itself(function):
    return function
