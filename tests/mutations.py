"""Do the tests bite? Seeded mutations of the kernels and of the rooms of shards and maps, and how many tests fail.

    PYTHONPATH=. python tests/mutations.py [--count 200] [--seed 1] [--only MODULES]

Each mutation is one change of the kind that a slip of the hand makes: another sign, another comparison, a term left
out, a number one off. It is made in a copy of the tree, and the tests of that module alone are run there; a test that
fails, or does not end, has caught it. Kernels run as plain Python first, and compiled if nothing failed. Every module
gets about as many mutations as every other. One line a mutation, and what was not caught at the end.
"""

import argparse
import ast
import itertools
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import textwrap
import time
from pathlib import Path
from typing import NamedTuple

import compiled

ROOT = Path(__file__).parents[1]
LONGEST = 300  # seconds of a processor that the tests of one module may take
COPIED = ("kernels", "sweeps", "tests", "results/README.md", "README.md", "Snakefile", ".slurm", "pyproject.toml")
ROOMS = ("kernels", "sweeps/shards", "sweeps/maps")
PLAIN = {"__init__", "options", "write_taylor_steps", "write_turning"}  # nothing in them computes
TESTS = {  # beside tests/ROOM/test_MODULE.py; the first that fails ends the run, so what is quick stands first
    "kernels/blocks": ["tests/kernels/test_blocks.py"],
    "kernels/elliptic": ["tests/kernels/test_elliptic.py", "tests/kernels/test_exact.py"],
    "kernels/enclosures": ["tests/mechanics/test_line.py", "tests/mechanics/test_boxes.py"],
    "kernels/flows": ["tests/mechanics/test_relative.py"],
    "kernels/marching": ["tests/kernels/test_attitude.py"],
    "kernels/plain": ["tests/systems/test_spins.py"],
    "kernels/findings": [
        "tests/kernels/test_survey.py",
        "tests/kernels/test_lanes.py",
        "tests/kernels/test_reduction.py",
    ],
    "kernels/lanes": ["tests/kernels/test_lanes.py", "tests/kernels/test_survey.py"],
    "kernels/measure": ["tests/kernels/test_measure.py", "tests/kernels/test_oscillations.py"],
    "kernels/survey": ["tests/kernels/test_survey.py", "tests/kernels/test_collapse.py", "tests/kernels/test_lanes.py"],
    "kernels/series": ["tests/kernels/test_symmetric_top.py"],
    "kernels/solution": ["tests/kernels/test_exact.py"],
    "kernels/statuses": ["tests/kernels/test_columns.py", "tests/kernels/test_oscillations.py"],
    "kernels/taylor_steps": ["tests/kernels/test_direct.py"],
    "kernels/turning": ["tests/kernels/test_attitude.py"],
    "kernels/uncertainty": ["tests/kernels/test_reduction.py", "tests/kernels/test_survey.py"],
    "sweeps/shards/chunks": ["tests/shards/test_chunks.py", "tests/maps/test_storage.py"],
    "sweeps/shards/content": ["tests/maps/test_storage.py"],
    "sweeps/shards/contract": ["tests/maps/test_dataset.py", "tests/maps/test_storage.py"],
    "sweeps/shards/merging": ["tests/maps/test_storage.py"],
    "sweeps/shards/shard": ["tests/maps/test_storage.py", "tests/maps/test_dataset.py"],
    "sweeps/shards/looking": ["tests/maps/test_door.py"],
    "sweeps/maps/admission": ["tests/maps/test_door.py"],
    "sweeps/maps/raw": ["tests/maps/test_door.py"],
}
ALL_SLOW = {f"kernels/{name}" for name in ("dense", "flows", "in_space", "jacobians", "spectrum")}  # their tests
AS_WRITTEN = "not as_written and not script_writes"  # a generated text is not to be caught by its letters
COMPARISONS = {
    **{ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq},
    **{ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In},
}
OPERATORS = {
    **{ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.FloorDiv: ast.Mult},
    **{ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd, ast.Mod: ast.Mult, ast.Pow: ast.Mult},
}
NAMES = {"min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "all": "any", "any": "all"}


class Mutation(NamedTuple):
    """One change of a module: which of all there are, its line, what stood there and what stands there now."""

    module: str
    number: int
    line: int
    before: str
    after: str

    def __str__(self):
        before, after = (textwrap.shorten(text, 120) for text in (self.before, self.after))
        return f"{self.module}.py:{self.line}: {before}  →  {after}"


def changes(node):
    """What may stand in a node's place."""
    if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
        yield ast.BinOp(node.left, OPERATORS[type(node.op)](), node.right)
        if isinstance(node.op, ast.Add | ast.Sub):
            yield node.left
            yield node.right
    elif isinstance(node, ast.BoolOp):
        yield ast.BoolOp(ast.Or() if isinstance(node.op, ast.And) else ast.And(), node.values)
        yield node.values[0]
    elif isinstance(node, ast.Compare) and type(node.ops[0]) in COMPARISONS:
        yield ast.Compare(node.left, [COMPARISONS[type(node.ops[0])](), *node.ops[1:]], node.comparators)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.Not):
        yield node.operand
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
        yield ast.Constant(not node.value)
    elif isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        yield ast.Constant(node.value + 1)
        yield ast.Constant(node.value - 1)
    elif isinstance(node, ast.Name) and node.id in NAMES:
        yield ast.Name(NAMES[node.id], node.ctx)
    elif isinstance(node, ast.Attribute) and node.attr in NAMES:
        yield ast.Attribute(node.value, NAMES[node.attr], node.ctx)
    elif isinstance(node, ast.IfExp):
        yield ast.IfExp(node.test, node.orelse, node.body)


