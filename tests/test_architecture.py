"""Imports of all modules, deferred ones and those for type checkers included, and their order."""

import ast
import re
import tomllib
from functools import cache
from pathlib import Path

import networkx
from legibility import nodes_of

from sweeps import systems
from sweeps.schema import DEFAULT_SYSTEM

ROOT = Path(__file__).parents[1]


def modules():
    """Name → file of each module."""
    files = {}
    for package in ("kernels", "sweeps"):
        for path in (ROOT / package).rglob("*.py"):
            words = path.relative_to(ROOT).with_suffix("").parts
            files[".".join(words[:-1] if words[-1] == "__init__" else words)] = path
    return files


def imports_of(name, path, module_files):
    """Modules of ours that a module imports, at its top, in a function, or for a type checker alone."""
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    for node in nodes_of(path):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in module_files)
        elif isinstance(node, ast.ImportFrom):
            words = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            base = ".".join([*words, *([node.module] if node.module else [])])
            for alias in node.names:
                full_name = f"{base}.{alias.name}"
                if full_name in module_files or base in module_files:
                    yield full_name if full_name in module_files else base
        elif isinstance(node, ast.Call) and getattr(node.func, "attr", getattr(node.func, "id", "")) == "import_module":
            yield from (a.value for a in node.args if isinstance(a, ast.Constant) and a.value in module_files)


@cache
def arrows():
    """Module → modules that it imports."""
    module_files = modules()
    return {name: sorted(set(imports_of(name, path, module_files)) - {name}) for name, path in module_files.items()}


def circles(graph):
    """Sets of modules in which each imports, in the end, itself."""
    components = networkx.strongly_connected_components(networkx.DiGraph(graph))
    return [sorted(members) for members in components if len(members) > 1]


def test_no_two_classes_share_a_name():
    names = [node.name for path in modules().values() for node in nodes_of(path)[0].body if type(node) is ast.ClassDef]
    assert sorted(names) == sorted(set(names))


def test_what_is_refused_is_refused_without_assertions_too():
    for path in modules().values():
        assert not any(isinstance(node, ast.Assert) for node in nodes_of(path))


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
# A system of equations lives in its own folder: no general package requests its name, or its coordinates'

PACKAGES = ("schema", "reading", "points", "shards", "maps", "views", "pipeline", "commands")
OWN_COMMANDS = {"bodies.py"}  # each uses one system alone, named by its import of answers
DESCRIBED = ("equilibrium", "mode", "eigenvalue", "epsilon", "phase")  # coordinates of the maps of described systems


def names_of_systems():
    """Names of the systems, and of the folders of those that are described."""
    return {*systems.system_names(), *(name.split(".")[2] for name in systems.DESCRIBED)}


def names_of_coordinates():
    """Names of the coordinates of all systems' maps."""
    layouts = (systems.resolve(name).layout().coordinates for name in systems.MODULES)
    return {*DESCRIBED, *(name for coordinates in layouts for name in coordinates)}


def texts(source):
    """Texts of a Python source that are no docstrings, with the imports' names."""
    tree = ast.parse(source)
    docstrings = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docstrings:
            yield node.value
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield from (*node.module.split("."), *(alias.name for alias in node.names))


def requested_names(path):
    """Words that the code of a file, a script or a page's section requests: texts, and members of a map."""
    source = path.read_text(encoding="utf-8")
    if path.suffix == ".py":
        return set(texts(source))
    quotations = re.findall(r"""(["'`])([\w-]+)\1""", source)
    return {text for _, text in quotations} | set(re.findall(r"(?:coordinates|columns)\.(\w+)", source))


def outside_of_systems():
    """Files of the packages that every system passes through."""
    files = [path for package in PACKAGES for path in (ROOT / "sweeps" / package).rglob("*") if path.is_file()]
    files += [
        ROOT / "sweeps/systems" / name
        for name in ("__init__.py", "system.py", "presentation/__init__.py", "presentation/appearance.py")
    ]
    return [p for p in files if p.suffix in (".py", ".js", ".html", ".css") and p.name not in OWN_COMMANDS]


def test_no_room_asks_for_a_systems_name_or_a_coordinates():
    of_systems, of_coordinates = names_of_systems(), names_of_coordinates()
    assert {"rigid_body", "oscillator", "pendulum", "gyrostat"} <= of_systems
    assert {"axis", "I1", "body", "omega0", "half_angle", "energy"} <= of_coordinates
    requests = {path: requested_names(path) & (of_systems | of_coordinates) for path in outside_of_systems()}
    requests[ROOT / "sweeps/commands/parser.py"] -= {"I1", "I2", "I3"}  # --moments I1 I2 I3
    requests[ROOT / "sweeps/points/in_memory_definitions.py"] -= {"axis"}  # `axes` of a definition, in a Dataset
    requests[ROOT / "sweeps/schema/__init__.py"] -= {DEFAULT_SYSTEM}  # the default is named here, once
    requests[ROOT / "sweeps/systems/__init__.py"] -= of_systems - {DEFAULT_SYSTEM}  # those that describe many
    requests[ROOT / "sweeps/reading/robot_files.py"] -= {"body"}  # an element of MJCF
    requests[ROOT / "sweeps/commands/definitions.py"] -= {"K"}  # part K of N
    requests[ROOT / "sweeps/views/report.py"] -= {"plane"}  # the plane of parameters that a page shows
    requests[ROOT / "sweeps/schema/refusals.py"] -= {"input"}  # a word of pydantic's
    requests[ROOT / "sweeps/views/page/controls.js"] -= {"input"}  # a word of browsers
    assert {str(path.relative_to(ROOT)): words for path, words in requests.items() if words} == {}


def test_every_file_of_the_page_is_shipped():
    patterns = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]["sweeps"]
    package_files = {path for pattern in patterns for path in (ROOT / "sweeps").glob(pattern)}
    page_files = {path for path in (ROOT / "sweeps").rglob("*") if path.suffix in (".js", ".html", ".css")}
    assert len(page_files) > 20
    assert page_files <= package_files


def test_no_two_files_of_tests_have_one_name():
    """Without packages, pytest imports them by their names alone."""
    names = [path.name for path in (ROOT / "tests").rglob("test_*.py")]
    assert sorted(names) == sorted(set(names))
