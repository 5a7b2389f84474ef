"""Diagnose what is wrong with a trajectory: a word is found by trying the alternative and showing that it fits.

Every alternative has a score, the error that it leaves relative to the error of the file. Conventions are tried first,
then noise, single rows, constants of the exact motion, and other equations of motion.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from kernels.free import exact
from sweeps.certification import conventions, dynamics, fits
from sweeps.certification.reference import BodyMotion, changes_of_integrals, exact_motion, row_errors

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
NOISE_ROWS = 2000  # rows in which noise is looked for
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
CONSTANTS = (  # word, columns of the files that may have it, constants to fit, first rows that count not, evidence
    ("clock", ("w", "qw"), ("clock",), 0,
     "if time runs {0.clock:.9g} times as fast (or the rates are {0.clock:.9g} times as large)"),
    ("staggered", ("qw",), ("rates", "delay"), 1, "if the rates are those of {0.delay:.6g} s after the attitudes"),
    ("wrong_inertia", ("w", "qw"), ("ratios",), 0, "if I1:I2:I3 = {0.ratios}"),
    ("wrong_inertia", ("q",), ("rates", "ratios"), 0, "if I1:I2:I3 = {0.ratios}"),
)  # fmt: skip


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
    if judgement.rows.is_mirrored:
        length.append(Finding("left_handed", "matrices have the determinant −1"))
    if not judgement.is_unit:
        text = f"attitudes are off a rotation by up to {judgement.rows.length_error:.3g}"
        length.append(Finding("not_unit", f"{text}; errors are those once normalised"))
    if length and judgement.worst <= judgement.tolerance:
        return [*length, *notes]
    findings = _search(judgement) or [Finding("unknown", "no alternative that was tried fits")]
    return list({each.word: each for each in [*findings, *length, *notes]}.values())


def _search(judgement) -> list[Finding]:
    """Return the findings of the first search that has any."""
    searches = [_conventions, _noise, _single_rows, _lost_time, _constants, _equations]
    motion = judgement.motion
    if np.median(np.diff(motion.times)) * np.linalg.norm(judgement.reference.w[0]) > DENSE:
        searches.insert(-1, searches.pop(1))  # noise only if nothing else fits
    return next((findings for search in searches if (findings := search(judgement))), [])


def _improvement(word: str, text: str, before: float, after: float) -> Finding:
    return Finding(word, f"{text}, the error falls from {before:.3g} to {after:.3g}", after / before)


def _worst(motion: BodyMotion) -> float:
    """Return the largest error of a motion against the exact one from its `_start`."""
    return float(row_errors(motion, exact_motion(motion, *_start(motion))).max())


def _start(motion: BodyMotion) -> tuple[Rotation, np.ndarray]:
    """Return attitude and angular velocity of the first row; fitted rates if there are none."""
    return motion.start if motion.w is not None else fits.fit(motion, fits.guess_start(motion), ("rates",)).start


# -- conventions


def _conventions(judgement) -> list[Finding]:
    """Return the first convention, in the order of readings, under which the file is an exact motion.

    For a steady spin, all conventions that fit as well, and the word "ambiguous".
    """
    rows, n = judgement.rows, len(judgement.rows.times)
    rows_at = np.unique(np.linspace(0, n - 1, CONVENTION_ROWS).astype(int))
    if rows.rates is None:  # rates are fitted: rows are near each other, and few
        few = rows.q[:FEW_ROWS]
        angle = float(np.median((few[:-1].inv() * few[1:]).magnitude()))
        stride = int(np.clip(ANGLE / max(angle, ANGLE / n), 1, max(1, (n - 1) // 4)))
        rows_at = np.arange(0, min(n, FEW_ROWS * stride), stride)
    q, w = (None if column is None else column[rows_at] for column in (rows.q, rows.rates))
    inertial = None if q is None else judgement.frame.in_space(rows, q, rows_at)
    before = _worst(judgement.rebuild(q, w, rows_at))
    if before <= judgement.tolerance:
        return []  # the error is that of other rows
    best: dict[str, Finding] = {}
    for word, text, *columns in conventions.readings(q, w, inertial):
        finding = _improvement(word, f"if {text}", before, _worst(judgement.rebuild(*columns, rows_at)))
        if finding.score < min(CONVENTION_SCORE, best[word].score / SIMILAR if word in best else np.inf):
            best[word] = finding
    smallest = min((finding.score for finding in best.values()), default=0.0)
    similar = [finding for finding in best.values() if finding.score < max(SIMILAR * smallest, EXACT)]
    if len(similar) > 1 and _is_steady(judgement.reference.w):
        words = ", ".join(finding.word for finding in similar)
        return [*similar, Finding("ambiguous", f"a spin as steady as this does not tell {words} apart")]
    # the order of readings decides: a quaternion with its scalar elsewhere is also a quaternion of other axes
    return similar[:1]


def _is_steady(w: np.ndarray) -> bool:
    """Return True if the angular velocity, (n, 3), keeps its direction in the body."""
    return bool((w @ w[0] > np.cos(STEADY) * np.linalg.norm(w, axis=1) * np.linalg.norm(w[0])).all())


# -- rows


def _gaps(times: np.ndarray) -> Iterator[Finding]:
    """Yield a note on the widest gap between rows that are evenly spaced otherwise."""
    steps = np.diff(times)
    usual, widest = float(np.median(steps)), int(np.argmax(steps))
    if len(steps) > 4 and steps[widest] > GAP * usual and np.quantile(steps, 0.9) < 1.5 * usual:
        row = f"row {widest + 1:,}, t = {times[widest]:.6g} s"
        yield Finding("gap", f"{steps[widest]:.4g} s without rows after {row}; rows are {usual:.4g} s apart otherwise")


def _noise(judgement) -> list[Finding]:
    """Return noise if the residual of a fit of the start has no correlation from row to row."""
    motion = judgement.motion.thin_rows(NOISE_ROWS)
    if len(motion.times) < 12:
        return []
    names = ("attitude", "rates") if motion.q is not None else ("rates",)
    fitted = fits.fit(motion, fits.Fit(judgement.reference.start, motion.moments), names, NOISE_ROWS)
    residual = max(fitted.residuals(motion), key=dynamics.root_mean_square)
    size = dynamics.root_mean_square(residual)
    correlation = float(np.sum(residual[1:] * residual[:-1]) / max(np.sum(residual[1:] ** 2), np.finfo(float).tiny))
    halves = [dynamics.root_mean_square(half) for half in np.array_split(residual, 2)]
    is_even = max(halves) <= 2 * min(halves) and np.abs(residual).max() <= PEAK * size
    if abs(correlation) > WHITE or not is_even or size < 2 * max(judgement.rows.attitude_resolution, 1e-15):
        return []
    worst = float(fitted.errors(motion).max())
    text = f"a fitted start leaves {size:.3g} (root mean square), without correlation from row to row; with --fit-start"
    verdict = "passes" if worst <= judgement.tolerance else "does not pass"
    return [Finding("noise", f"{text} the file {verdict}", worst / judgement.worst)]


def _single_rows(judgement) -> list[Finding]:
    """Return the few rows with the largest errors if the exact motion fits without them; last, the first row alone."""
    motion, before, error = judgement.motion, judgement.worst, judgement.row_errors
    worst = float(np.sort(error)[: -min(MAX_OUTLIERS, len(error) // 4) or None].max())
    rows = np.flatnonzero(error > max(SIMILAR * worst, judgement.tolerance))
    if not (worst < SCORE * before and 0 < len(rows) <= MAX_OUTLIERS):
        if motion.w is None or len(motion.times) < 6:
            return []
        later, rows = motion.select(slice(1, None)), np.zeros(1, dtype=int)
        worst = _worst(later.thin_rows())
        if worst > SCORE * before:
            return []
        if late := _late_rates(later.thin_rows(fits.FITTED_ROWS), judgement.reference.select(slice(1, 2)).start):
            return late
    words = ", ".join(f"{row + 1:,}" for row in rows)
    return [
        Finding("outlier", f"row {words} is off by {before:.3g}; all others are within {worst:.3g}", worst / before)
    ]


def _late_rates(later: BodyMotion, start) -> list[Finding]:
    """Return rates after the first row, at which the exact motion has a start, if they are those of later times."""
    rates = BodyMotion(later.moments, later.times, None, later.w)
    guess = fits.Fit(start, rates.moments)
    late = fits.fit(rates, guess, ("delay",))
    before, after = (float(each.errors(rates).max()) for each in (guess, late))
    text = f"if rates after the first row are those of {late.delay:.6g} s later"
    return [_improvement("staggered", text, before, after)] if after < SCORE * before else []


def _lost_time(judgement) -> list[Finding]:
    """Return the interval between two rows in which the motion goes on for longer than the time.

    All rows before it are one exact motion, and all rows after it another one. With rates it is where the error begins;
    with attitudes alone, where they turn fastest.
    """
    motion, before = judgement.motion, judgement.worst
    row = int(np.argmax(judgement.row_errors > SCORE * before))
    if motion.w is None:
        row = 1 + int(np.argmax((motion.q[:-1].inv() * motion.q[1:]).magnitude() / np.diff(motion.times)))
    if not 1 < row < len(motion.times) - 2:
        return []
    halves = [motion.select(slice(row)), motion.select(slice(row, None))]
    worst = max(_worst(half.thin_rows()) for half in halves)
    if worst > SCORE * before:
        return []
    known = halves[0] if motion.w is not None else exact_motion(halves[0], *_start(halves[0]))
    first, ends = known.select(slice(row - 1, row)).start, motion.select(slice(row - 1, row + 1))
    step = ends.times[1]
    spans = np.linspace(-GAP_STEPS * step, GAP_STEPS * step, GAP_TRIALS)
    trials = exact_motion(BodyMotion(motion.moments, spans, ends.q, None), *first)
    span = float(spans[np.argmin(row_errors(ends.select(slice(1, 2)), trials))])
    fitted = fits.fit(ends, fits.Fit(first, motion.moments, clock=span / step), ("clock",))
    miss = float(fitted.errors(ends).max())
    if miss > SCORE * before:
        return []
    span = fitted.clock * step
    text = f"between rows {row:,} and {row + 1:,} the motion goes on for {span:.6g} s in place of {step:.6g} s"
    return [Finding("gap", f"{text}; before and after it rows are within {max(worst, miss):.3g}", worst / before)]


# -- constants and equations


def _constants(judgement) -> list[Finding]:
    """Return the constants, of CONSTANTS, with which the file is nearest to an exact motion, if it is near."""
    motion, start, before = judgement.motion, judgement.reference.start, judgement.worst
    columns = "".join(name for name in "qw" if getattr(motion, name) is not None)
    motion = motion if columns == "q" else motion.thin_rows(fits.FITTED_ROWS)
    findings = []
    for word, kinds, names, num_left_out, text in CONSTANTS:
        if columns not in kinds:
            continue
        guesses = [fits.Fit(start, motion.moments, clock) for clock in ((1.0, *CLOCKS) if "clock" in names else (1.0,))]
        first = motion.select(slice(fits.FIRST_ROWS))
        best = fits.fit(motion, min(guesses, key=lambda guess: guess.errors(first).max()), names)
        worst = float(best.errors(motion)[num_left_out:].max())
        findings.append(_improvement(word, text.format(best), before, worst))
    return [finding for finding in findings if finding.score == min(SCORE, *(each.score for each in findings))]


def _equations(judgement) -> list[Finding]:
    """Return the equations of motion that lead from row to row, or what is not conserved."""
    motion, findings = judgement.motion, []
    is_short = len(motion.times) < 3 * WINDOW_ROWS
    if not is_short:
        motion = motion if motion.w is not None else _with_rates(motion)
        resolution = max(judgement.rows.attitude_resolution, 4e-16)
        for word, text, parameters, score in dynamics.explanations(motion, resolution):
            if score < (LOOSE_SCORE if word == "first_order" else SCORE):
                is_double = word == "kinematics" and abs(parameters[0] - 1.0) < DOUBLE
                values = ", ".join(f"{value:.4g}" for value in parameters)
                text = f"{text} (coefficients {values}) leaves {score:.2g} of the defect from row to row"
                findings.append(Finding("full_angle" if is_double else word, text, score))
    attitude = float(judgement.errors.get("attitude", np.zeros(1)).max())
    rates = float(judgement.errors.get("rates", np.full(1, np.inf)).max())
    has_right_rates = rates < max(RIGHT_RATES * attitude, judgement.tolerance) and attitude > judgement.tolerance
    if has_right_rates and not (findings and findings[0].word == "full_angle"):
        text = f"rates are right to {rates:.3g}, attitudes are off by {attitude:.3g} rad"
        return [Finding("kinematics", text), *(each for each in findings if each.word == "first_order")]
    return findings[:1] or ([] if is_short else [_drift(motion.thin_rows())])


def _drift(motion: BodyMotion) -> Finding:
    """Return which is not conserved: 2T, or L (in space where there are attitudes, else its size)."""
    energy, *momentum = changes_of_integrals(motion).values()
    size = float(np.linalg.norm(momentum))
    word = "energy_drift" if energy > ENERGY_SHARE * size else "momentum_drift"
    return Finding(word, f"2T changes by {energy:.3g}, L by {size:.3g} of itself")


def _with_rates(motion: BodyMotion) -> BodyMotion:
    """Return attitudes at some rows with the rates that are fitted to the rows around."""
    number = min(WINDOWS, len(motion.times) // WINDOW_ROWS)
    middles, states = [], []
    for rows in np.array_split(np.arange(len(motion.times)), number):
        window, middle = motion.select(rows), len(rows) // 2
        centre = fits.fit(window, fits.guess_start(window), ("attitude", "rates")).motion(window)
        states.append(centre.select(slice(middle, middle + 1)).start)
        middles.append(rows[middle])
    times = motion.times[middles]
    q, w = zip(*states, strict=True)
    return BodyMotion(motion.moments, times - times[0], Rotation.concatenate(q), np.array(w))


# -- files that do not determine the motion


def _ill_conditioning(judgement) -> Finding:
    """Return why motions that begin within the resolution differ by more than the tolerance."""
    w, moments = judgement.reference.w[0], judgement.motion.moments
    across = float(np.linalg.norm(np.delete(w, np.argsort(moments)[1])) / np.linalg.norm(w))
    m1 = exact.set_up(*moments, *w).m1
    text = f"motions within the resolution of the file end {judgement.bound:.2g} apart"
    if across < STEADY:
        return Finding("intermediate_axis", f"{text}: the spin begins {across:.2g} rad from the intermediate axis")
    if m1 < NEAR:
        return Finding("near_separatrix", f"{text}: 1 − m = {m1:.2g}, near the separatrix")
    return Finding("rounding", f"{text}: the digits of the first row are too few for the tolerance")
