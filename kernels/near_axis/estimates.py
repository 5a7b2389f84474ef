r"""Rates, errors and statuses from the sums of a block of W lanes, in units of s.

The sums are those of :mod:`kernels.near_axis.near_axis_block`; columns are written to rows of the same scratch array.
Cases are selected without branches, so that the loop over lanes stays packed: square roots and divisions then take an
eighth of the time.
"""

import math

import numpy as np

from kernels.compile import columns
from kernels.compile.blocks import W
from kernels.compile.columns import Column
from kernels.compile.jit import INLINE, INNER, OPTIONS, njit
from kernels.compile.llvm_formulas import formula
from kernels.estimator import measure, reduction, uncertainty
from kernels.estimator.statuses import NON_FINITE, NOT_CONVERGED, OK, SHORT_WINDOW
from kernels.free import direct, linear
from kernels.near_axis import near_axis_block, propagators
from kernels.near_axis.near_axis_block import row

# Work that is done if a column needs it; ERRORS need the certificate and the reduction, RATES and LOG_SLOPE the errors.
CERTIFICATE, INVARIANTS, LOG_SLOPE, REDUCTION = "certificate", "invariants", "log slope", "reduction"
ERRORS, RATES = "errors", "rates"
COLUMNS = (
    Column("omega_squared", power=2),
    Column("omega_squared_stderr", power=2),
    Column("omega_squared_error", power=2, work=ERRORS),
    Column("omega_squared_reduced", power=2, work=REDUCTION),
    Column("omega_squared_reduced_error", power=2, work=ERRORS),
    Column("amplitude_shift", power=2, work=REDUCTION),
    Column("omega_squared_error_scatter", power=2, work=REDUCTION),
    Column("omega_squared_error_integration", power=2, work=ERRORS),
    Column("omega_squared_error_amplitude", power=2, work=REDUCTION),
    Column("omega_squared_error_rounding", power=2, work=REDUCTION),
    *(
        Column(rate + suffix, power=1, work=RATES)
        for rate in ("growth_rate", "frequency")
        for suffix in ("", "_stderr", "_error", "_reduced", "_reduced_error")
    ),
    Column("growth_rate_logslope", power=1, work=LOG_SLOPE),
    Column("growth_rate_logslope_error", power=1, work=LOG_SLOPE),
    Column("e_folds", power=0, work=LOG_SLOPE),
    Column("euler_period", power=-1, work=RATES),
    Column("regime", power=0, dtype=np.int8, work=ERRORS),
    Column("samples_used", power=0, dtype=np.int32),
    Column("window_end", power=-1),
    Column("steps_per_sample", power=0, dtype=np.int32),
    Column("status", power=0, dtype=np.int8),
    Column("energy_drift", power=0, work=INVARIANTS),
    Column("momentum_drift", power=0, work=INVARIANTS),
    Column("perturbation_drift", power=0, work=INVARIANTS),
    Column("propagation_error", power=0, work=CERTIFICATE),
)
MEASURED = tuple(column.name for column in COLUMNS)
FIRST_COLUMN = near_axis_block.ROWS  # row of the first column
column = columns.numbers(MEASURED, FIRST_COLUMN, W)
# Auxiliary rows: |omega0| or NaN (the input, s-1). Dimensionless are the rates², the standard error, slopes by D, both
# errors of a rate², and the reduced rate with its error.
AUXILIARY = (
    *("spin_rate", "rate2", "stderr", "slope", "reduced", "reduced_slope"),
    *("error", "reduced_error", "rate", "rate_error"),
)
aux = columns.numbers(AUXILIARY, FIRST_COLUMN + len(COLUMNS), W)
ROWS = FIRST_COLUMN + len(COLUMNS) + len(AUXILIARY)


@njit(**INLINE)
def _reduced_D(S, lane):
    """Return D of the reduced motion of one lane."""
    return S[row.guess + lane] - 0.5 * S[row.sx + lane] / (S[row.xx + lane] + S[row.sw + lane])


