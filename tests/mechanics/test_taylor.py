from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import relative
import repeated
import sympy as sp
from described import model_of, points, rods
from oscillators import LIBRARY
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk

from sweeps.mechanics import taylor
from sweeps.mechanics.derivation import derive
from sweeps.mechanics.first_order import graph
from sweeps.mechanics.taylor import Code
from sweeps.systems.reintegration import rates_of

W = taylor.W


def scratch(model, columns, x, v, epsilon):
    """Return a scratch array with W copies of a point with the deviation ε x and the velocity ε v."""
    theory = model.theory(columns)
    place = theory["place"][:1]
    parameters = [p[:1] for p in theory["parameters"]]
    rows = model.code.starts(parameters, place, [(np.array([epsilon]), np.reshape([*x, *v], (-1, 1)))])[:, 0]
    S = np.repeat(rows[0], W)
    return S, place[0], theory["scale"][0]


def advance(model, S, step, steps):
    S = S.copy()
    S[model.code.step_row * W : (model.code.step_row + 1) * W] = step
    model.code.module().advance(S, steps)
    return S


def test_order_is_twelve():
    model = model_of("pendulum")
    columns = points(model, 1, {})
    theta0, time = 1.5, 4.0
    S, _, scale = scratch(model, columns, [1.0], [0.0], theta0)
    k = np.sin(theta0 / 2)
    sn, _, _, _ = ellipj(time + ellipk(k**2), k**2)  # sin(θ/2) = k sn(ω t + K)
    exact = 2 * np.arcsin(k * sn) / theta0
    counts = np.array([14, 17, 20, 25])  # errors from 3e-11 to 7e-14: past the higher orders, above rounding
    errors = [abs(advance(model, S, time / scale / n, n)[0] / theta0 - exact) for n in counts]
    slope = np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert slope == pytest.approx(-taylor.ORDER, abs=0.3)


# the code of each system but the pendulum takes long to compile
@pytest.mark.parametrize("name", repeated.but(("pendulum",), [*LIBRARY, *relative.RANGES]))
def test_full_motion_is_that_of_dop853(name):
    """Perturbations of 0.1 and of 0.01, which are far from linear, against SciPy on the symbolic rates."""
    model, epsilon = model_of(name), 0.1 if name in LIBRARY else 0.01
    ranges, e = LIBRARY | relative.RANGES, model.equations
    columns = points(model, 1, ranges[name], 5, epsilon=epsilon)
    theory = model.theory(columns)
    scale, sizes = theory["scale"][0], theory["sizes"][0]
    sizes = np.append(sizes, sizes * scale) if name in LIBRARY else sizes
    x = np.random.default_rng(5).uniform(-1, 1, e.n) * sizes
    S, place, _ = scratch(model, columns, x[: e.n - len(e.v)], x[e.n - len(e.v) :], epsilon)
    place = np.append(place, np.zeros(len(e.v)))
    numbers, rates = [columns[name][0] for name in model.names], rates_of(e)

    def rate(t, y):  # in units of sizes and of 1/scale
        return rates(numbers, 0.0, place + y * sizes) / sizes / scale

    solution = solve_ivp(rate, (0, 6.0), epsilon * x / sizes, method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
    mine = advance(model, S, 6.0 / scale / 60, 60)[: e.n * W : W] / sizes
    # DOP853 at 1e-13 a step adds up to 1e-11 of deviations of a tenth, and an unstable motion grows e^6
    assert mine == pytest.approx(solution, abs=4e-10)


@pytest.mark.parametrize("name", repeated.but(("pendulum",), ("pendulum", "double_pendulum", "central_potential")))
def test_energy_is_that_of_the_symbols(name):
    model = model_of(name)
    n, rng = model.equations.m, np.random.default_rng(6)
    columns = points(model, 1, LIBRARY[name])
    theory = model.theory(columns)
    x, v = rng.uniform(-1, 1, n) * theory["sizes"][0], rng.uniform(-1, 1, n) * theory["sizes"][0] * theory["scale"][0]
    epsilon = 1e-3
    S, place, _ = scratch(model, columns, x, v, epsilon)
    model.code.module().check(S)
    e = model.equations
    numbers = {p.symbol: sp.Float(columns[p.name][0], 60) for p in model.system.parameters.values()}
    # the place to 60 digits: in doubles its rounding alone moves V by 1e-16 ε
    guess = [sp.Float(value, 60) for value in place]
    free = [i for i, c in enumerate(model.system.kept) if c.hold is None]
    start = dict(zip(e.q, guess, strict=True))
    equations = [e.gradient[i].subs(numbers).subs({e.q[j]: guess[j] for j in range(n) if j not in free}) for i in free]
    root = sp.nsolve(equations, [e.q[i] for i in free], [guess[i] for i in free], prec=60)
    start |= {e.q[i]: root[k] for k, i in enumerate(free)}
    position = {q: start[q] + epsilon * sp.Float(x[i], 60) for i, q in enumerate(e.q)}
    speed = sp.Matrix([sp.Float(value, 60) for value in v])
    rise = e.V.subs(numbers).subs(position) - e.V.subs(numbers).subs(start)
    kinetic = (speed.T * e.a.subs(numbers).subs(position) * speed)[0] / 2
    # some tens of roundings; the doubles of the place are ε⁻¹ 1e-16 off in units of the nudge
    assert S[model.code.drift_row * W] == pytest.approx(float(kinetic + rise / sp.Float(epsilon, 60) ** 2), rel=1e-11)


@pytest.mark.slow
def test_nothing_is_lost_in_a_small_nudge():
    """The same motion at nudges of 1e-6, 1e-12 and 1e-100: each differs from the linear motion by its own ε."""
    model = model_of("double_pendulum")
    columns = points(model, 1, {})
    ends = []
    for epsilon in (1e-100, 1e-12, 1e-6):
        S, _, scale = scratch(model, columns, [1.0, -0.3], [0.0, 0.0], epsilon)
        state = advance(model, S, 10.0 / scale / 100, 100)
        ends.append(state[: 2 * W : W] * state[model.code.inverse_row * W])
    assert ends[1] == pytest.approx(ends[0], rel=1e-14)
    assert ends[2] == pytest.approx(ends[0], rel=1e-10)


def test_threads_wait_for_a_module_that_is_being_imported(tmp_path):
    class SlowModule(taylor.Generated):
        name, path = "slow_module", tmp_path / "slow_module.py"

    SlowModule.path.write_text("import time\ntime.sleep(0.3)\nvalue = 1.0\n")
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(lambda _: SlowModule().module().value, range(4))) == [1.0] * 4


@pytest.mark.parametrize("n", repeated.but((4,), (4, 7)))
def test_code_of_many_rods_grows_with_the_graph(n):
    """A pair of rods takes some twenty operations at most, and each some 13² products over the orders."""
    equations = derive(rods(n))
    m, length, _ = equations.parameters
    assert equations.a[0, 1] == (n - 1) * m * length**2 * sp.cos(equations.q[0] - equations.q[1])
    code = Code(graph(equations))
    assert len(code.graph.nodes) < 14 * n * n
    assert len(code.text) < 1100 * len(code.graph.nodes)
    assert code.compile_seconds <= 60


def test_a_damaged_generated_file_is_written_again(tmp_path):
    path = taylor._write_module(tmp_path, "name", "text")
    path.write_text("half")
    assert taylor._write_module(tmp_path, "name", "text").read_text() == "text"
    assert [p.name for p in tmp_path.iterdir()] == ["name.py"]
