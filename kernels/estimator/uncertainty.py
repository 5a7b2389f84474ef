r"""The error of a measured rate²: what a reader may rely on, in four terms that are added.

Time is in radians of spin, rates² in spin². h is the spacing of the samples, n their number in the window,
:math:`T = (n - 1)h`, :math:`u = 2^{-53}`, :math:`\Omega^2` the *reduced* rate² (:mod:`kernels.estimator.reduction`),
and :math:`\lambda^2 = \max(-\Omega^2, 0)`.

* **scatter**, :math:`\sigma\sqrt{n/(n-4)}\min(1, g)`: the standard error of the reduced rate² from the residuals of its
  own line, widened as Student's distribution is for few samples (its variance is :math:`\nu/(\nu - 2)`). Residuals s
  above the rounding are no noise but harmonics of the motion, which a sum over turns hardly sees. The transverse ε is
  a sinusoid of the phase :math:`\varphi = \Omega\tau`, and what the reduction leaves is odd in it, so that
  :math:`s\varepsilon` has only even multiples of φ beside its mean (which is the amplitude's term). Of m samples
  :math:`|\sum\cos(2j\varphi_k + \psi)| \le 1/\sin jx`, which is at most :math:`1/\sin x` and for j = 2 at most
  :math:`1/(2\sin x\cos x)`, :math:`x = \Omega h \le \frac12`; a third harmonic S, of the worst phase in either
  component, moves :math:`\sum s\varepsilon` by :math:`\frac12S|\varepsilon|(1/\sin x + 1/\sin 2x)`: both together by
  no more than :math:`q\,s_{rms}\varepsilon_{rms}/\sin x` with :math:`q = 1 + 1/(2\cos\frac12)`, a higher one by less.
  σ counts it as :math:`\sqrt{m/2}\,s_{rms}\varepsilon_{rms}`: hence :math:`g = q\sqrt{2/m}/\sin x`, m = n - 2, and
  :math:`\sin^2x \ge x^2(1 - x^2/3)`. It is below 1 only where the window holds a turn. The rounding of samples, which
  is noise, has a part of its own below.
* **integration**, :math:`\frac5T\sqrt{|\Omega^2| + 1/T^2}\,\delta + f(4 + 6.4\lambda h)\lambda^2(\delta + l)`. An error
  of the perturbation that grows to the relative size δ over the window is a rate off by δ/T, which moves Ω² by
  :math:`2\Omega\,\delta/T`; below :math:`\Omega T = 1` a bend by δ moves it by :math:`2\delta/T^2`. The factor is 5,
  not 2, because an early error and a later one may cancel in δ. A growing motion puts all weight on its last
  samples, over some :math:`1/\lambda`, and there δ may have come at the end: what a step leaves out goes with the cube
  of the perturbation, :math:`d = \delta e^{3\lambda t}`, whose second difference is
  :math:`2(\cosh 3x - \cosh x)\,d` beside the motion's, :math:`x = \lambda h`; over the samples that makes
  :math:`2(\cosh 3x - \cosh x)/(1 + e^{-2x})\,\delta/h^2`, 4λ²δ for small x, and below (4 + 6.4x)λ²δ up to
  :math:`x = \frac12`, which no spacing exceeds. A motion that decays puts all weight on its first samples, where the
  same error is :math:`d = d_0(e^{-3\lambda t} - e^{-\lambda t})`, for it starts at 0: seen is only its largest value,
  :math:`\delta = \frac{2}{3\sqrt3}d_0`. So :math:`f = \frac32\sqrt3` unless the motion has grown; f = 1 where the
  largest size squared is 40 times that of the start, a window that its size has closed. Beside it, and of the other
  sign, stands what a series to the order N leaves out of the linear motion, :math:`l = n\,x^{N+1}/(N+1)!` in n steps of
  x = λh: of the error at the end δ shows their difference. As l goes with the time, the other with
  :math:`e^{2\lambda t}`, that can't hide for long: from :math:`l(1 - s) - (\delta + l)(e^{-Ks} - e^{-K})/(1 - e^{-K})
  \le\delta` at s = 0.43, :math:`e^K = 40`, follows l ≤ 3.1 δ, and no more of it counts; nor does more than what steps
  near the axis leave out at that size (:mod:`kernels.free.direct`), for either hides no more than there is of the
  other. δ is the point's certificate; where there is none, the motion being the exact one, the rounding of its steps, n
  u, and :math:`n\,u|\Omega^2|` more: the spin's own rounding, at most u/2 a step and all in one sense, is a wandering
  that the reduction takes off by :math:`2|\Omega^2|` of its mean although the small motion's recurrence never saw it.
* **amplitude**, :math:`p\left[w\left(C x^4 + D x^2 w + w^3\right) + x^{12}/40000\right] + 2uc/h`, what the reduction
  leaves: p is the root mean square of what it took off, w the largest wandering of the spin over the window, both from
  the samples, c the largest :math:`|c_i|`, and :math:`x^2 = |\Omega^2|h^2`. The first term is the clock's end
  correction at the second order of the amplitude (its parts at twice the frequency: 16 x² of a fourth derivative, over
  60·4), the second and third the orders that were left out of p. C = 1/4 and D = 3/10 hold growing motions, where
  errors add up; about an oscillation they average out over a turn, and C = 3/2000, D = 3/500 hold. Within a turn they
  do not: :math:`\min(1, 1/|\Omega^2|T^2)` and 6/5 of it are added to C and D. These constants and that of the third
  term are held by experiment (10^5 points of random definitions, tests/benchmarks/error_bars.py; half of what is added
  within a turn leaves 1 point in 10^4 outside). The fourth is the series of x²
  (:func:`kernels.estimator.reduction.square`), whose first term left out is x¹²/84084 of it. The last is the rounding
  of the spin's excess, u, which moves p by :math:`u|\varepsilon_+ - \varepsilon_-| \le 2uch|\varepsilon|`. Well within
  a turn w is less than the orders that it stands for, and :math:`\frac12|\Omega^2|(wh^2/T^2)^2` is added: the spin's
  excess obeys :math:`a'' = K + (4\kappa + K)a + 6\kappa a^2 + 2\kappa a^3` with :math:`\kappa = -\Omega^2` and
  :math:`K = c_a\varepsilon^2(c_b\gamma_0^2 + c_c\beta_0^2)`, but the clock's end correction knows of 4κ alone. By
  Euler and Maclaurin it leaves :math:`\frac{h^3}{720}(a''' - 4\kappa a')|_0^h = \frac{h^4}{720}[Ka'' +
  12\kappa(aa')' + \cdots]` of μ, and of Ω² twice that. Over a span that is short beside a turn
  :math:`a = vt + \frac12Kt^2`, which turns back where v is of the other sign; yet :math:`w \ge \frac1{12}|K|T^2`
  whatever v (of seven samples; of more the bound is higher). So :math:`\frac2{720}K^2h^4 \le \frac25(wh^2/T^2)^2`,
  at the v of the least w the second part is :math:`\frac35|\Omega^2|T^2` of the first, and half holds both until the
  terms above are larger. It is left out where it is below the rounding u|Ω²|. Where the spin wanders by more than
  half of itself (within the seven samples that every window has) nothing here is small, and the error is
  :math:`|\Omega^2| + c^2`, for no rate exceeds c: the amplitude does not allow to decide, and the point is marginal.
  Where the reduction stopped at the first order, because no spin can wander by more than a w of its own, the term is
  p w.
* **rounding**, :math:`8u|\Omega^2| + u(6\sqrt{|\Omega^2|} + c_t)/h + u\max(0.4/\sqrt m, 2/m)/h^2`, m = n - 2: of the
  Euler coefficients and the step; of the state once a sample, all in one sense; and of the samples over h², at random.
  Of a component that hardly changes, the roundings of the samples leave only the first and the last, at most 2u, of
  the sum over m second differences; and where one coefficient is far above the other, a rounding of its component,
  :math:`u\gamma`, bends the other by :math:`c_t h` of that a sample, :math:`c_t = \max(|c_b|, |c_c|)`.

A decaying perturbation ends in the growing one that rounding has put beside it, and whose two components know nothing
of each other. The window closes where the size is below 10⁻⁶ of the start: squared, as it weighs in the sums, that is
10⁻¹², and what grows beside it no more than u/10⁻⁶ of it.

The measured rate² itself is off by the reduction's shift besides; its amplitude term holds that whole.

*The moments* are taken as they are given, to the last digit: errors of what was put in are the reader's own. But what
one rounding of each would move Ω² by, :math:`u(|c_b|(I_a + I_b)/I_c + |c_c|(I_a + I_c)/I_b)`, is added to the rounding
where the kernel did round them (the ratios of a scaling collapse), and where Ω² is within four times that of 0: two
moments that differ by their last digit make no growth rate.

*Assumed.* A linear motion beside the spin's wandering, so: no torque; a certificate that is one; and one harmonic that
rules the residuals of a stable motion.
"""