@njit(**INLINE)
def _measured_D(S, lane):
    """Return the measured D of one lane."""
    return S[row.guess + lane] - 0.5 * S[row.rx + lane] / S[row.xx + lane]


@njit(**OPTIONS)
def _write_squares(S, is_reduced):
    """Write rates² and their slopes by D, reduced if ``is_reduced``; return whether a lane's D is too large."""
    is_large = 0
    for lane in range(W):
        spacing, D = S[row.spacing + lane], _measured_D(S, lane)
        value, slope = measure.rate_squared_of_turn(D)
        S[aux.rate2 + lane], S[aux.slope + lane] = value / spacing / spacing, slope / spacing / spacing
        is_large |= 0 if abs(D) <= measure.MAX_SERIES_D else 1
    if is_reduced:
        for lane in range(W):
            spacing, D = S[row.spacing + lane], _reduced_D(S, lane)
            value, slope = measure.rate_squared_of_turn(D)
            S[aux.reduced + lane], S[aux.reduced_slope + lane] = value / spacing / spacing, slope / spacing / spacing
            is_large |= 0 if abs(D) <= measure.MAX_SERIES_D else 1
    return is_large > 0


@njit(**OPTIONS)
def _write_large_squares(S):
    """Write the same as :func:`_write_squares` lane by lane, for a D of any size."""
    for lane in range(W):
        spacing, D, reduced = S[row.spacing + lane], _measured_D(S, lane), _reduced_D(S, lane)
        if not abs(D) <= measure.MAX_SERIES_D:
            S[aux.rate2 + lane], S[aux.slope + lane] = measure.rate_squared(D, spacing)
        if not abs(reduced) <= measure.MAX_SERIES_D:
            S[aux.reduced + lane], S[aux.reduced_slope + lane] = measure.rate_squared(reduced, spacing)


@formula
def _standard_error(slope, sum_rx, sum_rr, sum_xx, samples_used):
    """Return the standard error of a slope, its scatter over the sum of squares; NaN for fewer than two triples."""
    scatter = max(sum_rr - sum_rx * sum_rx / sum_xx, 0.0)
    stderr = slope * math.sqrt(scatter / ((2.0 * samples_used - 5.0) * 4.0 * sum_xx))
    return stderr if samples_used >= 4.0 else math.nan


@njit(**INNER)
def _fill_square(S, certified, tolerance):
    """Write the measured Ω² and its basis; fewer than three samples give none.

    The certificate may reach the tolerance plus the growth of rounding at the start, 2e-15 e^{λt}, for which see
    :func:`_accept_grown_rounding`. Rounding in either solution also shifts the phase of a motion of n samples by less
    than 1e-16 n^{3/2}.
    """
    for lane in range(W):
        samples_used, spacing, spin = (S[row.samples + lane], S[row.spacing + lane], S[aux.spin_rate + lane])
        rx, rr, xx = S[row.rx + lane], S[row.rr + lane], S[row.xx + lane]
        stderr = _standard_error(S[aux.slope + lane], rx, rr, xx, samples_used)
        is_measured = (samples_used >= 3.0) & (spin - spin == 0.0)
        rate2 = S[aux.rate2 + lane] if is_measured else math.nan
        S[aux.rate2 + lane], S[aux.stderr + lane] = rate2, stderr
        S[column.omega_squared + lane] = rate2 * spin * spin
        S[column.omega_squared_stderr + lane] = stderr * spin * spin
        S[column.samples_used + lane], S[column.steps_per_sample + lane] = samples_used, S[row.steps + lane]
        S[column.window_end + lane] = (samples_used - 1.0) * spacing / spin
        distance = math.sqrt(S[row.distance2 + lane] / S[row.distance_size2 + lane])
        S[column.propagation_error + lane] = distance
        state = S[row.a + lane] + S[row.b + lane] + S[row.c + lane]
        short = samples_used < measure.MIN_SAMPLES
        is_undefined = (rate2 - rate2 != 0.0) & ((state - state != 0.0) | (samples_used >= measure.MIN_SAMPLES))
        near = distance <= tolerance + 2e-15 + 1e-16 * samples_used * math.sqrt(samples_used)
        status = OK if near | (not certified) else NOT_CONVERGED
        status = SHORT_WINDOW if short else status
        S[column.status + lane] = NON_FINITE if is_undefined else status


