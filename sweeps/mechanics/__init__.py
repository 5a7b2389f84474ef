"""Mechanical systems described in SymPy: equations of motion, equilibria, generated kernels.

`description` has the classes for such files; `derivation` makes the `equations` x' = f(x, t; p) of it; `graph` and
`taylor` turn these into a compiled Taylor integrator, `motions` runs it; `equilibria` and `modes` are the theory. A
`model` is all of a system; `normal_modes` and `relative` measure motions near its equilibria, `periodic` those near a
motion of the equations' own period, which `continuation` follows from its name; `library/` has systems that ship.
"""

from sweeps.mechanics import drawing
from sweeps.mechanics.description import System
from sweeps.schema.refusals import DescriptionError

__all__ = ["DescriptionError", "System", "drawing"]
