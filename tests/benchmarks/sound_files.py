"""Sound files of three engines, in double and single precision, of ten to a million rows: verdicts of `certify`.

    PYTHONPATH=.:tests python tests/benchmarks/sound_files.py [--bodies 6] [--rows 10,1000,1000000]

The engines are SciPy's DOP853, the splitting of McLachlan and Reich (three turns about principal axes, symplectic, of
second order) with small steps, and the classical Runge-Kutta method. Each has a tolerance that its errors meet; single
precision adds a hundred resolutions, for the motion amplifies them.
"""

import argparse
from collections import Counter

import numpy as np
import planted_faults
from scipy.integrate import solve_ivp
from trajectories import table

import sweeps

TOLERANCES = {"DOP853": 1e-8, "splitting": 3e-4, "Runge-Kutta": 1e-6}
SINGLE = 2e-4  # tolerance of single precision: 2 ulp of the rates over 40 rad of motion, amplified some tenfold
STEP = 2e-3  # rad, of the splitting; of the Runge-Kutta method ten times as much


def derivative(y, moments):
    """Free rotation of w and q, (n, 7)."""
    w, q = y[..., :3], y[..., 3:]
    turn = np.concatenate([-np.sum(q[..., 1:] * w, -1, keepdims=True), q[..., :1] * w + np.cross(q[..., 1:], w)], -1)
    return np.concatenate([np.cross(moments * w, w) / moments, turn / 2], -1)


def dop853(moments, start, q0, times):
    """Rows by SciPy's DOP853."""
    options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13, "t_eval": times}
    return solve_ivp(lambda t, y: derivative(y, moments), times[[0, -1]], [*start, *q0], **options).y.T


def runge_kutta(moments, start, q0, times):
    """Rows by the classical Runge-Kutta method."""
    y, rows = np.array([*start, *q0]), []
    for k, t in enumerate(times):
        span = t - times[k - 1] if k else 0.0
        steps = max(1, int(np.ceil(span / (10 * STEP))))
        h = span / steps
        for _ in range(steps if k else 0):
            k1 = derivative(y, moments)
            k2 = derivative(y + h / 2 * k1, moments)
            k3 = derivative(y + h / 2 * k2, moments)
            y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + derivative(y + h * k3, moments))
        rows.append(y)
    return np.array(rows)


def splitting(moments, start, q0, times):
    """Rows by turns about the principal axes 1, 2, 3, 2, 1: exact for each term of the energy."""
    L, q, rows = moments * start, np.array(q0), []
    for k, t in enumerate(times):
        span = t - times[k - 1] if k else 0.0
        steps = max(1, int(np.ceil(span / STEP)))
        for _ in range(steps if k else 0):
            for axis, part in ((0, 0.5), (1, 0.5), (2, 1.0), (1, 0.5), (0, 0.5)):
                angle = part * span / steps * L[axis] / moments[axis]
                j, m = (axis + 1) % 3, (axis + 2) % 3
                c, s = np.cos(angle), np.sin(angle)
                L[j], L[m] = c * L[j] + s * L[m], c * L[m] - s * L[j]
                c, s = np.cos(angle / 2), np.sin(angle / 2)
                a, b, j, m = 0, axis + 1, j + 1, m + 1
                q[a], q[b], q[j], q[m] = (
                    c * q[a] - s * q[b],
                    c * q[b] + s * q[a],
                    c * q[j] + s * q[m],
                    c * q[m] - s * q[j],
                )
        rows.append(np.array([*(L / moments), *q]))
    return np.array(rows)


ENGINES = {"DOP853": dop853, "splitting": splitting, "Runge-Kutta": runge_kutta}


def columns(engine, moments, start, q0, times):
    """Columns of a sound file in double precision: rates and normalised attitudes."""
    y = ENGINES[engine](moments, start, q0, times)
    y[:, 3:] /= np.linalg.norm(y[:, 3:], axis=1, keepdims=True)
    return table({"t": times, "w": y[:, :3], "q": y[:, 3:]})


def in_single_precision(run):
    """The motion in single precision, with its times in double precision."""
    return {name: column if name == "time" else column.astype(np.float32) for name, column in run.items()}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bodies", type=int, default=6)
    parser.add_argument("--rows", default="10,1000,100000")
    args = parser.parse_args()
    for engine in ENGINES:
        for number in map(int, args.rows.split(",")):
            times = np.linspace(0.0, min(40.0, 0.05 * number) if number < 1000 else 40.0, number)
            verdicts = {False: Counter(), True: Counter()}
            for moments, start, q0, _ in planted_faults.bodies(args.bodies):
                double = columns(engine, moments, start, q0, times)
                for is_single, counter in verdicts.items():
                    run = in_single_precision(double) if is_single else double
                    tolerance = max(TOLERANCES[engine], SINGLE if is_single else 0.0)
                    facts = sweeps.certify(run, moments.tolist(), tolerance=tolerance).attrs
                    counter[facts["verdict"]] += 1
                    if facts["verdict"] == "ill_conditioned" and facts["conditioning_rad"] <= tolerance:
                        print("ill-conditioned although the conditioning is below the tolerance")
            print(
                f"{engine:12} {number:8,} rows  double {dict(verdicts[False])}  single {dict(verdicts[True])}",
                flush=True,
            )


if __name__ == "__main__":
    main()