import math

from kernels.compile.llvm_formulas import formula

UNIT = 2.0**-53
FOLLOWED, BENT, STEEPER = 5.0, 4.0, 6.4
HARDLY_GROWN = 1.5 * math.sqrt(3.0)  # 1/max(e^-s - e^-3s)
GROWN = 40.0  # of the size squared
HIDDEN = 3.1
GROWING = (0.25, 0.3)
TURNING = (0.0015, 0.006)
WITHIN_A_TURN = (1.0, 1.2)
BEYOND = 1.0
SERIES = 1.0 / 40000.0
MOST_WANDER = 0.5
NEAR_NONE = 4.0
HARMONIC = 2.0 * (1.0 + 0.5 / math.cos(0.5)) ** 2  # 2 q²


@formula
def scatter(slope, squares, used, rate2, spacing):
    """Return the scatter term of n = ``used`` samples, from the slope by D and the residuals' sum of squares.

    The standard error squared, by what widens it: one root and one division. NaN for less than four samples.
    """
    x2 = rate2 * spacing * spacing
    turns = (used - 2.0) * x2 * (1.0 - x2 * (1 / 3))  # m sin²x; below 0 for growth, which keeps all of the scatter
    below = (8.0 * used - 20.0) * max(used - 4.0, 0.25) * max(turns, HARMONIC)
    return slope * math.sqrt(squares * used * HARMONIC / below) if used >= 4.0 else math.nan


