"""The contenders of the race: each in its best known mode, on the same bodies, sampled at the same times.

A contender's ``settings`` are the steps of its accuracy. ``rates(bodies, setting)`` is timed: the signed rate²
and its standard error of every body, and the processor time spent in its own processes. ``samples(bodies, setting)``
gives the samples themselves, from the same solver in the same mode, for comparison with the exact solution.
"""

import importlib.metadata
import multiprocessing
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np
from bodies import END, SAMPLES, SPACING, TIMES, rate_of, rates_of
from numba import njit, prange

from kernels.compile.jit import takes_whole_vectors
from kernels.estimator import measure
from kernels.free import direct, rigid_body
from kernels.near_axis import near_axis_block, propagators, survey

TOLERANCES = tuple(10.0**-n for n in range(6, 13))
SHARES = 4  # shares per thread or process, in sequence, so that a thread that is held up leaves work to its neighbours
REQUESTED = ("omega_squared", "omega_squared_stderr", "status")  # columns of all contenders: no errors, no regime


class Contender:
    """Base class of the contenders."""

    name, mode, package = "", "", None
    settings = TOLERANCES
    size, chunk = 2_000, 1  # bodies in a timed run, and the divisor of their number
    one_core = False

    def __init__(self, threads):
        self.threads = 1 if self.one_core else threads

    def version(self):
        return importlib.metadata.version(self.package)

    def close(self):
        """End started threads and processes."""


class Polhode(Contender):
    """The survey's kernel on threads of the pipeline's kind."""

    package, size = "numba", 100_000
    run = (END / (2.0 * np.pi), 2.0 * np.pi / SPACING)

    def __init__(self, threads):
        super().__init__(threads)
        self.pool = ThreadPoolExecutor(threads)

    def version(self):
        return f"this, Numba {super().version()}"

    def rates(self, bodies, setting):
        cuts = np.linspace(0, len(bodies), min(SHARES * self.threads, len(bodies)) + 1).astype(int)
        slices = [slice(i, j) for i, j in pairwise(cuts)]
        results = list(
            self.pool.map(lambda part_of_bodies: self.measured(bodies, part_of_bodies, setting, REQUESTED), slices)
        )
        columns = [np.concatenate([part_of_bodies[name] for part_of_bodies in results]) for name in REQUESTED[:2]]
        return np.stack(columns, axis=1), 0.0

    def measured(self, bodies, selection, tolerance, names):
        points = {name: x[selection] for name, x in bodies.points.items()}
        return survey.measure_points(points, *self.run, tolerance, self.propagator, names)

    def samples(self, bodies, setting):
        """Samples of the lanes, driven as the survey drives them; its steps a sample must come out the same."""
        steps = self.measured(bodies, slice(None), setting, ("steps_per_sample",))["steps_per_sample"]
        samples = np.empty((len(bodies), TIMES.size, 2))
        for i in range(len(bodies)):
            order, count = self.step(bodies[i : i + 1], setting)
            assert count == steps[i], (count, steps[i])
            _samples_of(_row(bodies[i : i + 1], count), order, count, samples[i])
        return samples

    def close(self):
        self.pool.shutdown()


def _row(body, steps):
    """Return one body's values of the rows that near_axis_block.integrate_block reads."""
    points = {name: x[0] for name, x in body.points.items()}
    moments = rigid_body.relabel(points["I1"], points["I2"], points["I3"], points["axis"])
    return np.array([*moments, 1.0, points["epsilon"], *body.start[0, 1:], SPACING, steps])


@njit(error_model="numpy")
def _samples_of(row, order, steps, samples):
    """Integrate one body in all lanes of a block and store the samples of lane 0."""
    S = np.zeros(near_axis_block.ROWS * near_axis_block.W)
    for r in range(row.size):
        S[near_axis_block.W * r : near_axis_block.W * (r + 1)] = row[r]
    near_axis_block.begin_block(S)
    if order == propagators.RECURRENCE:
        near_axis_block.begin_recurrence(S)
    for k in range(samples.shape[0]):
        if k > 0:
            near_axis_block.advance_lanes(S, order, steps)
        samples[k, 0], samples[k, 1] = S[near_axis_block.row.b], S[near_axis_block.row.c]


