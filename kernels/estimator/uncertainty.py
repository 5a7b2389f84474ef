r"""Error of a measured rate²: a bound in four terms that are added.

Time is in radians of spin, rates² in spin². h is the spacing of the samples, n their number in the window,
:math:`T = (n - 1)h`, :math:`u = 2^{-53}`, :math:`\Omega^2` the *reduced* rate² (:mod:`kernels.estimator.reduction`),
and :math:`\lambda^2 = \max(-\Omega^2, 0)`.

* **scatter**, :math:`\sigma\sqrt{n/(n-4)}\min(1, g)`: the standard error of the reduced rate² from the residuals of its
  own line, widened as Student's distribution is for few samples (its variance is :math:`\nu/(\nu - 2)`). Residuals s
  above the rounding are no noise but harmonics of the motion, which contribute little to a sum over turns. The
  transverse ε is a sinusoid of the phase :math:`\varphi = \Omega\tau`, and the remainder of the reduction is odd in it,
  so that :math:`s\varepsilon` has only even multiples of φ and its mean (which is the amplitude's term). Of m samples
  :math:`|\sum\cos(2j\varphi_k + \psi)| \le 1/\sin jx`, which is at most :math:`1/\sin x` and for j = 2 at most
  :math:`1/(2\sin x\cos x)`, :math:`x = \Omega h \le \frac12`; a third harmonic S, of the worst phase in either
  component, moves :math:`\sum s\varepsilon` by :math:`\frac12S|\varepsilon|(1/\sin x + 1/\sin 2x)`: both together by
  no more than :math:`q\,s_{rms}\varepsilon_{rms}/\sin x` with :math:`q = 1 + 1/(2\cos\frac12)`, a higher harmonic by
  less. σ counts it as :math:`\sqrt{m/2}\,s_{rms}\varepsilon_{rms}`: hence :math:`g = q\sqrt{2/m}/\sin x`, m = n - 2,
  and :math:`\sin^2x \ge x^2(1 - x^2/3)`. It is below 1 only if the window covers a turn. The rounding of samples, which
  is noise, has its own term below.
* **integration**, :math:`\frac5T\sqrt{|\Omega^2| + 1/T^2}\,\delta + f(4 + 6.4\lambda h)\lambda^2(\delta + l)`. An error
  of the perturbation that grows to the relative size δ over the window is a rate off by δ/T, which moves Ω² by
  :math:`2\Omega\,\delta/T`; below :math:`\Omega T = 1` a bend by δ moves it by :math:`2\delta/T^2`. The factor is 5,
  not 2, because an early error and a later one may cancel in δ. A growing motion puts all weight on its last
  samples, over some :math:`1/\lambda`, and there δ may have come at the end: a step's truncation goes with the cube
  of the perturbation, :math:`d = \delta e^{3\lambda t}`, and its second difference exceeds the motion's by
  :math:`2(\cosh 3x - \cosh x)\,d`, :math:`x = \lambda h`; over the samples that makes
  :math:`2(\cosh 3x - \cosh x)/(1 + e^{-2x})\,\delta/h^2`, 4λ²δ for small x, and below (4 + 6.4x)λ²δ up to
  :math:`x = \frac12`, which no spacing exceeds. A motion that decays puts all weight on its first samples, where the
  same error is :math:`d = d_0(e^{-3\lambda t} - e^{-\lambda t})`, for it starts at 0: only its largest value is
  observed, :math:`\delta = \frac{2}{3\sqrt3}d_0`. So :math:`f = \frac32\sqrt3` unless the motion has grown; f = 1 if
  the largest size squared is 40 times that of the start: a window closed by the size. Added to it, and of opposite
  sign, is the truncation of a series to the order N of the linear motion, :math:`l = n\,x^{N+1}/(N+1)!` in n steps of
  x = λh: of the error at the end δ shows their difference. As l goes with the time, δ with :math:`e^{2\lambda t}`, they
  cannot cancel for long: from :math:`l(1 - s) - (\delta + l)(e^{-Ks} - e^{-K})/(1 - e^{-K}) \le\delta` at s = 0.43,
  :math:`e^K = 40`, follows l ≤ 3.1 δ, and no more of it counts; nor does more than what steps near the axis leave out
  at that size (:mod:`kernels.free.direct`), for neither cancels more than there is of the second. δ is the point's
  certificate; without one, if the motion is the exact one, the rounding of its steps, n u, and :math:`n\,u|\Omega^2|`
  more: the spin's own rounding, at most u/2 a step and all in one sense, is a wandering that the reduction takes off by
  :math:`2|\Omega^2|` of its mean although the small motion's recurrence never saw it.
* **amplitude**, :math:`p\left[w\left(C x^4 + D x^2 w + w^3\right) + x^{12}/40000\right] + 2uc/h`, the remainder
  of the reduction: p is the root mean square of the part removed, w the largest change of the spin over the window,
  both from the samples, c the largest :math:`|c_i|`, and :math:`x^2 = |\Omega^2|h^2`. The first term is the clock's end
  correction at the second order of the amplitude (its parts at twice the frequency: 16 x² of a fourth derivative, over
  60·4), the second and third the orders that were left out of p. C = 1/4 and D = 3/10 suffice for growing motions, in
  which errors add up; in an oscillation they average out over a turn, and C = 3/2000, D = 3/500 suffice. Within a turn
  they do not: :math:`\min(1, 1/|\Omega^2|T^2)` and 6/5 of it are added to C and D. These constants and that of the
  third term are confirmed by experiment (10^5 points of random definitions, tests/benchmarks/error_bars.py; half of
  what is added within a turn leaves 1 point in 10^4 outside). The fourth is the series of x²
  (:func:`kernels.estimator.reduction.square`), with the first omitted term x¹²/84084 of it. The last is the rounding
  of the spin's excess, u, which moves p by :math:`u|\varepsilon_+ - \varepsilon_-| \le 2uch|\varepsilon|`. Well within
  a turn w is less than the orders that it stands for, and :math:`\frac12|\Omega^2|(wh^2/T^2)^2` is added: the spin's
  excess obeys :math:`a'' = K + (4\kappa + K)a + 6\kappa a^2 + 2\kappa a^3` with :math:`\kappa = -\Omega^2` and
  :math:`K = c_a\varepsilon^2(c_b\gamma_0^2 + c_c\beta_0^2)`, but the clock's end correction knows of 4κ alone. By
  Euler and Maclaurin it leaves :math:`\frac{h^3}{720}(a''' - 4\kappa a')|_0^h = \frac{h^4}{720}[Ka'' +
  12\kappa(aa')' + \cdots]` of μ, and of Ω² twice that. Over a span that is short compared with a turn
  :math:`a = vt + \frac12Kt^2`, which turns back if v is of opposite sign; yet :math:`w \ge \frac1{12}|K|T^2`
  whatever v (of seven samples; of more the bound is higher). So :math:`\frac2{720}K^2h^4 \le \frac25(wh^2/T^2)^2`,
  at the v of the least w the second part is :math:`\frac35|\Omega^2|T^2` of the first, and half covers both until the
  terms above are larger. It is left out if it is below the rounding u|Ω²|. If the spin changes by more than
  half (within the seven samples that every window has), nothing here is small, and the error is
  :math:`|\Omega^2| + c^2`, for no rate exceeds c: the amplitude does not allow a decision, and the point is marginal.
  If the reduction stopped at the first order, because no spin can wander by more than a w of its own, the term is
  p w.
* **rounding**, :math:`8u|\Omega^2| + u(6\sqrt{|\Omega^2|} + c_t)/h + u\max(0.4/\sqrt m, 2/m)/h^2`, m = n - 2: of the
  Euler coefficients and the step; of the state once a sample, all in one sense; and of the samples over h², at random.
  Of a component that hardly changes, the roundings of the samples leave only the first and the last, at most 2u, of
  the sum over m second differences; and if one coefficient is far above the second, a rounding of its component,
  :math:`u\gamma`, bends the second by :math:`c_t h` of that a sample, :math:`c_t = \max(|c_b|, |c_c|)`.

A decaying perturbation ends in a growing perturbation, due to rounding. The window closes when the size is below
10⁻⁶ of the start: squared, as it weighs in the sums, that is 10⁻¹², and the growing part is at most u/10⁻⁶ of it.

The measured rate² itself also differs by the reduction's shift, all of which is in its amplitude term.

*The moments* are used as given, to the last digit: errors of the input are not included. But the change of Ω² by
one rounding of each, :math:`u(|c_b|(I_a + I_b)/I_c + |c_c|(I_a + I_c)/I_b)`, is added to the rounding
if the kernel rounded them (the ratios of a scaling collapse), and if Ω² is within four times that of 0: two
moments that differ by their last digit make no growth rate.

*Assumed.* A linear motion apart from the change of the spin: no torque; a valid certificate; and one harmonic that
dominates the residuals of a stable motion.
"""

