"""Faults planted in trajectories of random bodies, and the words by which `certify` names them: a confusion table.

    PYTHONPATH=.:tests python tests/benchmarks/planted_faults.py [--bodies 20] [--kinds torque,noise]

Bodies are far from steady spins and from the separatrix, so that each fault can be told apart.
"""

import argparse
from collections import Counter

import numpy as np
from scipy.spatial.transform import Rotation
from trajectories import exact_rows, integrate_rows, table

import sweeps
from kernels.free import exact

SEED = 20261128
TIMES = np.linspace(0.0, 40.0, 401)
TOLERANCE = 1e-6


def bodies(number):
    """Yields moments, start and first attitude of random asymmetric bodies."""
    rng = np.random.default_rng(SEED)
    while number:
        a, b = np.sort(rng.uniform(0.15, 0.95, 2))
        if not (a + b > 1.05 and b - a > 0.08):
            continue
        moments = rng.permutation([a, b, 1.0]) * rng.choice([1e-3, 1.0, 250.0])
        start = rng.normal(size=3)
        start *= rng.uniform(0.7, 1.5) / np.linalg.norm(start)
        top = exact.set_up(*moments, *start)
        if top.m1 < 0.1 or np.abs(start).min() < 0.15:
            continue
        number -= 1
        yield moments, start, Rotation.random(rng=rng).as_quat(scalar_first=True), rng


def euler(moments, start, q0, steps, semi_implicit):
    """Euler's method with so many steps a row."""
    w, q, h = start.copy(), q0.copy(), TIMES[1] / steps
    rows = [(w, q)]
    for _ in TIMES[1:]:
        for _ in range(steps):
            new = w + h * np.cross(moments * w, w) / moments
            v = new if semi_implicit else w
            q = q + h / 2 * np.array([-q[1:] @ v, *(q[0] * v + np.cross(q[1:], v))])
            w, q = new, q / np.linalg.norm(q)
        rows.append((w, q))
    return {"t": TIMES, "w": np.array([w for w, _ in rows]), "q": np.array([q for _, q in rows])}


def turned(q, vectors):
    """Vectors of the body in space."""
    return Rotation.from_quat(q, scalar_first=True).apply(vectors)


def squared(q):
    """Quaternions of twice the angle."""
    return np.column_stack([2 * q[:, 0] ** 2 - 1, 2 * q[:, :1] * q[:, 1:]])


def without(rows, name):
    """Rows without attitudes or rates."""
    return {key: column for key, column in rows.items() if key != name}