@njit(**INNER)
def _accept_grown_rounding(S, tolerance):
    """Set the status OK of growing motions, with which rounding at the start has grown."""
    for lane in range(W):
        growth = -S[aux.rate2 + lane]
        if S[column.status + lane] == NOT_CONVERGED and growth > 0.0:
            samples_used = S[row.samples + lane]
            growth_factor = math.exp(math.sqrt(growth) * (samples_used - 1.0) * S[row.spacing + lane])
            allowed = tolerance + 2e-15 * growth_factor + 1e-16 * samples_used * math.sqrt(samples_used)
            if S[column.propagation_error + lane] <= allowed:
                S[column.status + lane] = OK


@njit(**INNER)
def _fill_errors(S, step, rounded, is_full):
    """Write the reduced Ω², the terms of both errors and the regime, which follows from the reduced one.

    ``step``: of :mod:`kernels.near_axis.propagators`; ``rounded``: the moments are ratios, rounded once each;
    ``is_full``: the reduction was done to its last order.
    """
    exactly, order = propagators.IS_EXACT[step], propagators.ORDER[step]
    is_near, is_nearest = propagators.IS_NEAR[step], propagators.IS_NEAREST[step]
    for lane in range(W):
        samples_used, spacing, spin = (S[row.samples + lane], S[row.spacing + lane], S[aux.spin_rate + lane])
        rate2 = S[aux.rate2 + lane]
        reduced = S[aux.reduced + lane] if rate2 - rate2 == 0.0 else math.nan
        sx, ss, inverse = S[row.sx + lane], S[row.ss + lane], 1.0 / S[row.xx + lane]
        per = 1.0 / ((samples_used - 1.0) * spacing)
        samples = (samples_used - 1.0) * per
        distance = samples_used * uncertainty.UNIT if exactly else S[column.propagation_error + lane]
        squares = max(ss - sx * sx * inverse, 0.0) * inverse
        scatter = uncertainty.scatter(S[aux.reduced_slope + lane], squares, samples_used, reduced, spacing)
        rate = math.sqrt(abs(reduced))
        steps, growth = (S[row.steps + lane], S[row.max_size2 + lane] / S[row.start_size2 + lane])
        Ia, Ib, Ic = S[row.Ia + lane], S[row.Ib + lane], S[row.Ic + lane]
        bend = max(abs(S[row.cb + lane]), abs(S[row.cc + lane]))
        bound = max(abs(Ib - Ic) / Ia, bend)
        epsilon = S[row.epsilon + lane]
        size, x = (epsilon * math.sqrt(S[row.max_size2 + lane]), bound * spacing * math.sqrt(1.0 + epsilon * epsilon))
        cubic = direct.nearest_truncation(x, size, samples_used) if is_nearest else math.inf
        cubic = direct.near_truncation(x, size, samples_used) if is_near else cubic
        truncation = uncertainty.truncation_error(rate * spacing / steps, (samples_used - 1.0) * steps, order)
        end = uncertainty.end_error(distance, growth, 0.0 if exactly else min(truncation, cubic))
        integration = uncertainty.integration(reduced, rate, distance, end, per, spacing)
        integration += distance * abs(reduced) if exactly else 0.0
        rms_part = reduction.rms_part(S[row.rr + lane], ss, inverse, samples)
        remainder = rms_part * reduction.SMALL_WANDER
        if is_full:
            remainder = uncertainty.amplitude(reduced, rms_part, S[row.wander + lane], spacing, per, bound)
        moment_error = uncertainty.moment_rounding(reduced, Ia, Ib, Ic, rounded)
        S[aux.rate + lane] = rate
        rounding = uncertainty.rounding(rate, samples, samples_used, bend) + moment_error
        shift = rate2 - reduced
        amplitude = abs(shift) + remainder
        error = scatter + integration + rounding
        S[aux.error + lane], S[aux.reduced_error + lane] = error + amplitude, error + remainder
        end = linear.STABLE_MINOR if S[row.turning + lane] * S[row.spin + lane] < 0.0 else linear.STABLE_MAJOR
        regime = linear.UNSTABLE if reduced < 0.0 else end
        regime = regime if abs(reduced) > error + remainder else linear.MARGINAL
        regime = linear.SPHERE if (Ia == Ib) & (Ib == Ic) else regime
        S[column.regime + lane] = regime if rate2 - rate2 == 0.0 else -1
        S[column.omega_squared_error + lane] = (error + amplitude) * spin * spin
        S[column.omega_squared_reduced + lane] = reduced * spin * spin
        S[column.omega_squared_reduced_error + lane] = (error + remainder) * spin * spin
        S[column.amplitude_shift + lane] = shift * spin * spin
        S[column.omega_squared_error_scatter + lane] = scatter * spin * spin
        S[column.omega_squared_error_integration + lane] = integration * spin * spin
        S[column.omega_squared_error_amplitude + lane] = amplitude * spin * spin
        S[column.omega_squared_error_rounding + lane] = rounding * spin * spin


