import re
from pathlib import Path

import numpy as np
import pytest

import sweeps
from sweeps.handbook import generated
from sweeps.systems.dissipative_body import system as dissipative
from sweeps.systems.observed_periods import system as observed_periods
from sweeps.systems.orbit import system as orbit
from sweeps.systems.oscillator import system as oscillator
from sweeps.systems.periodic import system as periodic
from sweeps.systems.pumped_body import system as pumped_body
from sweeps.systems.relative_equilibrium import system as relative
from sweeps.systems.rigid_body import system as rigid_body
from sweeps.systems.symmetric_top import system as symmetric_top
from sweeps.systems.tumbling import system as tumbling
from sweeps.systems.twist import system as twist
from sweeps.systems.uncertain_bodies import system as uncertain

ROOT = Path(__file__).parents[1]
CONTRACT = ROOT / "results" / "README.md"
TABLES = [  # marker in results/README.md, and the variables of the code
    ("coordinates", rigid_body.LAYOUT.coordinates),
    ("variables", rigid_body.VARIABLES),
    ("terms", rigid_body.TERMS),
    ("certificate", rigid_body.CERTIFICATE),
    ("flips", rigid_body.FLIPS),
    ("in space", rigid_body.IN_SPACE),
    ("symmetric top, coordinates", symmetric_top.LAYOUT.coordinates),
    ("symmetric top, variables", symmetric_top.VARIABLES),
    ("twist, coordinates", twist.LAYOUT.coordinates),
    ("twist, variables", twist.VARIABLES),
    ("tumbling, coordinates", tumbling.LAYOUT.coordinates),
    ("tumbling, variables", tumbling.VARIABLES),
    ("dissipative body, coordinates", dissipative.LAYOUT.coordinates),
    ("dissipative body, variables", dissipative.VARIABLES),
    ("observed periods, coordinates", observed_periods.LAYOUT.coordinates),
    ("observed periods, variables", observed_periods.VARIABLES),
    ("pumped body, coordinates", pumped_body.COORDINATES),
    ("pumped body, variables", pumped_body.VARIABLES),
    ("orbit, coordinates", orbit.COORDINATES),
    ("orbit, variables", orbit.VARIABLES),
    ("periodic, coordinates", periodic.COORDINATES),
    ("periodic, variables", periodic.VARIABLES),
    ("periodic, invariants", periodic.INVARIANTS),
    ("periodic, branch", periodic.BRANCH),
    ("uncertain bodies, coordinates", uncertain.COORDINATES),
    ("uncertain bodies, variables", uncertain.VARIABLES),
    ("uncertain bodies, twists", uncertain.TWISTS),
    ("uncertain bodies, kept", uncertain.DRAW_VARIABLES),
    ("oscillator coordinates", oscillator.COORDINATES),
    ("oscillator variables", oscillator.VARIABLES),
    ("oscillator degenerate", oscillator.DEGENERATE),
    ("oscillator followed", oscillator.BRANCHES),
    ("relative equilibrium coordinates", relative.COORDINATES),
    ("relative equilibrium variables", relative.VARIABLES),
    ("relative equilibrium invariants", relative.INVARIANTS),
]


def rows(truth):
    """Lines of a table: name, units and meaning of each variable."""
    return [f"| {name} | {' | '.join(generated.meaning(variable))} |" for name, variable in truth.items()]


@pytest.mark.parametrize(("marker", "truth"), TABLES)
def test_data_contract_for_readers_is_the_table_of_the_code(marker, truth):
    """`python tests/test_documents.py` writes the tables again."""
    table = CONTRACT.read_text(encoding="utf-8").split(f"<!-- {marker}:")[1].split("\n\n")[1]
    assert table.splitlines()[2:] == rows(truth)


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
    for marker, truth in TABLES:
        lines = "".join(f"{row}\n" for row in rows(truth))
        text = re.sub(rf"(<!-- {marker}:.*\n\n.*\n.*\n)(?:\|.*\n)*", lambda m, lines=lines: m[1] + lines, text)
    CONTRACT.write_text(text, encoding="utf-8")
