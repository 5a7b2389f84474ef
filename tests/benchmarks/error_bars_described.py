"""Errors of described systems: random definitions of each shipped system, against 40 digits.

    python tests/benchmarks/error_bars.py --only-described [--definitions 2000]

Called by error_bars.py. Parameters are drawn over ten times the ranges of the shipped sweeps and more, some of them at
values of multiple eigenvalues; rotations, samples, tolerance, runs and the perturbation's direction over what the
contract allows, its size from 1e-30 to 0.5. Theory's own eigenvalues decide if their rounding cannot matter; else
the description's matrix is evaluated and its eigenvalues are found in 40 digits by mpmath.
"""

from functools import cached_property

import described
import mpmath
import numpy as np
import oscillators
import random_motions
import relative
import sympy as sp
from scipy.optimize import linear_sum_assignment

from kernels.estimator.statuses import OK
from kernels.flow import codes
from kernels.flow.oscillations import MARGINAL
from kernels.flow.runs import Sampling
from sweeps.mechanics import relative as spectra
from sweeps.mechanics.relative import THEORY_ROUNDING, regimes
from sweeps.schema.refusals import DescriptionError

DIGITS = 40
ROUNDING_OF_40_DIGITS = 1e-18  # relative to the scale, rounding of 40 digits in a zero part of two equal eigenvalues
CLOSED = {"mass_ratio": (1e-6, 0.5), "k1": (-0.999, 0.999), "k3": (-0.999, 0.999), "tilt": (0.01, 3.13)}
CLOSED |= {"exponent": (-1.95, 8.0), "axial_moment": (0.02, 1.98), "stiffness": (1.0, 2e4)}
OSCILLATOR = ("omega_squared", "growth_rate", "frequency")
OF_RATES = (*(f"{name}{end}" for name in OSCILLATOR for end in ("", "_reduced")), "growth_rate_logslope")
OF_EIGENVALUES = ("eigenvalue_real", "eigenvalue_imag")
INVARIANTS = {"sum_of_squares": 2, "product_of_squares": 4, "discriminant": 4}


class Exact:
    """The matrix of a description in 40 digits, from its own expressions.

    Args:
        model: of its equations the expressions, and doubles near the equilibria.
    """

    def __init__(self, model):
        self.model = model
        self.flow = None if model.equations.natural else model.equations

    @cached_property
    def functions(self):
        """Functions of the parameters and the position: zero functions, their slopes, the matrices; the labels."""
        if self.flow is None:
            equations = self.model.equations
            symbols, zeros = equations.q, list(equations.gradient)
            matrices = [equations.hessian, equations.a]
        else:
            flow = self.flow
            symbols, zeros = [place.symbol for place in flow.places], list(flow.pulls)
            matrices = [flow.slopes]
            if flow.v:
                upper = sp.zeros(flow.m).row_join(sp.eye(flow.m))
                matrices = [upper.col_join(flow.a.subs(flow.still).inv() * flow.slopes)]
        parameters = [p.symbol for p in self.model.system.parameters.values()]
        slopes = sp.Matrix([[e.diff(x) for x in symbols] for e in zeros])
        labels = [[label.get(x) for x in symbols] for label in self.model.system.labels.values()]
        labels = [label for label in labels if None not in label]
        arguments = (*parameters, *symbols)
        return (
            *(sp.lambdify(arguments, e, "mpmath") for e in (zeros, slopes)),
            [sp.lambdify(arguments, matrix, "mpmath") for matrix in matrices],
            [sp.lambdify(parameters, label, "mpmath") for label in labels],
        )

    def place(self, parameters, near):
        """The equilibrium in 40 digits: a label's, where that is one, else by Newton's steps."""
        zero_functions, slopes, _, labels = self.functions
        for label in labels:
            x = [mpmath.mpf(v) if not isinstance(v, mpmath.mpc) else v.real for v in label(*parameters)]
            if all(abs(a - b) < 1e-9 * (1 + abs(b)) for a, b in zip(x, near, strict=True)):
                size = max(abs(v) for v in slopes(*parameters, *x)) or 1
                if max(abs(v) for v in zero_functions(*parameters, *x)) < 1e-34 * size * (1 + max(abs(v) for v in x)):
                    return x
        x = mpmath.matrix([mpmath.mpf(float(v)) for v in near])
        for _ in range(5):
            x -= mpmath.lu_solve(mpmath.matrix(slopes(*parameters, *x)), mpmath.matrix(zero_functions(*parameters, *x)))
        return list(x)

    def eigenvalues(self, parameters, near):
        """Eigenvalues of a relative equilibrium, less one zero for each conserved quantity; ω² of an oscillator."""
        with mpmath.workdps(DIGITS):
            parameters = [mpmath.mpf(float(p)) for p in parameters]
            x = self.place(parameters, near)
            matrices = [mpmath.matrix(matrix(*parameters, *x)) for matrix in self.functions[2]]
            if self.flow is None:
                unit = mpmath.diag([1 / mpmath.sqrt(matrices[1][i, i]) for i in range(len(x))])  # whatever the units
                inverse = mpmath.cholesky(unit * matrices[1] * unit) ** -1 * unit
                return sorted(mpmath.eigsy(inverse * matrices[0] * inverse.T, eigvals_only=True))
            values = mpmath.eig(matrices[0], left=False, right=False)
            return sorted(values, key=abs)[len(values) - self.model.n :]


