"""`python -m sweeps.handbook`: makes the handbook, static HTML that opens from a disk."""

import argparse
import os
import shutil
import subprocess
import sys
from functools import partial
from importlib.util import find_spec
from pathlib import Path

NEEDED = {"sphinx": "Sphinx", "myst_nb": "MyST-NB", "sphinx_design": "sphinx-design", "furo": "Furo"}
NEEDED |= {"ipykernel": "ipykernel", "trimesh": "trimesh"}
PACKAGE = Path(__file__).parent
COLUMNS = "84"  # letters in a line of the commands' output on the pages
_say = partial(print, flush=True)


def main(arguments: list[str] | None = None) -> int:
    """Make maps, numbers, pictures and pages. Return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m sweeps.handbook", description=__doc__, allow_abbrev=False)
    parser.add_argument("-o", "--output", metavar="FOLDER", type=Path, default=Path("results/handbook"))
    parser.add_argument("--work", metavar="FOLDER", type=Path, default=Path("results/.handbook"), help="for its maps")
    numbers = "measure the numbers of the pages, write them into sweeps/handbook/text, and stop"
    parser.add_argument("--numbers", action="store_true", help=numbers)
    args = parser.parse_args(arguments)
    if missing := [name for module, name in NEEDED.items() if not args.numbers and find_spec(module) is None]:
        what = f"handbook: needs {', '.join(missing)}, which this Python has not"
        print(f"{what}; allowed: pip install -c constraints.txt -e '.[docs]'", file=sys.stderr)
        return 2
    from sweeps.schema.refusals import RefusedError

    os.environ["MPLBACKEND"] = "agg"
    work = args.work.resolve()
    work.mkdir(parents=True, exist_ok=True)
    try:
        if args.numbers:
            return _write_numbers(work)
        _make(work)
    except (RefusedError, ValueError) as refused:
        print(f"handbook: {refused}", file=sys.stderr)
        return 2
    return _html(work, args.output.resolve())


def _write_numbers(work: Path) -> int:
    """Measure the numbers of the pages and write them into their Markdown; return the exit status."""
    from sweeps.handbook import evidence, pages

    facts = evidence.measure_numbers(evidence.measure_maps(work, _say), _say)
    for page, text in pages.texts().items():
        page_text = pages.with_numbers(text, partial(evidence.as_markdown, facts))
        if page_text != text:
            (pages.TEXT / f"{page}.md").write_text(page_text, encoding="utf-8")
            _say(f"{page}: numbers written")
    return 0


def _make(work: Path) -> None:
    """Make maps, pictures, the gallery and the source folder of Sphinx below `work`."""
    from sweeps.handbook import evidence, gallery, generated, pages

    facts = evidence.make(work, _say)
    contents = gallery.make(work, _say)
    source = work / "source"
    shutil.rmtree(source, ignore_errors=True)
    shutil.copytree(pages.TEXT, source)
    for page, text in pages.texts().items():
        page_text = pages.with_numbers(text, partial(evidence.as_html, facts))
        (source / f"{page}.md").write_text(pages.as_notebook(page, page_text), encoding="utf-8")
    shutil.copytree(PACKAGE / "static", source / "static")
    shutil.copy2(PACKAGE / "conf.py", source)
    generated.write(source, work, contents)
    shutil.copytree(work / "pictures", source / "pictures")


def _html(work: Path, output: Path) -> int:
    """Run Sphinx, which runs the pages' code with `polhode` of this environment; print the warnings that stop it."""
    from sweeps.handbook import lecture

    html_folder, warnings_file = work / "html", work / "warnings.txt"
    first = {"PATH": Path(sys.executable).parent, "PYTHONPATH": PACKAGE.parents[1]}  # pages run in folders of their own
    paths = {name: os.pathsep.join(filter(None, [str(path), os.environ.get(name)])) for name, path in first.items()}
    # Jupyter requests colours, which a page cannot show
    environment = {**os.environ, **paths, "COLUMNS": COLUMNS, "TTY_COMPATIBLE": "0"}
    environment.pop("MPLBACKEND")  # a notebook's own
    settings = ("-q", "-W", "--keep-going", "-w", str(warnings_file), "-d", str(work / "doctrees"), "-j", "auto")
    command = [sys.executable, "-m", "sphinx", *settings, str(work / "source"), str(html_folder)]
    if subprocess.run(command, env=environment, check=False).returncode:
        print(
            f"handbook: stopped by these warnings of Sphinx:\n{warnings_file.read_text(encoding='utf-8')}",
            file=sys.stderr,
        )
        return 1
    shutil.rmtree(output, ignore_errors=True)
    shutil.copytree(html_folder, output, ignore=shutil.ignore_patterns(".buildinfo", ".doctrees"))
    print(lecture.write(output))
    print(output / "index.html")
    return 0


if __name__ == "__main__":
    sys.exit(main())
