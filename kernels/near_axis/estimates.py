r"""Estimates: from the sums of W lanes to their columns, in units, side by side.

What :mod:`kernels.near_axis.near_axis_block` has summed up becomes rates, errors and statuses here, in rows of the same
scratch array, by selection where a case differs, so that the loop over lanes stays packed: square roots and divisions
cost a lane what an eighth of them does alone.
"""

import math

import numpy as np

from kernels.compile import columns
from kernels.compile.blocks import W
from kernels.compile.columns import Column
from kernels.compile.jit import INLINE, INNER, OPTIONS, njit, whole_vectors
from kernels.compile.llvm_formulas import formula
from kernels.estimator import measure, reduction, uncertainty
from kernels.estimator.statuses import NON_FINITE, NOT_CONVERGED, OK, SHORT_WINDOW
from kernels.free import direct, linear
from kernels.near_axis import near_axis_block, propagators
from kernels.near_axis.near_axis_block import row

# Work that is done where it is asked for; ERRORS stand on the certificate and on the reduction, RATES and LOG_SLOPE on
# the errors.
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
        Column(rate + part, power=1, work=RATES)
        for rate in ("growth_rate", "frequency")
        for part in ("", "_stderr", "_error", "_reduced", "_reduced_error")
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
FIRST = near_axis_block.ROWS  # row of the first column
column = columns.numbers(MEASURED, FIRST, W)
# Auxiliary rows: |omega0| or NaN (the input, s-1); dimensionless: the rates², the standard error, slopes by D, errors
# of both rates², and the reduced rate with its error.
AUXILIARY = ("spin_rate", "rate2", "stderr", "slope", "reduced", "reduced_slope", "error", "left", "rate", "rate_error")
aux = columns.numbers(AUXILIARY, FIRST + len(COLUMNS), W)
ROWS = FIRST + len(COLUMNS) + len(AUXILIARY)


@njit(**INLINE)
def _reduced_turn(S, lane):
    """Return D of the reduced motion."""
    return S[row.guess + lane] - 0.5 * S[row.sx + lane] / (S[row.xx + lane] + S[row.sw + lane])


@njit(**INLINE)
def _turn(S, lane):
    """Return D as measured."""
    return S[row.guess + lane] - 0.5 * S[row.rx + lane] / S[row.xx + lane]


@njit(**OPTIONS)
def _squares(S, followed):
    """Return rates² and their slopes by D, the reduced ones where followed, and whether a lane's D is too large."""
    whole_vectors()
    beyond = 0
    for lane in range(W):
        spacing, D = S[row.spacing + lane], _turn(S, lane)
        value, slope = measure.rate_squared_of_turn(D)
        S[aux.rate2 + lane], S[aux.slope + lane] = value / spacing / spacing, slope / spacing / spacing
        beyond |= 0 if abs(D) <= measure.MAX_SERIES_D else 1
    if followed:
        for lane in range(W):
            spacing, D = S[row.spacing + lane], _reduced_turn(S, lane)
            value, slope = measure.rate_squared_of_turn(D)
            S[aux.reduced + lane], S[aux.reduced_slope + lane] = value / spacing / spacing, slope / spacing / spacing
            beyond |= 0 if abs(D) <= measure.MAX_SERIES_D else 1
    return beyond > 0


@njit(**OPTIONS)
def _squares_beyond(S):
    """Write the same as :func:`_squares` lane by lane, for a D of any size."""
    whole_vectors()
    for lane in range(W):
        spacing, D, reduced = S[row.spacing + lane], _turn(S, lane), _reduced_turn(S, lane)
        if not abs(D) <= measure.MAX_SERIES_D:
            S[aux.rate2 + lane], S[aux.slope + lane] = measure.rate_squared(D, spacing)
        if not abs(reduced) <= measure.MAX_SERIES_D:
            S[aux.reduced + lane], S[aux.reduced_slope + lane] = measure.rate_squared(reduced, spacing)


@formula
def _standard_error(slope, sum_rx, sum_rr, sum_xx, used):
    """Return the standard error of a slope, its scatter over the sum of squares; NaN for fewer than two triples."""
    scatter = max(sum_rr - sum_rx * sum_rx / sum_xx, 0.0)
    stderr = slope * math.sqrt(scatter / ((2.0 * used - 5.0) * 4.0 * sum_xx))
    return stderr if used >= 4.0 else math.nan