import math

from kernels.compile.llvm_formulas import formula

UNIT = 2.0**-53  # unit roundoff of doubles
RATE_FACTOR, BEND_FACTOR, BEND_SLOPE = 5.0, 4.0, 6.4  # the integration term's factors 5, 4 and 6.4
DECAY_FACTOR = 1.5 * math.sqrt(3.0)  # f of the integration term: 1/max(e^-s - e^-3s)
CLOSED_GROWTH = 40.0  # growth of the size squared that shows that the size has closed the window; f is then 1
MAX_HIDDEN_RATIO = 3.1  # largest l/δ of the integration term
# Factors (C, D) of the amplitude term: of growing motions, of oscillations, and added in windows of less than a turn.
GROWING_ORDERS, ROTATING_ORDERS, SHORT_WINDOW_ORDERS = (0.25, 0.3), (0.0015, 0.006), (1.0, 1.2)
THIRD_ORDER = 1.0  # factor of w³ in the amplitude term, confirmed by experiment
SERIES_FACTOR = 1.0 / 40000.0  # factor of x¹² in the amplitude term: twice the series' first omitted term
MAX_WANDER = 0.5  # relative change of the spin above which the error is |Ω²| + c²
NEAR_ZERO_RATIO = 4.0  # |Ω²| below this multiple of the moments' rounding counts as near 0
HARMONIC_FACTOR = 2.0 * (1.0 + 0.5 / math.cos(0.5)) ** 2  # 2 q² of the scatter term


