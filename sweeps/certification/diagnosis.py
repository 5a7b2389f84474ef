"""Diagnose what is wrong with a trajectory: a word is found by trying the alternative and showing that it fits.

Every alternative has a score, the error that it leaves relative to the error of the file. Conventions are tried first,
then single rows, noise, constants of the exact motion, and other equations of motion.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from sweeps.certification import conventions, dynamics, fits
from sweeps.certification.reference import BodyMotion, distance, exact_motion, largest_error
from sweeps.systems.motion import rotate_vectors

CONVENTION_ROWS = 200  # rows at which conventions are tried
FEW_ROWS, ANGLE = 64, 0.2  # the same without rates, which are fitted; rad from row to row
EXACT = 1e-9  # scores below which only rounding differs
CONVENTION_SCORE = 0.02  # a convention leaves less than this part of the error
SCORE = 0.1  # constants of the motion, single rows and other equations leave less than this part
LOOSE_SCORE = 0.35  # remaining part of an error of first order, of which higher orders remain
SIMILAR = 10.0  # scores of readings that fit alike differ by less than this factor
RIGHT_RATES = 0.03  # error of the rates relative to that of the attitudes, below which the rates count as right
ENERGY_SHARE = 0.5  # change of 2T relative to that of L, above which it is the energy that drifts
DOUBLE = 0.01  # attitudes turn twice as fast as the rates to this part
WHITE = 0.35  # correlation of a residual from row to row, below which it counts as noise
DENSE = 1.0  # rad from row to row, above which rows of a smooth error have no correlation either
PEAK = 8.0  # largest part of noise over its root mean square; an outlier is more
MAX_OUTLIERS = 3
GAP_STEPS, GAP_TRIALS = 200, 8001  # a lost time is searched within so many distances of rows, at so many times
GAP = 8.0  # a gap is so many times the usual distance of rows
CLOCKS = np.geomspace(1e-4, 1e4, 81)  # first guesses of the time that passes per second of the file
WINDOW_ROWS = 4  # the least rows of a window
WINDOWS = 24  # parts of a trajectory without rates, in each of which rates are fitted
STEADY, NEAR = 1e-2, 1e-2  # transverse rates, and m1, near the intermediate axis and near the separatrix


class Finding(NamedTuple):
    """A word of the diagnosis."""

    word: str
    evidence: str
    score: float = 0.0


def diagnose(judgement) -> list[Finding]:
    """Return the words of the diagnosis of a judgement, most likely first."""
    notes = list(_gaps(judgement.motion.times))
    if judgement.verdict == "pass":
        return notes or [Finding("none", "every row is within the tolerance of the exact motion")]
    if judgement.verdict == "ill_conditioned":
        return [_ill_conditioning(judgement), *notes]
    length = []
    if not judgement.is_unit:
        text = f"attitudes are off a rotation by up to {judgement.rows.length_error:.3g}"
        length = [Finding("not_unit", f"{text}; errors are those once normalised")]
    if judgement.rows.is_mirrored:
        length.insert(0, Finding("left_handed", "matrices have the determinant −1"))
    if length and judgement.worst <= judgement.tolerance:
        return [*length, *notes]
    findings = _search(judgement)
    findings = findings or [Finding("unknown", "no alternative that was tried fits")]
    return list({each.word: each for each in [*findings, *length, *notes]}.values())


def _search(judgement) -> list[Finding]:
    findings = _conventions(judgement)
    if findings:
        return findings
    motion = judgement.motion
    is_dense = np.median(np.diff(motion.times)) * np.linalg.norm(judgement.reference.w[0]) < DENSE
    first = (_noise, _single_rows, _jumps, _constants) if is_dense else (_single_rows, _jumps, _constants, _noise)
    for search in (*first, _equations):
        if findings := search(judgement):
            return findings
    return []


# -- conventions


def _conventions(judgement) -> list[Finding]:
    """Return the first convention, in the order of readings, under which the file is an exact motion.

    For a steady spin, all conventions that fit as well, and the word "ambiguous".
    """
    rows = judgement.rows
    n = len(rows.times)
    rows_at = np.unique(np.linspace(0, n - 1, CONVENTION_ROWS).astype(int))
    if rows.rates is None:  # rates are fitted: rows are near each other, and few
        angle = float(np.median(distance(judgement.motion.q[1:FEW_ROWS], judgement.motion.q[: FEW_ROWS - 1][: n - 1])))
        stride = int(np.clip(ANGLE / max(angle, ANGLE / n), 1, max(1, (n - 1) // 4)))
        rows_at = np.arange(0, min(n, FEW_ROWS * stride), stride)
    q = None if rows.q is None else rows.q[rows_at]
    w = None if rows.rates is None else rows.rates[rows_at]
    before = _worst(judgement.rebuilt(q, w, rows_at))
    inertial = None if q is None else judgement.frame.in_space(rows, q, rows_at)
    findings: dict[str, Finding] = {}
    for reading in conventions.readings(q, w, inertial):
        score = _worst(judgement.rebuilt(reading.q, reading.w, rows_at)) / before
        if score < CONVENTION_SCORE and score < findings.get(reading.word, Finding("", "", np.inf)).score / SIMILAR:
            text = f"if {reading.text}, the error falls from {before:.3g} to {score * before:.3g}"
            findings[reading.word] = Finding(reading.word, text, score)
    best = min((finding.score for finding in findings.values()), default=0.0)
    equal_readings = [finding for finding in findings.values() if finding.score < max(SIMILAR * best, EXACT)]
    if len(equal_readings) > 1 and _is_steady(judgement.reference.w):
        words = ", ".join(finding.word for finding in equal_readings)
        return [*equal_readings, Finding("ambiguous", f"a spin as steady as this does not tell {words} apart")]
    # the order of readings decides: a quaternion with its scalar elsewhere is also a quaternion of other axes
    return equal_readings[:1]


def _is_steady(w: np.ndarray) -> bool:
    """Return True if the angular velocity, (n, 3), keeps its direction in the body."""
    return bool((w @ w[0] > np.cos(STEADY) * np.linalg.norm(w, axis=1) * np.linalg.norm(w[0])).all())


def _worst(motion: BodyMotion) -> float:
    """Return the largest error of a motion against the exact one from its first row."""
    start = motion.start if motion.w is not None else _fitted_start(motion)
    return largest_error(motion, exact_motion(motion, *start))


def _fitted_start(motion: BodyMotion) -> tuple[np.ndarray, np.ndarray]:
    guess = fits.Fit((motion.q[0], fits.first_rates(motion)), motion.moments)
    return fits.fit(motion, guess, ("rates",)).start


# -- rows


def _gaps(times: np.ndarray) -> Iterator[Finding]:
    """Yield a note on the widest gap between rows that are evenly spaced otherwise."""
    steps = np.diff(times)
    usual, widest = float(np.median(steps)), int(np.argmax(steps))
    if len(steps) > 4 and steps[widest] > GAP * usual and np.quantile(steps, 0.9) < 1.5 * usual:
        row = f"row {widest + 1:,}, t = {times[widest]:.6g} s"
        yield Finding("gap", f"{steps[widest]:.4g} s without rows after {row}; rows are {usual:.4g} s apart otherwise")


def _single_rows(judgement) -> list[Finding]:
    """Return the few rows with the largest errors if the exact motion fits without them; last, the first row alone.

    Rates of the first row that fit another time are those of `_late_rates`.
    """
    motion, before = judgement.motion, judgement.worst
    is_kept = np.ones(len(motion.times), dtype=bool)
    error = judgement.all_errors
    is_kept[np.argsort(error)[-min(MAX_OUTLIERS, len(error) // 4) :]] = False
    worst = float(error[is_kept].max(initial=0.0))
    is_outlier = error > max(SIMILAR * worst, judgement.tolerance)
    if worst < SCORE * before and is_outlier.any() and is_outlier.sum() <= MAX_OUTLIERS:
        return [_outlier(np.flatnonzero(is_outlier), before, worst)]
    if motion.w is None or len(motion.times) < 6:
        return []
    later = motion.select(slice(1, None))
    later = BodyMotion(motion.moments, later.times - later.times[0], later.q, later.w)
    worst = _worst(later.thin_rows())
    if worst > SCORE * before:
        return []
    return _late_rates(judgement) or [_outlier(np.zeros(1, dtype=int), before, worst)]


def _late_rates(judgement) -> list[Finding]:
    """Return rates of a constant time off that of their rows, but for the first row."""
    motion = judgement.motion.select(slice(1, None)).thin_rows(fits.FITTED_ROWS)
    rates = BodyMotion(motion.moments, motion.times, None, motion.w)
    guess = fits.Fit(judgement.reference.start, motion.moments)
    fitted = fits.fit(rates, guess, ("delay",))
    before, after = guess.worst(rates), fitted.worst(rates)
    if after > SCORE * before:
        return []
    text = f"rates after the first row are those of {fitted.delay:.6g} s later: their error falls from"
    return [Finding("staggered", f"{text} {before:.3g} to {after:.3g}", after / before)]


def _outlier(rows: np.ndarray, before: float, after: float) -> Finding:
    words = ", ".join(f"{row + 1:,}" for row in rows)
    return Finding("outlier", f"row {words} is off by {before:.3g}; all others are within {after:.3g}", after / before)


def _noise(judgement) -> list[Finding]:
    """Return noise if what is left of a fit of the start has no correlation from row to row."""
    motion = judgement.motion.thin_rows(2000)
    if len(motion.times) < 12:
        return []
    names = ("attitude", "rates") if motion.q is not None else ("rates",)
    fitted = fits.fit(motion, fits.Fit(judgement.reference.start, motion.moments), names, 2000)
    residual = fits.residuals(motion, fitted)
    sizes = [float(np.sqrt(np.mean(np.square(misfit)))) for misfit in residual]
    misfit = residual[int(np.argmax(sizes))]
    correlation = float(np.sum(misfit[1:] * misfit[:-1]) / max(np.sum(misfit[1:] ** 2), np.finfo(float).tiny))
    halves = [np.sqrt(np.mean(np.square(half))) for half in np.array_split(misfit, 2)]
    floor = max(judgement.rows.attitude_resolution, 1e-15)
    if (
        abs(correlation) > WHITE
        or max(halves) > 2 * min(halves)
        or max(sizes) < 2 * floor
        or np.abs(misfit).max() > PEAK * max(sizes)
    ):
        return []
    worst = fitted.worst(motion)
    verdict = "passes" if worst <= judgement.tolerance else "does not pass"
    text = f"a fitted start leaves {max(sizes):.3g} (root mean square), without correlation from row to row"
    return [Finding("noise", f"{text}; with --fit-start the file {verdict}", worst / judgement.worst)]


def _jumps(judgement) -> list[Finding]:
    """Return the interval between two rows in which the motion goes on for longer than the time.

    All rows before it are one exact motion, and all rows after it another one.
    """
    motion, before = judgement.motion, judgement.worst
    if motion.w is None:
        return []
    row = int(np.argmax(judgement.all_errors > SCORE * before))
    if not 0 < row < len(motion.times) - 2:
        return []
    later = motion.select(slice(row, None))
    halves = [motion.select(slice(0, row)), BodyMotion(motion.moments, later.times - later.times[0], later.q, later.w)]
    worst = max(_worst(half.thin_rows()) for half in halves)
    if worst > SCORE * before:
        return []
    step = motion.times[row] - motion.times[row - 1]
    spans = np.linspace(-GAP_STEPS * step, GAP_STEPS * step, GAP_TRIALS)
    first, last = motion.select(slice(row - 1, row)), motion.select(slice(row, row + 1))
    prediction = exact_motion(BodyMotion(motion.moments, spans, first.q, None), *first.start)
    misses = [np.linalg.norm(last.w - prediction.w, axis=1) / motion.speed]
    misses += [] if motion.q is None else [distance(prediction.q, last.q)]
    guess = fits.Fit(first.start, motion.moments, delay=float(spans[np.argmin(np.max(misses, axis=0))]))
    target = BodyMotion(motion.moments, np.zeros(1), None, last.w)
    fitted = fits.fit(target, guess, ("delay",))
    miss = fitted.worst(target)
    if miss > SCORE * before:
        return []
    text = f"between rows {row:,} and {row + 1:,} the motion goes on for {fitted.delay:.6g} s in place of {step:.6g} s"
    return [Finding("gap", f"{text}; before and after it rows are within {max(worst, miss):.3g}", worst / before)]


# -- constants and equations


def _constants(judgement) -> list[Finding]:
    """Return clock, delay and ratios of moments with which the file is an exact motion."""
    motion = judgement.motion.thin_rows(fits.FITTED_ROWS) if judgement.motion.w is not None else judgement.motion
    start, before = judgement.reference.start, judgement.worst
    guess = fits.Fit(start, motion.moments)
    readings = []
    if motion.w is not None:
        first = motion.select(slice(0, fits.FIRST_ROWS))
        guesses = [guess, *(fits.Fit(start, motion.moments, clock=clock) for clock in CLOCKS)]
        best = fits.fit(motion, min(guesses, key=lambda trial: trial.worst(first)), ("clock",))
        text = f"if time runs {best.clock:.9g} times as fast (or the rates are {best.clock:.9g} times as large)"
        readings.append((best, "clock", text))
    if motion.w is not None and motion.q is not None:
        best = fits.fit(motion, guess, ("rates", "delay"))
        readings.append((best, "staggered", f"if the rates are those of {best.delay:.6g} s after the attitudes"))
    best = fits.fit(motion, guess, ("ratios",) if motion.w is not None else ("rates", "ratios"))
    ratios = ":".join(f"{ratio:.6g}" for ratio in best.moments / best.moments[2])
    readings.append((best, "wrong_inertia", f"if I1:I2:I3 = {ratios}"))
    findings = []
    for best_fit, word, text in readings:
        error = np.sort(np.max([each for each in best_fit.errors(motion) if each is not None], axis=0))
        worst = float(error[-2] if word == "staggered" else error[-1])  # rates of the first row may be exact
        if worst < SCORE * before:
            findings.append(Finding(word, f"{text}, the error falls from {before:.3g} to {worst:.3g}", worst / before))
    return sorted(findings, key=lambda finding: finding.score)[:1]


def _equations(judgement) -> list[Finding]:
    """Return the equations of motion that lead from row to row, or what is not conserved."""
    motion = judgement.motion
    if len(motion.times) < 3 * WINDOW_ROWS:
        return list(_kinematics(judgement))
    motion = motion if motion.w is not None else _with_rates(motion)
    resolution = max(judgement.rows.attitude_resolution, 4e-16)
    findings: dict[str, Finding] = {}
    for fit in dynamics.explanations(motion, resolution):
        if fit.score > (LOOSE_SCORE if fit.word == "first_order" else SCORE) or fit.word in findings:
            continue
        values = ", ".join(f"{value:.4g}" for value in fit.parameters)
        text = f"{fit.text} (coefficients {values}) leaves {fit.score:.2g} of the defect from row to row"
        is_double = fit.word == "kinematics" and abs(fit.parameters[0] - 1.0) < DOUBLE
        word = "full_angle" if is_double else fit.word
        findings[word] = Finding(word, text, fit.score)
    if next(iter(findings), "") == "full_angle":
        return list(findings.values())[:1]
    kinematics = list(_kinematics(judgement))
    if kinematics:
        return [*kinematics, *(fit for fit in findings.values() if fit.word == "first_order")]
    return list(findings.values())[:1] or list(_drifts(motion.thin_rows()))


def _kinematics(judgement) -> Iterator[Finding]:
    """Yield wrong attitudes from right rates."""
    if judgement.attitude_errors is None or judgement.rates_errors is None:
        return
    attitude, rates = float(judgement.attitude_errors.max()), float(judgement.rates_errors.max())
    if rates < max(RIGHT_RATES * attitude, judgement.tolerance) and attitude > judgement.tolerance:
        yield Finding("kinematics", f"rates are right to {rates:.3g}, attitudes are off by {attitude:.3g} rad")


def _drifts(motion: BodyMotion) -> Iterator[Finding]:
    """Yield what is not conserved: 2T, or L (in space where there are attitudes, else its size)."""
    L = motion.w * motion.moments
    twice_energy, size = np.einsum("ij,ij->i", motion.w, L), np.linalg.norm(L, axis=1)
    energy = float(np.abs(twice_energy / twice_energy[0] - 1).max())
    in_space = size[:, None] if motion.q is None else rotate_vectors(motion.q, L)
    momentum = float((np.linalg.norm(in_space - in_space[0], axis=1) / size[0]).max())
    text = f"2T changes by {energy:.3g}, L by {momentum:.3g} of itself"
    yield Finding("energy_drift" if energy > ENERGY_SHARE * momentum else "momentum_drift", text)


def _with_rates(motion: BodyMotion) -> BodyMotion:
    """Return attitudes at some rows with the rates that are fitted to the rows around."""
    number = min(WINDOWS, len(motion.times) // WINDOW_ROWS)
    states = []
    for rows in np.array_split(np.arange(len(motion.times)), number):
        window = motion.select(rows)
        window = BodyMotion(motion.moments, window.times - window.times[0], window.q, None)
        guess = fits.Fit((window.q[0], fits.first_rates(window)), motion.moments)
        middle = BodyMotion(motion.moments, window.times[[len(rows) // 2]], window.q[:1], None)
        centre = fits.fit(window, guess, ("attitude", "rates")).motion(middle)
        states.append((motion.times[rows[0]] + middle.times[0], centre.q[0], centre.w[0]))
    times, q, w = (np.array(values) for values in zip(*states, strict=True))
    return BodyMotion(motion.moments, times - times[0], q, w)


# -- files that do not determine the motion


def _ill_conditioning(judgement) -> Finding:
    """Return why motions that begin within the resolution differ by more than the tolerance."""
    from kernels.free import exact

    w = judgement.reference.w[0]
    top = exact.set_up(*judgement.motion.moments, *w)
    middle = int(np.argsort(judgement.motion.moments)[1])
    across = float(np.linalg.norm(np.delete(w, middle)) / np.linalg.norm(w))
    bound = judgement.conditioning_rad if judgement.conditioning_rad is not None else judgement.conditioning_rates
    text = f"motions within the resolution of the file end {bound:.2g} apart"
    if across < STEADY:
        return Finding("intermediate_axis", f"{text}: the spin begins {across:.2g} rad from the intermediate axis")
    if top.m1 < NEAR:
        return Finding("near_separatrix", f"{text}: 1 − m = {top.m1:.2g}, near the separatrix")
    return Finding("rounding", f"{text}: the digits of the first row are too few for the tolerance")
