"""How kernels are compiled: one set of options for all of them.

Division by zero gives an infinity as in NumPy. Multiplications and additions may contract into one rounding, but never
in an error-free transformation, which counts its own roundings (EXACT). Nothing else is reordered.
"""

EXACT = {"cache": True, "error_model": "numpy"}
OPTIONS = {**EXACT, "fastmath": {"contract"}}
# a loop over lanes vectorises only what is inlined into it
EXACT_INLINE = {**EXACT, "forceinline": True}
INLINE = {**OPTIONS, "forceinline": True}
