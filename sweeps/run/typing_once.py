"""Numba's types of operators, found once.

Numba tries one template after the other for every product and every ``S[k]`` of a kernel, most often the same few
types by the same operator: a fifth of all compiling. What it found for an operator of its own is what it would find
again; a function that somebody compiles, or overloads, is looked up as ever.
"""

from collections.abc import Iterator
from contextlib import contextmanager

from numba import types


@contextmanager
def operators_typed_once() -> Iterator[None]:
    """Within it Numba remembers the signatures of its own operators, by the types they are called with."""
    find, found = types.Function.get_call_type, {}

    def remembered(self, context, args, kws):
        key = id(self), tuple(args)
        if not kws and key in found:
            return found[key][1]
        told = find(self, context, args, kws)
        if not kws and getattr(self, "_impl_keys", {}).get(told.args) is self.typing_key:
            found[key] = self, told  # with the operator, or another object may come to have its id
        return told

    types.Function.get_call_type = remembered
    try:
        yield
    finally:
        types.Function.get_call_type = find
