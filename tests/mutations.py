"""Do the tests bite? Seeded mutations of the kernels and of the packages that read, store and check maps.

    PYTHONPATH=. python tests/mutations.py FOLDER [--count 200] [--seed 1] [--only MODULES] [--compiled] [--ask FILES]

Each mutation is one change of the kind that a slip of the hand makes: another sign, another comparison, a term left
out, a number one off. It is made in a copy of the tree, in FOLDER; there the tests run that pass through the changed
line (`coverage` says which, once), the quick ones first, and one that fails, or does not end, has caught it. Kernels
run as plain Python, where no test of `in_space` ends within seconds; `--compiled` asks compiled ones about what plain
ones let pass: all quick tests of the files that know the changed line, up to ten minutes a mutation. Every module gets
about as many mutations as every other.
FOLDER/log.txt has a line for each: who breaks off goes on from there. `--ask` asks all tests of some files, as they
are today, about what the log calls not caught. What changes nothing that anybody could see stands in
`equivalent_mutations.txt`, each with its reason, and is not counted.

Of 20 with the seed 1 (`--only '^sweeps' --count 20`) one changes nothing, and the others are caught; 12 were before
tests were sharpened for what was let pass, and before more files of tests were asked. Of 46 with the seed 2 in six
modules (`--only '^kernels/(measure|oscillations|direct|principal|collapse|columns)' --count 46 --seed 2`) 11 change
nothing, and 34 of the other 35 are caught; 30 were before. The one left adds to an oscillator's error by rounding.
"""

import argparse
import ast
import itertools
import json
import multiprocessing
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import textwrap
import time
from collections import Counter
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[1]
LONGEST = 4  # seconds of a processor that one test may take, to be asked
PATIENCE = 60  # seconds of a processor, under the eyes of coverage, that the tests of one mutation may take
COPIED = ("kernels", "sweeps", "tests", "results/README.md", "README.md", "Snakefile", ".slurm", "pyproject.toml")
ROOMS = ("kernels", "sweeps/reading", "sweeps/shards", "sweeps/maps")
LEFT_OUT = {"__init__", "flows"}  # nothing computes in the one; what calls the other is generated, minutes to compile
COMPILING = ("fingerprint", "cache", "jit", "straight")  # of kernels/: nothing without the compiler
ASKED = {  # whether kernels are plain: the tests that may be asked
    True: ["tests/kernels", "tests/mechanics/test_roots.py", "tests/mechanics/test_taylor.py"],
    False: [
        *("tests/reading", "tests/points", "tests/shards", "tests/maps", "tests/views/test_slices.py"),
        *("tests/systems/test_inertia.py", "tests/systems/test_seen.py", "tests/pipeline/test_pipeline.py"),
        *(f"tests/kernels/test_{name}.py" for name in COMPILING),
    ],
}
OTHERS = {  # of what runs when a module is imported: tests of who uses it, beside those of its own name
    "kernels/circular": ["tests/kernels/test_attitude.py"],
    "kernels/enclosures": ["tests/mechanics/test_roots.py"],
    "kernels/estimates": ["tests/kernels/test_lanes.py", "tests/kernels/test_survey.py"],
    "kernels/lanes": ["tests/kernels/test_survey.py"],
    "kernels/roots": ["tests/mechanics/test_roots.py"],
    "kernels/solution": ["tests/kernels/test_exact.py"],
    "kernels/statuses": ["tests/kernels/test_columns.py", "tests/kernels/test_oscillations.py"],
    "kernels/taylor": ["tests/kernels/test_direct.py", "tests/kernels/test_attitude.py"],
    "kernels/uncertainty": ["tests/kernels/test_reduction.py", "tests/kernels/test_survey.py"],
    "sweeps/shards/content": ["tests/maps/test_storage.py"],
    "sweeps/shards/contract": ["tests/maps/test_dataset.py"],
    "sweeps/reading/limits": ["tests/points/test_loading.py"],
    "sweeps/reading/sandbox": ["tests/maps/test_door.py"],
    "sweeps/maps/admission": ["tests/maps/test_door.py"],
    "sweeps/reading/stored_values": ["tests/maps/test_door.py"],
}
AS_WRITTEN = "not as_written and not script_writes"  # a generated text is not to be caught by its letters
LOADED = ["numpy", "numba", "xarray", "netCDF4", "pytest", "hypothesis", "coverage", "scipy.integrate", "mpmath"]
LOADED += ["scipy.optimize", "scipy.stats", "matplotlib.pyplot", "sympy", "pydantic", "h5py", "dask.array"]
LOADED += ["rich.console"]
SURVIVES = "not caught"
MOST_FILES = 4  # of tests that compiled kernels are asked about: each compiles what it needs
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
    """One change of a module: which of all there are, its line, what stood there, what stands there now, and where."""

    module: str
    number: int
    line: int
    before: str
    after: str
    source: str  # the line's text
    column: int  # in that

    @property
    def place(self):
        """What it changes, wherever in its module that line has moved to."""
        return f"{self.module}.py: {self.source} [{self.column}]: {self._change}"

    @property
    def _change(self):
        before, after = (textwrap.shorten(text, 120) for text in (self.before, self.after))
        return f"{before}  →  {after}"

    def __str__(self):
        return f"{self.module}.py:{self.line}: {self._change}"


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
    lines, found = text.splitlines(), []
    for k, (node, new, _) in enumerate(_every(ast.parse(text))):
        line = lines[node.lineno - 1]
        source, indent = line.partition("  #")[0].strip(), len(line) - len(line.lstrip())
        change = (node.lineno, ast.unparse(node), ast.unparse(new))
        found.append(Mutation(module, k, *change, source, node.col_offset - indent))
    return found