def _random_parameters(random, system, varied, count):
    """Values of each parameter, shape (count,): far beyond the shipped ranges, some at multiple eigenvalues."""
    columns = {name: np.full(count, p.default) for name, p in system.parameters.items()}
    for name, (low, high) in varied.items():
        lower_bound = max(low, 0.0) if system.parameters[name].positive or low >= 0.0 else -np.inf
        if name in CLOSED:
            values = random.uniform(*CLOSED[name], count)
        elif low > 0.0:
            values = np.exp(random.uniform(np.log(low / 10.0), np.log(high * 10.0), count))
        else:
            values = random.uniform(3.0 * low if lower_bound < 0.0 else 0.0, 3.0 * high, count)
        special = random.random(count)
        values = np.where((special < 0.05) & (lower_bound <= 0.0) & (low <= 0.0), 0.0, values)
        columns[name] = np.where((special > 0.9) & (name not in CLOSED), float(system.parameters[name].default), values)
    return columns


def _amplitudes(random, count):
    share = random.random(count)
    ways = (10.0 ** random.uniform(-12, np.log10(0.5), count), random.uniform(0.005, 0.5, count))
    return np.select([share < 0.5, share < 0.8], ways, 10.0 ** random.uniform(-30, -12, count))


def _points(random, system, numbers, varied, count):
    """Each equilibrium and mode or eigenvalue at random places."""
    slots = system.most * numbers
    columns = _random_parameters(random, system, varied, count) | {"epsilon": _amplitudes(random, count)}
    columns["phase"] = random.uniform(-np.pi, np.pi, count)
    columns = {name: np.repeat(values, slots) for name, values in columns.items()}
    columns["equilibrium"] = np.tile(np.repeat(np.arange(system.most), numbers), count)
    columns["number"] = np.tile(np.arange(1, numbers + 1), count * system.most)
    return columns


def _ratios(value, error, truth, unsure, exact):
    """Return deviations over errors, from `exact(i)` in 40 digits if the error of theory could decide."""
    with np.errstate(all="ignore"):
        ratios = np.abs(value - truth) / error
        close = np.flatnonzero(np.isfinite(value + error) & ~(np.abs(value - truth) + unsure <= error))
    ratios[np.isnan(ratios) & (value == truth) & (error == 0.0)] = 0.0
    for i in close:
        true = exact(i)
        deviation = abs(mpmath.mpf(float(value[i])) - true)
        ratios[i] = float(deviation / error[i]) if error[i] > 0.0 else (np.inf if deviation else 0.0)
    return ratios


