"""CONTRIBUTING.md against the code: its list of packages, the names on it, and its recipes followed literally."""

import ast
import os
import re
import shutil
import subprocess
import sysconfig
import tomllib
import venv
from importlib.util import find_spec
from pathlib import Path

import netCDF4
import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")


def blocks(heading, language="python"):
    """The code blocks of one section."""
    section = PAGE.split(f"## {heading}\n")[1].split("\n## ")[0]
    return re.findall(rf"```{language}\n(.*?)```", section, re.DOTALL)


def packages():
    """The packages in the order of their imports, each with the first line of its docstring."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    orders = [contract for contract in contracts if contract["type"] == "layers"]
    layers = [(order.get("containers", [""])[0], layer) for order in orders for layer in order["layers"]]
    for name in (f"{around}.{name}".strip(".") for around, layer in layers for name in layer.split(" | ")):
        path = ROOT / name.replace(".", "/")
        text = (path / "__init__.py" if path.is_dir() else path.with_suffix(".py")).read_text(encoding="utf-8")
        yield f"{name:18s} {ast.get_docstring(ast.parse(text)).splitlines()[0]}"


def test_the_packages_are_those_of_the_code():
    """`python tests/test_contributing.py` writes the list again."""
    assert blocks("Packages, in the order of their imports", "text")[0].splitlines() == list(packages())


def test_every_module_on_the_page_exists():
    names = set(re.findall(r"`((?:kernels|sweeps)(?:\.\w+)*)`", PAGE))
    assert len(names) > 15
    for name in names:
        parent, _, last = name.rpartition(".")
        spec = find_spec(name) if not parent or find_spec(parent).submodule_search_locations else None
        source = "" if spec else Path(find_spec(parent).origin).read_text(encoding="utf-8")
        assert spec or re.search(rf"^(def|class) {last}\b", source, re.MULTILINE), name


def change(path, old, new):
    """Replace a text that occurs once in a file."""
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1
    path.write_text(text.replace(old, new), encoding="utf-8")


@pytest.fixture(scope="module")
def clone(tmp_path_factory):
    """A copy of the repository with commands in .venv/bin; all packages are those of this environment."""
    folder = tmp_path_factory.mktemp("clone") / "polhode"
    shutil.copytree(ROOT, folder, ignore=shutil.ignore_patterns(".*", "results", "__pycache__", "*.egg-info"))
    venv.create(folder / ".venv", symlinks=True)
    (site_packages,) = (folder / ".venv/lib").glob("*/site-packages")
    (site_packages / "packages.pth").write_text(f"{folder}\n{sysconfig.get_path('purelib')}")
    for program, module in (("pip", "pip"), ("polhode", "sweeps")):
        script = folder / ".venv/bin" / program
        script.write_text(f'#!/bin/sh\nexec {folder}/.venv/bin/python -m {module} "$@"\n')
        script.chmod(0o755)
    return folder


def type_lines(folder, lines):
    """Run lines of shell in a folder, as a reader types them, and return their output."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    command = ["bash", "-euo", "pipefail", "-c", lines]
    process = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert process.returncode == 0, process.stderr + process.stdout
    return process.stdout


@pytest.mark.slow
def test_the_recipes_are_typed_as_they_are_printed(clone):
    """All in one clone, in sequence, as a contributor follows the page."""
    system = clone / "tests/toy/damped_top/system.py"
    (install,) = blocks("Recipes: install the toy system first", "sh")
    assert "24 = 2 spin × 12 tau" in type_lines(clone, install)

    variable, column = blocks("Recipe: a new measured column", "text")
    change(system, "VARIABLES = table(\n", f"VARIABLES = table(\n{variable}")
    change(system, "        return {\n", f"        return {{\n{column}")
    (lines,) = blocks("Recipe: a new measured column", "sh")
    assert re.search(r"half_life +0\.69314\d+ +s", type_lines(clone, lines))  # log(2); h = 1/64: h^4 = 6e-8

    (lines,) = blocks("Recipe: another executor", "sh")
    (code,) = blocks("Recipe: another executor")
    run_hash = map_hash(clone)
    (clone / "executor.py").write_text(code)
    assert type_lines(clone, lines).split()[-2:] == [run_hash, run_hash]

    (lines,) = blocks("Recipe: a new system", "sh")
    assert "results/oil/report.html" in type_lines(clone, lines)

    (code,) = blocks("Recipe: another integrator")
    old = re.search(r"def integrate\(.*?\n\n\n", system.read_text(encoding="utf-8"), re.DOTALL)[0]
    change(system, old, f"{code}\n\n")
    (lines,) = blocks("Recipe: another integrator", "sh")
    assert type_lines(clone, lines).count(" holds\n") >= 8
    assert map_hash(clone) != run_hash


def map_hash(clone):
    """Return the content hash of the map of the toy's sweep."""
    with netCDF4.Dataset(clone / "results/honey/stability_map.nc") as file:
        return file.content_hash


if __name__ == "__main__":
    before, old = PAGE.split("```text\n", 1)
    text = before + "```text\n" + "".join(f"{line}\n" for line in packages()) + old[old.index("```") :]
    (ROOT / "CONTRIBUTING.md").write_text(text, encoding="utf-8")
