"""The race of monodromies of a body on an orbit: Polhode's tangent flow against heyoka.py's variational mode, one core.

    python tests/benchmarks/attitude_race.py

Bodies with moments in (0.5, 1), synchronous on ellipses of eccentricities up to 0.3, from their periodic motions, over
one orbit. heyoka.py (of the extra `bench`) follows quaternion and body rates with `var_ode_sys` in compact mode, 7 +
49 equations, and the equations of Polhode's tangent flow, 22 in the plane and out of it, in both modes. Errors are
those of the sum of all multipliers over the largest entry of a matrix, against steps of a quarter of Polhode's: the
least that 99 % of the bodies do not exceed. Of each the loosest tolerance with an error of 1e-12 at most is taken.
Both run in fresh processes in turn, and the fastest counts, by processors' time. Nothing is asserted.
"""

import sys

import numpy as np
import sympy as sp
from timing import compare_rates, min_times, print_results

from kernels.flow import floquet
from sweeps.mechanics import periodic
from sweeps.systems.orbit import equations

BODIES, ROUNDS, PROCESSES, ERROR = 4_096, 5, 3, 1e-12
TOLERANCES = 10.0 ** -np.arange(9.0, 13.1, 0.5)


def base_motions() -> tuple[dict, tuple, tuple]:
    """Return the arguments of the bodies, and their motions in both planes, each in groups of one kind."""
    rng, ones = np.random.default_rng(1), np.ones(BODIES)
    I1, asymmetry = rng.uniform(0.5, 0.95, BODIES), rng.uniform(0.02, 0.3, BODIES)
    points = {"I1": I1, "I2": I1 + asymmetry, "I3": ones, "eccentricity": rng.uniform(0.0, 0.3, BODIES)}
    arguments = equations.arguments_of(points, "synchronous") | {"equilibrium": np.zeros(BODIES, dtype=int)}
    planar = equations.planar_motions(arguments)
    planes = planar, equations.tilt_motions(arguments, "synchronous", planar)
    groups = ([(which, base.select(which)) for which in periodic.groups(base)] for base in planes)
    return arguments, planes, tuple(groups)


def exact_traces(groups) -> tuple[np.ndarray, np.ndarray]:
    """Return the sums of the multipliers, and the largest entries of the matrices, by short steps."""
    traces, sizes = np.zeros(BODIES), np.zeros(BODIES)
    for which, motions in (group for plane in groups for group in plane):
        matrix = motions.measure_in_steps(np.ones(which.size), 4 * periodic.FIRST_TANGENT_STEPS)[0].matrix
        traces[which] += np.einsum("nii->n", matrix)
        sizes[which] = np.maximum(sizes[which], floquet.largest_entry(matrix))
    return traces, sizes


def race(exact, run) -> None:
    """Print rate and error of `run`, a function of the tolerance, at the loosest tolerance that keeps the error."""
    traces, sizes = exact
    for tolerance in TOLERANCES:
        error = float(np.quantile(np.abs(run(tolerance) - traces) / sizes, 0.99))
        if error <= ERROR:
            break
    print(f"rate: {BODIES / min_times(ROUNDS, lambda: run(tolerance))[0]}")
    print(f"error: {error}")


def ours(groups, has_errors):
    """Return the function of the tolerance that returns traces: of single matrices, or measured with their errors."""

    def single_matrices(motions, tolerance, steps=periodic.FIRST_TANGENT_STEPS):
        """Return matrices by steps that are halved until their truncation is below the tolerance."""
        matrices, (truncation, _) = motions.measure_in_steps(np.ones(motions.period.size), steps)
        still_open = np.flatnonzero(truncation > tolerance)
        if still_open.size:
            matrices.set_points(still_open, single_matrices(motions.select(still_open), tolerance, 2 * steps))
        return matrices

    def run(tolerance):
        traces = np.zeros(BODIES)
        for which, motions in (group for plane in groups for group in plane):
            matrices = (
                motions.measure(np.ones(which.size), tolerance)[0]
                if has_errors
                else single_matrices(motions, tolerance)
            )
            traces[which] += np.einsum("nii->n", matrices.matrix)
        return traces

    return run


def quaternion_system(hy):
    """Return heyoka.py's variational system of a quaternion (body to space) and body rates; parameters A, D, e."""
    q, w, (A, D, e) = (
        hy.make_vars("q0", "q1", "q2", "q3"),
        hy.make_vars("w1", "w2", "w3"),
        [hy.par[k] for k in range(3)],
    )
    radius, c, s, moments = 1.0 + e * hy.cos(hy.time), hy.cos(hy.time), hy.sin(hy.time), (A, A + D, 1.0)
    first = (q[0] ** 2 + q[1] ** 2 - q[2] ** 2 - q[3] ** 2, 2.0 * (q[1] * q[2] - q[0] * q[3]))
    second = (2.0 * (q[1] * q[2] + q[0] * q[3]), q[0] ** 2 - q[1] ** 2 + q[2] ** 2 - q[3] ** 2)
    u = [x * c + y * s for x, y in zip(first, second, strict=True)]
    u.append(2.0 * (q[1] * q[3] + q[0] * q[2]) * c + 2.0 * (q[2] * q[3] - q[0] * q[1]) * s)
    rates = [
        -0.5 * (q[1] * w[0] + q[2] * w[1] + q[3] * w[2]) / radius**2,
        0.5 * (q[0] * w[0] + q[2] * w[2] - q[3] * w[1]) / radius**2,
        0.5 * (q[0] * w[1] + q[3] * w[0] - q[1] * w[2]) / radius**2,
        0.5 * (q[0] * w[2] + q[1] * w[1] - q[2] * w[0]) / radius**2,
    ]
    for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        difference = moments[b] - moments[c]
        rates.append(difference * (w[b] * w[c] / radius**2 - 3.0 * radius * u[b] * u[c]) / moments[a])
    return hy.var_ode_sys([*zip([*q, *w], rates, strict=True)], hy.var_args.vars, order=1)