@njit(**INNER)
def _widen_short_windows(S):
    """Widen errors and regimes if the axis wanders far within few samples (:mod:`kernels.estimator.uncertainty`)."""
    for lane in range(W):
        spin, reduced = S[aux.spin_rate + lane], S[aux.reduced + lane]
        more = uncertainty.clock_correction_error(reduced, S[row.wander + lane], S[row.samples + lane] - 1.0)
        if more > 0.0:
            S[aux.error + lane] += more
            S[aux.reduced_error + lane] += more
            S[column.omega_squared_error_amplitude + lane] += more * spin * spin
            S[column.omega_squared_error + lane] = S[aux.error + lane] * spin * spin
            S[column.omega_squared_reduced_error + lane] = S[aux.reduced_error + lane] * spin * spin
            if S[column.regime + lane] >= 0.0 and abs(reduced) <= S[aux.reduced_error + lane]:
                S[column.regime + lane] = linear.MARGINAL


def _rate_writer(reduced):
    """Return a function that writes the rates of the measured Ω², or of the reduced one, known when it is compiled."""
    square_of, error_of = (aux.reduced, aux.reduced_error) if reduced else (aux.rate2, aux.error)
    names = [rate + ("_reduced" if reduced else "") for rate in ("growth_rate", "frequency")]
    growth, frequency = (getattr(column, name) for name in names)
    growth_error, frequency_error = (getattr(column, f"{name}_error") for name in names)

    @njit(name="fill_reduced_rates" if reduced else "fill_rates", **OPTIONS)
    def fill_rates(S):
        """Write growth rate or frequency, by the regime, and errors from the measured square, for each lane."""
        for lane in range(W):
            spin, regime = S[aux.spin_rate + lane], S[column.regime + lane]
            square, error = S[square_of + lane], S[error_of + lane]
            unstable, marginal = regime == linear.UNSTABLE, regime == linear.MARGINAL
            stable = (regime == linear.STABLE_MINOR) | (regime == linear.STABLE_MAJOR)
            signed_square = -square if unstable else square
            rate = S[aux.rate + lane] if reduced else math.sqrt(max(signed_square, 0.0))
            # roots of the upper end of the square's interval, and of the size of its lower end
            high, end = math.sqrt(max(signed_square + error, 0.0)), math.sqrt(abs(signed_square - error))
            low, high_decay = (end, 0.0) if signed_square > error else (0.0, end)
            rate_error = uncertainty.interval_distance(max(signed_square, 0.0), error, rate, low, high)
            none = 0.0 if regime >= 0.0 else math.nan
            S[growth + lane] = rate * spin if unstable else none
            S[frequency + lane] = rate * spin if stable else none
            # rates of marginal points are 0; their errors are the ends of the square's interval
            marginal_error = high_decay if marginal else math.nan
            S[growth_error + lane] = (rate_error if unstable else marginal_error) * spin
            marginal_error = high if marginal else math.nan
            S[frequency_error + lane] = (rate_error if stable else marginal_error) * spin
            if reduced:
                S[aux.rate_error + lane] = rate_error if unstable | stable else math.nan
            else:
                divisor = rate if rate > 0.0 else math.nan
                stderr = 0.5 * S[aux.stderr + lane] / divisor * spin
                S[column.growth_rate_stderr + lane] = stderr if unstable else math.nan
                S[column.frequency_stderr + lane] = stderr if stable else math.nan
                S[column.euler_period + lane] = 2.0 * math.pi / divisor / spin if stable else math.nan

    return fill_rates


