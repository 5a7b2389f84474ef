"""The race of described systems: the same motions for Polhode and heyoka.py, at the same error, one core's processor.

    python tests/benchmarks/described_race.py [system …]

Motions begin 1e-3 of the states' sizes from a stable equilibrium of a sweep that ships, and are sampled at 64
intervals of 2π/16 over the scale. Errors are the largest distance of any sample from a run of ours at the tolerance
1e-15, which heyoka.py's at 1e-16 bears out, over the motion's largest deviation; the worst of all motions. Of each the
loosest tolerance with an error of 1e-10 at most is taken. heyoka.py runs in batches (the best of WIDTHS), its steps'
Taylor coefficients summed by compiled code, as in contenders.py. The survey's kernel, which integrates and measures,
is listed too, in motions a second. All run in fresh processes, and the fastest of each counts: the place of code in
memory changes its rate by up to a half. Nothing is asserted.
"""

import math
import sys
from unittest import mock

import numpy as np
import sympy as sp
from numba import njit
from timing import compare_rates, min_times, print_results

from kernels.flow import flows, oscillations, runs
from sweeps import systems
from sweeps.mechanics import motions
from sweeps.points import catalogue
from sweeps.points.loading import read_sweep

RACED = {
    "double_pendulum": "hanging",
    "lagrange_points": "",
    "sleeping_top": "",
}  # system → its equilibrium, "" for all
COUNT, INTERVALS, SIZE, ERROR = 4096, 64, 1e-3, 1e-10
ROUNDS, PROCESSES, ALONE = 15, 3, "--alone"
WIDTHS = (16, 32, 64)
TOLERANCES, FINER = 10.0 ** -np.arange(8.0, 16.1, 0.5), 10.0 ** np.array([0.375, 0.25, 0.125, 0.0])


class Task:
    """Motions of a system: parameters, starts (motions, states) and times (motions, samples)."""

    def __init__(self, name):
        self.model, random = systems.resolve(name).mechanism, np.random.default_rng(1)
        grid = read_sweep(catalogue.shipped_files()[name]).grid
        points = grid.points(0, min(grid.size, 65536))
        labels = {label: k for k, label in enumerate(self.model.system.names)}
        if RACED[name]:
            points = {key: values[points["equilibrium"] == RACED[name]] for key, values in points.items()}
        points["equilibrium"] = np.array([labels[str(label)] for label in points["equilibrium"]])
        theory, natural = self.model.theory(points), self.model.equations.natural
        rates = theory["omega_squared"] if natural else -np.abs(theory["eigenvalues"].real).max(1) / theory["scale"]
        with np.errstate(invalid="ignore"):
            stable = (theory["status"] == 0) & (rates > (0.0 if natural else -1e-9))
        selection = random.choice(np.flatnonzero(stable), COUNT)
        self.points = {key: values[selection] for key, values in points.items()} | {"epsilon": np.full(COUNT, SIZE)}
        self.parameters = [p[selection] for p in theory["parameters"]]
        S, place, sizes = (theory[key][selection] for key in ("scale", "place", "sizes"))
        n = self.model.equations.n
        if sizes.shape[1] < n:
            sizes = np.concatenate([sizes, sizes * S[:, None]], axis=1)
        self.place = np.concatenate([place, np.zeros((COUNT, n - place.shape[1]))], axis=1)
        self.start = self.place + SIZE * sizes * random.uniform(-1.0, 1.0, sizes.shape)
        spacing = 2.0 * np.pi / 16 / S
        self.times = spacing[:, None] * np.arange(INTERVALS + 1)
        self.truth = self.ours(1e-15)
        self.largest = np.abs(self.truth - self.place[:, None]).max(axis=(1, 2))

    def ours(self, tolerance):
        """Samples by Polhode's steps."""
        return motions.integrate_in_steps(self.model.moving, self.parameters, self.start, self.times, tolerance)[0]

    def error(self, samples):
        """Return the worst error of samples."""
        return float((np.abs(samples - self.truth).max(axis=(1, 2)) / self.largest).max())

    def loosest(self, run):
        """Return the loosest tolerance that keeps the error, to an eighth of a decade, and the error."""
        for coarse in TOLERANCES:
            if self.error(run(coarse)) <= ERROR:
                pairs = ((tolerance, self.error(run(tolerance))) for tolerance in coarse * FINER)
                return next(pair for pair in pairs if pair[1] <= ERROR)
        raise SystemExit("no tolerance keeps the error")


