"""Every public function of Polhode with the types of its arguments and of its result, for :mod:`test_types`.

Run by hand, it writes the files of `sweeps.run` to the current folder.
"""

from pathlib import Path
from typing import Any

import sympy as sp
import xarray as xr
from matplotlib.axes import Axes

import sweeps
from sweeps.mechanics import DescriptionError, System
from sweeps.systems.uncertain_bodies.body_answer import BodyAnswer


def describe_pendulum() -> System:
    """Return a pendulum of unit length."""
    system = System("Pendulum of unit length")
    gravity: sp.Symbol = system.parameter("gravity", "m s-2", default=9.80665, positive=True)
    theta: sp.Symbol = system.coordinate("theta", "rad", bounds=(-sp.pi, sp.pi), periodic=True)
    system.particle(1, (sp.sin(theta), -sp.cos(theta)))
    system.potential(-gravity * sp.cos(theta))
    system.equilibrium("hanging", {theta: 0})
    return system


def main() -> None:
    """Call the functions."""
    version: str = sweeps.__version__
    ds: xr.Dataset = sweeps.survey(I1=1.0, I2=[1.5, 2.0], I3=[2.5, 3.0], omega0="30 rpm")
    lazy_ds: xr.Dataset = sweeps.survey({"grid": {"I1": 1.0, "I2": 2.0, "I3": 2.5, "omega0": 1.0}}, chunks="auto")
    files: list[Path] = sweeps.run("tiny", cores=1)
    stored_ds: xr.Dataset = sweeps.open_map(files[0])
    digest: str = sweeps.content_hash(stored_ds)
    row: xr.Dataset = sweeps.point(ds, axis=2, I2=1.9, I3=2.5)

    answer: BodyAnswer = sweeps.body([1.0, 2.0, 2.5], omega0="30 rpm", epsilon=1e-3)
    name: str = answer.name
    facts: dict[str, Any] = answer.facts
    draws: xr.Dataset = sweeps.uncertainty([1.0, 2.0, 2.1], "5 %", omega0=1.0, draws=64)
    energies: xr.Dataset = sweeps.tumbler(368.7, "67.27 h", sigma_psi=0.5)
    modes: list[dict[str, Any]] = sweeps.tumbler(368.7, "67.27 h", ratios=(0.36, 0.96))

    spin: xr.Dataset = sweeps.motion([1.0, 2.0, 2.5], [0.1, 1.0, 0.2], "20 s")
    flip: xr.Dataset = sweeps.motion(row)
    swing: xr.Dataset = sweeps.motion(describe_pendulum(), {"theta": "170 deg"}, [0.0, 1.0])
    verdict: xr.Dataset = sweeps.certify(spin, [1.0, 2.0, 2.5], tolerance=1e-6)

    ax: Axes = sweeps.plot.stability(ds, axis=2, at={"I1": 1.0})
    polhodes: Axes = sweeps.plot.polhodes(ds)
    drawn: Axes = sweeps.plot.draw(ds, "theory_against_measured")
    summary: str = sweeps.plot.Polhode(ds).summary()
    print(version, digest, name, facts, modes, summary, ax, polhodes, drawn)
    print(lazy_ds, draws, energies, flip, swing, verdict)

    refusals: tuple[type[ValueError], ...] = (sweeps.DefinitionError, sweeps.MapError, DescriptionError)
    try:
        sweeps.survey(I1=-1.0)
    except refusals as refused:
        print(refused)


if __name__ == "__main__":
    main()
