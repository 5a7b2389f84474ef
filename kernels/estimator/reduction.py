r"""Reduction to zero amplitude: the rate² of an infinitesimal perturbation from the samples of a finite one.

*Where the bias sits.* In the units of :mod:`kernels.near_axis.near_axis_block`, with the clock
:math:`d\theta = |\alpha|\,d\tau`, Euler's equations of the transverse part are linear at every amplitude,

.. math:: \frac{d\beta}{d\theta} = \pm c_b\,\gamma, \qquad \frac{d\gamma}{d\theta} = \pm c_c\,\beta
          \;\Rightarrow\; \frac{d^2\beta}{d\theta^2} = \kappa\,\beta, \quad \kappa = c_bc_c = -\Omega^2/\omega_0^2

so a finite perturbation shifts the measured rate² only because samples that are equally spaced in time are not so in
theta. Of any solution of that linear equation three samples, :math:`d_\pm = m \pm \delta` apart after and before,
obey *exactly*, with :math:`C_x = \cosh\sqrt\kappa x`, :math:`S_x = \sinh\sqrt\kappa x`,

.. math:: \beta_+ - 2\beta + \beta_- = 2\left(\frac{C_m}{C_\delta} - 1\right)\beta
          + \frac{S_\delta}{C_\delta}\frac{C_m}{S_m}\,(\beta_+ - \beta_-)

Put :math:`m = h(1 + \mu)`, :math:`\delta = h\eta`, :math:`x^2 = \kappa h^2`. What an equally spaced motion would not
have is, to the third order in :math:`\mu` and :math:`\eta`, the amplitude's part

.. math:: p = \left[2xS\,\mu + x^2C\,(\mu^2 - \eta^2) + \tfrac13x^3S\,\mu^3\right]\beta
          + \eta\left[x\coth x - \frac{x^2}{S^2}\mu + \mu^2 - \mu^3\right](\beta_+ - \beta_-)

(C and S at x). Taken off sample by sample it leaves the recurrence of :mod:`kernels.estimator.measure` for zero
amplitude, with the same sums, from which the reduced rate² and its own scatter follow. The slope's weights are
:math:`(1 + \mu)^2\varepsilon^2`.

*The clock.* :math:`|\alpha| = 1 + a` is sampled, and its rate of change is the motion's own,
:math:`a' = \pm c_a\varepsilon^2\beta\gamma`. To first order in the amplitude a is a constant and a part that obeys
:math:`a'' = 4\kappa a`, because :math:`a'` is a product of two transverse components; for such an a the trapezoid with
its end correction is exact,

.. math:: \frac1h\int_0^h a\,d\tau = \tfrac12(a_0 + a_1) - \frac{x\coth x - 1}{4x^2}\,h\,(a_1' - a_0')

*Small perturbations.* If no spin of a run can deviate by more than :math:`w = 10^{-8}` of itself, p is its part of the
first order, :math:`2xS\mu\beta + \eta x\coth x(\beta_+ - \beta_-)`: what is left out is the part w of p, and of Ω²
below w² = 10⁻¹⁶, a rounding. The clock is not summed up then. The integrals of
:math:`a = \bar a + y,\ y'' = 4\kappa y`, over the interval before and after the triple's middle are

.. math:: \mu = \bar a + zy = za + (1 - z)\bar a, \qquad \eta = \frac{S^2}{2x^2}ha', \qquad
          z = \frac{\sinh 2x}{2x} = \frac{SC}x

with a and :math:`a'` at the middle, so that :math:`\eta x\coth x = \frac12zh\,a'`. The constant comes from the first
triple, with the ends :math:`h(a'_+ - a'_-) = 8x^2z\,y` apart. The slope's weights are :math:`\varepsilon^2`, for what
is left of D after the first guess is a rounding, and the weights' part w of that nothing. The bound is :math:`|a| \le
|c_a|\varepsilon^2\int|\beta\gamma|\,d\tau \le \frac12|c_a|\varepsilon^2\,10^2\,T` of samples up to ten times the
start, in a run of length T.

*Blind.* x² comes from the second difference of the first three samples, corrected for its own amplitude by two rounds
of the above; no theoretical rate is used. c_a is the coefficient by which the transverse motion drives the spin: it
is part of no linear rate.

Source: derived here. Not validated: spacings of more than half a radian.
"""

import math

from kernels.compile.jit import INLINE, njit
from kernels.compile.llvm_formulas import formula
from kernels.estimator import measure

GUESS_ROUNDS = 2  # number of corrections of the first guess for the amplitude of its own three samples
MAX_WANDER = 1.0 / 32.0  # the window ends when the spin has changed by more than this fraction of its initial value,
MIN_FOLLOWED_SAMPLES = 7  # but not before this number of samples
SMALL_WANDER = 1e-8  # relative change of the spin up to which the reduction's first order suffices


