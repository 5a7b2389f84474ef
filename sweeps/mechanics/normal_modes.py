"""Small oscillations of a natural system: points in, columns out, mode by mode; linear theory beside what is measured.

The measurement does not know the theory: of it places, modes (as directions) and the scale are used.
"""

from collections.abc import Mapping

import numpy as np

from kernels import codes, measure, statuses
from kernels import oscillations as kernel
from kernels.runs import SIZES, Runs, Sampling
from sweeps.mechanics import modes
from sweeps.mechanics.equilibria import runs_of
from sweeps.mechanics.landscape import matrix_change

CHUNK = 16384
EVEN = 1e-9  # third derivatives smaller than this, in the system's own units, make no second run
LEAST_SHARE = 1e-6  # of a nudge: a mode with less of it is left to rounding and to the others' cubes


# -- theory


def theory(model, points: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the predictions of linear theory for points.

    Args:
        model: of a natural system.
        points: each parameter, `equilibrium` (slot from 0), `mode` (from 1), `epsilon`, `phase`: shape (points,).

    Returns:
        What `Model.located` gives; `omega_squared` (s-2), `modes` (points, n, n), `a` (points, n, n), `terms` (points,
        n, n), `sizes` (points, n), `scale` (s-1), `uncertain` (by how much rounding of the place moves ω², over S²),
        `parameters` (a list of arrays); NaN where there is no equilibrium.
    """
    slot = np.asarray(points["equilibrium"])
    parameters = model.parameters(points, slot.size)
    group, back = runs_of([*parameters, slot])
    chosen = [p[group] for p in parameters]
    there = model.located(chosen, slot[group])
    there |= _linear(model.landscape, chosen, there["place"], there["place_uncertainty"])
    linear = {name: array[back] for name, array in there.items()}
    mode = np.asarray(points["mode"]) - 1
    squares, uncertain = (
        np.take_along_axis(linear.pop(name), mode[:, None], axis=1)[:, 0] for name in ("squares", "uncertain")
    )
    return linear | {"omega_squared": squares, "uncertain": uncertain, "parameters": parameters}


def _linear(landscape, parameters, place, hidden):
    q, nowhere, m = list(place.T), np.isnan(place).any(axis=1), place.shape[1]
    with np.errstate(all="ignore"):
        slopes, terms = landscape.slopes(parameters, q)
        hessian, terms, a = -slopes[:, :, :m], terms[:, :, :m], landscape.a(parameters, q)
        for matrix in (hessian, a, terms):
            matrix[nowhere] = np.nan  # where V″ is constant too
        sizes = modes.sizes(landscape, parameters, place, terms)
        terms, vanished = modes.bounding_terms(landscape, parameters, place, terms, sizes)
        hessian[vanished] = 0.0  # a place is known to a rounding, and V″ there to no better
        error = landscape.place_error(parameters, place, hidden)
    squares, vectors = modes.normal_modes(hessian, a)
    S = modes.scale(terms, a)
    pulled = matrix_change(
        lambda x: landscape.slopes(parameters, list(x.T))[0][:, :, :m], slopes[:, :, :m], place, error
    )
    heavier = matrix_change(lambda x: landscape.a(parameters, list(x.T)), a, place, error)
    changes = pulled / (S * S)[:, None, None] + heavier
    uncertain = np.nan_to_num(np.einsum("pik,pij,pjk->pk", np.abs(vectors), changes, np.abs(vectors)))
    twice = _twice(landscape.third(*parameters, *q), terms, a, sizes)
    linear = {"squares": squares, "modes": vectors, "a": a, "scale": S, "sizes": sizes}
    return linear | {"twice": twice, "terms": terms, "positive": modes.positive(a), "uncertain": uncertain}


def _twice(third, terms, a, sizes):
    """Return where runs from both sides are needed: V‴ beside V″ and a' beside a are not small in the sizes' units."""
    if not third:
        return np.ones(len(a), dtype=bool)
    m = a.shape[1]
    cubic, bent = np.split(np.abs(np.stack(third, axis=-1)), [m * (m + 1) * (m + 2) // 6], axis=1)
    unit = sizes.max(axis=1, initial=0.0)
    with np.errstate(all="ignore"):
        cubic = cubic.max(axis=1, initial=0.0) * unit / np.abs(terms).max(axis=(1, 2))
        bent = bent.max(axis=1, initial=0.0) * unit / np.abs(a).max(axis=(1, 2))
    return ~(np.maximum(np.nan_to_num(cubic), bent) <= EVEN)


# -- motion


def measured(model, points, theory, cycles: float, samples_per_cycle: int, tolerance: float, direction=None):
    """Measure points by their motions; only places, modes (as directions) and the scale are used from theory.

    Runs take so many cycles of 2π/S; samples are 0.5/S apart at most. The perturbation has the direction of the mode,
    or one number for each coordinate.

    Returns:
        `raw` (points, len(kernel.RAW)), `status` (int8), `spacing`, `reach` (the signed size of the mode's part of the
        perturbation, relative to the whole) and `share` (of the norm that the kinetic matrix makes).
    """
    sampling = Sampling.of(cycles, samples_per_cycle, tolerance)
    intervals, spacing, _ = sampling
    size, status = len(points["epsilon"]), theory["status"].copy()
    raw, here = np.full((size, len(kernel.RAW)), np.nan), status == statuses.OK
    unsound = here & ~np.isfinite(theory["scale"] * theory["modes"].sum(axis=(1, 2)))
    unbound = np.where(theory["positive"], statuses.NON_FINITE, statuses.KINETIC_ENERGY_NOT_POSITIVE)
    status[unsound] = unbound[unsound]
    which = np.flatnonzero(here & ~unsound)
    chosen, nudge = [p[which] for p in theory["parameters"]], (points["epsilon"] * theory["sizes"].T).T[which]
    wide = which[modes.too_wide(model.landscape, chosen, theory["place"][which], theory["terms"][which], nudge)]
    status[wide], unsound[wide] = statuses.PERTURBATION_TOO_LARGE, True
    which = np.flatnonzero(here & ~unsound)
    reach, share = np.ones(size), np.ones(size)
    for start in range(0, which.size, CHUNK):
        part = which[start : start + CHUNK]
        nudge = _nudge(points, theory, part, direction)
        reach[part], share[part] = nudge["reach"], np.maximum(nudge["start"], LEAST_SHARE)
        nudged = nudge["start"] >= LEAST_SHARE
        status[part[~nudged]] = statuses.NOT_PERTURBED
        if not nudged.all():
            part, nudge = part[nudged], {name: values[nudged] for name, values in nudge.items()}
        raw[part] = _run(model, points, theory, part, nudge, sampling)
        status[part] = kernel.status(raw[part], intervals, tolerance, spacing)
    wide = (status == statuses.OK) & kernel.is_too_wide(raw, theory["scale"], spacing)
    raw[wide], status[wide] = np.nan, statuses.PERTURBATION_TOO_LARGE
    return {"raw": raw, "status": status, "spacing": spacing, "reach": reach, "share": share}


def _nudge(points, theory, part, direction):
    """Return the perturbation of relative size one and its components along the modes.

    Returns:
        `along` (points, n); `projection` (points, n, n) to the modes' shares of it, the point's own first;
        `start`, the size of its own share; `reach`, the signed relative size of its part; `allowed`.
    """
    a, sizes = theory["a"][part], theory["sizes"][part]
    vectors = _nudged_first(theory["modes"][part], np.asarray(points["mode"])[part] - 1)
    first = vectors[:, :, 0]
    unit = 1.0 / np.abs(first / sizes).max(axis=1)
    if direction is None:
        one = np.ones(part.size)
        along, projection = first * unit[:, None], np.einsum("pjk,pji->pki", vectors, a) / unit[:, None, None]
        return {"along": along, "projection": projection, "start": one, "reach": one, "allowed": 0.0 * one}
    along = np.asarray(direction, dtype=np.float64) / np.abs(direction).max()
    along = along / np.abs(along / sizes).max(axis=1)[:, None]
    norm = np.sqrt(np.einsum("pi,pij,pj->p", along, a, along))
    projection = np.einsum("pjk,pji->pki", vectors, a) / norm[:, None, None]
    share = np.einsum("pi,pi->p", projection[:, 0], along)
    allowed = np.full(part.size, measure.WINDOW)
    reach = share * norm / unit
    return {"along": along, "projection": projection, "start": np.abs(share), "reach": reach, "allowed": allowed}


def _run(model, points, theory, part, nudge, sampling):
    parameters = [p[part] for p in theory["parameters"]]
    epsilon = np.asarray(points["epsilon"], dtype=np.float64)[part]
    phase = np.asarray(points["phase"], dtype=np.float64)[part]
    S, mode = theory["scale"][part], np.asarray(points["mode"])[part] - 1
    x = np.concatenate([nudge["along"] * np.cos(phase)[:, None], nudge["along"] * (-S * np.sin(phase))[:, None]], 1)
    signs = (1.0, -1.0) if theory["twice"][part].any() else (1.0, 1.0)  # the second is not read
    motions = [(size * epsilon, sign * x.T) for size in SIZES for sign in signs]
    starts = model.code.starts(parameters, theory["place"][part], motions)[:, None]
    places, m = nudge["projection"], model.equations.m
    project = np.zeros((part.size, m + 1, 2 * m))
    project[:, 0, :m], project[:, 1, m:], project[:, 2:, :m] = places[:, 0], places[:, 0] / S[:, None], places[:, 1:]
    twice = theory["twice"][part].astype(np.int64)
    family = m * np.asarray(points["equilibrium"], dtype=np.int64)[part] + mode
    given = np.stack([nudge["start"], nudge["allowed"]], axis=1)
    return kernel.run(model.code.integrator(), Runs(starts, project, S, epsilon, twice, family, given), sampling)


def _nudged_first(vectors, mode):
    """Return the modes with the perturbed one first, then the others in their order."""
    n = vectors.shape[2]
    others = np.broadcast_to(np.arange(n), (mode.size, n))
    order = np.argsort(np.where(others == mode[:, None], -1, others), axis=1, kind="stable")
    return np.take_along_axis(vectors, order[:, None, :], axis=2)


# -- both


def survey(
    model,
    points,
    cycles: float = 4,
    samples_per_cycle: int = 16,
    tolerance: float = 1e-10,
    direction=None,
    degenerate: bool = False,
):
    """Return all columns of points, in units; see `sweeps.systems.oscillator.system`."""
    linear = theory(model, points)
    motions = measured(model, points, linear, cycles, samples_per_cycle, tolerance, direction)
    columns = _columns(model, points, linear, motions)
    return columns | _at_amplitude(model, points, linear, columns["regime_theory"]) if degenerate else columns


def _at_amplitude(model, points, theory, regime):
    """Return frequencies at the perturbation's amplitude where V″ vanishes; see `sweeps.mechanics.degenerate`."""
    epsilon, phase = (np.asarray(points[name], dtype=np.float64) for name in ("epsilon", "phase"))
    size, place = theory["sizes"][:, 0], theory["place"][:, 0]
    x, v = epsilon * size * np.cos(phase), epsilon * size * theory["scale"] * np.sin(phase)
    columns = model.degenerate.oscillations(theory["parameters"], place, x, v)
    columns["degenerate_amplitude"] = columns["degenerate_amplitude"] / size
    marginal = regime == kernel.MARGINAL
    nothing = {name: 0 if values.dtype == np.int8 else np.nan for name, values in columns.items()}
    return {name: np.where(marginal, values, nothing[name]).astype(values.dtype) for name, values in columns.items()}


def _columns(model, points, theory, measured):
    raw, S = measured["raw"], theory["scale"]
    reduced = raw[:, kernel.RAW.reduced]
    epsilon, phase = (np.asarray(points[name], dtype=np.float64) for name in ("epsilon", "phase"))
    is_measured = np.isfinite(raw[:, kernel.RAW.rate2])
    with np.errstate(invalid="ignore"):
        uncertain = theory["uncertain"] * S * S
        error, left = (x + uncertain for x in kernel.errors(raw, S, measured["spacing"], measured["share"]))
        regime = kernel.regime(reduced, left)
        predicted = kernel.regime(theory["omega_squared"], 32.0 * codes.UNIT * S * S + uncertain)
    regime = np.where(is_measured, regime, -1).astype(np.int8)
    predicted = np.where(np.isfinite(theory["omega_squared"]), predicted, -1).astype(np.int8)
    columns = {
        "omega_squared_theory": theory["omega_squared"],
        "omega_squared": raw[:, kernel.RAW.rate2],
        "omega_squared_stderr": raw[:, kernel.RAW.stderr],
        "omega_squared_error": error,
        "omega_squared_reduced": reduced,
        "omega_squared_reduced_error": left,
        "amplitude_shift": raw[:, kernel.RAW.rate2] - reduced,
        **_rates("_theory", theory["omega_squared"], predicted),
        **_rates("", raw[:, kernel.RAW.rate2], regime, error),
        **_rates("_reduced", reduced, regime, left),
        **_log_slope(raw, regime),
        "regime_theory": predicted,
        "regime": regime,
        **model.columns_of_runs(theory, measured, raw[:, kernel.RAW.samples], raw[:, kernel.RAW.steps]),
        "energy_drift": raw[:, kernel.RAW.energy_drift],
    }
    columns["growth_rate_logslope_error"] = (
        np.abs(columns["growth_rate_logslope"] - columns["growth_rate_reduced"]) + columns["growth_rate_reduced_error"]
    )
    for name in ("growth_rate", "frequency"):
        rate, nothing = columns[name], np.full_like(S, np.nan)
        columns[f"{name}_stderr"] = np.divide(0.5 * raw[:, kernel.RAW.stderr], rate, out=nothing, where=rate > 0.0)
    amplitude, angle = _lecture_solution(epsilon * measured["reach"], phase, S, columns["frequency"])
    columns |= {"amplitude": amplitude, "initial_phase": angle}
    if model.system.follow:
        columns["branches_decided"] = (~theory["is_order_decided"]).astype(np.int8)
    return columns


def _rates(suffix, squares, regime, error=None):
    """Return the rates, and their errors to the farther end of the square's interval where these have an error.

    Missing where there is no such rate. Where it is marginal both rates are 0, and may be what the interval allows.
    """
    columns, missing = {}, np.where(regime < 0, np.nan, 0.0)
    for name, regime_of_rate, sign in (("growth_rate", kernel.UNSTABLE, -1.0), ("frequency", kernel.STABLE, 1.0)):
        is_one = regime == regime_of_rate
        with np.errstate(invalid="ignore"):
            rate = np.sqrt(np.maximum(sign * squares, 0.0))
            columns[f"{name}{suffix}"] = np.where(is_one, rate, missing)
            if error is not None:
                low, high = (np.sqrt(np.maximum(sign * squares + e, 0.0)) for e in (-error, error))
                farther = np.where(is_one, np.maximum(rate - low, high - rate), np.nan)
                columns[f"{name}{suffix}_error"] = np.where(regime == kernel.MARGINAL, high, farther)
    return columns


def _log_slope(raw, regime):
    """Return the lecture's estimator, where its window held at least two e-folds."""
    e_folds = np.where(regime == kernel.UNSTABLE, raw[:, kernel.RAW.e_folds], np.nan)
    is_long_enough = e_folds >= measure.LEAST_EFOLDS
    return {"growth_rate_logslope": np.where(is_long_enough, raw[:, kernel.RAW.log_slope], np.nan), "e_folds": e_folds}


def _lecture_solution(size, phase, S, frequency):
    """Return amplitude a and phase α of η = a cos(ωt + α), measured ω, from η(0) = s cos φ, η̇(0) = −s S sin φ."""
    with np.errstate(all="ignore"):
        ratio = np.where(frequency > 0.0, S / frequency, np.nan)
        sense = np.where(size < 0.0, -1.0, 1.0)
        sine, cosine = sense * ratio * np.sin(phase), sense * np.cos(phase)
        return np.abs(size) * np.hypot(cosine, sine), np.where(np.isnan(ratio), np.nan, np.arctan2(sine, cosine))
