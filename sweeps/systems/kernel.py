"""The table of what a system calls of compiled code, which `sweeps.points.compile` compiles before it measures."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sweeps.schema.definition import Definition


@dataclass(frozen=True)
class Kernel:
    """Something to compile."""

    module: str  #: name of a module of `kernels`, or the path of a generated file
    name: str = ""  #: a compiled function of the module; "" where importing the module compiles all of it
    #: the types of the function's arguments, as Numba writes them; "" for a Python function, which is called.
    types: str = ""
    #: what a Python function is called with, which compiles all that it calls.
    example: tuple = field(default=(), compare=False)
    seconds: float = 1.0  #: how long it takes on one core of 2024, s, about
    #: a kernel is compiled after those above it in the table that have a lower stage, which it links; others fill gaps.
    stage: int = 0
    #: whether a definition needs it.
    when: "Callable[[Definition], bool]" = field(default=lambda definition: True, compare=False)

    @property
    def call(self) -> tuple:
        """Return the arguments of `sweeps.points.compiler.compile_kernel` for this kernel."""
        return self.module, self.name, self.types, self.example, self.stage
