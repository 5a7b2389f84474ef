"""How kernels are compiled: a few sets of options for all of them.

Division by zero gives an infinity as in NumPy. Multiplications and additions may contract into one rounding, but never
in an error-free transformation, which counts its own roundings (EXACT). Nothing else is reordered.

Numba names the code of a function by where it stands and by how many were compiled before it in that process. Closures
stand in one place: two of them, compiled and stored by two processes, could have one name, and a third process that
links both would call one for the other. So each process counts from a number of its own.
"""

from itertools import count
from secrets import randbits

import numba

if hasattr(numba, "core"):  # else Numba is left out (see kernels.plain)
    from numba.core.bytecode import FunctionIdentity

    FunctionIdentity._unique_ids = count(randbits(60))

# nothing but a function that is passed as an argument needs a form to be called by C
EXACT = {"cache": True, "error_model": "numpy", "no_cfunc_wrapper": True}
OPTIONS = {**EXACT, "fastmath": {"contract"}}
PASSED = {**OPTIONS, "no_cfunc_wrapper": False}
# a loop over lanes vectorises only what is inlined into it
EXACT_INLINE = {**EXACT, "forceinline": True}
INLINE = {**OPTIONS, "forceinline": True}
