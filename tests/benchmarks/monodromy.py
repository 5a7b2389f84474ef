"""Print monodromy matrices a second and core of described periodic systems, against heyoka.py's variational mode.

By processors' time: `python tests/benchmarks/monodromy.py [SYSTEM …]`. heyoka.py (of the extra `bench`) follows the
same equations, of two and of four states, with `var_ode_sys` in batches at the tolerance 1e-12. Both run in fresh
processes in turn, and the fastest counts: their rates differ by a third. Errors are relative to a matrix's largest
entry, against steps of a third of their length: the least that 99 % of the points do not exceed.
"""

import sys

import numpy as np
import sympy as sp
from timing import compare_rates, min_times, print_results

from kernels.flow import floquet
from sweeps import systems
from sweeps.mechanics import periodic
from sweeps.mechanics.graph import compile_expression

POINTS, ROUNDS, PROCESSES, BATCH, COMPARED = 65_536, 9, 5, 16, 4_096
RANGES = {
    "mathieu": {"a": (-2.0, 10.0), "q": (0.0, 10.0)},
    "paul_trap": {"a": (-0.3, 0.3), "q": (0.0, 1.5)},
    "parametric_double_pendulum": {"amplitude": (0.0, 0.2), "frequency": (3.0, 20.0)},
}


def rate(work) -> float:
    """Return the points a second of the fastest of some rounds of a piece of work, by processor time."""
    work()
    return POINTS / min_times(ROUNDS, work)[0]


def group_motions(model, values) -> list[tuple]:
    """Return the base motions of points, in parts of one kind, each with the numbers of its points."""
    size = len(next(iter(values.values())))
    points = {p.name: np.full(size, p.default) for p in model.system.parameters.values()} | values
    base = periodic.BaseMotions(model, model.parameters(points, size), np.zeros(size, dtype=int))
    return [(which, base.select(which)) for which in periodic.groups(base)]


def steps(motions) -> int:
    """Return the steps of the first try of a certificate."""
    return 2 * (5 * int(motions.num_segments[0]) // 8 + 1)


def error(model, values, matrices) -> float:
    """Return the error of the matrices of the first points, shape (points, n, n), that 99 % do not exceed."""
    errors = np.empty(COMPARED)
    for which, motions in group_motions(model, {name: x[:COMPARED] for name, x in values.items()}):
        exact = motions.integrate_variation(3 * steps(motions))[0].matrix
        computed = matrices(which, motions)
        errors[which] = floquet.largest_entry(computed - exact) / floquet.largest_entry(exact)
    return float(np.quantile(errors, 0.99))


def ours(model, values) -> None:
    """Print the rates of a system: steps alone, one matrix, the blind measurement, the certificate, all columns."""
    groups, small = [group for _, group in group_motions(model, values)], np.full(POINTS, 1e-8)
    works = {
        "variational flow by collocation": lambda p: p.integrate_variation(steps(p)),
        "the same with its error, from two phases": lambda p: p.certify(),
        "one matrix from perturbed motions": lambda p: p.measure_in_steps(small[: p.period.size], periodic.FIRST_STEPS),
        "blind measurement, with errors": lambda p: p.measure(small[: p.period.size], 1e-12),
    }
    for words, work in works.items():
        print(f"{words}: {rate(lambda work=work: [work(group) for group in groups])}")
    print(
        "error of the flow:", error(model, values, lambda _, group: group.integrate_variation(steps(group))[0].matrix)
    )


def theirs(model, values) -> None:
    """Print heyoka.py's rate for the same equations and points."""
    import heyoka as hy

    equations, n, periods = model.equations, model.equations.n, model.system.given_period
    values_by_symbol = {p.symbol: p.default for p in model.system.parameters.values() if p.name not in values}
    varied = [model.system.parameters[key].symbol for key in values]
    states = [hy.expression(x.name) for x in equations.states]
    symbols = dict(zip(varied, hy.par, strict=False)) | {equations.system.time: hy.time}
    symbols |= dict(zip(equations.states, states, strict=True))
    rates = [
        *equations.v,
        *(equations.a.inv() * sp.Matrix(equations.forces)).applyfunc(sp.simplify).subs(values_by_symbol),
    ]
    rates = [hy.from_sympy(sp.sympify(e).evalf(17), symbols) for e in rates]
    flow = hy.var_ode_sys([*zip(states, rates, strict=True)], hy.var_args.vars, order=1)
    nothing = np.zeros((n, BATCH)), np.zeros((len(values), BATCH))
    ta = hy.taylor_adaptive_batch(flow, nothing[0], tol=1e-12, pars=nothing[1], fast_math=True)
    start, values_by_symbol = ta.state.copy(), np.array([*values.values()])
    (period,), matrices = compile_expression(varied, [periods])(*values_by_symbol), np.empty((n * n, POINTS))

    def work():
        for first in range(0, POINTS, BATCH):
            group = slice(first, first + BATCH)
            ta.set_time(0.0)
            ta.state[:], ta.pars[:] = start, values_by_symbol[:, group]
            ta.propagate_until(period[group])
            matrices[:, group] = ta.state[n:]

    def matrices_of(which, group):
        return matrices[:, which].T.reshape(-1, n, n) * group.sizes[:, None] / group.sizes[:, :, None]

    print(f"heyoka.py {hy.__version__}, var_ode_sys, batches of {BATCH}, tolerance 1e-12: {rate(work)}")
    print("error of heyoka.py:", error(model, values, matrices_of))


def main(names) -> None:
    """Run both in turn, and print the rate of the fastest process of each, and the slowness of its other processes."""
    for name in names:
        rates = print_results([__file__, who, name] for who in ["theirs", "ours"] * PROCESSES)
        peer = max(next(iter(rates.values())))
        for words, rates_of in rates.items():
            result = (
                f"{max(rates_of):.1e}" if words.startswith("error") else compare_rates(rates_of, peer, "matrices/s")
            )
            print(f"{name}: {words} {result}", flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] in (["ours"], ["theirs"]):
        who, name = sys.argv[1:]
        rng = np.random.default_rng(1)
        values = {key: rng.uniform(*ends, POINTS) for key, ends in RANGES[name].items()}
        {"ours": ours, "theirs": theirs}[who](systems.resolve(name).mechanism, values)
    else:
        main(sys.argv[1:] or RANGES)