class Direct(Polhode):
    """The direct integrator, uncertified: its peers have no certificate either."""

    name, propagator = "Polhode direct", "direct"
    mode = "Taylor steps of order 8 to 12 chosen per body, 32 lanes, a thread per core"

    @staticmethod
    def step(body, tolerance):
        """Order and steps a sample of one body, as the survey chooses them."""
        size = min(1.0, measure.MAX_GROWTH * body.points["epsilon"][0] * np.exp(0.5))
        coefficients = tuple(direct.truncation(size, order) for order in direct.ORDERS)
        points = {name: x[0] for name, x in body.points.items()}
        moments = rigid_body.relabel(points["I1"], points["I2"], points["I3"], points["axis"])
        bound = max(abs(x) for x in rigid_body.euler_coefficients(*moments))
        x = bound * SPACING * np.sqrt(1.0 + points["epsilon"] ** 2)
        return direct.choose_steps(x, size, coefficients, SAMPLES, tolerance)


class Exact(Polhode):
    """The exact solution by its recurrence, one step a sample."""

    name, propagator, settings = "Polhode exact", "exact", (0.0,)
    size = 400_000  # a run as long as its peers': the bodies are taken several times
    mode = "addition theorem of the closed form, one step a sample, 32 lanes, a thread per core"
    step = staticmethod(lambda body, tolerance: (propagators.RECURRENCE, 1))

    def measured(self, bodies, selection, tolerance, names):
        return super().measured(bodies, selection, 1e-10, names)