@njit(**INNER)
def _fill_square(S, certified, tolerance):
    """Write the measured Ω² and its basis; fewer than three samples give none.

    The certificate may reach the tolerance, and what rounding at the start grows to: 2e-15 e^{λt}, which is left to
    :func:`_forgive_growth`. Rounding in either solution also shifts the phase of a motion of n samples by less than
    1e-16 n^{3/2}.
    """
    whole_vectors()
    for lane in range(W):
        used, spacing, spin = (S[row.samples + lane], S[row.spacing + lane], S[aux.spin_rate + lane])
        rx, rr, xx = S[row.rx + lane], S[row.rr + lane], S[row.xx + lane]
        stderr = _standard_error(S[aux.slope + lane], rx, rr, xx, used)
        is_measured = (used >= 3.0) & (spin - spin == 0.0)
        rate2 = S[aux.rate2 + lane] if is_measured else math.nan
        S[aux.rate2 + lane], S[aux.stderr + lane] = rate2, stderr
        S[column.omega_squared + lane], S[column.omega_squared_stderr + lane] = (
            rate2 * spin * spin,
            stderr * spin * spin,
        )
        S[column.samples_used + lane], S[column.steps_per_sample + lane] = used, S[row.steps + lane]
        S[column.window_end + lane] = (used - 1.0) * spacing / spin
        apart = math.sqrt(S[row.distance2 + lane] / S[row.distance_size2 + lane])
        S[column.propagation_error + lane] = apart
        state = S[row.a + lane] + S[row.b + lane] + S[row.c + lane]
        short = used < measure.MIN_SAMPLES
        lost = (rate2 - rate2 != 0.0) & ((state - state != 0.0) | (used >= measure.MIN_SAMPLES))
        near = apart <= tolerance + 2e-15 + 1e-16 * used * math.sqrt(used)
        status = OK if near | (not certified) else NOT_CONVERGED
        status = SHORT_WINDOW if short else status
        S[column.status + lane] = NON_FINITE if lost else status


@njit(**INNER)
def _forgive_growth(S, tolerance):
    """Write the statuses of growing motions, whose rounding at the start has grown with them."""
    whole_vectors()
    for lane in range(W):
        growth = -S[aux.rate2 + lane]
        if S[column.status + lane] == NOT_CONVERGED and growth > 0.0:
            used = S[row.samples + lane]
            grown = math.exp(math.sqrt(growth) * (used - 1.0) * S[row.spacing + lane])
            if S[column.propagation_error + lane] <= tolerance + 2e-15 * grown + 1e-16 * used * math.sqrt(used):
                S[column.status + lane] = OK


