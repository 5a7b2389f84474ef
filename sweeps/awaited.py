"""What is to be done as soon as somebody loads a module, which may be never."""

import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from importlib.machinery import ModuleSpec
from importlib.util import LazyLoader, find_spec
from types import ModuleType


def once_loaded(name: str, then: Callable[[ModuleType], None]) -> None:
    """Calls a function with a module: now where it is loaded, else when it has just been; once, whoever asks again."""

    @contextmanager
    def followed(module: ModuleType) -> Iterator[None]:
        yield
        then(module)

    if name in sys.modules:
        then(sys.modules[name])
    else:
        _await(name, followed)


def once_asked(name: str) -> None:
    """Lets a module that somebody imports be loaded only when it is asked for something, which may be never."""
    _await(name, None)


def while_loaded(name: str, within: Callable[[], AbstractContextManager]) -> None:
    """Lets a module that nobody has loaded be loaded within a context."""
    _await(name, lambda module: within())


def _await(name: str, around: Callable[[ModuleType], AbstractContextManager] | None) -> None:
    """Waits for a module that is not loaded, unless somebody does already."""
    if name not in sys.modules and not any(isinstance(f, _Awaited) and f.name == name for f in sys.meta_path):
        sys.meta_path.insert(0, _Awaited(name, around))


class _Awaited:
    """Waits for one module's import, and then loads it within a context, or lets the module itself wait."""

    def __init__(self, name: str, around: Callable[[ModuleType], AbstractContextManager] | None):
        self.name, self._around = name, around

    def find_spec(self, name: str, path=None, target=None) -> ModuleSpec | None:
        """The module as others find it, but for how it is loaded."""
        if name != self.name:
            return None
        sys.meta_path.remove(self)
        spec = find_spec(name)
        if spec is None or spec.loader is None:
            return spec
        if self._around is None:
            spec.loader = LazyLoader(spec.loader)
            return spec
        load = spec.loader.exec_module

        def exec_module(module):
            with self._around(module):
                load(module)

        spec.loader.exec_module = exec_module
        return spec