@formula
def scatter(slope, squares, samples_used, rate2, spacing):
    """Return the scatter term, by one root and one division; NaN for less than four samples.

    Args:
        slope (float): Derivative of the rate² by D.
        squares (float): Sum of the squares of the residuals, over that of the samples.
        samples_used (float): n.
        rate2 (float): The reduced rate².
        spacing (float): h.
    """
    x2 = rate2 * spacing * spacing
    turns = (samples_used - 2.0) * x2 * (1.0 - x2 * (1 / 3))  # m sin²x; below 0 for growth: all of the scatter counts
    below = (8.0 * samples_used - 20.0) * max(samples_used - 4.0, 0.25) * max(turns, HARMONIC_FACTOR)
    return slope * math.sqrt(squares * samples_used * HARMONIC_FACTOR / below) if samples_used >= 4.0 else math.nan


@formula
def truncation_error(x, steps, order):
    """Return the truncation error of e^x by series.

    Args:
        `x` (float): λh of one step.
        steps (float): Number of steps.
        order (float): Order of the series: 8, 10 or 12.
    """
    x2 = x * x
    x4 = x2 * x2
    more = x2 * (1 / 39916800) if order < 11.0 else x4 * (1 / 6227020800)
    return steps * (x4 * x4 * x) * (1 / 362880 if order < 9.0 else more)


@formula
def end_error(distance, growth, truncation):
    """Return the error at the end of a growing motion, f(δ + l).

    Args:
        distance (float): δ.
        growth (float): Largest size squared over that of the start.
        truncation (float): Bound on l.
    """
    end_distance = distance + min(truncation, MAX_HIDDEN_RATIO * distance)
    return end_distance if growth >= CLOSED_GROWTH else end_distance * DECAY_FACTOR


