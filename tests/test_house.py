"""The house: which module imports which, deferred imports and those for type checkers counted, and in which order."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def modules(root=ROOT, packages=("kernels", "sweeps")):
    """Name → file of each module."""
    found = {}
    for package in packages:
        for path in (root / package).rglob("*.py"):
            parts = path.relative_to(root).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imported(name, path, known):
    """Modules of ours that a module imports, at its top, in a function, or for a type checker alone."""
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom):
            parts = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            base = ".".join([*parts, *([node.module] if node.module else [])])
            for alias in node.names:
                whole = f"{base}.{alias.name}"
                if whole in known or base in known:
                    yield whole if whole in known else base
        elif isinstance(node, ast.Call) and getattr(node.func, "attr", getattr(node.func, "id", "")) == "import_module":
            yield from (a.value for a in node.args if isinstance(a, ast.Constant) and a.value in known)


def arrows(root=ROOT, packages=("kernels", "sweeps")):
    """Module → modules that it imports."""
    known = modules(root, packages)
    return {name: sorted(set(imported(name, path, known)) - {name}) for name, path in known.items()}


def circles(graph):
    """Sets of modules each of which imports, in the end, itself (Tarjan's strongly connected components)."""
    index, low, stack, found = {}, {}, [], []

    def visit(name):
        index[name] = low[name] = len(index)
        stack.append(name)
        for other in graph[name]:
            if other not in index:
                visit(other)
            if other in stack:
                low[name] = min(low[name], low[other])
        if low[name] == index[name]:
            members = [stack.pop()]
            while members[-1] != name:
                members.append(stack.pop())
            if len(members) > 1:
                found.append(sorted(members))

    for name in graph:
        if name not in index:
            visit(name)
    return found


def named(kind):
    """Name → modules that define something of that kind and name at their top level."""
    found = {}
    for module, path in modules().items():
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, kind):
                found.setdefault(node.name, []).append(module)
    return found


def test_no_two_classes_share_a_name():
    assert {name: where for name, where in named(ast.ClassDef).items() if len(where) > 1} == {}


@pytest.mark.parametrize("name", ["duration", "triangle_margin", "blocks", "dimensions", "flags"])
def test_one_name_stands_for_one_function(name):
    assert len(named(ast.FunctionDef)[name]) == 1


def test_what_is_refused_is_refused_without_assertions_too():
    for path in modules().values():
        assert not any(isinstance(node, ast.Assert) for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))))


def test_no_import_runs_in_a_circle():
    assert circles(arrows()) == []


@pytest.mark.parametrize(
    "text",
    [
        "import sweeps.b",
        "def f():\n    from sweeps import b",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from sweeps.b import c",
        "from . import b",
        "import importlib\nimportlib.import_module('sweeps.b')",
    ],
)
def test_a_circle_is_seen_however_it_is_hidden(tmp_path, text):
    (tmp_path / "sweeps").mkdir()
    (tmp_path / "sweeps/__init__.py").write_text("")
    (tmp_path / "sweeps/a.py").write_text(text)
    (tmp_path / "sweeps/b.py").write_text("def g():\n    import sweeps.a")
    assert circles(arrows(tmp_path, ("sweeps",))) == [["sweeps.a", "sweeps.b"]]