def mutated(mutation, text):
    """The module's text with the mutation made."""
    _, _, tree = next(itertools.islice(_every(ast.parse(text)), mutation.number, None))
    return ast.unparse(tree)


def modules(folder=ROOT):
    """Every module of the rooms, by its path without the suffix."""
    paths = (path for room in ROOMS for path in sorted((folder / room).glob("*.py")) if path.stem not in LEFT_OUT)
    return [path.relative_to(folder).with_suffix("").as_posix() for path in paths]


def drawn(folder, count, seed, only=""):
    """So many mutations of a tree, each module in its turn."""
    piles = []
    for module in modules(folder):
        pile = mutations(module, (folder / f"{module}.py").read_text())
        random.Random(f"{seed} {module}").shuffle(pile)
        if re.search(only, module) and pile:
            piles.append(pile)
    chosen = []
    while len(chosen) < count and any(piles):
        chosen += [pile.pop() for pile in piles if pile]
    return chosen[:count]


class Watch:
    """A plugin of pytest: keeps the tests that are wanted, in their order; says what passed and through which lines."""

    def __init__(self, wanted=None, coverage=None, limit=0):
        self.wanted, self.coverage, self.limit = wanted, coverage, limit
        self.seconds, self.failed, self.begun = {}, [], 0.0

    def pytest_collection_finish(self, session):
        """The quick tests first."""
        if self.wanted is not None:
            places = {name: k for k, name in enumerate(self.wanted)}
            kept = [item for item in session.items if item.nodeid in places]
            session.items[:] = sorted(kept, key=lambda item: places[item.nodeid])

    def pytest_runtest_logstart(self, nodeid):
        """Notes the lines under the test's name, and the time."""
        self.begun = time.process_time()
        if self.coverage is not None:
            self.coverage.switch_context(nodeid)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_setup(self):
        """Breaks off a fixture or a test that takes too long, but not pytest as it says so."""
        signal.setitimer(signal.ITIMER_VIRTUAL, self.limit)
        try:
            return (yield)
        finally:
            signal.setitimer(signal.ITIMER_VIRTUAL, 0)

    pytest_runtest_call = pytest_runtest_setup

    def pytest_runtest_logreport(self, report):
        """Seconds of a processor that a test takes, and what did not pass."""
        self.seconds[report.nodeid] = time.process_time() - self.begun
        too_long = self.coverage is not None and self.seconds[report.nodeid] > LONGEST
        if report.outcome != "passed" or too_long:
            self.failed.append(report.nodeid)