@formula
def integration(rate2, rate, distance, end, per, spacing):
    """Return the integration term.

    Args:
        rate2, rate (float): Ω² and √|Ω²|.
        distance (float): δ, the largest relative error of the perturbation.
        end (float): Its :func:`end_error`.
        per (float): 1/T.
        spacing (float): h.
    """
    bend = (BEND_FACTOR + BEND_SLOPE * rate * spacing) * max(-rate2, 0.0)
    return distance * RATE_FACTOR * per * math.sqrt(abs(rate2) + per * per) + end * bend


@formula
def amplitude(rate2, rms_part, wander, spacing, per, bound):
    """Return the amplitude term.

    Args:
        rate2 (float): Ω².
        rms_part (float): p, the root mean square of the reduction's part.
        wander (float): w, the largest relative change of the spin.
        spacing (float): h.
        per (float): 1/T.
        bound (float): c, the largest size of an Euler coefficient, which no rate exceeds.
    """
    x2 = abs(rate2) * spacing * spacing
    short_window = min(1.0, per * per / max(abs(rate2), 1e-300))
    fourth = (GROWING_ORDERS[0] if rate2 < 0.0 else ROTATING_ORDERS[0]) + SHORT_WINDOW_ORDERS[0] * short_window
    second = (GROWING_ORDERS[1] if rate2 < 0.0 else ROTATING_ORDERS[1]) + SHORT_WINDOW_ORDERS[1] * short_window
    x4 = x2 * x2
    terms = (
        wander * (fourth * x4 + wander * (second * x2 + THIRD_ORDER * wander * wander)) + SERIES_FACTOR * x4 * x4 * x4
    )
    return rms_part * terms + 2.0 * UNIT * bound / spacing if wander <= MAX_WANDER else abs(rate2) + bound * bound


@formula
def clock_correction_error(rate2, wander, intervals):
    """Return the error of the clock's end correction over a window that is short compared with a turn.

    Args:
        rate2 (float): Ω².
        wander (float): w, the largest relative change of the spin.
        intervals (float): n - 1.
    """
    bend = wander / (intervals * intervals)
    remainder = 0.5 * bend * bend
    return abs(rate2) * remainder if remainder > UNIT else 0.0


@formula
def rounding(rate, samples, samples_used, bend):
    """Return the rounding of coefficients, steps and samples.

    Args:
        rate (float): √|Ω²|.
        samples (float): 1/h.
        samples_used (float): n.
        bend (float): c_t, the larger of |c_b| and |c_c|.
    """
    of_steps = rate * (8.0 * rate + 6.0 * samples) + bend * samples
    remainder = max(samples_used - 2.0, 1.0)
    return UNIT * (of_steps + max(0.4 * math.sqrt(remainder), 2.0) / remainder * samples * samples)


@formula
def moment_rounding(rate2, Ia, Ib, Ic, rounded):
    """Return the change of Ω² by one rounding of each moment if it is to be added, else 0.

    Args:
        rate2 (float): Ω².
        `Ia`, `Ib`, `Ic` (float): Moments of inertia, the spin axis first.
        rounded (bool): Whether the kernel has rounded the moments.
    """
    shift = UNIT * (abs(Ic - Ia) * (Ia + Ib) + abs(Ia - Ib) * (Ia + Ic)) / (Ib * Ic)
    return shift if rounded | (abs(rate2) <= NEAR_ZERO_RATIO * shift) else 0.0


@formula
def interval_distance(square, error, rate, low, high):
    """Return the larger distance of a rate from an end of its interval.

    The distance from the lower end is a difference of squares over a sum of roots, which keeps digits.

    Args:
        square, error (float): The rate's square, at least 0, and its error.
        rate (float): √square.
        low, high (float): Roots of the ends of the square's interval; low is at least 0.
    """
    below = min(square, error) / (rate + low if rate > 0.0 else 1.0)
    return max(high - rate, below if rate > 0.0 else 0.0)