def oscillator(name, model, exact, random, integration, count):
    """Of random points of an oscillator: parameters, status, wrong regimes, deviation over error of each column."""
    modes = len(model.system.kept)
    points = _points(random, model.system, modes, oscillators.LIBRARY[name], count)
    points["mode"] = points.pop("number")
    settings = (integration.rotations, integration.samples_per_rotation, integration.tolerance)
    direction = random.uniform(-1, 1, modes) if random.random() < 0.2 else None
    columns = model.survey(points, *settings, direction)
    theory = model.theory(points)
    condition = np.ones(len(points["mode"]))
    is_finite = np.isfinite(theory["a"]).all((1, 2))
    condition[is_finite] = np.linalg.cond(theory["a"][is_finite])
    unsure = THEORY_ROUNDING * condition * theory["scale"] ** 2
    cache = {}

    def square(i):
        key = (*(float(p[i]) for p in theory["parameters"]), int(points["equilibrium"][i]))
        if key not in cache:
            cache[key] = exact.eigenvalues([points[n][i] for n in model.names], theory["place"][i])
        return cache[key][int(points["mode"][i]) - 1]

    def rate(i, sign):
        with mpmath.workdps(DIGITS):
            return mpmath.sqrt(max(sign * square(i), mpmath.mpf(0)))

    truth = columns["omega_squared_theory"]
    truths = {"omega_squared": (truth, unsure, square)}
    for rate_name, sign in (("growth_rate", -1), ("frequency", 1)):
        with np.errstate(invalid="ignore"):
            low, middle, high = (np.sqrt(np.maximum(sign * x, 0.0)) for x in (truth - unsure, truth, truth + unsure))
            theory_error = np.maximum(np.abs(middle - low), np.abs(high - middle))
        truths[rate_name] = (middle, theory_error, lambda i, sign=sign: rate(i, sign))
    row = {"status": columns["status"], "regime": columns["regime"], "epsilon": points["epsilon"]}
    for column in OF_RATES:
        truth, unsure, true = truths[column.removesuffix("_reduced").removesuffix("_logslope")]
        row[column] = _ratios(columns[column], columns[f"{column}_error"], truth, unsure, true)
    has_regime = np.isin(columns["regime"], (0, 1))
    differs = np.flatnonzero(has_regime & (columns["regime"] != columns["regime_theory"]))
    is_wrong = np.zeros(has_regime.size, dtype=bool)
    is_wrong[differs] = [(columns["regime"][i] == 0) != (square(i) > 0) for i in differs]
    missing = ~np.isfinite(columns["omega_squared"] + columns["omega_squared_reduced_error"])
    return row | {"wrong": is_wrong, "marginal": columns["regime"] == MARGINAL, "missing": missing}


