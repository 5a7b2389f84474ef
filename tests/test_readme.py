"""Every command of README.md, and of the handbook's pages that are not run when it is built, run in a folder."""

import re
import shlex
from pathlib import Path

import compiled
import pytest

import sweeps
from sweeps.__main__ import main
from sweeps.maps import storage

ROOT = Path(__file__).parents[1]
HOWTO = ("bodies", "parts", "robots", "check-cases", "points", "python", "report")
PAGES = ("README", *(f"sweeps/handbook/text/howto/{n}" for n in HOWTO), "sweeps/handbook/text/tutorials/cluster")
TEXTS = {page: (ROOT / f"{page}.md").read_text(encoding="utf-8") for page in PAGES}
TEXT = "\n".join(TEXTS.values())
BLOCK = re.compile(r"(?:<!-- run by (\S+) -->\n\n)?```sh\n(.*?)```", re.DOTALL)
ELSEWHERE = {
    "python3 -m venv": ".ci/run",
    ".venv/bin/pip install": ".ci/run",
    ".venv/bin/snakemake --cores 2 handbook": "tests/test_handbook.py",
}


def commands(page):
    """Yield the lines of the shell blocks of a page that are not run elsewhere."""
    for place, text in BLOCK.findall(TEXTS[page]):
        for line in text.splitlines():
            if not place and not line.startswith((*ELSEWHERE,)):
                yield line


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The current folder, with a map and the files that a reader of the README has."""
    trimesh = pytest.importorskip("trimesh")
    monkeypatch.chdir(tmp_path)
    trimesh.creation.box((0.27, 0.2, 0.01)).export("racket.stl")
    Path("my.yaml").write_text(re.search(r"```yaml\n(title: A brick\n.*?)```", TEXT, re.DOTALL)[1])
    Path("cubesat.yaml").write_text(re.search(r"```yaml\n(name: CubeSat\n.*?)```", TEXT, re.DOTALL)[1])
    Path("parts.csv").write_text(re.search(r"```csv\n(.*?)```", TEXT, re.DOTALL)[1])
    Path("arm.urdf").write_text(re.search(r"```xml\n(.*?)```", TEXT, re.DOTALL)[1])
    Path("results/tennis_racket").mkdir(parents=True)
    storage.write_map(sweeps.survey("tiny"), "results/tennis_racket/stability_map.nc")
    return tmp_path


@pytest.mark.slow
@pytest.mark.usefixtures("folder", "few_frames")
@pytest.mark.parametrize("page", [page for page in PAGES if [*commands(page)]])
def test_the_commands_of_a_page_do_what_it_says_in_their_order(page, capsys):
    for line in commands(page):
        program, *words = shlex.split(line)
        assert program == ".venv/bin/polhode"
        assert main(words) == 0, f"{line}: {capsys.readouterr().err}"


@pytest.mark.slow
@pytest.mark.usefixtures("folder")
def test_the_bodies_of_the_readme_are_a_definition(capsys):
    Path("real.yaml").write_text(re.search(r"```yaml\n(bodies:\n.*?)```", TEXT, re.DOTALL)[1])
    assert main(["check", "real.yaml"]) == 0, capsys.readouterr().err
    assert "Satellite: principal moments and axes" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.usefixtures("folder")
def test_the_python_of_the_readme_runs():
    exec(re.search(r"```python\n(import sweeps\n\nds = .*?)```", TEXT, re.DOTALL)[1], {})


def test_what_runs_elsewhere_is_there():
    for place, text in BLOCK.findall(TEXT):
        for line in text.splitlines():
            if place:
                # a script by its name, a profile by its folder
                what = next(word for word in shlex.split(line) if word.endswith(".py") or word.startswith(".slurm"))
                assert Path(what).name.removesuffix(".py") in (ROOT / place).read_text(encoding="utf-8")
    assert ".ci/run" in ELSEWHERE.values()
    assert "python3 -m venv" in (ROOT / ".ci/run").read_text(encoding="utf-8")


def test_links_and_pictures_of_the_readme_are_there():
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", TEXTS["README"]):
        assert target.startswith("http") or (ROOT / target).exists(), target


@pytest.mark.parametrize("package", ["kernels", "sweeps"])
def test_another_package_of_our_names_is_reported(package, tmp_path):
    """Another project's package was installed over ours: its __init__.py in place of ours, or before it on the path."""
    folder = compiled.copy_sources(tmp_path)
    (folder / package / "__init__.py").write_text("")
    answer = compiled.run(folder, "-m", "sweeps", "--version")
    assert answer.returncode != 0
    assert f"{package}: {folder / package / '__init__.py'} is another package" in answer.stderr.splitlines()[-1]
