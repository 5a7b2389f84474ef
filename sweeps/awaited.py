"""What is to be done as soon as somebody loads a module, which may be never."""

import sys
from collections.abc import Callable
from importlib.machinery import ModuleSpec
from importlib.util import LazyLoader, find_spec
from types import ModuleType


def once_loaded(name: str, then: Callable[[ModuleType], None]) -> None:
    """Calls a function with a module: now where it is loaded, else when it has just been; once, whoever asks again."""
    if name in sys.modules:
        then(sys.modules[name])
    elif not any(isinstance(finder, _Awaited) and finder.name == name for finder in sys.meta_path):
        sys.meta_path.insert(0, _Awaited(name, then))


def once_asked(name: str) -> None:
    """Lets a module that somebody imports be loaded only when it is asked for something, which may be never."""
    if name not in sys.modules:
        sys.meta_path.insert(0, _Awaited(name, None))


class _Awaited:
    """Waits for one module's import, and then does something, or lets the module itself wait."""

    def __init__(self, name: str, then: Callable[[ModuleType], None] | None):
        self.name, self._then = name, then

    def find_spec(self, name: str, path=None, target=None) -> ModuleSpec | None:
        """The module as others find it, with what is to be done done once it is loaded."""
        if name != self.name:
            return None
        sys.meta_path.remove(self)
        spec = find_spec(name)
        if spec is None or spec.loader is None:
            return spec
        if self._then is None:
            spec.loader = LazyLoader(spec.loader)
            return spec
        load = spec.loader.exec_module

        def exec_module(module):
            load(module)
            self._then(module)

        spec.loader.exec_module = exec_module
        return spec
