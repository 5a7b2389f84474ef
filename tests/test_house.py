"""The house: which module imports which, deferred imports and those for type checkers counted, and in which order."""

import ast
import re
import tomllib
from functools import cache
from pathlib import Path

import networkx
import pytest

from sweeps import systems
from sweeps.schema import DEFAULT_SYSTEM

ROOT = Path(__file__).parents[1]


def modules(root=ROOT, packages=("kernels", "sweeps")):
    """Name → file of each module."""
    found = {}
    for package in packages:
        for path in (root / package).rglob("*.py"):
            parts = path.relative_to(root).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


@cache
def parsed(path):
    """The syntax tree of a file."""
    return ast.parse(path.read_text(encoding="utf-8"))


def imported(name, path, known):
    """Modules of ours that a module imports, at its top, in a function, or for a type checker alone."""
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    for node in ast.walk(parsed(path)):
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
    """Sets of modules each of which imports, in the end, itself."""
    components = networkx.strongly_connected_components(networkx.DiGraph(graph))
    return [sorted(members) for members in components if len(members) > 1]


def named(kind):
    """Name → modules that define something of that kind and name at their top level."""
    found = {}
    for module, path in modules().items():
        for node in parsed(path).body:
            if isinstance(node, kind):
                found.setdefault(node.name, []).append(module)
    return found


def test_no_two_classes_share_a_name():
    assert {name: where for name, where in named(ast.ClassDef).items() if len(where) > 1} == {}


@pytest.mark.parametrize("name", ["format_span", "triangle_margin", "blocks", "dimensions", "flags"])
def test_one_name_stands_for_one_function(name):
    assert len(named(ast.FunctionDef)[name]) == 1


def test_what_is_refused_is_refused_without_assertions_too():
    for path in modules().values():
        assert not any(isinstance(node, ast.Assert) for node in ast.walk(parsed(path)))


def test_no_import_runs_in_a_circle():
    assert circles(arrows()) == []


def test_no_import_among_the_packages_of_systems_runs_in_a_circle():
    package = lambda module: ".".join(module.split(".")[:3])  # noqa: E731
    graph = {package(module): set() for module in arrows() if module.startswith("sweeps.systems.")}
    for module, targets in arrows().items():
        if package(module) in graph:
            graph[package(module)] |= {package(target) for target in targets if package(target) in graph}
    assert circles({name: targets - {name} for name, targets in graph.items()}) == []


# ---------------------------------------------------------------------------------------------------------
# A system of equations lives in its own folder: no other room asks for its name, nor for its coordinates'

ROOMS = ("schema", "reading", "points", "shards", "maps", "views", "pipeline", "commands")
OWN_COMMANDS = {"bodies.py"}  # each asks one system alone, named where it imports answers
DESCRIBED = ("equilibrium", "mode", "eigenvalue", "epsilon", "phase")  # of the maps of described systems


def names_of_systems():
    """Names of the systems, and of the folders of those that are described."""
    return {*systems.system_names(), *(name.split(".")[2] for name in systems.DESCRIBED)}


def names_of_coordinates():
    """Names of the coordinates of all systems' maps."""
    found = (systems.resolve(name).layout().coordinates for name in systems.MODULES)
    return {*DESCRIBED, *(name for coordinates in found for name in coordinates)}


def texts(source):
    """Texts of a Python source that are no docstrings, with the imports' names."""
    tree = ast.parse(source)
    told = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in told:
            yield node.value
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield from (*node.module.split("."), *(alias.name for alias in node.names))


def asked_for(path):
    """Words that the code of a file, a script or a page's section asks for: texts, and members of a map."""
    source = path.read_text(encoding="utf-8")
    if path.suffix == ".py":
        return set(texts(source))
    quoted = re.findall(r"""(["'`])([\w-]+)\1""", source)
    return {text for _, text in quoted} | set(re.findall(r"(?:coordinates|columns)\.(\w+)", source))


def outside_of_systems():
    """Files of the rooms that every system passes through."""
    found = [path for room in ROOMS for path in (ROOT / "sweeps" / room).rglob("*") if path.is_file()]
    found += [
        ROOT / "sweeps/systems" / name
        for name in ("__init__.py", "system.py", "presentation/__init__.py", "presentation/appearance.py")
    ]
    return [p for p in found if p.suffix in (".py", ".js", ".html", ".css") and p.name not in OWN_COMMANDS]


def test_no_room_asks_for_a_systems_name_or_a_coordinates():
    of_systems, of_coordinates = names_of_systems(), names_of_coordinates()
    assert {"rigid_body", "oscillator", "pendulum", "gyrostat"} <= of_systems
    assert {"axis", "I1", "body", "omega0", "half_angle", "energy"} <= of_coordinates
    found = {path: asked_for(path) & (of_systems | of_coordinates) for path in outside_of_systems()}
    found[ROOT / "sweeps/commands/parser.py"] -= {"I1", "I2", "I3"}  # --moments I1 I2 I3
    found[ROOT / "sweeps/points/in_memory_definitions.py"] -= {"axis"}  # `axes` of a definition, in a Dataset
    found[ROOT / "sweeps/schema/__init__.py"] -= {DEFAULT_SYSTEM}  # where the default is named, once
    found[ROOT / "sweeps/systems/__init__.py"] -= of_systems - {DEFAULT_SYSTEM}  # those that describe many
    found[ROOT / "sweeps/schema/refusals.py"] -= {"input"}  # a word of pydantic's
    found[ROOT / "sweeps/views/page/controls.js"] -= {"input"}  # a word of browsers
    assert {str(path.relative_to(ROOT)): words for path, words in found.items() if words} == {}


def test_every_file_of_the_page_is_shipped():
    shipped = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]["sweeps"]
    found = {path for pattern in shipped for path in (ROOT / "sweeps").glob(pattern)}
    parts = {path for path in (ROOT / "sweeps").rglob("*") if path.suffix in (".js", ".html", ".css")}
    assert len(parts) > 20
    assert parts <= found