def _fields(node):
    """A node's children that are run: no decorator, no annotation, no message of an error, no type's alternatives."""
    for name, value in ast.iter_fields(node):
        skipped = name in ("decorator_list", "annotation", "returns", "type_comment")
        if not skipped and not (isinstance(node, ast.Raise) and name == "exc"):
            yield name, value


def _sites(node, copy):
    """Each node of a tree with what puts another into its place, in a copy of the same tree."""
    for name, value in _fields(node):
        if isinstance(value, ast.AST):
            yield value, lambda new, c=copy, n=name: setattr(c, n, new), getattr(copy, name)
            yield from _sites(value, getattr(copy, name))
        elif isinstance(value, list):
            for i, item in enumerate(value):
                if isinstance(item, ast.AST):
                    twins = getattr(copy, name)
                    yield item, lambda new, t=twins, i=i: t.__setitem__(i, new), twins[i]
                    yield from _sites(item, twins[i])


def _every(tree):
    """Each node of a tree with one change of it, made in the tree while it is looked at."""
    copy = ast.parse(ast.unparse(tree))
    for node, put, twin in _sites(tree, copy):
        for change in changes(node):
            put(ast.fix_missing_locations(change))
            yield node, change, copy
            put(twin)


def mutations(module, text):
    """Every mutation of a module's text."""
    found = enumerate(_every(ast.parse(text)))
    return [Mutation(module, k, node.lineno, ast.unparse(node), ast.unparse(new)) for k, (node, new, _) in found]


def mutated(mutation, text):
    """The module's text with the mutation made."""
    _, _, tree = next(itertools.islice(_every(ast.parse(text)), mutation.number, None))
    return ast.unparse(tree)


def modules():
    """Every module of the rooms, by its path without the suffix."""
    paths = (path.relative_to(ROOT).with_suffix("") for room in ROOMS for path in sorted((ROOT / room).glob("*.py")))
    return [path.as_posix() for path in paths if path.name not in PLAIN]


def files_of_tests(module):
    """The tests that are asked about a module, those that there are."""
    room, _, name = module.rpartition("/")
    own = f"tests/{room.removeprefix('sweeps/')}/test_{name}.py"
    return [path for path in dict.fromkeys([own, *TESTS.get(module, ())]) if (ROOT / path).exists()]