_fill_rates, _fill_reduced_rates = _rate_writer(False), _rate_writer(True)


@njit(**INNER)
def _fill_log_slope(S):
    """Write the log slope, if the growth in its window was at least two e-folds.

    Its error is its distance from the reduced rate, which uses more samples, plus that rate's error: the line itself
    does not show how the transient bends it.
    """
    for lane in range(W):
        n, spin = S[row.log_samples + lane], S[aux.spin_rate + lane]
        has_slope = (S[column.regime + lane] == linear.UNSTABLE) & (n >= 2.0)
        e_folds = 0.5 * measure.logarithm(S[row.log_last + lane] / S[row.log_first + lane])
        slope = measure.slope_of_products(
            n, S[row.log_p + lane], S[row.p_exponent + lane], S[row.log_q + lane], S[row.q_exponent + lane]
        )
        rate = 0.5 * slope / S[row.spacing + lane]
        rate = rate if has_slope & (e_folds >= measure.MIN_E_FOLDS) else math.nan
        S[column.e_folds + lane] = e_folds if has_slope else math.nan
        S[column.growth_rate_logslope + lane] = rate * spin
        error = abs(rate - S[aux.rate + lane]) + S[aux.rate_error + lane]
        S[column.growth_rate_logslope_error + lane] = error * spin


@njit(**INNER)
def _fill_drifts(S):
    """Write the relative drifts of energy, of L² and of the perturbation's invariant J."""
    for lane in range(W):
        S[column.energy_drift + lane] = S[row.E_change + lane] / S[row.E + lane]
        S[column.momentum_drift + lane] = S[row.L2_change + lane] / S[row.L2 + lane]
        drift, scale = S[row.J_change + lane] / S[row.J_scale + lane], S[row.J_scale + lane]
        S[column.perturbation_drift + lane] = drift if scale > 0.0 else 0.0


@njit(**OPTIONS)
def write_columns(S, work, reduced, step, rounded, tolerance):
    """Write every lane's columns from its sums, in units of s.

    Args:
        `S` (numpy.ndarray, shape (ROWS * W,)): Scratch after :func:`kernels.near_axis.near_axis_block.integrate_block`,
            with the row spin_rate filled. Column k of lane l is written to ``S[(FIRST_COLUMN + k) * W + l]``; columns
            are undefined if their work was not done.
        work, reduced, step: As in :func:`kernels.near_axis.near_axis_block.integrate_block`.
        rounded, tolerance: As in :class:`kernels.near_axis.survey.RunSettings`.
    """
    with_exact, with_invariants, with_log, _, with_rates = work
    if _write_squares(S, reduced != near_axis_block.NO_REDUCTION):
        _write_large_squares(S)
    _fill_square(S, with_exact, tolerance)
    if with_exact:
        _accept_grown_rounding(S, tolerance)
    if reduced != near_axis_block.NO_REDUCTION:
        _fill_errors(S, step, rounded, reduced == near_axis_block.FULL_REDUCTION)
        if reduced == near_axis_block.FULL_REDUCTION:
            _widen_short_windows(S)
        if with_rates:
            _fill_rates(S)
            _fill_reduced_rates(S)
        if with_log:
            _fill_log_slope(S)
    if with_invariants:
        _fill_drifts(S)