def split_system(hy):
    """Return heyoka.py's system of Polhode's equations: motion, two columns in the plane, and four out of it."""
    model = equations.tilt_model("synchronous")
    x, y, *tilts = model.equations.q
    values = {"p": 1, "pace": 1}
    constants = {p.symbol: values[n] for n, p in model.system.parameters.items() if n in values}
    f = [e.subs(constants) for e in model.equations.f]
    rates = dict(zip((x, y), f[:2], strict=True))
    for k in range(2):
        column = sp.symbols(f"dx{k} dy{k}", real=True)
        rates |= {z: sum(f[i].diff(v) * dv for v, dv in zip((x, y), column, strict=True)) for i, z in enumerate(column)}
    for k in range(4):
        column = sp.symbols([f"{z}{k}" for z in tilts], real=True)
        at_column = dict(zip(tilts, column, strict=True))
        rates |= {z: e.subs(at_column) for z, e in zip(column, f[2:], strict=True)}
    names = ("I1_over_I3", "asymmetry", "eccentricity")
    symbols = {model.system.parameters[n].symbol: hy.par[k] for k, n in enumerate(names)}
    symbols |= {model.system.time: hy.time} | {z: hy.expression(str(z)) for z in rates}
    return [(symbols[z], hy.from_sympy(sp.sympify(e).evalf(17), symbols)) for z, e in rates.items()]


def theirs(arguments, planar, kind):
    """Return the function of the tolerance that returns heyoka.py's traces; `kind` is one of its KINDS."""
    import heyoka as hy

    width = 8 if kind == "unrolled" else 16  # the fastest of 4, 8, 16
    has_quaternions, (_, slope), e = kind == "quaternions", planar.start.T, arguments["eccentricity"]
    system = (quaternion_system if has_quaternions else split_system)(hy)
    start = np.zeros((56 if has_quaternions else 22, BODIES))
    if has_quaternions:
        start[0], start[6], start[7:] = 1.0, (1.0 + e) ** 2 * (1.0 + slope), np.eye(7).reshape(-1, 1)
    else:
        start[1], start[2:] = (1.0 + e) ** 2 * slope, np.r_[np.eye(2).ravel(), np.eye(4).ravel()][:, None]
    pars = np.array([arguments[name] for name in ("I1_over_I3", "asymmetry", "eccentricity")])
    integrators: dict[float, object] = {}
    end = np.empty_like(start)

    def rotation_columns(q):
        """Return ½ q ⊗ e_k, shape (4, 3, bodies): derivatives of a quaternion by rotations about the body's axes."""
        a, b, c, d = 0.5 * q
        return np.array([[-b, -c, -d], [a, -d, c], [d, a, -b], [-c, b, a]])

    def run(tolerance):
        if tolerance not in integrators:
            integrators[tolerance] = hy.taylor_adaptive_batch(
                system, start[: 7 if has_quaternions else 22, :width].copy(), tol=tolerance, fast_math=True,
                pars=np.zeros((3, width)), compact_mode=kind != "unrolled",
            )  # fmt: skip
        ta = integrators[tolerance]
        for first in range(0, BODIES, width):
            group = slice(first, first + width)
            ta.set_time(0.0)
            ta.state[:], ta.pars[:] = start[:, group], pars[:, group]
            ta.propagate_until(np.full(width, 2.0 * np.pi))
            end[:, group] = ta.state
        if not has_quaternions:
            return end[2] + end[5] + end[6::5].sum(axis=0)
        M, before, after = end[7:].reshape(7, 7, -1), rotation_columns(start[:4]), rotation_columns(end[:4])
        return 4.0 * np.einsum("ikn,ijn,jkn->n", after, M[:4, :4], before) + np.einsum("iin->n", M[4:, 4:])

    return run


KINDS = {
    "heyoka.py, quaternions, var_ode_sys, compact": "quaternions",
    "heyoka.py, planes apart, compact": "compact",
    "heyoka.py, planes apart": "unrolled",
    "Polhode, matrices": "matrices",
    "Polhode, measured with errors": "measured",
}


def main() -> None:
    """Run all in turn, and print the rate and error of the fastest process of each."""
    results = {words: print_results([[__file__, kind]] * PROCESSES) for words, kind in KINDS.items()}
    peer = max(next(iter(results.values()))["rate"])
    for words, result in results.items():
        rate = compare_rates(result["rate"], peer, "orbits/s")
        print(f"{words}: {rate}; error {max(result['error']):.1e}", flush=True)


if __name__ == "__main__":
    if len(sys.argv) == 1:
        main()
    else:
        arguments, (planar, _), groups = base_motions()
        is_ours = sys.argv[1] in ("matrices", "measured")
        run = ours(groups, sys.argv[1] == "measured") if is_ours else theirs(arguments, planar, sys.argv[1])
        race(exact_traces(groups), run)
