"""Small oscillations of a natural system, mode by mode: linear theory, and rates measured from motions.

The measurement uses places, modes (as directions) and the scale of theory, but no rate.
"""

from collections.abc import Mapping

import numpy as np

from kernels.estimator import measure, statuses
from kernels.flow import codes
from kernels.flow import oscillations as kernel
from kernels.flow.runs import SIZES, Runs, Sampling
from sweeps.mechanics import modes
from sweeps.mechanics.equilibria import runs_of
from sweeps.mechanics.landscape import matrix_change

MAX_CHUNK_POINTS = 16384  # points that are measured together, which bounds the memory
MAX_EVEN_DERIVATIVE = 1e-9  # third derivatives, in units of the sizes, that need no motion from the opposite side
MIN_SHARE = 1e-6  # share of the perturbation below which a mode's motion is rounding and the other modes' cubic terms


# -- theory


def theory(model, points: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the predictions of linear theory for points.

    Args:
        model: of a natural system.
        points: each parameter, `equilibrium` (slot from 0), `mode` (from 1), `epsilon`, `phase`: shape (points,).

    Returns:
        The result of `Model.place_columns`; `omega_squared` (s-2), `modes` (points, n, n), `a` (points, n, n), `terms`
        (points, n, n), `sizes` (points, n), `scale` (s-1), `uncertain` (error of ω² by that of the
        place, over S²), `parameters` (a list of arrays); NaN where there is no equilibrium.
    """
    slot = np.asarray(points["equilibrium"])
    parameters = model.parameters(points, slot.size)
    first_rows, row_index = runs_of([*parameters, slot])
    values = [p[first_rows] for p in parameters]
    columns = model.place_columns(values, slot[first_rows])
    columns |= _linear_theory(model.landscape, values, columns["place"], columns["place_uncertainty"])
    columns_of_points = {name: array[row_index] for name, array in columns.items()}
    mode = np.asarray(points["mode"]) - 1
    squares, uncertain = (
        np.take_along_axis(columns_of_points.pop(name), mode[:, None], axis=1)[:, 0]
        for name in ("squares", "uncertain")
    )
    return columns_of_points | {"omega_squared": squares, "uncertain": uncertain, "parameters": parameters}


def _linear_theory(landscape, parameters, place, uncertainty):
    """Return the linear theory of points: a dictionary of arrays, NaN if there is no equilibrium.

    Returns:
        `squares` (ω², s-2, (points, m)), `modes`, `a`, `scale`, `sizes`, `terms` and `uncertain` as of :func:`theory`,
        `twice` (True if runs from both sides are needed) and `positive` (True if a is positive definite).

    Args:
        landscape: F and its slopes.
        parameters: one array (points,) for each.
        place: equilibria, shape (points, m).
        uncertainty: half-width of the region that rounding leaves for them, shape (points, m).
    """
    q, is_missing, m = list(place.T), np.isnan(place).any(axis=1), place.shape[1]
    with np.errstate(all="ignore"):
        slopes, terms = landscape.slopes(parameters, q)
        hessian, terms, a = -slopes[:, :, :m], terms[:, :, :m], landscape.a(parameters, q)
        for matrix in (hessian, a, terms):
            matrix[is_missing] = np.nan  # where V″ is constant too
        sizes = modes.sizes(landscape, parameters, place, terms)
        terms, is_zero = modes.bounding_terms(landscape, parameters, place, terms, sizes)
        hessian[is_zero] = 0.0  # a place is known to a rounding, and V″ there to no better
        error = landscape.place_error(parameters, place, uncertainty)
    squares, vectors = modes.normal_modes(hessian, a)
    S = modes.scale(terms, a)
    curvature_change = matrix_change(
        lambda x: landscape.slopes(parameters, list(x.T))[0][:, :, :m], slopes[:, :, :m], place, error
    )
    mass_change = matrix_change(lambda x: landscape.a(parameters, list(x.T)), a, place, error)
    changes = curvature_change / (S * S)[:, None, None] + mass_change
    uncertain = np.nan_to_num(np.einsum("pik,pij,pjk->pk", np.abs(vectors), changes, np.abs(vectors)))
    even = _is_two_sided(landscape.third(*parameters, *q), terms, a, sizes)
    linear = {"squares": squares, "modes": vectors, "a": a, "scale": S, "sizes": sizes}
    return linear | {"twice": even, "terms": terms, "positive": modes.is_positive_definite(a), "uncertain": uncertain}


def _is_two_sided(third, terms, a, sizes):
    """Return True for points that need runs from both sides: V‴/V″ or a'/a is not small in units of the sizes.

    `third` has the third derivatives of V and then the slopes of `a`; without any, all points need both sides.
    """
    if not third:
        return np.ones(len(a), dtype=bool)
    m = a.shape[1]
    cubic, mass_slopes = np.split(np.abs(np.stack(third, axis=-1)), [m * (m + 1) * (m + 2) // 6], axis=1)
    unit = sizes.max(axis=1, initial=0.0)
    with np.errstate(all="ignore"):
        cubic = cubic.max(axis=1, initial=0.0) * unit / np.abs(terms).max(axis=(1, 2))
        mass_slopes = mass_slopes.max(axis=1, initial=0.0) * unit / np.abs(a).max(axis=(1, 2))
    return ~(np.maximum(np.nan_to_num(cubic), mass_slopes) <= MAX_EVEN_DERIVATIVE)


# -- measurement


def measure_points(model, points, theory, sampling: Sampling, direction=None):
    """Measure points by their motions; only places, modes (as directions) and the scale are used from theory.

    Args:
        model: of a natural system.
        points: as of :func:`theory`.
        theory: its result.
        sampling: number, distance and accuracy of the samples.
        direction: of the perturbation, one number for each coordinate; by default that of the mode.

    Returns:
        `raw` (points, len(kernel.RAW)), `status` (int8), `spacing`, `reach` (the signed size of the mode's part of the
        perturbation, relative to the whole) and `share` (of the norm that the kinetic matrix makes).
    """
    size, status = len(points["epsilon"]), theory["status"].copy()
    raw, exists = np.full((size, len(kernel.RAW)), np.nan), status == statuses.OK
    is_unusable = exists & ~np.isfinite(theory["scale"] * theory["modes"].sum(axis=(1, 2)))
    reasons = np.where(theory["positive"], statuses.NON_FINITE, statuses.KINETIC_ENERGY_NOT_POSITIVE)
    status[is_unusable] = reasons[is_unusable]
    which = np.flatnonzero(exists & ~is_unusable)
    values, perturbation = [p[which] for p in theory["parameters"]], (points["epsilon"] * theory["sizes"].T).T[which]
    too_wide = which[
        modes.is_too_wide(model.landscape, values, theory["place"][which], theory["terms"][which], perturbation)
    ]
    status[too_wide], is_unusable[too_wide] = statuses.PERTURBATION_TOO_LARGE, True
    which = np.flatnonzero(exists & ~is_unusable)
    reach, share = np.ones(size), np.ones(size)
    for start in range(0, which.size, MAX_CHUNK_POINTS):
        chunk = which[start : start + MAX_CHUNK_POINTS]
        perturbation = _perturbation(points, theory, chunk, direction)
        reach[chunk], share[chunk] = perturbation["reach"], np.maximum(perturbation["start"], MIN_SHARE)
        is_perturbed = perturbation["start"] >= MIN_SHARE
        status[chunk[~is_perturbed]] = statuses.NOT_PERTURBED
        if not is_perturbed.all():
            chunk = chunk[is_perturbed]
            perturbation = {name: values[is_perturbed] for name, values in perturbation.items()}
        raw[chunk] = _integrate_runs(model, points, theory, chunk, perturbation, sampling)
        status[chunk] = kernel.row_status(raw[chunk], sampling)
    too_wide = (status == statuses.OK) & kernel.is_too_wide(raw, theory["scale"], sampling.spacing)
    raw[too_wide], status[too_wide] = np.nan, statuses.PERTURBATION_TOO_LARGE
    return {"raw": raw, "status": status, "spacing": sampling.spacing, "reach": reach, "share": share}


def _perturbation(points, theory, rows, direction):
    """Return the perturbation of relative size one and its components along the modes.

    Returns:
        `along` (points, n); `projection` (points, n, n) to the modes' shares of it, the point's own first;
        `start`, the size of its own share; `reach`, the signed relative size of its part; `allowed`.
    """
    a, sizes = theory["a"][rows], theory["sizes"][rows]
    vectors = _perturbed_first(theory["modes"][rows], np.asarray(points["mode"])[rows] - 1)
    first = vectors[:, :, 0]
    unit = 1.0 / np.abs(first / sizes).max(axis=1)
    if direction is None:
        units = np.ones(rows.size)
        along, projection = first * unit[:, None], np.einsum("pjk,pji->pki", vectors, a) / unit[:, None, None]
        return {"along": along, "projection": projection, "start": units, "reach": units, "allowed": 0.0 * units}
    along = np.asarray(direction, dtype=np.float64) / np.abs(direction).max()
    along = along / np.abs(along / sizes).max(axis=1)[:, None]
    norm = np.sqrt(np.einsum("pi,pij,pj->p", along, a, along))
    projection = np.einsum("pjk,pji->pki", vectors, a) / norm[:, None, None]
    share = np.einsum("pi,pi->p", projection[:, 0], along)
    allowed = np.full(rows.size, measure.MAX_GROWTH)
    reach = share * norm / unit
    return {"along": along, "projection": projection, "start": np.abs(share), "reach": reach, "allowed": allowed}


def _integrate_runs(model, points, theory, rows, perturbation, sampling):
    """Return the raw measurements of runs, shape (rows, len(kernel.RAW)).

    Args:
        model: of a natural system.
        points: as of :func:`theory`.
        theory: its result, and `twice` of :func:`_linear_theory`.
        rows: indices of the points.
        perturbation: result of :func:`_perturbation` for these.
        sampling: length and samples of a run.
    """
    parameters = [p[rows] for p in theory["parameters"]]
    epsilon = np.asarray(points["epsilon"], dtype=np.float64)[rows]
    phase = np.asarray(points["phase"], dtype=np.float64)[rows]
    S, mode = theory["scale"][rows], np.asarray(points["mode"])[rows] - 1
    x = np.concatenate(
        [perturbation["along"] * np.cos(phase)[:, None], perturbation["along"] * (-S * np.sin(phase))[:, None]], 1
    )
    signs = (1.0, -1.0) if theory["twice"][rows].any() else (1.0, 1.0)  # the second is not read
    motions = [(size * epsilon, sign * x.T) for size in SIZES for sign in signs]
    starts = model.code.starts(parameters, theory["place"][rows], motions)[:, None]
    projection, m = perturbation["projection"], model.equations.m
    project = np.zeros((rows.size, m + 1, 2 * m))
    project[:, 0, :m], project[:, 1, m:] = projection[:, 0], projection[:, 0] / S[:, None]
    project[:, 2:, :m] = projection[:, 1:]
    is_two_sided = theory["twice"][rows].astype(np.int64)
    block_group = m * np.asarray(points["equilibrium"], dtype=np.int64)[rows] + mode  # such points share blocks
    given_values = np.stack([perturbation["start"], perturbation["allowed"]], axis=1)
    return kernel.measure_points(
        model.code.integrator(), Runs(starts, project, S, epsilon, is_two_sided, block_group, given_values), sampling
    )


def _perturbed_first(vectors, mode):
    """Return the modes, the perturbed one first."""
    n = vectors.shape[2]
    modes = np.broadcast_to(np.arange(n), (mode.size, n))
    order = np.argsort(np.where(modes == mode[:, None], -1, modes), axis=1, kind="stable")
    return np.take_along_axis(vectors, order[:, None, :], axis=2)


# -- columns


def survey(
    model,
    points,
    cycles: float = 4,
    samples_per_cycle: int = 16,
    tolerance: float = 1e-10,
    direction=None,
    degenerate: bool = False,
):
    """Return all columns of points, in units; see `sweeps.systems.oscillator.system`.

    Args:
        model: of a natural system.
        points: as of :func:`theory`.
        cycles: length of a run, in 2π/S.
        samples_per_cycle: samples in 2π/S; they are 0.5/S apart at most.
        tolerance: relative truncation error allowed over a run.
        direction: as of :func:`measure_points`.
        degenerate: add the columns of frequencies at the perturbation's amplitude, for points with V″ = 0.
    """
    linear = theory(model, points)
    motions = measure_points(model, points, linear, Sampling.of(cycles, samples_per_cycle, tolerance), direction)
    columns = _columns(model, points, linear, motions)
    return columns | _at_amplitude(model, points, linear, columns["regime_theory"]) if degenerate else columns


def _at_amplitude(model, points, theory, regime):
    """Return frequencies at the perturbation's amplitude if V″ vanishes; see `sweeps.mechanics.degenerate`."""
    epsilon, phase = (np.asarray(points[name], dtype=np.float64) for name in ("epsilon", "phase"))
    size, place = theory["sizes"][:, 0], theory["place"][:, 0]
    x, v = epsilon * size * np.cos(phase), epsilon * size * theory["scale"] * np.sin(phase)
    columns = model.degenerate.oscillations(theory["parameters"], place, x, v)
    columns["degenerate_amplitude"] = columns["degenerate_amplitude"] / size
    marginal = regime == kernel.MARGINAL
    nothing = {name: 0 if values.dtype == np.int8 else np.nan for name, values in columns.items()}
    return {name: np.where(marginal, values, nothing[name]).astype(values.dtype) for name, values in columns.items()}


def _columns(model, points, theory, results):
    """Return the columns of `survey`, from the dictionaries of :func:`theory` and :func:`measure_points`."""
    raw, S = results["raw"], theory["scale"]
    reduced = raw[:, kernel.RAW.reduced]
    epsilon, phase = (np.asarray(points[name], dtype=np.float64) for name in ("epsilon", "phase"))
    is_measured = np.isfinite(raw[:, kernel.RAW.rate2])
    with np.errstate(invalid="ignore"):
        uncertain = theory["uncertain"] * S * S
        error, reduced_error = (x + uncertain for x in kernel.find_errors(raw, S, results["spacing"], results["share"]))
        regime = kernel.find_regime(reduced, reduced_error)
        predicted_regime = kernel.find_regime(theory["omega_squared"], 32.0 * codes.UNIT * S * S + uncertain)
    regime = np.where(is_measured, regime, -1).astype(np.int8)
    predicted_regime = np.where(np.isfinite(theory["omega_squared"]), predicted_regime, -1).astype(np.int8)
    columns = {
        "omega_squared_theory": theory["omega_squared"],
        "omega_squared": raw[:, kernel.RAW.rate2],
        "omega_squared_stderr": raw[:, kernel.RAW.stderr],
        "omega_squared_error": error,
        "omega_squared_reduced": reduced,
        "omega_squared_reduced_error": reduced_error,
        "amplitude_shift": raw[:, kernel.RAW.rate2] - reduced,
        **_rates("_theory", theory["omega_squared"], predicted_regime),
        **_rates("", raw[:, kernel.RAW.rate2], regime, error),
        **_rates("_reduced", reduced, regime, reduced_error),
        **_log_slope(raw, regime),
        "regime_theory": predicted_regime,
        "regime": regime,
        **model.columns_of_runs(theory, results, raw[:, kernel.RAW.samples], raw[:, kernel.RAW.steps]),
        "energy_drift": raw[:, kernel.RAW.energy_drift],
    }
    columns["growth_rate_logslope_error"] = (
        np.abs(columns["growth_rate_logslope"] - columns["growth_rate_reduced"]) + columns["growth_rate_reduced_error"]
    )
    for name in ("growth_rate", "frequency"):
        rate, nothing = columns[name], np.full_like(S, np.nan)
        columns[f"{name}_stderr"] = np.divide(0.5 * raw[:, kernel.RAW.stderr], rate, out=nothing, where=rate > 0.0)
    amplitude, angle = _lecture_solution(epsilon * results["reach"], phase, S, columns["frequency"])
    columns |= {"amplitude": amplitude, "initial_phase": angle}
    if model.system.follow:
        columns["branches_decided"] = (~theory["is_order_decided"]).astype(np.int8)
    return columns


def _rates(suffix, squares, regime, error=None):
    """Return the rates and, with an error of the square, errors to the farther end of its interval.

    A rate that does not exist is NaN. If the regime is marginal, both rates are 0, with an error from the interval.
    """
    columns, missing = {}, np.where(regime < 0, np.nan, 0.0)
    for name, regime_of_rate, sign in (("growth_rate", kernel.UNSTABLE, -1.0), ("frequency", kernel.STABLE, 1.0)):
        applies = regime == regime_of_rate
        with np.errstate(invalid="ignore"):
            rate = np.sqrt(np.maximum(sign * squares, 0.0))
            columns[f"{name}{suffix}"] = np.where(applies, rate, missing)
            if error is not None:
                low, high = (np.sqrt(np.maximum(sign * squares + e, 0.0)) for e in (-error, error))
                farther_end = np.where(applies, np.maximum(rate - low, high - rate), np.nan)
                columns[f"{name}{suffix}_error"] = np.where(regime == kernel.MARGINAL, high, farther_end)
    return columns


def _log_slope(raw, regime):
    """Return the log-slope estimate of the growth rate; NaN if its window has less than LEAST_EFOLDS e-folds."""
    e_folds = np.where(regime == kernel.UNSTABLE, raw[:, kernel.RAW.e_folds], np.nan)
    is_long_enough = e_folds >= measure.MIN_E_FOLDS
    return {"growth_rate_logslope": np.where(is_long_enough, raw[:, kernel.RAW.log_slope], np.nan), "e_folds": e_folds}


def _lecture_solution(size, phase, S, frequency):
    """Return amplitude a and phase α of η = a cos(ωt + α), measured ω, from η(0) = s cos φ, η̇(0) = −s S sin φ."""
    with np.errstate(all="ignore"):
        ratio = np.where(frequency > 0.0, S / frequency, np.nan)
        sense = np.where(size < 0.0, -1.0, 1.0)
        sine, cosine = sense * ratio * np.sin(phase), sense * np.cos(phase)
        return np.abs(size) * np.hypot(cosine, sine), np.where(np.isnan(ratio), np.nan, np.arctan2(sine, cosine))
