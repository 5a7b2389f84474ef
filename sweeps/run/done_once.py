"""What Numba does again and again while it compiles, and need not.

After each of its passes over a function Numba finds which variables live where, which only generators and code that
calls Python read, and before each function it imports its own modules by name, some forty, to look for what is new in
their registries. And Python looks for garbage among objects that are all in use. Together a sixth of all compiling.
"""

import gc
from collections.abc import Iterator
from contextlib import contextmanager

import numba
from numba.core import transforms
from numba.core.cpu import CPUContext
from numba.core.postproc import PostProcessor, VariableLifetime
from numba.core.typing.context import Context

from sweeps.run.linked_parts import KNOWN

OBJECTS = 50_000  # made since garbage was looked for last: Python's own number is 700

_run, _load, _load_types = PostProcessor.run, CPUContext.load_additional_registries, Context.load_additional_registries


@contextmanager
def done_once() -> Iterator[None]:
    """Within it lifetimes are found where they are read, modules imported once, and garbage is seldom looked for."""
    if numba.version_info.short != KNOWN:
        yield
        return
    thresholds = gc.get_threshold()
    try:
        PostProcessor.run = _run_shortly
        CPUContext.load_additional_registries = _loaded_once(_load)
        Context.load_additional_registries = _loaded_once(_load_types)
        gc.freeze()
        gc.set_threshold(OBJECTS, *thresholds[1:])
        yield
    finally:
        gc.set_threshold(*thresholds)
        gc.unfreeze()
        PostProcessor.run, CPUContext.load_additional_registries = _run, _load
        Context.load_additional_registries = _load_types


def _run_shortly(self, emit_dels=False, extend_lifetimes=False):
    """As `PostProcessor.run`, but for the variables that live where a block begins, unless more is to be made of it."""
    code = self.func_ir
    if emit_dels or code.is_generator:
        _run(self, emit_dels, extend_lifetimes)
        return
    code.blocks = transforms.canonicalize_cfg(code.blocks)
    code.variable_lifetime = VariableLifetime(code.blocks)
    code.generator_info = None


def _loaded_once(load):
    """A context's registries, each looked through for what is new; their modules are imported the first time alone."""
    loaded = set()

    def load_or_look(context):
        if context in loaded:
            for registry in tuple(context._registries):
                context.install_registry(registry)
        else:
            load(context)
            loaded.add(context)

    return load_or_look
