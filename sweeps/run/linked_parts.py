"""Kernels that only others call are compiled as far as a linker needs them, and no further.

Numba makes of every function that a kernel calls what Python could call as well: a wrapper, machine code, memory to
run it in. Whoever calls it from a kernel takes none of that: it links the intermediate code and makes machine code of
all together. A good third of all compiling is for nothing. Here a function that Python calls is compiled whole, and
what it calls as a part, which is stored in a folder of its own, where nothing but compiling looks: a part that Python
asks for by itself, a test or a command, is compiled whole then. A function that is declared with its signature is
compiled whole at once: Numba compiles it at no other time.
"""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from copy import copy
from functools import partial
from pathlib import Path

import numba
from numba.core import sigutils
from numba.core.caching import FunctionCache
from numba.core.codegen import CPUCodeLibrary, JITCPUCodegen
from numba.core.compiler_lock import global_compiler_lock
from numba.core.cpu import CPUContext
from numba.core.dispatcher import Dispatcher, _DispatcherBase
from numba.core.environment import lookup_environment
from numba.core.errors import ForceLiteralArg
from numba.core.typed_passes import BaseNativeLowering

KNOWN = (0, 68)  # the version of Numba whose ways these are: another one compiles everything whole
FOLDER = "parts"

_original = {
    (owner, name): getattr(owner, name)
    for owner, name in (
        (_DispatcherBase, "_compile_for_args"),
        (Dispatcher, "compile"),
        (BaseNativeLowering, "run_pass"),
        (CPUCodeLibrary, "_optimize_final_module"),
        (CPUCodeLibrary, "_finalize_final_module"),
        (CPUCodeLibrary, "serialize_using_object_code"),
        (JITCPUCodegen, "set_env"),
        (CPUContext, "get_executable"),
    )
}


class _Part:
    """In the place of what Python would call: Numba finds a function by it, so each has its own."""


class _Now(threading.local):
    """Compilations of a thread, each inside the one before: whether it is a part, and calls; and whom Python calls."""

    def __init__(self) -> None:
        self.parts: list[bool] = []
        self.call: list[bool] = []  # kernels that are not inlined
        self.asked: Dispatcher | None = None


_now = _Now()


@contextmanager
def parts_for_the_linker(ours: bool = True) -> Iterator[None]:
    """Within it what is called from Python is compiled whole, everything else as a part.

    Args:
        ours: whether kernels are parts, too, or what they call of Numba's alone.
    """
    if numba.version_info.short != KNOWN:
        yield
        return
    made: list[tuple[Dispatcher, tuple]] = []
    new = (
        _compiled_for_python,
        lambda self, sig: _compiled(self, sig, ours, made),
        _lowered,
        _optimized_here_or_there,
        _left_to_the_linker,
        _serialized,
        _with_environment,
        _executable,
    )
    try:
        for (owner, name), function in zip(_original, new, strict=True):
            setattr(owner, name, function)
        yield
    finally:
        for (owner, name), function in _original.items():
            setattr(owner, name, function)
        for dispatcher, arguments in made:  # whom Python calls from now on, it has compiled
            if _is_part(dispatcher.overloads.get(arguments)):
                del dispatcher.overloads[arguments]


def _is_part(compiled) -> bool:
    return compiled is not None and isinstance(compiled.entry_point, _Part)


def _compiled_for_python(self, *args, **kws):
    _now.asked = self
    return _original[_DispatcherBase, "_compile_for_args"](self, *args, **kws)