@formula
def left_out(x, steps, order):
    """Return the part of e^x that so many series to the order 8, 10 or 12 leave out together; x of one step."""
    x2 = x * x
    x4 = x2 * x2
    more = x2 * (1 / 39916800) if order < 11.0 else x4 * (1 / 6227020800)
    return steps * (x4 * x4 * x) * (1 / 362880 if order < 9.0 else more)


@formula
def at_the_end(apart, growth, hidden):
    """Return the error at the end of a growing motion, f(δ + l), from the largest seen and the most that may be hidden.

    ``growth`` is the largest size squared over that of the start.
    """
    whole = apart + min(hidden, HIDDEN * apart)
    return whole if growth >= GROWN else whole * HARDLY_GROWN


@formula
def integration(rate2, rate, apart, end, per, spacing):
    """Return the integration's term from the largest relative error ``apart`` and that at the ``end``.

    rate is √|Ω²|, ``per`` 1/T.
    """
    bent = (BENT + STEEPER * rate * spacing) * max(-rate2, 0.0)
    return apart * FOLLOWED * per * math.sqrt(abs(rate2) + per * per) + end * bent


@formula
def amplitude(rate2, part, wander, spacing, per, bound):
    """Return the term of the reduction to zero amplitude, from the rms ``part`` it took off and the spin's ``wander``.

    ``per`` is 1/T, ``bound`` the largest Euler coefficient's size, which no rate exceeds.
    """
    x2 = abs(rate2) * spacing * spacing
    within = min(1.0, per * per / max(abs(rate2), 1e-300))
    fourth = (GROWING[0] if rate2 < 0.0 else TURNING[0]) + WITHIN_A_TURN[0] * within
    second = (GROWING[1] if rate2 < 0.0 else TURNING[1]) + WITHIN_A_TURN[1] * within
    x4 = x2 * x2
    left = wander * (fourth * x4 + wander * (second * x2 + BEYOND * wander * wander)) + SERIES * x4 * x4 * x4
    return part * left + 2.0 * UNIT * bound / spacing if wander <= MOST_WANDER else abs(rate2) + bound * bound


@formula
def well_within_a_turn(rate2, wander, intervals):
    """Return the clock's end correction over a window of so many intervals that is short beside a turn."""
    bent = wander / (intervals * intervals)
    left = 0.5 * bent * bent
    return abs(rate2) * left if left > UNIT else 0.0


@formula
def rounding(rate, samples, used, bend):
    """Return the rounding of coefficients, steps and samples, from √|Ω²|, 1/h and the larger of |c_b| and |c_c|."""
    of_steps = rate * (8.0 * rate + 6.0 * samples) + bend * samples
    left = max(used - 2.0, 1.0)
    return UNIT * (of_steps + max(0.4 * math.sqrt(left), 2.0) / left * samples * samples)


@formula
def of_moments(rate2, Ia, Ib, Ic, rounded):
    """Return the change of Ω² by one rounding of each moment, where it counts: see the module's docstring."""
    moved = UNIT * (abs(Ic - Ia) * (Ia + Ib) + abs(Ia - Ib) * (Ia + Ic)) / (Ib * Ic)
    return moved if rounded | (abs(rate2) <= NEAR_NONE * moved) else 0.0


@formula
def farther(square, error, rate, low, high):
    """Return the distance of rate = sqrt(square), square >= 0, from the farther end of its interval.

    Of the lower end, at least 0, it is a difference of squares over a sum of roots: a few roundings keep their digits.
    """
    below = min(square, error) / (rate + low if rate > 0.0 else 1.0)
    return max(high - rate, below if rate > 0.0 else 0.0)
