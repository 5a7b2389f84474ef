import re
from pathlib import Path

import pytest

from sweeps.systems import rigid_body, symmetric_top

ROOT = Path(__file__).parents[1]


def table(marker):
    """Rows {first cell: (second, third)} of the Markdown table behind a comment."""
    text = (ROOT / "results" / "README.md").read_text(encoding="utf-8").split(f"<!-- {marker}:")[1].split("\n\n")[1]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines()[2:]]
    return {name: (units, meaning) for name, units, meaning in cells}


@pytest.mark.parametrize(
    ("marker", "truth"),
    [
        ("coordinates", rigid_body.COORDINATES),
        ("variables", rigid_body.VARIABLES),
        ("certificate", rigid_body.CERTIFICATE),
        ("flips", rigid_body.FLIPS),
        ("symmetric top, coordinates", symmetric_top.COORDINATES),
        ("symmetric top, variables", symmetric_top.VARIABLES),
    ],
)
def test_data_contract_for_readers_is_the_table_of_the_code(marker, truth):
    told = table(marker)
    assert list(told) == list(truth)
    for name, variable in truth.items():
        units, meaning = told[name]
        assert units == (variable.units or ("flags" if variable.flags else "text"))
        assert meaning.startswith(variable.long_name)
        assert all(flag in meaning for flag in variable.flags)


def test_readme_names_the_two_lines():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    lines = re.findall(r"^python3 -m venv .*$", text, re.MULTILINE)
    assert len(lines) == 2
    assert lines[0].endswith("-e . && .venv/bin/snakemake --cores 2")
    assert lines[1].endswith("-e '.[test]' && .venv/bin/pytest")


def test_constraints_pin_versions_and_name_no_address():
    for line in (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines():
        assert re.fullmatch(r"[A-Za-z0-9._-]+==[A-Za-z0-9.+!]+", line), line