@njit(**INNER)
def _fill_errors(S, step, rounded, whole):
    """Write the reduced Ω², the terms of both errors and the regime, which follows from the reduced one.

    ``step``: of :mod:`kernels.near_axis.propagators`; ``rounded``: the moments are ratios, rounded once each;
    ``whole``: the reduction was done to its last order.
    """
    whole_vectors()
    exactly, order = propagators.IS_EXACT[step], propagators.ORDER[step]
    is_near, is_nearest = propagators.IS_NEAR[step], propagators.IS_NEAREST[step]
    for lane in range(W):
        used, spacing, spin = (S[row.samples + lane], S[row.spacing + lane], S[aux.spin_rate + lane])
        rate2 = S[aux.rate2 + lane]
        reduced = S[aux.reduced + lane] if rate2 - rate2 == 0.0 else math.nan
        sx, ss, inverse = S[row.sx + lane], S[row.ss + lane], 1.0 / S[row.xx + lane]
        per = 1.0 / ((used - 1.0) * spacing)
        samples = (used - 1.0) * per
        apart = used * uncertainty.UNIT if exactly else S[column.propagation_error + lane]
        squares = max(ss - sx * sx * inverse, 0.0) * inverse
        scatter = uncertainty.scatter(S[aux.reduced_slope + lane], squares, used, reduced, spacing)
        rate = math.sqrt(abs(reduced))
        steps, growth = (S[row.steps + lane], S[row.max_size2 + lane] / S[row.start_size2 + lane])
        Ia, Ib, Ic = S[row.Ia + lane], S[row.Ib + lane], S[row.Ic + lane]
        bend = max(abs(S[row.cb + lane]), abs(S[row.cc + lane]))
        bound = max(abs(Ib - Ic) / Ia, bend)
        epsilon = S[row.epsilon + lane]
        size, x = (epsilon * math.sqrt(S[row.max_size2 + lane]), bound * spacing * math.sqrt(1.0 + epsilon * epsilon))
        cubic = direct.left_by_nearest(x, size, used) if is_nearest else math.inf
        cubic = direct.left_by_near(x, size, used) if is_near else cubic
        hidden = uncertainty.truncation_error(rate * spacing / steps, (used - 1.0) * steps, order)
        end = uncertainty.end_error(apart, growth, 0.0 if exactly else min(hidden, cubic))
        integration = uncertainty.integration(reduced, rate, apart, end, per, spacing)
        integration += apart * abs(reduced) if exactly else 0.0
        part = reduction.rms_part(S[row.rr + lane], ss, inverse, samples)
        left = part * reduction.SMALL_WANDER
        if whole:
            left = uncertainty.amplitude(reduced, part, S[row.wander + lane], spacing, per, bound)
        moved = uncertainty.moment_rounding(reduced, Ia, Ib, Ic, rounded)
        S[aux.rate + lane] = rate
        rounding = uncertainty.rounding(rate, samples, used, bend) + moved
        shift = rate2 - reduced
        amplitude = abs(shift) + left
        error = scatter + integration + rounding
        S[aux.error + lane], S[aux.left + lane] = error + amplitude, error + left
        end = linear.STABLE_MINOR if S[row.turning + lane] * S[row.spin + lane] < 0.0 else linear.STABLE_MAJOR
        regime = linear.UNSTABLE if reduced < 0.0 else end
        regime = regime if abs(reduced) > error + left else linear.MARGINAL
        regime = linear.SPHERE if (Ia == Ib) & (Ib == Ic) else regime
        S[column.regime + lane] = regime if rate2 - rate2 == 0.0 else -1
        S[column.omega_squared_error + lane] = (error + amplitude) * spin * spin
        S[column.omega_squared_reduced + lane] = reduced * spin * spin
        S[column.omega_squared_reduced_error + lane] = (error + left) * spin * spin
        S[column.amplitude_shift + lane] = shift * spin * spin
        S[column.omega_squared_error_scatter + lane] = scatter * spin * spin
        S[column.omega_squared_error_integration + lane] = integration * spin * spin
        S[column.omega_squared_error_amplitude + lane] = amplitude * spin * spin
        S[column.omega_squared_error_rounding + lane] = rounding * spin * spin


@njit(**INNER)
def _widen_within_a_turn(S):
    """Widen errors and regimes if the axis wanders far within few samples (:mod:`kernels.estimator.uncertainty`)."""
    for lane in range(W):
        spin, reduced = S[aux.spin_rate + lane], S[aux.reduced + lane]
        more = uncertainty.clock_correction_error(reduced, S[row.wander + lane], S[row.samples + lane] - 1.0)
        if more > 0.0:
            S[aux.error + lane] += more
            S[aux.left + lane] += more
            S[column.omega_squared_error_amplitude + lane] += more * spin * spin
            S[column.omega_squared_error + lane] = S[aux.error + lane] * spin * spin
            S[column.omega_squared_reduced_error + lane] = S[aux.left + lane] * spin * spin
            if S[column.regime + lane] >= 0.0 and abs(reduced) <= S[aux.left + lane]:
                S[column.regime + lane] = linear.MARGINAL


def _rates_of(reduced):
    """Return the rates of the measured Ω², or of the reduced one; decided when it is compiled."""
    square_of, error_of = (aux.reduced, aux.left) if reduced else (aux.rate2, aux.error)
    names = [rate + ("_reduced" if reduced else "") for rate in ("growth_rate", "frequency")]
    growth, turning = (getattr(column, name) for name in names)
    growth_error, turning_error = (getattr(column, f"{name}_error") for name in names)

    @njit(name="fill_reduced_rates" if reduced else "fill_rates", **OPTIONS)
    def fill_rates(S):
        whole_vectors()
        for lane in range(W):
            spin, regime = S[aux.spin_rate + lane], S[column.regime + lane]
            square, error = S[square_of + lane], S[error_of + lane]
            unstable, marginal = regime == linear.UNSTABLE, regime == linear.MARGINAL
            stable = (regime == linear.STABLE_MINOR) | (regime == linear.STABLE_MAJOR)
            signed = -square if unstable else square
            rate = S[aux.rate + lane] if reduced else math.sqrt(max(signed, 0.0))
            # the square's interval, which holds 0 where it is marginal: roots of its upper end and of the other's size
            high, end = math.sqrt(max(signed + error, 0.0)), math.sqrt(abs(signed - error))
            low, beyond = (end, 0.0) if signed > error else (0.0, end)
            rate_error = uncertainty.interval_distance(max(signed, 0.0), error, rate, low, high)
            none = 0.0 if regime >= 0.0 else math.nan
            S[growth + lane] = rate * spin if unstable else none
            S[turning + lane] = rate * spin if stable else none
            # where it is marginal rates are 0: either way, no more than the square's interval allows
            other = beyond if marginal else math.nan
            S[growth_error + lane] = (rate_error if unstable else other) * spin
            other = high if marginal else math.nan
            S[turning_error + lane] = (rate_error if stable else other) * spin
            if reduced:
                S[aux.rate_error + lane] = rate_error if unstable | stable else math.nan
            else:
                divisor = rate if rate > 0.0 else math.nan
                stderr = 0.5 * S[aux.stderr + lane] / divisor * spin
                S[column.growth_rate_stderr + lane] = stderr if unstable else math.nan
                S[column.frequency_stderr + lane] = stderr if stable else math.nan
                S[column.euler_period + lane] = 2.0 * math.pi / divisor / spin if stable else math.nan

    return fill_rates


