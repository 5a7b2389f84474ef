"""How kernels are compiled: a few sets of options for all of them.

Division by zero gives an infinity as in NumPy. Multiplications and additions may contract into one rounding, but never
in an error-free transformation, which counts its own roundings (EXACT). Nothing else is reordered.
"""

# nothing but a function that is passed as an argument needs a form to be called by C
EXACT = {"cache": True, "error_model": "numpy", "no_cfunc_wrapper": True}
OPTIONS = {**EXACT, "fastmath": {"contract"}}
PASSED = {**OPTIONS, "no_cfunc_wrapper": False}
# a loop over lanes vectorises only what is inlined into it
EXACT_INLINE = {**EXACT, "forceinline": True}
INLINE = {**OPTIONS, "forceinline": True}
