import math
import os
import pickle
import platform
import re
import shutil
import subprocess

import numpy as np
import pytest
from calls import python
from naive import FEWER, bodies
from numba import config

from kernels.compile.blocks import W
from kernels.compile.cache import CHECKSUM, cache_folder
from kernels.estimator import measure, statuses
from kernels.free import direct, exact, linear, rigid_body, taylor
from kernels.near_axis import estimates, examples, near_axis_block, survey
from kernels.near_axis.estimates import aux
from kernels.near_axis.near_axis_block import row

STEPS = taylor.STEPS


def point(points, i):
    """Moments from the spin axis, and the start in units of the spin."""
    I1, I2, I3, axis, omega0, epsilon, phase = (
        points[name][i] for name in ("I1", "I2", "I3", "axis", "omega0", "epsilon", "phase")
    )
    moments = rigid_body.relabel(I1, I2, I3, axis)
    return moments, np.array([np.sign(omega0), epsilon * np.cos(phase), epsilon * np.sin(phase)])


def taylor(moments, start, spacing, intervals, order, steps):
    """Samples by the direct integrator's own step, one body at a time."""
    c = rigid_body.euler_coefficients(*moments)
    h, state, rows = spacing / steps, tuple(start), [start]
    for _ in range(intervals):
        for _ in range(steps):
            state = STEPS[order](*state, *(k * h for k in c))
        rows.append(np.array(state))
    return np.array(rows)


@pytest.mark.parametrize("epsilon", [1e-6, 0.05])
def test_the_certificate_is_the_distance_from_the_closed_form(epsilon):
    tolerance, intervals, spacing = 1e-6, 24, 0.5  # a loose tolerance: truncation far above rounding
    points = bodies(40 * FEWER, 1, epsilon=epsilon)
    columns = survey.measure_points(points, 3.0, 8, tolerance)
    size = min(1.0, 10 * epsilon * np.exp(0.5))
    coefficients = tuple(direct.truncation(size, order) for order in direct.ORDERS)
    num_visible = 0
    for i in range(40):
        moments, start = point(points, i)
        bound = np.abs(rigid_body.euler_coefficients(*moments)).max()
        x = bound * spacing * np.sqrt(1 + epsilon**2)
        order, steps = direct.choose_steps(x, size, coefficients, intervals, tolerance)
        ours = taylor(moments, start, spacing, intervals, order, steps)
        truth = exact.rotation(moments, start, spacing * np.arange(intervals + 1))
        num_samples = columns["samples_used"][i]
        largest = np.maximum.accumulate(np.hypot(ours[:, 1], ours[:, 2]))
        distance = (np.hypot(*(ours - truth)[:, 1:].T) / largest)[:num_samples].max()
        # sixty steps of either solution round by 1e-15 or so in all, and in another order
        assert columns["propagation_error"][i] == pytest.approx(distance, rel=1e-4, abs=2e-14)
        num_visible += distance > 1e-13
    assert num_visible > 10


# at 0.3 some motions pass so near the separatrix that rounding alone makes more than 1e-12
@pytest.mark.parametrize(
    ("tolerance", "epsilon"),
    [(t, e) for t in (1e-8, 1e-10, 1e-12) for e in (1e-8, 1e-6, 1e-3, 0.3) if (t, e) != (1e-12, 0.3)],
)
def test_every_certificate_is_within_its_allowance(tolerance, epsilon):
    columns = survey.measure_points(bodies(5000, 2, epsilon=epsilon), 4.0, 16, tolerance)
    allowed = tolerance + 2e-15 * np.exp(columns["growth_rate"] * columns["window_end"])
    assert (columns["propagation_error"] <= allowed).all()
    assert (columns["status"] == survey.OK).all()


def test_on_the_decaying_direction_rounding_grows_and_is_allowed():
    # c_b = c_c = 1/2, so phase 3 pi/4 or its mirror decays: the contribution of rounding grows by e^{12.6} over the run
    points = {"I1": 1.0, "I2": 0.6, "I3": 1.6666666666666667, "axis": 1, "omega0": 1.0, "epsilon": 1e-6}
    rates = rigid_body.euler_coefficients(1.0, 0.6, 1.6666666666666667)
    decay_phase = np.arctan2(np.sqrt(abs(rates[2])), -np.sqrt(abs(rates[1])) * np.sign(rates[1]))
    columns = survey.survey(points | {"phase": decay_phase}, 4.0, 16, 1e-10)
    assert columns["growing_fraction"][0] < 1e-15
    assert columns["regime"][0] == linear.UNSTABLE
    assert columns["status"][0] == survey.OK


BROKEN = """
import numpy as np
from kernels.compile import jit
jit.leave_out_compiler()
from kernels.free import taylor
def broken(step):
    def taken(a, b, c, ka, kb, kc):
        a, b, c = step(a, b, c, ka, kb, kc)
        return a, b, c * (1 + DEFECT)
    taken.__name__ = step.__name__
    return taken
taylor.STEPS = tuple(map(broken, taylor.STEPS))
from kernels.near_axis import survey
points = {"I1": 1.0, "I2": 2.0, "I3": 2.7, "axis": np.array([1, 2, 3]), "omega0": 1.0, "phase": 0.6, "epsilon": 1e-6}
columns = survey.measure_points(points, 4.0, 16, 1e-10)
print(*(x for name in ("status", "propagation_error", "perturbation_drift", "energy_drift") for x in columns[name]))
"""


