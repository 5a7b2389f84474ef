"""Mechanical systems described in SymPy: equations of motion, equilibria, generated kernels.

`description` is what that file writes; `derivation` makes a_ij(q), the equations of motion and V″ of it; `graph` and
`taylor` turn the equations into a compiled Taylor integrator; `equilibria` and `modes` are the theory; `model` runs
points through it all; `library/` holds the systems that ship.
"""

from sweeps.mechanics.description import DescriptionError, System

__all__ = ["DescriptionError", "System"]
