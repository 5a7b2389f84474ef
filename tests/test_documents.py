import re
from importlib import import_module
from operator import attrgetter
from pathlib import Path

import numpy as np
import pytest

import sweeps
from sweeps import systems
from sweeps.handbook import generated

ROOT = Path(__file__).parents[1]
CONTRACT = ROOT / "results" / "README.md"
TABLES = re.findall(r"<!-- (\w+ [\w.]+): a test compares", CONTRACT.read_text(encoding="utf-8"))


def rows(table):
    """Lines of a table, "SYSTEM TABLE" in its module: name, units and meaning of each variable."""
    system, _, name = table.partition(" ")
    truth = attrgetter(name)(import_module(f"sweeps.systems.{system}.system"))
    return [f"| {name} | {' | '.join(generated.meaning(variable))} |" for name, variable in truth.items()]


@pytest.mark.parametrize("table", TABLES)
def test_data_contract_for_readers_is_the_table_of_the_code(table):
    """`python tests/test_documents.py` writes the tables again."""
    text = CONTRACT.read_text(encoding="utf-8").split(f"<!-- {table}:")[1].split("\n\n")[1]
    assert text.splitlines()[2:] == rows(table)


def test_every_system_has_its_tables():
    described = {"oscillator", "periodic", "relative_equilibrium"}
    for name in {*systems.MODULES, *described}:
        assert {f"{name} VARIABLES"} < {table for table in TABLES if table.startswith(f"{name} ")}


def test_readme_names_the_two_lines():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    lines = re.findall(r"^python3 -m venv .*$", text, re.MULTILINE)
    assert len(lines) == 2
    assert lines[0].endswith("-e . && .venv/bin/snakemake --cores 2")
    assert lines[1].endswith("-e . --group test && .venv/bin/pytest")


def test_constraints_pin_versions_and_name_no_address():
    for line in (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines():
        assert re.fullmatch(r"[A-Za-z0-9._-]+==[A-Za-z0-9.+!]+", line), line


@pytest.mark.slow
def test_a_new_system_from_its_page(tmp_path, monkeypatch):
    """The page's files, unchanged, checked and measured; against a derivation by hand."""
    page = (ROOT / "sweeps" / "mechanics" / "README.md").read_text(encoding="utf-8")
    assert len(page.splitlines()) <= 40
    (code,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    (text,) = re.findall(r"```yaml\n(.*?)```", page, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    Path("buckling.py").write_text(code, encoding="utf-8")
    Path("buckling.yaml").write_text(text, encoding="utf-8")
    ds = sweeps.survey("buckling.yaml").squeeze()
    middle = (ds["stiffness"] * (1 - 1 / ds["distance"])).transpose(*ds["omega_squared"].dims[:2])
    bound = ds["rate_scale"].sel(equilibrium="middle").values ** 2
    deviation = np.abs(ds["omega_squared"].sel(equilibrium="middle").values - middle.values)
    assert (deviation <= 1e-9 * bound).all()
    right = ds.sel(equilibrium="right", distance=ds["distance"][ds["distance"] < 0.99])
    expected = right["stiffness"] * (1 - right["distance"] ** 2)
    assert np.abs(right["omega_squared"] / expected - 1).max() <= 1e-9


def test_what_leads_out_of_the_documents_is_a_whole_address():
    """Without a network only the form can be checked; today no link leads out."""
    pages = [*ROOT.glob("*.md"), ROOT / "results" / "README.md"]
    pages += [path for kind in ("md", "html") for path in (ROOT / "sweeps").rglob(f"*.{kind}")]
    for path in pages:
        for target in re.findall(r"(?:\]\(|href=\"|src=\")(\w+:[^)\"\s]*)", path.read_text(encoding="utf-8")):
            assert re.fullmatch(r"https://[\w-]+(\.[\w-]+)+(/\S*)?", target), (path.name, target)


if __name__ == "__main__":
    text = CONTRACT.read_text(encoding="utf-8")
    for table in TABLES:
        lines = "".join(f"{row}\n" for row in rows(table))
        text = re.sub(rf"(<!-- {table}:.*\n\n.*\n.*\n)(?:\|.*\n)*", lambda m, lines=lines: m[1] + lines, text)
    CONTRACT.write_text(text, encoding="utf-8")