def drawn(count, seed, only=""):
    """So many mutations, each module in its turn."""
    rng, piles = random.Random(seed), []
    for module in modules():
        pile = mutations(module, (ROOT / f"{module}.py").read_text())
        rng.shuffle(pile)
        if re.search(only, module) and pile:
            piles.append(pile)
    chosen = []
    while len(chosen) < count and any(piles):
        chosen += [pile.pop() for pile in piles if pile]
    return chosen[:count]


def _limited():
    resource.setrlimit(resource.RLIMIT_CPU, (LONGEST, LONGEST + 5))


class Copy:
    """A copy of the tree, with compiled kernels of its own, in which tests run."""

    def __init__(self, folder):
        self.folder = Path(folder) / "polhode"
        self.folder.mkdir()
        for name in COPIED:
            source, target = ROOT / name, self.folder / name
            target.parent.mkdir(exist_ok=True)
            if source.is_dir():
                shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"))
            elif source.exists():
                shutil.copy(source, target)
        own = {"PYTHONPATH": str(self.folder), "PYTHONDONTWRITEBYTECODE": "1", "XDG_CACHE_HOME": str(folder)}
        self.environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"} | own
        compiled.share(self.folder, Path(folder))

    def run(self, module, plain=True, more=()):
        """What a module's tests say when they fail, a line each; nothing if they pass, "did not end" if they go on."""
        command = [sys.executable, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider", "--no-header", *more]
        asked = "not faults" if module in ALL_SLOW else "not slow and not faults"
        command += ["-m", asked, "-k", AS_WRITTEN, *files_of_tests(module)]
        options = {"cwd": self.folder, "env": self.environment, "capture_output": True, "text": True}
        if plain and module.startswith("kernels/"):
            options["env"] = options["env"] | {"NUMBA_DISABLE_JIT": "1"}
        done = subprocess.run(command, preexec_fn=_limited, **options)
        if done.returncode == -signal.SIGXCPU:
            return ["did not end"]
        told = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
        return (told or [f"exit status {done.returncode}"]) if done.returncode else []

    def sound(self, module):
        """What of a module's tests to leave out, which fail as it is where nothing is compiled; None if that is all."""
        failed = self.run(module)
        left_out = [f"--deselect={line.split()[1]}" for line in failed if line.startswith("FAILED")]
        if len(left_out) < len(failed):
            return None
        return None if self.run(module, more=left_out) else left_out

    def judged(self, mutation, left_out):
        """What caught a mutation; nothing if nothing did."""
        path = self.folder / f"{mutation.module}.py"
        before = path.read_text()
        path.write_text(mutated(mutation, before))
        try:
            told = self.run(mutation.module, more=["-x", *left_out])
            if not told and mutation.module.startswith("kernels/"):
                told = self.run(mutation.module, plain=False, more=["-x"])
            return "".join(told[:1])
        finally:
            path.write_text(before)


def main(arguments=None):
    """Print one line a mutation, and how many were caught."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="modules whose path this regular expression finds")
    parser.add_argument("--list", action="store_true", help="say which mutations there would be, and run nothing")
    given = parser.parse_args(arguments)
    chosen, survivors, judged = drawn(given.count, given.seed, given.only), [], 0
    if given.list:
        print(*chosen, sep="\n")
        return
    with tempfile.TemporaryDirectory(prefix="mutations-") as folder:
        copy = Copy(folder)
        left_out = {}
        for number, mutation in enumerate(chosen, 1):
            begun = time.monotonic()
            if mutation.module not in left_out:
                left_out[mutation.module] = found = copy.sound(mutation.module)
                told = "cannot be judged" if found is None else f"passes {' '.join(['', *found])}".strip()
                print(f"{mutation.module} as it is: {told} ({time.monotonic() - begun:.0f} s)", flush=True)
            if left_out[mutation.module] is None:
                continue
            judged += 1
            caught = copy.judged(mutation, left_out[mutation.module])
            if not caught:
                survivors.append(mutation)
            told = f"caught by {caught}" if caught else "NOT CAUGHT"
            print(f"{number} {mutation}: {told} ({time.monotonic() - begun:.0f} s)", flush=True)
    print(f"{judged - len(survivors)} of {judged} caught", *survivors, sep="\n")


if __name__ == "__main__":
    main()