@njit(**INLINE)
def is_small(ca, epsilon, span):
    """Return True if the first order suffices: no spin changes by more than SMALL_WANDER.

    Args:
        `ca` (float): Euler coefficient of the spin axis.
        epsilon (float): Relative size of the perturbation.
        span (float): Length of the run, radians of spin.
    """
    return 0.5 * abs(ca) * (epsilon * epsilon) * (measure.MAX_GROWTH * measure.MAX_GROWTH) * span <= SMALL_WANDER


@formula
def square(guess):
    """Return x² of D_0 = 1 - cosh x, by its series; dimensionless."""
    G = -2.0 * guess
    series = G * (1 / 560 - G * (1 / 3150 - G * (1 / 16632)))
    return G * (1.0 - G * (1 / 12 - G * (1 / 90 - series)))


@formula
def constants(guess, drive):
    """Return constants of a lane from D_0 (dimensionless) and the drive c_a epsilon² h, its sign the spin's.

    Returns:
        quadrature, first, second, third, along, slope (float): The clock's end correction times the drive; 2xS, x²C and
            x³S/3; x coth x and -x²/S². Series in x², cut at 1e-8 of them for |x| up to 1/2.
    """
    G, x2 = -2.0 * guess, square(guess)
    series = x2 * (1 / 4725 - x2 * (2 / 93555 - x2 * (1382 / 638512875)))
    c = 1 / 3 - x2 * (1 / 45 - x2 * (2 / 945 - series))
    s = 1.0 + x2 * (1 / 6 + x2 * (1 / 120 + x2 * (1 / 5040 + x2 * (1 / 362880))))
    return 0.25 * c * drive, 2.0 * x2 * s, x2 * (1.0 + 0.5 * G), x2 * x2 * s / 3.0, 1.0 + x2 * c, -1.0 / (s * s)


@formula
def first_order(guess, drive, a1, products):
    """Return constants of a lane for small ε: z, (1 - z) times the mean excess, and the factor of βγ in ηx coth x.

    Args:
        guess, drive (float): As in :func:`constants`.
        `a1` (float): Excess of the spin at the middle of the first triple.
        products (float): βγ at the end of the first triple less that at its start.
    """
    x2 = 4.0 * square(guess)
    mean_factor = 1 / 6 + x2 * (1 / 120 + x2 * (1 / 5040 + x2 * (1 / 362880 + x2 * (1 / 39916800))))
    z = 1.0 + x2 * mean_factor
    return z, mean_factor * (0.5 * drive / z * products - x2 * a1), 0.5 * z * drive


@formula
def amplitude_part(u, u1, lane):
    """Return the factors of (β, γ) and of (β_+ - β_-, γ_+ - γ_-) in p, and μ.

    Args:
        `u`, `u1` (float): Integral of a over the interval after the triple's middle, and before it, over h: μ ± η.
        lane (tuple of 5 float): The lane's :func:`constants` without the quadrature.
    """
    first, second, third, along, slope = lane
    mu, eta = 0.5 * (u + u1), 0.5 * (u - u1)
    square = mu * mu
    along_first = mu * first + (second * (u * u1) + third * (square * mu))  # μ² - η² = u u1
    across = eta * (along + (mu * slope + square * (1.0 - mu)))
    return along_first, across, mu


@njit(**INLINE)
def corrected_guess(excess, now, before, earlier, drive):
    """Return D_0 of the first three samples without the effect of their amplitude (dimensionless).

    Args:
        excess (tuple of 2 float): Excess of the spin at the second and at the third sample (0 at the first).
        now, before, earlier (tuple of 2 float): The third, the second and the first sample, each (β, γ).
        drive (float): As in :func:`constants`.
    """
    (a1, a), (b, c), (b1, c1), (b2, c2) = excess, now, before, earlier
    raw = measure.first_guess(now, before, earlier)
    guess = raw
    size = b1 * b1 + c1 * c1
    along1 = ((b - b2) * b1 + (c - c2) * c1) / size
    for _ in range(GUESS_ROUNDS):
        quadrature, first, second, third, along, slope = constants(guess, drive)
        u1 = 0.5 * a1 - quadrature * (b1 * c1 - b2 * c2)
        u = 0.5 * (a + a1) - quadrature * (b * c - b1 * c1)
        along_first, across, _ = amplitude_part(u, u1, (first, second, third, along, slope))
        guess = raw + 0.5 * (along_first + across * along1)
    return guess


@formula
def rms_part(sum_rr, sum_ss, inverse, samples):
    """Return the root mean square of p relative to the motion, as a rate².

    Args:
        sum_rr, sum_ss (float): Sums of the squares of the residuals before and after the reduction.
        inverse (float): 1/Σxx.
        samples (float): 1/h.
    """
    return math.sqrt(max(sum_rr - sum_ss, 0.0) * inverse) * samples * samples