class Heyoka(Contender):
    """heyoka.py: adaptive Taylor in wide batches, one process per core (its Python side keeps the GIL).

    The dense output takes most of the time of propagate_grid. Evaluated by Numba instead, from the Taylor
    coefficients that every step leaves, the same samples come twice as fast; wide batches share the calls from Python.
    """

    name, package, size = "heyoka.py", "heyoka", 8_192
    mode = "taylor_adaptive_batch of 64, step(write_tc=True), dense output by Numba, fast_math, a process per core"
    width, gridded = 64, False

    def __init__(self, threads):
        super().__init__(threads)
        import heyoka

        if self.gridded:
            self.width = 32 if takes_whole_vectors() else heyoka.recommended_simd_size()
        self.pool = multiprocessing.get_context("spawn").Pool(threads)

    def rates(self, bodies, setting):
        return self.mapped(_heyoka_rates, bodies, setting)

    def samples(self, bodies, setting):
        return self.mapped(_heyoka_samples, bodies, setting)[0]

    def mapped(self, work, bodies, setting):
        """Return the processes' results of equal shares, the last batch padded, and their processor time."""
        batches = -(-len(bodies) // self.width)
        indices = np.arange(batches * self.width) % len(bodies)
        k, start = (np.ascontiguousarray(x[indices].T) for x in (bodies.k, bodies.start))
        cuts = np.linspace(0, batches, min(SHARES * self.threads, batches) + 1).astype(int) * self.width
        shares = [
            (setting, k[:, i:j].copy(), start[:, i:j].copy(), self.width, self.gridded) for i, j in pairwise(cuts)
        ]
        results = self.pool.starmap(work, shares, chunksize=1)
        return np.concatenate([out for out, _ in results])[: len(bodies)], sum(seconds for _, seconds in results)

    def close(self):
        self.pool.terminate()
        self.pool.join()


class HeyokaGrid(Heyoka):
    """heyoka.py as its manual shows it; with vectors of 512 bits (force_avx512) in batches of four of them."""

    name, gridded = "heyoka.py propagate_grid", True
    mode = "taylor_adaptive_batch of the SIMD width (32 where force_avx512 is taken), propagate_grid, fast_math"


_integrators = {}  # of this process, by tolerance and width


def _heyoka_integrator(tolerance, width, on_grid):
    if (tolerance, width) not in _integrators:
        import heyoka

        a, b, c = heyoka.make_vars("a", "b", "c")
        ka, kb, kc = (heyoka.par[i] for i in range(3))
        _integrators[tolerance, width] = heyoka.taylor_adaptive_batch(
            [(a, ka * (b * c)), (b, kb * (c * a)), (c, kc * (a * b))],
            np.ones((3, width)),
            pars=np.zeros((3, width)),
            tol=tolerance,
            compact_mode=False,
            fast_math=True,
            force_avx512=on_grid and takes_whole_vectors(),  # batches of 64 are no faster with it, and often slower
        )
    return _integrators[tolerance, width]


def _heyoka_batches(tolerance, k, start, width, on_grid):
    """Transverse samples (2, times, width) of batch after batch, in one array that each batch overwrites."""
    integrator = _heyoka_integrator(tolerance, width, on_grid)
    state, pars, coefficients, step_sizes = integrator.state, integrator.pars, integrator.tc, integrator.last_h
    times = np.repeat(TIMES[:, None], width, axis=1)
    samples, due = np.empty((2, TIMES.size, width)), np.empty(width, dtype=np.int64)
    step_starts, *scratch = (np.empty(width) for _ in range(4))
    for i in range(0, k.shape[1], width):
        integrator.set_time(0.0)
        state[:], pars[:] = start[:, i : i + width], k[:, i : i + width]
        if on_grid:
            samples = integrator.propagate_grid(times)[1][:, 1:].transpose(1, 0, 2)
        else:
            step_starts[:], due[:] = 0.0, 0
            is_unfinished = True
            while is_unfinished:
                integrator.step(write_tc=True)
                is_unfinished = _dense_output(coefficients, step_starts, step_sizes, due, samples, *scratch)
        yield slice(i, i + width), samples


@njit(error_model="numpy", fastmath={"contract"})
def _dense_output(coefficients, step_starts, step_sizes, due, samples, t, b, c):
    """Evaluate each lane's Taylor polynomials at the samples due within its step; lanes innermost, hence packed."""
    width, last, max_samples, is_unfinished = step_starts.size, coefficients.shape[1] - 1, 0, False
    for lane in range(width):
        max_samples = max(max_samples, _samples_until(step_starts[lane] + step_sizes[lane]) - due[lane])
    for n in range(max_samples):
        of_b, of_c = coefficients[1, last], coefficients[2, last]
        for lane in range(width):
            t[lane] = (due[lane] + n) * SPACING - step_starts[lane]
            b[lane], c[lane] = of_b[lane], of_c[lane]
        for term in range(1, last + 1):
            of_b, of_c = coefficients[1, last - term], coefficients[2, last - term]
            for lane in range(width):
                b[lane] = b[lane] * t[lane] + of_b[lane]
            for lane in range(width):
                c[lane] = c[lane] * t[lane] + of_c[lane]
        for lane in range(width):
            sample = due[lane] + n
            # a step's polynomial is valid a little beyond its end, so rounding may put a sample into either step
            if sample < TIMES.size and t[lane] <= step_sizes[lane] + 1e-12:
                samples[0, sample, lane], samples[1, sample, lane] = b[lane], c[lane]
    for lane in range(width):
        step_starts[lane] += step_sizes[lane]
        due[lane] = max(due[lane], _samples_until(step_starts[lane]))
        is_unfinished |= due[lane] < TIMES.size
    return is_unfinished


@njit(error_model="numpy", forceinline=True)
def _samples_until(t):
    """Number of samples at times up to t."""
    return min(int(t / SPACING) + 1, TIMES.size)


def _heyoka_rates(tolerance, k, start, *mode):
    begin = time.process_time()
    out = np.empty((k.shape[1], 2))
    for batch, (b, c) in _heyoka_batches(tolerance, k, start, *mode):
        rates_of(b.T, c.T, out[batch])
    return out, time.process_time() - begin


def _heyoka_samples(tolerance, k, start, *mode):
    batches = _heyoka_batches(tolerance, k, start, *mode)
    return np.concatenate([samples.transpose(2, 1, 0).copy() for _, samples in batches]), 0.0


class CyRK(Contender):
    """CyRK: DOP853 in C++, called from compiled code with a compiled right-hand side."""

    name, package, size = "CyRK DOP853", "CyRK", 8_000
    mode = "nbsolve2_ivp under prange, right-hand side a Numba cfunc, a thread per core"

    def __init__(self, threads):
        super().__init__(threads)
        from CyRK import cyjit, nbsolve2_ivp

        @cyjit
        def right_hand_side(dw, t, w, k):
            dw[0], dw[1], dw[2] = k[0] * (w[1] * w[2]), k[1] * (w[2] * w[0]), k[2] * (w[0] * w[1])

        @njit(parallel=True, error_model="numpy")
        def run(address, k, start, times, tolerance, out, samples):
            for i in prange(k.shape[0]):
                solution = nbsolve2_ivp(
                    address, (times[0], times[-1]), start[i], "DOP853", times, False, k[i], tolerance, tolerance
                )
                w = solution.y
                out[i] = rate_of(w[1], w[2])
                if samples.size > 0:
                    samples[i] = w[1:].T
                solution.free()

        self.right_hand_side, self.run = right_hand_side, run

    def rates(self, bodies, setting, samples=None):
        out, samples = np.empty((len(bodies), 2)), np.empty((0, TIMES.size, 2)) if samples is None else samples
        self.run(self.right_hand_side.address, bodies.k, bodies.start, TIMES, setting, out, samples)
        return out, 0.0

    def samples(self, bodies, setting):
        samples = np.empty((len(bodies), TIMES.size, 2))
        self.rates(bodies, setting, samples)
        return samples


class Diffrax(Contender):
    """diffrax: Dopri8 over a batch, by so many equal steps a sample, which spares it the error control."""

    name, package, size, chunk, settings = "diffrax Dopri8, fixed", "diffrax", 4_096, 4_096, (1, 2, 3)
    mode = "vmap, x64, jit, StepTo with every sample a step, a thread per core over chunks of 2,048"
    width = 2_048

    def __init__(self, threads):
        super().__init__(threads)
        import jax

        jax.config.update("jax_enable_x64", True)
        import diffrax

        def right_hand_side(t, w, k):  # a tuple for a state is faster than an array of three
            return k[0] * (w[1] * w[2]), k[1] * (w[2] * w[0]), k[2] * (w[0] * w[1])

        def samples_of(start, k, steps):
            controller = diffrax.StepTo(jax.numpy.linspace(0.0, END, SAMPLES * steps + 1))
            solution = diffrax.diffeqsolve(
                *(diffrax.ODETerm(right_hand_side), diffrax.Dopri8(), 0.0, END, None, tuple(start)),
                args=tuple(k), saveat=diffrax.SaveAt(t0=True, steps=True), stepsize_controller=controller,
                max_steps=SAMPLES * steps, throw=False,
            )  # fmt: skip
            return solution.ys[1][::steps], solution.ys[2][::steps]

        self.pool = ThreadPoolExecutor(threads)
        self.solve = jax.jit(jax.vmap(samples_of, in_axes=(0, 0, None)), static_argnums=(2,))

    def version(self):
        return f"{super().version()}, JAX {importlib.metadata.version('jax')}"

    def rates(self, bodies, setting):
        out = np.empty((len(bodies), 2))

        def work(first):
            chunk = slice(first, first + self.width)
            b, c = self.solve(bodies.start[chunk], bodies.k[chunk], setting)
            rates_of(np.asarray(b), np.asarray(c), out[chunk])

        list(self.pool.map(work, range(0, len(bodies), self.width)))
        return out, 0.0

    def samples(self, bodies, setting):
        batch = bodies[np.arange(self.width) % len(bodies)]  # the compiled shape
        return np.stack(self.solve(batch.start, batch.k, setting), axis=-1)[: len(bodies)]

    def close(self):
        self.pool.shutdown()


class SciPy(Contender):
    """SciPy's solve_ivp, body after body."""

    name, package, size, one_core = "SciPy DOP853", "scipy", 12, True
    mode = "solve_ivp in a loop, one core, right-hand side on plain floats"

    def rates(self, bodies, setting):
        out = np.empty((len(bodies), 2))
        samples = self.samples(bodies, setting)
        rates_of(samples[:, :, 0], samples[:, :, 1], out)
        return out, 0.0

    def samples(self, bodies, setting):
        from scipy.integrate import solve_ivp

        samples = np.empty((len(bodies), TIMES.size, 2))
        for i in range(len(bodies)):
            ka, kb, kc = bodies.k[i].tolist()

            def right_hand_side(t, w, ka=ka, kb=kb, kc=kc):
                a, b, c = w.tolist()
                return ka * (b * c), kb * (c * a), kc * (a * b)

            solution = solve_ivp(
                right_hand_side, (0.0, END), bodies.start[i], "DOP853", TIMES, rtol=setting, atol=setting
            )
            samples[i] = solution.y[1:].T
        return samples


ALL = (Direct, Exact, Heyoka, HeyokaGrid, CyRK, Diffrax, SciPy)