@pytest.mark.parametrize(
    ("defect", "status"), [pytest.param(0.0, survey.OK, marks=pytest.mark.slow), (1e-9, statuses.NOT_CONVERGED)]
)
def test_an_integrator_broken_by_1e_9_is_told_by_the_certificate(defect, status):
    # in a process of its own and in plain Python, for the compiler freezes inlined constants
    program = BROKEN.replace("DEFECT", repr(defect))
    output = list(map(float, python(program, PYTHONWARNINGS="ignore").split()))
    assert output[:3] == [status] * 3
    if defect:
        assert min(output[3:9]) > defect
        assert max(output[9:]) < 1e-13  # the perturbation's energy is 1e-12 of the whole


@pytest.mark.compiled
def test_the_exact_propagator_measures_the_same():
    points = bodies(5000, 3)
    by_steps = survey.survey(points, 4.0, 16, 1e-12)
    columns = survey.survey(points, 4.0, 16, 1e-12, propagator="exact")
    assert (columns["status"] == survey.OK).all()
    assert (columns["steps_per_sample"] == 1).all()
    np.testing.assert_array_equal(columns["regime"], by_steps["regime"])
    # both are within 1e-12 of the truth, which (Omega h)² in the recurrence amplifies for small rates
    scale = points["omega0"] ** 2
    np.testing.assert_allclose(columns["omega_squared"] / scale, by_steps["omega_squared"] / scale, rtol=0, atol=1e-10)
    # roundings of a motion that falls before it grows have grown by e^(lambda t), up to 1e3 here, when it is small
    grows, drift = columns["growth_rate"] > 0, columns["perturbation_drift"]
    assert drift[~grows].max() < 1e-14
    assert drift[grows].max() < 3e-13


def test_work_that_nobody_asked_for_changes_no_other_column():
    points = bodies(500, 4)
    all_columns = survey.measure_points(points, 4.0, 16, 1e-10)
    regimes, log_slope = ("omega_squared", "regime", "status"), ("growth_rate_logslope_error",)
    for requested in (regimes, log_slope, ("euler_period",), ("frequency_reduced_error", "energy_drift")):
        columns = survey.survey(points, 4.0, 16, 1e-10, wanted=requested)
        assert sorted(columns) == sorted(requested)
        for name in requested:
            np.testing.assert_array_equal(columns[name], all_columns[name], err_msg=name)


def test_squares_of_turns_beyond_the_series_are_those_of_each_lane():
    """Lanes of odd number rotate more than a motion may between two samples; each has its own square and slope."""
    rng, S = np.random.default_rng(7), np.full(estimates.ROWS * W, math.nan)
    for start in (row.guess, row.rx, row.xx, row.sx, row.sw, row.spacing):
        S[start : start + W] = rng.uniform(0.5, 1.0, W)
    squares = np.where(np.arange(W) % 2, rng.uniform(-3.0, -0.2, W), rng.uniform(-0.1, 0.1, W))
    S[row.guess : row.guess + W] = squares + 0.5 * S[row.rx : row.rx + W] / S[row.xx : row.xx + W]
    assert estimates._write_squares(S, True)
    estimates._write_large_squares(S)
    for lane in range(W):
        turns = estimates._measured_D(S, lane), estimates._reduced_D(S, lane)
        rows = (aux.rate2, aux.slope), (aux.reduced, aux.reduced_slope)
        for D, (square, slope) in zip(turns, rows, strict=True):
            measurement = S[square + lane], S[slope + lane]
            assert measurement == pytest.approx(measure.rate_squared(D, S[row.spacing + lane]), rel=1e-13)


ARITHMETIC = r"\tv?(?:add|sub|mul|div|sqrt|max|min|cmp\w*|fn?m(?:add|sub)\d*)"
SCALAR = {"store_excess"}  # one product a lane of the second sample: too short for LLVM not to unroll it


@pytest.mark.slow
@pytest.mark.skipif(bool(config.DISABLE_JIT), reason="nothing is compiled")
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="reads x86 instructions")
@pytest.mark.skipif(not shutil.which("objdump"), reason="takes compiled code apart by objdump")
def test_every_loop_over_lanes_is_packed(tmp_path):
    examples.follow_block()  # compiles, and stores, what no earlier run has stored
    for kernel in vars(near_axis_block).values():
        if (function := getattr(kernel, "py_func", None)) and "W" in function.__code__.co_names:
            # what lies in the cache, for Numba shows no assembly of what it has loaded
            path = max((cache_folder() / "code").glob(f"{kernel._cache._name}-*"), key=os.path.getmtime)
            _, _, _, signature, *_ = pickle.loads(path.read_bytes()[CHECKSUM:])
            kernel.compile(signature.args)  # again, if the file is of other sources
            (_, _, (code, *_)), *_ = pickle.loads(path.read_bytes()[CHECKSUM:])
            (tmp_path / f"{function.__name__}.o").write_bytes(code)
    files = sorted(tmp_path.glob("*.o"))
    assert len(files) > 20
    process = subprocess.run(
        ["objdump", "-d", "--no-show-raw-insn", *files], capture_output=True, text=True, check=True
    )
    texts = re.split(r"^.*file format.*$", process.stdout, flags=re.M)[1:]
    for file, text in zip(files, texts, strict=True):
        num_packed, num_scalar = (len(re.findall(ARITHMETIC + kind + r"\b", text)) for kind in ("pd", "sd"))
        assert (num_packed > num_scalar) != (file.stem in SCALAR), (file.stem, num_packed, num_scalar)
