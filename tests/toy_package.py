"""The toy system of tests/toy as an installed package: metadata with its entry point, as pip writes it."""

import tomllib
from pathlib import Path

TOY = Path(__file__).parent / "toy"


def write_metadata(folder: Path) -> None:
    """Write the metadata of an installation to a folder on the path: the package's name and its entry points."""
    project = tomllib.loads((TOY / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    metadata = folder / f"{project['name']}-{project['version']}.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    )
    ((group, systems),) = project["entry-points"].items()
    lines = [f"[{group}]", *(f"{name} = {module}" for name, module in systems.items())]
    (metadata / "entry_points.txt").write_text("\n".join(lines))
