"""Do the tests bite? Random mutations of the kernels by cosmic-ray, in a copy of the tree.

    pip install -c constraints.txt -e . --group mutations
    python tests/mutations.py FOLDER [--count 20] [--seed 1] [--only measure]

Each mutation is one change of the kind that a slip of the hand makes: another sign, another comparison, a number one
off. The quick tests that are named in `TESTS` then run with kernels as plain Python, and should fail. FOLDER keeps the
copy and the sessions: `cr-report --surviving-only --show-diff FOLDER/NAME.sqlite` shows the undetected mutations.
"""

import argparse
import random
import re
import shutil
import subprocess
import sys
from pathlib import Path

from cosmic_ray import work_db

ROOT = Path(__file__).parents[1]
TESTS = {  # of modules without a test file of their own name, or with a better test file
    "sincos": ["attitude"],
    "estimates": ["near_axis_block", "survey"],
    "linear": ["linear_columns"],
    "near_axis_block": ["survey"],
    "elliptic_constants": ["exact"],
    "taylor": ["direct", "attitude"],
    "uncertainty": ["reduction", "survey"],
}
WITHOUT_COMPILER = {"cache", "fingerprint", "jit", "plain", "llvm_formulas"}  # their tests need the compiler
CONFIGURATION = """
[cosmic-ray]
module-path = ["{path}"]
timeout = 180.0
excluded-modules = []
test-command = "env NUMBA_DISABLE_JIT=1 {python} -m pytest -x -q -n 0 -p no:cacheprovider {files}"
[cosmic-ray.distributor]
name = "local"
[cosmic-ray.filters.operators-filter]
exclude-operators = ["core/Replace.*_(BitOr|BitAnd|BitXor|LShift|RShift|FloorDiv|Pow|Mod)", "core/RemoveDecorator"]
"""


def files_of(name):
    """Return the test files that are run for a mutated kernel."""
    files = [f"tests/kernels/test_{stem}.py" for stem in dict.fromkeys([name, *TESTS.get(name, ())])]
    return [file for file in files if (ROOT / file).exists()]


def run(folder, module, *arguments):
    """Run a tool of cosmic-ray in a folder."""
    subprocess.run([sys.executable, "-m", module, *arguments], cwd=folder, check=True)


def sample(session, count, rng):
    """Leave `count` random mutations in a session."""
    with work_db.use_db(session, work_db.WorkDB.Mode.open) as db:
        items = sorted(db.pending_work_items, key=lambda item: repr(item.mutations))
        db.clear()
        db.add_work_items(rng.sample(items, min(count, len(items))))


def survivors(session):
    """Return (number of mutations, number not caught) of a session."""
    with work_db.use_db(session, work_db.WorkDB.Mode.open) as db:
        results = [result for _, result in db.completed_work_items]
        return len(results), sum(not result.is_killed for result in results)


def main():
    """Print a line for each module: mutations, and how many of them no test has noticed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="where the copy of the tree and the sessions are")
    parser.add_argument("--count", type=int, default=20, help="mutations of each module (default 20)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="modules whose name this regular expression finds")
    arguments = parser.parse_args()
    copy = arguments.folder.resolve() / "polhode"
    shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns(".git", ".venv", "results", "__pycache__"))
    for path in sorted((copy / "kernels").rglob("*.py")):
        name = path.stem
        if not files_of(name) or name in WITHOUT_COMPILER or not re.search(arguments.only, name):
            continue
        config, session = (str(copy.parent / f"{name}.{suffix}") for suffix in ("toml", "sqlite"))
        text = CONFIGURATION.format(path=path.relative_to(copy), python=sys.executable, files=" ".join(files_of(name)))
        Path(config).write_text(text)
        run(copy, "cosmic_ray.cli", "init", config, session)
        run(copy, "cosmic_ray.tools.filters.operators_filter", session, config)
        sample(session, arguments.count, random.Random(f"{arguments.seed} {name}"))
        run(copy, "cosmic_ray.cli", "exec", config, session)
        num_mutations, num_survivors = survivors(session)
        print(f"{name}: {num_mutations - num_survivors} of {num_mutations} caught", flush=True)


if __name__ == "__main__":
    main()