def flow(name, model, exact, random, integration, count):
    """Of random points of a relative equilibrium: parameters, status, wrong regimes, deviations over errors."""
    n = model.n
    points = _points(random, model.system, 1, relative.RANGES[name], count)
    runs = int(random.integers(1, 5)) if random.random() < 0.5 else spectra.usual_runs(model)
    theory = model.theory(points)
    sampling = Sampling.of(integration.rotations, integration.samples_per_rotation, integration.tolerance)
    columns = spectra.make_columns(model, theory, spectra.measure_points(model, points, theory, sampling, runs))
    values, S = theory["eigenvalues"], theory["scale"]
    unsure = (THEORY_ROUNDING * S)[:, None] * np.maximum(1.0, theory["condition"])
    unsure = np.where(np.isfinite(unsure), unsure, np.inf)
    cache = {}

    def spectrum(i):
        """Eigenvalues in 40 digits, in the order of theory's."""
        if i not in cache:
            exact_values = exact.eigenvalues([points[p][i] for p in model.names], theory["place"][i])
            distance = np.abs(values[i][:, None] - np.array([complex(v) for v in exact_values]))
            cache[i] = [exact_values[k] for k in linear_sum_assignment(distance)[1]]
        return cache[i]

    def invariant(i, which):
        with mpmath.workdps(DIGITS):
            total = sum(v * v for v in spectrum(i)).real / 2
            product = mpmath.fprod(spectrum(i)).real
            return {"sum_of_squares": total, "product_of_squares": product}.get(which, total**2 - 4 * product)

    row = {"status": columns["status"], "regime": columns["regime"], "epsilon": points["epsilon"]}
    for column in OF_EIGENVALUES:
        component = column.split("_")[1]
        flat = [x.ravel() for x in (columns[column], columns[f"{column}_error"], getattr(values, component), unsure)]
        exact_values = _ratios(
            *flat, lambda i, component=component: getattr(mpmath.mpmathify(spectrum(i // n)[i % n]), component)
        )
        row[column] = exact_values.reshape(-1, n)
    fastest = _ratios(
        columns["growth_rate"],
        columns["growth_rate_error"],
        values.real.max(1),
        unsure.max(1),
        lambda i: max(mpmath.mpmathify(v).real for v in spectrum(i)),
    )
    row["growth_rate"] = fastest
    for which, power in INVARIANTS.items() if n == 4 else ():
        settings = (columns[which], columns[f"{which}_error"], columns[f"{which}_theory"], THEORY_ROUNDING * S**power)
        row[which] = _ratios(*settings, lambda i, which=which: invariant(i, which))
    has_regime = (columns["regime"] >= 0) & (columns["regime"] != codes.MARGINAL)
    is_wrong = np.zeros(has_regime.size, dtype=bool)
    for i in np.flatnonzero(has_regime & (columns["regime"] != columns["regime_theory"])):
        exact_values = np.array([[complex(v) for v in spectrum(i)]])
        nothing = np.full((1, n), ROUNDING_OF_40_DIGITS * S[i])
        exact_values.imag[np.abs(exact_values.imag) < ROUNDING_OF_40_DIGITS * S[i]] = 0.0
        true = regimes(exact_values.real, exact_values.imag, nothing, nothing, None, theory["has_pairs"][[i]])
        is_wrong[i] = columns["regime"][i] not in (true[0], codes.UNSTABLE if true[0] == codes.FLUTTER else true[0])
    missing = ~np.isfinite(columns["eigenvalue_real"] + columns["eigenvalue_real_error"]).all(1)
    row |= {"wrong": is_wrong, "marginal": columns["regime"] == codes.MARGINAL, "missing": missing}
    with np.errstate(invalid="ignore"):
        grows = columns["growth_rate_theory"] > 10.0 * columns["growth_rate_error"]
    return row | {"withheld": grows & ~has_regime}


def random_tables(count, points=20, seed=1, max_samples=400, names=None):
    """Yield the name of each system that ships, and the table of its random definitions: arrays over their points."""
    for name in (*oscillators.LIBRARY, *relative.RANGES) if names is None else names:
        kind = oscillator if name in oscillators.LIBRARY else flow
        random = np.random.default_rng([seed, sum(map(ord, name))])
        model = described.model_of(name)
        exact, tables = Exact(model), []
        for _ in range(count):
            integration = random_motions.random_integration(random, max_samples)
            try:
                tables.append(kind(name, model, exact, random, integration, points))
            except DescriptionError:
                continue  # no point of this definition has an equilibrium
        yield name, {key: np.concatenate([table[key] for table in tables]) for key in tables[0]}


def columns_of(table):
    """Names of the columns that have an error."""
    return [name for name in table if name in (*OF_RATES, *OF_EIGENVALUES, *INVARIANTS)]


def lines(tables):
    """Lines of the tables: each column whole and in its worst tenth by ε; missing, marginal and wrong points."""
    for name, table in tables:
        ok = table["status"] == OK
        yield from ("", f"{name}:", *random_motions.HEADER)
        for column in columns_of(table):
            ratio = table[column].reshape(ok.size, -1)
            epsilon = np.repeat(table["epsilon"], ratio.shape[1])
            ratio = np.where(np.isfinite(ratio) & ok[:, None], ratio, np.nan).ravel()
            if not np.isnan(ratio).all():
                yield random_motions.row_of(column, ratio, {"epsilon": epsilon})
        yield (
            f"{ok.size:,} points, {100 * ok.mean():.1f} % ok, {(table['wrong'] & ok).sum()} wrong regimes, "
            f"{100 * table['marginal'][ok].mean():.1f} % marginal, "
            f"{(table['withheld'] & ok).sum() if 'withheld' in table else 0} withheld at ten errors of growth, "
            f"{(table['missing'] & ok).sum()} missing with status ok"
        )
