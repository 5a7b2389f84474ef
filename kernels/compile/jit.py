"""Compiler of kernels: :func:`njit` with a few sets of options, and a cache of our own, :mod:`kernels.compile.cache`.

This module and the cache hold all contact with Numba but for :mod:`kernels.compile.llvm_formulas`. Nothing of Numba's
own settings is changed: a function that somebody else compiles in the same process is cached where Numba puts it.

Division by zero gives an infinity as in NumPy. Every operation rounds by itself and in the order written, so that the
last bits of a kernel depend neither on where it is inlined nor on what was compiled before it. Products and sums with
one rounding stand in formulas alone (:mod:`kernels.compile.llvm_formulas`), which say where.

*Plain mode.* A process that asks so little of kernels that loading the compiler would take longer calls
:func:`leave_out_compiler` before it imports one: kernels are then the Python functions of their files. Only compiled
code rounds a product and a sum once, and divides by zero without a word.
"""

import sys
from copy import copy
from functools import cache
from typing import Any

from kernels.compile.cache import KernelCache

# only a function that is passed as an argument needs a form to be called by C
OPTIONS: dict[str, Any] = {"error_model": "numpy", "no_cfunc_wrapper": True}
PASSED: dict[str, Any] = {**OPTIONS, "no_cfunc_wrapper": False}
INNER: dict[str, Any] = {**OPTIONS, "no_cpython_wrapper": True}  # only kernels call it: a form for Python takes long
INLINE: dict[str, Any] = {**OPTIONS, "forceinline": True}  # a loop over lanes vectorises only what is inlined into it

# Processors for which LLVM uses vectors of 256 bits although 512 do not lower their clock. (Skylake-X, Cascade Lake,
# Cooper Lake and Cannon Lake lower it, and keep LLVM's choice.)
FULL_WIDTH = {
    *("icelake-client", "icelake-server", "tigerlake", "rocketlake"),
    *("sapphirerapids", "emeraldrapids", "graniterapids", "graniterapids-d"),
}
NUMBA_TYPES = {"UniTuple", "boolean", "complex128", "float64", "int8", "int32", "int64", "types", "uint32", "void"}

_plain = False  # whether kernels are left to Python


def leave_out_compiler() -> bool:
    """Let kernels imported from now on be Python functions, unless Numba is loaded; return whether they are."""
    global _plain
    _plain = _plain or "numba" not in sys.modules
    return _plain


def is_plain() -> bool:
    """Return whether kernels are Python functions, by :func:`leave_out_compiler` or by NUMBA_DISABLE_JIT."""
    if _plain:
        return True
    from numba import config

    return bool(config.DISABLE_JIT)


def njit(*signature: Any, name: str = "", **options: Any) -> Any:
    """Compile a function as ``numba.njit`` does, and keep its machine code in the cache of kernels.

    Args:
        signature (Numba signature or str, optional): Compiled at once, and the only one allowed; left out, each is
            compiled at its first call.
        name (str): The function's name, which a closure must have: two of one factory would otherwise share the name of
            their code.
        options (dict): As for ``numba.njit``.
    """

    def compiled(function):
        """Return the dispatcher of a function, or the function itself if kernels are plain."""
        if name:
            function.__name__ = function.__qualname__ = name
        elif function.__closure__:
            raise ValueError(f"{function.__qualname__} is a closure; allowed: njit(name=…), a name for each")
        return function if is_plain() else _dispatcher(function, signature, options)

    return compiled


def _dispatcher(function, signature: tuple, options: dict):
    """Return Numba's dispatcher of a function, with our cache for its code."""
    import numba

    if "no_cpython_wrapper" in options:
        kernel = _inner()(function, targetoptions={"nopython": True, **options}, pipeline_class=_compiler())
    else:
        kernel = numba.njit(pipeline_class=_compiler(), **options)(function)
    kernel._cache = KernelCache(function)
    for types in signature:
        kernel.compile(types)
        kernel.disable_compile()
        _share(kernel)
    return kernel


@cache
def _inner() -> type:
    """Return the class of kernels without a form for Python; a call of Numba's own class would crash the process."""
    from numba.core import registry

    class Inner(registry.CPUDispatcher):
        def __call__(self, *_):
            raise TypeError(f"{self.py_func.__name__} is called by kernels alone")

    return Inner


def _share(kernel) -> None:
    """Let kernels that call this one jump to its machine code, by a name that is the same in every process.

    Numba would compile it once more into each of them.
    """
    from llvmlite import binding

    (compiled,) = kernel.overloads.values()
    shared = copy(compiled.fndesc)
    shared.mangled_name = f"{shared.modname}.{shared.qualname}{compiled.signature}"
    binding.add_symbol(shared.mangled_name, compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name))
    compiled.target_context.insert_user_function(compiled.entry_point, shared)


@cache
def passed(kernel):
    """Return a kernel, compiled with PASSED for one signature, as an argument of kernels, with its address.

    Numba would search for the address at each call, which takes longer than many a block of points.
    """
    if is_plain():
        return kernel
    from numba import types

    (compiled,) = kernel.overloads.values()
    address = compiled.library.get_pointer_to_function(compiled.fndesc.llvm_cfunc_wrapper_name)

    class Passed:
        _numba_type_ = types.FunctionType(compiled.signature)

        def __wrapper_address__(self):
            return address

    return Passed()


@cache
def takes_whole_vectors() -> bool:
    """Return whether kernels use vectors of 512 bits: on some processors (FULL_WIDTH), unless a user sets a rule.

    Rates alone are measured a quarter faster there. It changes no bit.
    """
    import llvmlite.binding as llvm
    from numba import config

    name = config.CPU_NAME or llvm.get_host_cpu_name()
    return name in FULL_WIDTH and not config.CPU_FEATURES and bool(llvm.get_host_cpu_features().get("avx512f"))


@cache
def _compiler() -> type:
    """Return Numba's compiler, or one that marks functions for whole vectors if :func:`takes_whole_vectors`."""
    from numba.core import compiler, compiler_machinery, lowering, typed_passes

    if not takes_whole_vectors():
        return compiler.Compiler

    class WideLower(lowering.Lower):
        def setup_function(self, fndesc):
            super().setup_function(fndesc)
            # llvmlite's own set of attributes refuses those with a value
            set.add(self.function.attributes, '"prefer-vector-width"="512"')

    @compiler_machinery.register_pass(mutates_CFG=True, analysis_only=False)
    class WideLowering(typed_passes.BaseNativeLowering):
        _name = "wide_native_lowering"
        lowering_class = WideLower

    class WideCompiler(compiler.CompilerBase):
        def define_pipelines(self):
            pipeline = compiler.DefaultPassBuilder.define_nopython_pipeline(self.state)
            replaced = {typed_passes.NativeLowering: WideLowering}
            pipeline.passes = [(replaced.get(step, step), words) for step, words in pipeline.passes]
            pipeline.finalize()
            return [pipeline]

    return WideCompiler


def __getattr__(name: str) -> Any:
    """Return Numba's type of that name, for signatures; in plain mode something in its place that nobody reads."""
    if name not in NUMBA_TYPES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if _plain:
        return _UnreadType()
    import numba

    return getattr(numba if name == "types" else numba.types, name)


class _UnreadType:
    """A type, or a signature made of types, in plain mode."""

    def __getattr__(self, name: str) -> "_UnreadType":
        if name.startswith("__"):
            raise AttributeError(name)
        return self

    def __getitem__(self, key) -> "_UnreadType":
        return self

    def __call__(self, *arguments, **options) -> "_UnreadType":
        return self