def kinds():
    """Word → kind → function of (rows, moments, start, q0, rng) that plants the fault; it returns columns."""

    def matrix(rows):
        matrices = Rotation.from_quat(rows["q"], scalar_first=True).as_matrix() @ np.diag([1.0, 1.0, -1.0])
        columns = {f"r{i + 1}{j + 1}": matrices[:, i, j] for i in range(3) for j in range(3)}
        return {"time": TIMES} | columns | {f"w{i + 1}": rows["w"][:, i] for i in range(3)}

    def changed(name, function):
        return lambda rows, moments, start, q0, rng: table(rows | {name: function(rows)})

    def outlier(row, name="q", alone=False):
        def plant(rows, moments, start, q0, rng):
            values = rows[name].copy()
            values[row] += rng.normal(size=values.shape[1]) * 0.01
            if name == "q":
                values[row] /= np.linalg.norm(values[row])
            rows = rows | {name: values}
            return table(without(rows, "w") if alone else rows)

        return plant

    def noise(q, w, unit=True):
        def plant(rows, moments, start, q0, rng):
            attitude = rows["q"] + q * rng.normal(size=rows["q"].shape)
            attitude /= np.linalg.norm(attitude, axis=1, keepdims=True) if unit else 1.0
            columns = {"t": TIMES, "q": attitude, "w": rows["w"] + w * rng.normal(size=rows["w"].shape)}
            return table(columns if q and w else without(columns, "q" if w else "w"))

        return plant

    def other(change, turning=lambda w, f: w, alone=""):
        def plant(rows, moments, start, q0, rng):
            p = rng.normal(size=3)
            size = 10.0 ** rng.uniform(-5, -3)
            p *= size / np.linalg.norm(p)
            planted = integrate_rows(moments, start, q0, TIMES, change(moments, p, size), turning)
            return table(without(planted, alone))

        return plant

    def late(rows, moments, start, q0, rng):
        delay = rng.uniform(0.1, 0.9) * TIMES[1]
        return table(rows | {"w": exact.rotation(moments, start, TIMES + delay)})

    def restamped(alone=""):
        def plant(rows, moments, start, q0, rng):
            row, lost = rng.integers(100, 300), rng.uniform(0.5, 3.0)
            at = np.where(np.arange(len(TIMES)) < row, TIMES, TIMES + lost)
            return table(without(exact_rows(moments, start, at, q0) | {"t": TIMES}, alone))

        return plant

    def missing(rows, moments, start, q0, rng):
        row, lost = rng.integers(50, 250), rng.integers(20, 100)
        keep = np.r_[0:row, row + lost : len(TIMES)]
        return {name: column[keep] for name, column in table(rows).items()}

    def scaled(factor):
        return lambda rows, moments, start, q0, rng: table(
            exact_rows(moments, start, factor * TIMES, q0) | {"t": TIMES}
        )

    def drifting(rows, moments, start, q0, rng):
        off = rng.normal(size=3)
        off *= 10.0 ** rng.uniform(-4, -1) / np.linalg.norm(off)
        return table(integrate_rows(moments, start, q0, TIMES, turning=lambda w, f: w + off))

    def other_side(rows, moments, start, q0, rng):  # q' = w q/2 with the rates in the body
        return table(integrate_rows(moments, start, q0, TIMES, side=-1))

    def inertia(size, alone=""):
        def plant(rows, moments, start, q0, rng):
            wrong = moments * np.exp(size * rng.normal(size=3) * [1, 1, 0])
            return table(without(exact_rows(wrong, start, TIMES, q0), alone))

        return plant

    def first_order(semi_implicit):
        return lambda rows, moments, start, q0, rng: table(euler(moments, start, q0, 4, semi_implicit))

    def in_space(moments, p, size):
        return lambda w, q: turned([q[0], *-q[1:]], p) / moments

    def dissipation(m, p, s):
        return lambda w, q: s / m.max() * np.cross(m * w, np.cross(m * w, w)) / m

    return {
        "scalar_last": {
            "last": changed("q", lambda r: np.roll(r["q"], -1, axis=1)),
            "last, attitude alone": lambda r, *a: table({"t": TIMES, "q": np.roll(r["q"], -1, axis=1)}),
        },
        "inverse_quaternion": {
            "conjugate": changed("q", lambda r: r["q"] * [1, -1, -1, -1]),
            "conjugate, attitude alone": lambda r, *a: table({"t": TIMES, "q": r["q"] * [1, -1, -1, -1]}),
        },
        "full_angle": {
            "square": changed("q", lambda r: squared(r["q"])),
            "factor 2": lambda r, *motion: table(integrate_rows(*motion[:3], TIMES, turning=lambda w, f: 2 * w)),
        },
        "axes_swapped": {
            "y and z of attitudes": changed("q", lambda r: r["q"][:, [0, 1, 3, 2]]),
            "cyclic rates": changed("w", lambda r: r["w"][:, [1, 2, 0]]),
            "both": lambda r, *a: table(r | {"q": r["q"][:, [0, 2, 3, 1]], "w": r["w"][:, [1, 2, 0]]}),
        },
        "left_handed": {
            "z of attitudes": changed("q", lambda r: r["q"] * [1, -1, -1, 1]),
            "z of rates": changed("w", lambda r: r["w"] * [1, 1, -1]),
            "matrix": lambda r, *a: matrix(r),
        },
        "kinematics": {"drift": drifting, "from the other side": other_side},
        "not_unit": {"growing": changed("q", lambda r: r["q"] * (1 + 1e-4 * TIMES)[:, None])},
        "space_rates": {"space": changed("w", lambda r: turned(r["q"], r["w"]))},
        "degrees": {
            "times": changed("w", lambda r: np.degrees(r["w"])),
            "divided": changed("w", lambda r: np.radians(r["w"])),
            "times, rates alone": lambda r, *a: table({"t": TIMES, "w": np.degrees(r["w"])}),
        },
        "negated_rates": {"negated": changed("w", lambda r: -r["w"])},
        "staggered": {"late": late},
        "wrong_inertia": {
            "1e-3": inertia(1e-3), "10 %": inertia(0.1),
            "attitude alone": inertia(0.03, "w"), "rates alone": inertia(0.03, "q"),
        },
        "clock": {"1.0001": scaled(1.0001), "0.9": scaled(0.9), "ms": scaled(1e-3)},
        "gap": {"missing": missing, "lost": restamped(), "lost, attitude alone": restamped("w")},
        "first_order": {"explicit": first_order(False), "semi-implicit": first_order(True)},
        "energy_drift": {
            "dissipation": other(dissipation), "attitude alone": other(dissipation, alone="w"),
        },
        "momentum_drift": {
            "damping": other(lambda m, p, s: lambda w, q: -s * w),
            "rates alone": other(lambda m, p, s: lambda w, q: s * w, alone="q"),
        },
        "torque": {
            "body": other(lambda m, p, s: lambda w, q: p * m.max() / m),
            "space": other(lambda m, p, s: lambda w, q: m.max() * in_space(m, p, s)(w, q)),
            "attitude alone": other(lambda m, p, s: lambda w, q: p * m.max() / m, alone="w"),
            "rates alone": other(lambda m, p, s: lambda w, q: p * m.max() / m, alone="q"),
        },
        "noise": {"both": noise(1e-5, 1e-5), "attitude": noise(1e-4, 0), "rates": noise(0, 1e-4)},
        "outlier": {
            "attitude": outlier(123), "rates": outlier(77, "w"), "first": outlier(0, "w"),
            "attitude alone": outlier(200, alone=True),
        },
        "none": {"sound": lambda r, *a: table(r), "attitude": lambda r, *a: table(without(r, "w"))},
    }  # fmt: skip


def first_word(columns, moments):
    """The first word of the diagnosis."""
    return sweeps.certify(columns, moments.tolist(), tolerance=TOLERANCE).attrs["diagnosis"]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bodies", type=int, default=20)
    parser.add_argument("--kinds", default="")
    args = parser.parse_args()
    wanted = set(args.kinds.split(",")) if args.kinds else set(kinds())
    right = total = unknown = 0
    for word, variants in kinds().items():
        for name, plant in variants.items() if word in wanted else ():
            words = Counter()
            for moments, start, q0, rng in bodies(args.bodies):
                rows = exact_rows(moments, start, TIMES, q0)
                words[first_word(plant(rows, moments, start, q0, rng), moments)[0]] += 1
            right, total, unknown = right + words[word], total + words.total(), unknown + words["unknown"]
            others = ", ".join(f"{other} {n}" for other, n in words.most_common() if other != word)
            print(f"{word:20} {name:26} {words[word]:3} of {words.total():3}  {others}", flush=True)
    print(f"right word first: {right} of {total} ({right / total:.2%}); unknown {unknown / total:.2%}")


if __name__ == "__main__":
    main()