def _compiled(self, sig, ours, made):
    """As `Dispatcher.compile` does it, but for its watches of who waits for the compiler."""
    for_python, _now.asked = self is _now.asked, None
    is_kernel, is_passed = isinstance(self._cache, FunctionCache), not self.targetoptions.get("no_cfunc_wrapper", False)
    arguments, return_type = sigutils.normalize_signature(sig)
    declared = return_type is not None
    part = not (for_python or declared or (is_kernel and (is_passed or not ours)))
    if _now.call and is_kernel and not self.targetoptions.get("forceinline", False):
        _now.call[-1] = True
    with global_compiler_lock, self._compiling_counter:
        existing = self.overloads.get(tuple(arguments))
        if existing is not None and (part or not _is_part(existing)):
            return existing.entry_point
        self.targetctx.refresh()  # what it compiles for itself is whole
        _now.parts.append(part)
        _now.call.append(False)
        try:
            found = _found(self, sig, arguments, return_type, part)
        finally:
            _now.parts.pop()
            _now.call.pop()
    if part:
        made.append((self, tuple(found.signature.args)))
    return found.entry_point


def _found(self, sig, arguments, return_type, part):
    """From the cache, or compiled and stored there; made known to Numba."""
    own = _parts_of(self._cache) if part and isinstance(self._cache, FunctionCache) else self._cache
    found = own.load_overload(sig, self.targetctx)
    if found is None and own is not self._cache:
        found = self._cache.load_overload(sig, self.targetctx)
    known = found is not None
    if known:
        self.targetctx.insert_user_function(found.entry_point, found.fndesc, [found.library])
    else:
        try:
            found = self._compiler.compile(arguments, return_type)
        except ForceLiteralArg as error:
            folded = self._compiler.fold_argument_types
            raise error.bind_fold_arguments(lambda args, kws: folded(args, kws)[1]) from None
    if part:
        self.overloads[tuple(found.signature.args)] = found
    else:
        self.add_overload(found)
    if not known:
        own.save_overload(sig, found)
    return found


def _parts_of(whole: FunctionCache) -> FunctionCache:
    """Where the parts of a function are stored."""
    if not hasattr(whole, "parts"):
        whole.parts, file = copy(whole), copy(whole._cache_file)
        whole.parts._cache_file = file
        folder = Path(whole.cache_path) / FOLDER
        folder.mkdir(parents=True, exist_ok=True)
        file._cache_path = str(folder)
        file._index_path = str(folder / Path(file._index_path).name)
    return whole.parts


def _lowered(self, state):
    if _now.parts and _now.parts[-1]:
        state.flags.no_cpython_wrapper = state.flags.no_cfunc_wrapper = True
    return _original[BaseNativeLowering, "run_pass"](self, state)


def _optimized_here_or_there(self):
    """Of a library: a part that calls others is optimised with them where it is linked, and not here as well."""
    if not (_now.parts and _now.parts[-1] and _now.call[-1]):
        _original[CPUCodeLibrary, "_optimize_final_module"](self)


def _left_to_the_linker(self):
    """Of a library: machine code is made once it is asked for the address of a function, if ever."""
    stored_whole = getattr(self, "_compiled_object", None) is not None
    if stored_whole or not (_now.parts and _now.parts[-1]):
        _original[CPUCodeLibrary, "_finalize_final_module"](self)
        return
    self._finalize_dynamic_globals()
    self._verify_declare_only_symbols()
    self._finalized = self.unmade = True
    self.get_pointer_to_function = partial(_address, self)


def _address(self, name):
    del self.get_pointer_to_function
    self._dynamic_globals.clear()
    self.unmade = False
    _original[CPUCodeLibrary, "_finalize_final_module"](self)
    for variable in self._final_module.global_variables:
        environment = lookup_environment(variable.name)
        if environment is not None:
            self.codegen.set_env(variable.name, environment)
            self.environments = (*getattr(self, "environments", ()), environment)  # kept as long as the code
    return self.get_pointer_to_function(name)


def _serialized(self):
    if getattr(self, "unmade", False):
        return self.serialize_using_bitcode()
    return _original[CPUCodeLibrary, "serialize_using_object_code"](self)


def _with_environment(self, name, environment):
    if self._engine.is_symbol_defined(name):  # or it is set where its code is made
        _original[JITCPUCodegen, "set_env"](self, name, environment)


def _executable(self, library, fndesc, environment):
    if _now.parts and _now.parts[-1]:
        return _Part()
    return _original[CPUContext, "get_executable"](self, library, fndesc, environment)