class Heyoka:
    """Samples of a task by heyoka.py."""

    def __init__(self, task, width):
        self.task, self.width, self.integrators = task, width, {}

    def integrator(self, tolerance):
        """Return the batch integrator of a tolerance."""
        import heyoka

        if tolerance not in self.integrators:
            equations, width = self.task.model.equations, self.width
            states = [*equations.q, *equations.v] if equations.v else [*equations.states]
            rates = [*equations.f]
            if equations.v:
                inverse = sp.Matrix(equations.a).inv().applyfunc(sp.simplify)
                rates = [*equations.v, *(inverse * sp.Matrix(list(equations.forces)))]
            symbols_used = set().union(*(e.free_symbols for e in rates))
            parameters = [symbol for symbol in equations.parameters if symbol in symbols_used]
            names = {symbol: heyoka.par[k] for k, symbol in enumerate(parameters)}
            self.parameter_indices = [equations.parameters.index(symbol) for symbol in parameters]
            variables = heyoka.make_vars(*(f"s{i}" for i in range(len(states))))
            names |= dict(zip(states, variables, strict=True))
            system = [(x, heyoka.from_sympy(e, names)) for x, e in zip(variables, rates, strict=True)]
            self.integrators[tolerance] = heyoka.taylor_adaptive_batch(
                system, np.ones((len(states), width)), tol=tolerance, fast_math=True
            )
        return self.integrators[tolerance]

    def __call__(self, tolerance):
        integrator, task, width = self.integrator(tolerance), self.task, self.width
        samples = np.empty((COUNT, INTERVALS + 1, task.start.shape[1]))
        due, step_starts = np.empty(width, dtype=np.int64), np.empty(width)
        for first in range(0, COUNT, width):
            selection = slice(first, first + width)
            integrator.set_time(0.0)
            integrator.state[:] = task.start[selection].T
            integrator.pars[:] = np.array([task.parameters[k][selection] for k in self.parameter_indices])
            due[:], step_starts[:] = 0, 0.0
            is_unfinished = True
            while is_unfinished:
                integrator.step(write_tc=True)
                is_unfinished = dense_output(
                    integrator.tc, step_starts, integrator.last_h, due, task.times[selection], samples[selection]
                )
        return samples


@njit(error_model="numpy", fastmath={"contract"})
def dense_output(coefficients, step_starts, step_sizes, due, times, samples):
    """Sum each lane's Taylor polynomials at the samples due within its step; lanes innermost; whether some are left."""
    states, last, width = coefficients.shape[0], coefficients.shape[1] - 1, step_starts.size
    t, x, ends, max_samples, is_unfinished = np.empty(width), np.empty(width), np.empty(width, dtype=np.int64), 0, False
    for lane in range(width):
        end = due[lane]
        while end < times.shape[1] and times[lane, end] <= step_starts[lane] + step_sizes[lane]:
            end += 1
        ends[lane], max_samples = end, max(max_samples, end - due[lane])
    for n in range(max_samples):
        for lane in range(width):
            t[lane] = times[lane, min(due[lane] + n, times.shape[1] - 1)] - step_starts[lane]
        for i in range(states):
            for lane in range(width):
                x[lane] = coefficients[i, last, lane]
            for term in range(last - 1, -1, -1):
                for lane in range(width):
                    x[lane] = x[lane] * t[lane] + coefficients[i, term, lane]
            for lane in range(width):
                if due[lane] + n < ends[lane]:
                    samples[lane, due[lane] + n, i] = x[lane]
    for lane in range(width):
        step_starts[lane] += step_sizes[lane]
        due[lane] = ends[lane]
        is_unfinished |= due[lane] < times.shape[1]
    return is_unfinished


class Survey:
    """The survey's kernel, motions a second."""

    def __init__(self, task):
        kernel = oscillations if task.model.equations.natural else flows
        with mock.patch.object(kernel, "measure_points", wraps=kernel.measure_points) as measure_points:
            task.model.survey(task.points)
        calls = measure_points.call_args_list
        self.work = lambda: [kernel.measure_points(*call.args, **call.kwargs) for call in calls]
        shapes = [(call.args[1].starts.shape, call.args[1].has_both_sides) for call in calls]
        sizes = len(runs.SIZES)
        single = sizes if kernel is oscillations else 1
        self.motions = sum(
            shape[1] * int(np.where(both_sizes > 0, 2 * sizes, single).sum()) for shape, both_sizes in shapes
        )


def race(name):
    """Print the rates of a system's race, of this process."""
    task = Task(name)
    ours = task.loosest(task.ours)
    lanes = {"Polhode steps": (lambda: task.ours(ours[0]), COUNT)}
    survey = Survey(task)
    lanes["Polhode survey, measuring"] = survey.work, survey.motions
    print(f"{name}: Polhode, tolerance {ours[0]:.1e}, error {ours[1]:.1e}", file=sys.stderr)
    try:
        import heyoka
    except ImportError:
        print("heyoka.py is not here", file=sys.stderr)
    else:
        deviation = task.error(Heyoka(task, 32)(1e-16))
        print(f"heyoka.py {heyoka.__version__}: its best at 1e-16 is {deviation:.1e} off", file=sys.stderr)
        for width in WIDTHS:
            peer = Heyoka(task, width)
            loosest = task.loosest(peer)
            print(f"heyoka.py, {width} lanes: tolerance {loosest[0]:.1e}, error {loosest[1]:.1e}", file=sys.stderr)
            lanes[f"heyoka.py, {width} lanes"] = (lambda peer=peer, at=loosest[0]: peer(at)), COUNT
    for label, (work, count) in lanes.items():
        print(f"{label}: {count / min_times(ROUNDS, work)[0]}")


def main(names):
    """Print the rate of the fastest process of each, and by how much others are slower."""
    for name in names:
        rates = print_results([[__file__, ALONE, name]] * PROCESSES)
        peer = max((max(values) for label, values in rates.items() if label.startswith("heyoka")), default=math.nan)
        for label, values in rates.items():
            print(f"{name}: {label} {compare_rates(values, peer, 'motions/s')}", flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == [ALONE]:
        race(sys.argv[2])
    else:
        main(sys.argv[1:] or RACED)
