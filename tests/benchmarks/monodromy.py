"""Print monodromy matrices a second and core of described periodic systems, beside heyoka.py's variational mode.

By the process's own time: `python tests/benchmarks/monodromy.py`. heyoka.py (of the extra `bench`) follows the same
equations, of two and of four states, with `var_ode_sys` in batches at the tolerance 1e-12.
"""

import time

import numpy as np
import sympy as sp

from sweeps import systems
from sweeps.mechanics import periodic
from sweeps.mechanics.graph import lambdified

POINTS, ROUNDS, BATCH = 65_536, 5, 16
RANGES = {
    "mathieu": {"a": (-2.0, 10.0), "q": (0.0, 10.0)},
    "paul_trap": {"a": (-0.3, 0.3), "q": (0.0, 1.5)},
    "parametric_double_pendulum": {"amplitude": (0.0, 0.2), "frequency": (3.0, 20.0)},
}


def seconds(work) -> float:
    """Return the least processor time of a piece of work, s."""
    work()
    taken = []
    for _ in range(ROUNDS):
        start = time.process_time()
        work()
        taken.append(time.process_time() - start)
    return min(taken)


def ours(name: str) -> None:
    """Print the rates of a system: steps alone, one matrix, the blind measurement, the certificate, all columns."""
    rng, model = np.random.default_rng(1), systems.resolve(name).mechanism
    points = {p.name: np.full(POINTS, p.default) for p in model.system.parameters.values()}
    points |= {key: rng.uniform(*ends, POINTS) for key, ends in RANGES[name].items()}
    points |= {"epsilon": np.full(POINTS, 1e-8), "equilibrium": np.zeros(POINTS, dtype=int)}
    base = periodic.Base(model, model.parameters(points, POINTS), points["equilibrium"])
    parts = [base.chosen(part) for part in periodic.alike(base)]

    def each(work):
        return lambda: [work(part, np.full(part.period.size, 1e-8)) for part in parts]

    matrix = each(lambda part, size: part.followed(size, periodic.STEPS))
    works = {
        "one matrix from parameters": matrix,
        "blind measurement, with errors": each(lambda part, size: part.measured(size, 1e-12)),
        "variational flow by collocation alone": each(
            lambda part, _: part.varied(2 * (5 * int(part.number[0]) // 8 + 1))
        ),
        "the same with its error, from two phases": each(lambda part, _: part.certified()),
        "all columns": lambda: periodic.survey(model, points, 1e-12),
    }
    for words, work in works.items():
        print(f"{name}: {words} {POINTS / seconds(work):,.0f}")


def theirs(name: str) -> None:
    """Print heyoka.py's rate for the same equations and points."""
    try:
        import heyoka as hy
    except ImportError:
        print("heyoka.py: is not installed")
        return
    model, rng = systems.resolve(name).mechanism, np.random.default_rng(1)
    equations, varied = model.equations, list(RANGES[name])
    given = {p.symbol: p.default for p in model.system.parameters.values() if p.name not in varied}
    symbols = {model.system.parameters[key].symbol: hy.par[i] for i, key in enumerate(varied)}
    states = [hy.expression(x.name) for x in equations.states]
    symbols |= {equations.system.time: hy.time} | dict(zip(equations.states, states, strict=True))
    rates = [*equations.v, *(equations.a.inv() * sp.Matrix(equations.forces)).applyfunc(sp.simplify).subs(given)]
    rates = [hy.from_sympy(sp.sympify(e).evalf(17), symbols) for e in rates]
    equations = hy.var_ode_sys([*zip(states, rates, strict=True)], hy.var_args.vars, order=1)
    nothing = np.zeros((len(states), BATCH)), np.zeros((len(varied), BATCH))
    ta = hy.taylor_adaptive_batch(equations, nothing[0], tol=1e-12, pars=nothing[1], fast_math=True)
    start, values = ta.state.copy(), np.array([rng.uniform(*ends, POINTS) for ends in RANGES[name].values()])
    (period,) = lambdified([model.system.parameters[key].symbol for key in varied], [model.system.given_period])(
        *values
    )

    def work():
        for first in range(0, POINTS, BATCH):
            ta.set_time(0.0)
            ta.state[:], ta.pars[:] = start, values[:, first : first + BATCH]
            ta.propagate_until(period[first : first + BATCH])

    rate = POINTS / seconds(work)
    print(f"{name}: heyoka.py {hy.__version__}, var_ode_sys, batches of {BATCH}, tolerance 1e-12: {rate:,.0f}")


if __name__ == "__main__":
    for system in RANGES:
        ours(system)
        theirs(system)