_fill_rates, _fill_reduced_rates = _rates_of(False), _rates_of(True)


@njit(**INNER)
def _fill_log_slope(S):
    """Write the lecture's estimator, where its window held at least two e-folds.

    Its error is its distance from the reduced rate, which stands on more samples and knows the amplitude, and that
    rate's own error: a line through a logarithm cannot see what its transient bends.
    """
    whole_vectors()
    for lane in range(W):
        n, spin = S[row.log_samples + lane], S[aux.spin_rate + lane]
        held = (S[column.regime + lane] == linear.UNSTABLE) & (n >= 2.0)
        e_folds = 0.5 * measure.logarithm(S[row.log_last + lane] / S[row.log_first + lane])
        slope = measure.slope_of_products(
            n, S[row.log_p + lane], S[row.p_exponent + lane], S[row.log_q + lane], S[row.q_exponent + lane]
        )
        rate = 0.5 * slope / S[row.spacing + lane]
        rate = rate if held & (e_folds >= measure.MIN_E_FOLDS) else math.nan
        S[column.e_folds + lane] = e_folds if held else math.nan
        S[column.growth_rate_logslope + lane] = rate * spin
        error = abs(rate - S[aux.rate + lane]) + S[aux.rate_error + lane]
        S[column.growth_rate_logslope_error + lane] = error * spin


@njit(**INNER)
def _fill_no_log_slope(S):
    """Write the estimator as missing where no lane was ever in the window: this spares two logarithms."""
    whole_vectors()
    for missing in (column.e_folds, column.growth_rate_logslope, column.growth_rate_logslope_error):
        for lane in range(W):
            S[missing + lane] = math.nan


@njit(**INNER)
def _fill_drifts(S):
    whole_vectors()
    for lane in range(W):
        S[column.energy_drift + lane] = S[row.E_change + lane] / S[row.E + lane]
        S[column.momentum_drift + lane] = S[row.L2_change + lane] / S[row.L2 + lane]
        drift, scale = S[row.J_change + lane] / S[row.J_scale + lane], S[row.J_scale + lane]
        S[column.perturbation_drift + lane] = drift if scale > 0.0 else 0.0


@njit(**OPTIONS)
def fill(S, work, reduced, step, rounded, tolerance):
    """Turn every lane's sums into its columns, in units of s.

    Args:
        S (numpy.ndarray, shape (ROWS * W,)): Scratch after :func:`kernels.near_axis.near_axis_block.follow`, with the
            row spin_rate filled. Column k of lane l goes to ``S[(FIRST + k) * W + l]``; those of work that was not done
            hold no sense.
        work, reduced, step: As of :func:`kernels.near_axis.near_axis_block.follow`.
        rounded, tolerance: As of :class:`kernels.near_axis.survey.RunSettings`.
    """
    certified, invariants, logged, _, rated = work
    if _squares(S, reduced != near_axis_block.NONE):
        _squares_beyond(S)
    _fill_square(S, certified, tolerance)
    if certified:
        _forgive_growth(S, tolerance)
    if reduced != near_axis_block.NONE:
        _fill_errors(S, step, rounded, reduced == near_axis_block.WHOLE)
        if reduced == near_axis_block.WHOLE:
            _widen_within_a_turn(S)
        if rated:
            _fill_rates(S)
            _fill_reduced_rates(S)
        if logged and near_axis_block.were_logged(S):
            _fill_log_slope(S)
        elif logged:
            _fill_no_log_slope(S)
    if invariants:
        _fill_drifts(S)
