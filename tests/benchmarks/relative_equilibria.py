"""What relative equilibria hold: spectra against books, errors and coverage, invariants, drifts, points per second.

    python tests/benchmarks/relative_equilibria.py [--points N] [system …]

Each system that ships at random places of its parameters, against the polynomials of `tests/relative.py`. All
distances are over the system's scale. Seconds are those of one core's processor, warm; a point is one eigenvalue of
one equilibrium, as in a map. Nothing is asserted.
"""

import argparse
import sys
import warnings
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

import oscillations
import relative
from timing import least

from sweeps.mechanics.model import Model

ROUNDS = 3
TIMED = 8192  # places of the parameters at which points are counted per second, about as many as in a shard
COLUMNS = (
    *("states", "theory", "error", "worst", "covered", "invariants", "drift", "regimes", "ok"),
    *("operations", "points/s"),
)
WHOLE = ("states", "operations", "points/s")


def _coefficients(found, suffix, n):
    roots = (found[f"eigenvalue_real{suffix}"] + 1j * found[f"eigenvalue_imag{suffix}"]).reshape(-1, n)
    return np.array([np.poly(row).real for row in roots])


def _books(name, columns, n):
    rows = range(0, len(columns["epsilon"]), n)
    points = ({k: v[i] for k, v in columns.items()} for i in rows)
    return np.array([np.real(relative.polynomial(name, point, int(point["equilibrium"]))) for point in points])


def measure(name: str, count: int) -> dict[str, float]:
    """The figures of one system at so many places.

    Returns:
        `theory`: the largest distance of a coefficient of theory's polynomial from the book's; `error`: the median
        error told, `worst`: the ratio of distance and error at its largest; `covered`: share of eigenvalues within
        their errors; `invariants`: the largest error of S, D and S² - 4D; `drift`: of what is conserved; `regimes`:
        share that are theory's; `ok`: share of points whose status is; `operations`: multiplications and additions of
        one generated step; `points/s`.
    """
    model = Model(relative.shipped(name))
    columns = relative.points(model.system, model.n, count, relative.RANGES[name])
    many = relative.points(model.system, model.n, TIMED // model.system.most, relative.RANGES[name])
    found, (seconds,) = model.survey(columns), least(ROUNDS, lambda: model.survey(many))
    ok, S, n = found["status"] == 0, found["rate_scale"], model.n
    powers = S[::n, None] ** np.arange(n + 1)
    theory = np.abs(_coefficients(found, "_theory", n) - _books(name, columns, n)) / powers
    errors = [found[f"eigenvalue_{part}_error"][ok] for part in ("real", "imag")]
    off = [np.abs(found[f"eigenvalue_{p}"] - found[f"eigenvalue_{p}_theory"])[ok] for p in ("real", "imag")]
    error, distance = np.concatenate(errors), np.concatenate(off)
    powered = (("sum_of_squares", 2), ("product_of_squares", 4), ("discriminant", 4)) if n == 4 else ()
    return {
        "states": n,
        "theory": float(theory[ok[::n]].max()),
        "error": float(np.median(error / np.tile(S[ok], 2))),
        "worst": float((distance / error).max()),
        "covered": float((distance <= error).mean()),
        "invariants": max((float((found[f"{v}_error"] / S**k)[ok].max()) for v, k in powered), default=np.nan),
        "drift": max((float(np.nanmax(found[f"{q}_drift"][ok])) for q in model.quantities), default=np.nan),
        "regimes": float((found["regime"] == found["regime_theory"])[ok].mean()),
        "ok": float(ok.mean()),
        "operations": oscillations.operations(model.code.text),
        "points/s": len(many["epsilon"]) / seconds,
    }


def main(arguments: list[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("systems", nargs="*", default=list(relative.RANGES))
    parser.add_argument("--points", type=int, default=400, help="places of the parameters, of each system")
    chosen = parser.parse_args(arguments)
    warnings.simplefilter("ignore")  # roots of a real polynomial as complex numbers
    print(f"{'system':24s}", *(f"{name:>12s}" for name in COLUMNS))
    for name in chosen.systems:
        told = measure(name, chosen.points)
        numbers = (f"{told[key]:12.0f}" if key in WHOLE else f"{told[key]:12.3g}" for key in COLUMNS)
        print(f"{name:24s}", *numbers, flush=True)


if __name__ == "__main__":
    main()