def _too_long(*_):
    signal.setitimer(signal.ITIMER_VIRTUAL, 1)  # again, should somebody take this for one of the numbers' errors
    raise TimeoutError("a test that takes too long to be asked")


def _enter(folder, plain, limit):
    """Makes this process one that runs tests in a copy of the tree."""
    os.chdir(folder)
    sys.path[:] = [str(folder), *(path for path in sys.path if path not in (str(ROOT), str(ROOT / "tests")))]
    os.environ.update(PYTHONPATH=str(folder), XDG_CACHE_HOME=str(folder.parent))
    for name in ("NUMBA_CACHE_DIR", "PYTHONDONTWRITEBYTECODE"):
        os.environ.pop(name, None)
    sys.dont_write_bytecode = False
    if plain:
        os.environ["NUMBA_DISABLE_JIT"] = "1"
        sys.modules["numba"].config.DISABLE_JIT = 1
    if limit:
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5))
    out = os.open(folder.parent / "said.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(out, 1), os.dup2(out, 2)


def _run(folder, plain, files, wanted, limit, mapped):
    """Runs tests in a process of its own, and leaves what it saw in a file; ends with pytest's status."""
    _enter(folder, plain, limit)
    told, watcher = {}, None
    if mapped:
        import coverage

        rooms = [f"{folder}/{room}/*.py" for room in ROOMS]
        watcher = coverage.Coverage(data_file=None, config_file=False, include=rooms)
        watcher.start()
    signal.signal(signal.SIGVTALRM, _too_long)
    watch = Watch(wanted, watcher, LONGEST if mapped and plain else 0)  # a compiled thread may hold a lock
    whole = not mapped and wanted is None
    status = pytest.main([*_options(plain, whole), *([] if mapped else ["-x"]), *files], plugins=[watch])
    if mapped:
        watcher.stop()
        told["lines"] = _lines(watcher, folder)
    told |= {"failed": watch.failed, "seconds": watch.seconds}
    (folder.parent / "told.json").write_text(json.dumps(told))
    sys.stdout.flush()
    os._exit(int(status))


def _options(plain, whole=False):
    """Of pytest; slow tests too where files are asked as a whole, or where there is nothing to compile."""
    marks = "not faults" if plain or whole else "not faults and not slow"
    # test_plain compiles the same mutation beside, for minutes: the two always agree
    left_out = [f"--ignore=tests/kernels/test_{name}.py" for name in (*COMPILING, "plain") if plain]
    return [*left_out, "-q", "-n", "0", "-p", "no:cacheprovider", "--no-header", "-m", marks, "-k", AS_WRITTEN]


def _lines(watcher, folder):
    """Of each module each line, and the tests that ran it."""
    data, found = watcher.get_data(), {}
    for file in data.measured_files():
        lines = data.contexts_by_lineno(file).items()
        module = Path(file).relative_to(folder).with_suffix("").as_posix()
        found[module] = {line: [name for name in names if name] for line, names in lines}
    return found


def _put(path, text):
    """Writes a module, and forgets what Python compiled of it: dates are of a second, and a change hardly of a size."""
    path.write_text(text)
    for compiled_one in (path.parent / "__pycache__").glob(f"{path.stem}.*"):
        compiled_one.unlink()


class Copy:
    """A copy of the tree, with compiled kernels of its own, in which tests run."""

    def __init__(self, folder):
        self.folder = folder / "polhode"
        self.processes = multiprocessing.get_context("forkserver")
        self.processes.set_forkserver_preload(LOADED)
        if not self.folder.exists():
            self.folder.mkdir(parents=True)
            self.take(COPIED)
            import compiled

            compiled.share(self.folder, folder)
        self.maps = {}

    def take(self, names):
        """Copies folders and files of the tree as it is now."""
        for name in names:
            source, target = ROOT / name, self.folder / name
            target.parent.mkdir(exist_ok=True)
            if source.is_dir():
                ignored = shutil.ignore_patterns("__pycache__")
                shutil.copytree(source, target, ignore=ignored, dirs_exist_ok=True)
            elif source.exists():
                shutil.copy(source, target)

    def run(self, plain, files, wanted=None, limit=60, mapped=False):
        """The status of a run of tests, and what they told."""
        (self.folder.parent / "told.json").unlink(missing_ok=True)
        process = self.processes.Process(target=_run, args=(self.folder, plain, files, wanted, limit, mapped))
        process.start()
        process.join(20 * limit)
        if process.is_alive():
            process.kill()
            process.join()
        told = self.folder.parent / "told.json"
        return process.exitcode, json.loads(told.read_text()) if told.exists() else {}

    def map(self, plain):
        """Which tests pass through which line of which module, and how long each takes; made once."""
        kept = self.folder.parent / ("plain.json" if plain else "compiled.json")
        if not kept.exists():
            _, told = self.run(plain, ASKED[plain], limit=3600, mapped=True)
            if not told.get("seconds"):
                sys.exit(f"no test was run: {self.folder.parent / 'said.txt'} says why")
            kept.write_text(json.dumps(told))
        if plain not in self.maps:
            self.maps[plain] = json.loads(kept.read_text())
        return self.maps[plain]

    def asked(self, mutation, plain):
        """The tests to ask about a mutation, the quick ones first, as many as patience allows."""
        told = self.map(plain)
        lines, room, name = told["lines"].get(mutation.module, {}), *mutation.module.rsplit("/", 1)
        passing = set(lines.get(str(mutation.line), ()))
        if not passing:  # it runs when the module is imported
            files = [f"tests/{room.removeprefix('sweeps/')}/test_{name}.py", *OTHERS.get(mutation.module, ())]
            passing = {test for test in told["seconds"] if test.partition("::")[0] in files}
            passing |= {test for tests in lines.values() for test in tests}
        seconds = {test: told["seconds"][test] for test in passing - set(told["failed"])}
        chosen, sofar = [], 0.0
        for test in sorted(seconds, key=seconds.get):
            sofar += seconds[test]
            if sofar > PATIENCE and chosen:
                break
            chosen.append(test)
        return chosen

    def judged(self, mutation, compiled=False, files=()):
        """What caught a mutation; nothing if nothing did."""
        plain, asked = _is_plain(mutation.module), None
        path = self.folder / f"{mutation.module}.py"
        before, dates = path.read_text(), path.stat()
        if compiled and not files:
            files = self.knowing(mutation, plain)
        elif not files:
            asked = self.asked(mutation, plain)
            files = list(dict.fromkeys(test.partition("::")[0] for test in asked))
        if not files:
            return ""
        whole = self.cache() if compiled else None
        _put(path, mutated(mutation, before))
        try:
            if compiled:
                _keep(whole, self.cache(), self.folder, mutation.module)
            limit = 600 if compiled or asked is None else 3 * PATIENCE
            status, told = self.run(plain and not compiled, files, asked, limit)
        finally:
            _put(path, before)
            os.utime(path, ns=(dates.st_atime_ns, dates.st_mtime_ns))
        if not told and status in (-signal.SIGXCPU, -signal.SIGKILL):
            return "no end"
        return (told.get("failed") or [f"status {status}"])[-1] if status not in (0, 5) else ""

    def knowing(self, mutation, plain):
        """Files of tests that know a mutation's line: its module's own first, then those with most such tests."""
        room, name = mutation.module.rsplit("/", 1)
        own = [f"tests/{room.removeprefix('sweeps/')}/test_{name}.py", *OTHERS.get(mutation.module, ())]
        passing = self.map(plain)["lines"].get(mutation.module, {}).get(str(mutation.line), ())
        most = Counter(test.partition("::")[0] for test in passing).most_common()
        found = dict.fromkeys([*own, *(file for file, _ in most)])
        return [file for file in found if (self.folder / file).exists()][:MOST_FILES]

    def cache(self):
        """Where compiled kernels of the tree lie, as it stands."""
        code = "from kernels.cache import cache_folder; print(cache_folder())"
        env = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
        env |= {"PYTHONPATH": str(self.folder), "XDG_CACHE_HOME": str(self.folder.parent)}
        run = subprocess.run([sys.executable, "-c", code], cwd=self.folder, env=env, capture_output=True, check=True)
        return Path(run.stdout.decode().strip())


def _keep(here, there, folder, module):
    """Puts what was compiled of kernels that do not import a changed module to what is compiled with it."""
    from kernels.fingerprint import sources  # of this tree, whose imports are the copy's

    changed = Path(f"{module}.py").name
    for path in (folder / "kernels").glob("*.py"):
        if changed not in {file.name for file in sources(path.stem)}:
            for file in here.glob(f"kernels_*/{path.stem}.*.nb[ic]"):
                (there / file.parent.name).mkdir(exist_ok=True)
                shutil.copy2(file, there / file.parent.name)


def _is_plain(module):
    return module.startswith("kernels/") and module.rpartition("/")[2] not in COMPILING


def _name(mutation):
    return f"{mutation} #{mutation.number}"


def _known(log):
    """What the log says of each mutation, the last word."""
    return dict(line.rsplit("\t", 1) for line in log.read_text().splitlines()) if log.exists() else {}


def equivalents():
    """The places of mutations that change nothing that anybody could see, and why."""
    lines = (ROOT / "tests" / "equivalent_mutations.txt").read_text().splitlines()
    return dict(line.split("\t") for line in lines if line and not line.startswith("#"))


def main(arguments=None):
    """Print one line a mutation, and how many were caught."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="where the copy of the tree and the log are, and stay")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="modules whose path this regular expression finds")
    parser.add_argument("--compiled", action="store_true", help="ask compiled kernels about what was not caught")
    parser.add_argument("--ask", nargs="*", default=[], help="ask these files of tests about what was not caught")
    given = parser.parse_args(arguments)
    copy, log = Copy(given.folder.resolve()), given.folder / "log.txt"
    chosen, reasons = drawn(copy.folder, given.count, given.seed, given.only), equivalents()
    copy.take(given.ask)
    known, left = _known(log), [x for x in chosen if x.place not in reasons]
    again = given.ask or given.compiled
    asked = [x for x in left if (known.get(_name(x)) == SURVIVES if again else _name(x) not in known)]
    for mutation in asked:
        told = copy.judged(mutation, given.compiled, given.ask) or SURVIVES
        with log.open("a") as file:
            file.write(f"{_name(mutation)}\t{told}\n")
    report(chosen, _known(log), reasons)


def report(chosen, known, reasons):
    """Prints what was not caught, what changes nothing, and how many there were of each."""
    judged = {_name(x): known[_name(x)] for x in chosen if _name(x) in known and x.place not in reasons}
    survivors = [name for name, told in judged.items() if told == SURVIVES]
    equivalent = [f"{x}: {reasons[x.place]}" for x in chosen if x.place in reasons]
    print(*survivors, f"{len(equivalent)} change nothing:", *equivalent, sep="\n")
    print(f"{len(judged) - len(survivors)} of {len(judged)} caught")


if __name__ == "__main__":
    main()
