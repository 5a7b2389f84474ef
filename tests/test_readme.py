"""Every command of README.md, and of the handbook's pages that are not run when it is built, run in a copy."""

import re
import shlex
from pathlib import Path

import compiled
import pytest

import sweeps
from sweeps.maps import storage

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
HOWTO = ("bodies", "parts", "robots", "check-cases", "points", "python", "report")
PAGES = (*(f"howto/{name}" for name in HOWTO), "tutorials/cluster")
TEXT = "\n".join([README, *((ROOT / f"sweeps/handbook/text/{page}.md").read_text(encoding="utf-8") for page in PAGES)])
BLOCK = re.compile(r"(?:<!-- run by (\S+) -->\n\n)?```sh\n(.*?)```", re.DOTALL)
ELSEWHERE = {
    "python3 -m venv": ".ci/run",
    ".venv/bin/pip install": ".ci/run",
    ".venv/bin/snakemake --cores 2 handbook": "tests/test_handbook.py",
}


def commands():
    """The lines of the shell blocks that are not run elsewhere."""
    for place, text in BLOCK.findall(TEXT):
        for line in text.splitlines():
            elsewhere = place or next((where for start, where in ELSEWHERE.items() if line.startswith(start)), "")
            if not elsewhere:
                yield line


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The repository, the default map, and the files that a reader of the README has."""
    trimesh = pytest.importorskip("trimesh")
    folder = compiled.copy_sources(tmp_path_factory.mktemp("readme"))
    compiled.share(folder, folder / ".cache")
    large = folder / "sweeps/definitions/gravity_gradient.yaml"
    large.write_text(re.sub(r"num: \d+", "num: 9", large.read_text()))  # its points take minutes
    trimesh.creation.box((0.27, 0.2, 0.01)).export(folder / "racket.stl")
    (folder / "my.yaml").write_text(re.search(r"```yaml\n(title: A brick\n.*?)```", TEXT, re.DOTALL)[1])
    (folder / "cubesat.yaml").write_text(re.search(r"```yaml\n(name: CubeSat\n.*?)```", TEXT, re.DOTALL)[1])
    (folder / "parts.csv").write_text(re.search(r"```csv\n(.*?)```", TEXT, re.DOTALL)[1])
    (folder / "arm.urdf").write_text(re.search(r"```xml\n(.*?)```", TEXT, re.DOTALL)[1])
    (folder / "results/tennis_racket").mkdir(parents=True)
    storage.write_map(sweeps.survey("tennis_racket", threads=2), folder / "results/tennis_racket/stability_map.nc")
    return folder


def run(folder, line):
    program, *arguments = shlex.split(line)
    module = {".venv/bin/python": [], ".venv/bin/snakemake": ["-m", "snakemake"], ".venv/bin/polhode": ["-m", "sweeps"]}
    return compiled.run(folder, *module[program], *arguments)


def make_what_it_reads(folder, line):
    """A reader has run the line above it; a test may be alone, or in another process."""
    for name in re.findall(r" results/(\w+)/stability_map.nc", line):
        if not (folder / f"results/{name}/stability_map.nc").exists():
            definition = f"{name}.yaml" if (folder / f"{name}.yaml").exists() else name
            process = run(folder, f".venv/bin/polhode run {definition}")
            assert process.returncode == 0, process.stderr


@pytest.mark.slow
@pytest.mark.parametrize("line", list(commands()))
def test_a_command_of_the_readme_does_what_it_says(folder, line):
    make_what_it_reads(folder, line)
    answer = run(folder, line)
    assert answer.returncode == 0, answer.stderr
    assert "Traceback" not in answer.stderr


@pytest.mark.slow
def test_the_bodies_of_the_readme_are_a_definition(folder):
    text = re.search(r"```yaml\n(bodies:\n.*?)```", TEXT, re.DOTALL)[1]
    (folder / "real.yaml").write_text(text)
    answer = run(folder, ".venv/bin/polhode check real.yaml")
    assert answer.returncode == 0, answer.stderr
    assert "Satellite: principal moments and axes" in answer.stdout


@pytest.mark.slow
def test_the_python_of_the_readme_runs(folder, monkeypatch):
    monkeypatch.chdir(folder)
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
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", README):
        assert target.startswith("http") or (ROOT / target).exists(), target


@pytest.mark.parametrize("package", ["kernels", "sweeps"])
def test_another_package_of_our_names_is_reported(package, tmp_path):
    """Another project's package was installed over ours: its __init__.py in place of ours, or before it on the path."""
    folder = compiled.copy_sources(tmp_path)
    (folder / package / "__init__.py").write_text("")
    answer = compiled.run(folder, "-m", "sweeps", "--version")
    assert answer.returncode != 0
    assert f"{package}: {folder / package / '__init__.py'} is another package" in answer.stderr.splitlines()[-1]
