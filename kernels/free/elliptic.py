r"""Jacobi's elliptic functions and Legendre's integrals of the first kind, in double precision.

Every function takes the parameter ``m`` in [0, 1] *and* its complement ``m1 = 1 - m``: near the separatrix
of a free top ``m`` rounds to one while ``m1`` keeps all its digits.  The smaller of the two decides the
accuracy.

The arithmetic-geometric mean ``a_0 = 1, b_0 = sqrt(m1), a_{n+1} = (a_n + b_n)/2, b_{n+1} = sqrt(a_n b_n)``
ends, after N steps, in ``a_N = b_N = pi/(2 K)``.  Gauss' transformation (Abramowitz & Stegun 16.12, DLMF
22.7.2-4) leads from the circular functions of ``phi = a_N u`` back up to the elliptic functions.  Written in
``C_n = a_n cn_n/sn_n`` and ``d_n = dn_n`` it is::

    C_N = a_N cot(phi),   d_N = 1,
    q = C_n^2/a_n,   C_{n-1} = C_n d_n,   d_{n-1} = (q + b_{n-1})/(q + a_{n-1}),

with products and sums of positive terms only, so dn and cn keep their *relative* precision
however small m1 is (the arrangement is Bulirsch's, Numer. Math. 7 (1965) 78).  The mean is carried in
double-double and so is ``a_N u``: large arguments lose nothing to the rounding of the period.
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.compile.jit import INLINE, OPTIONS, njit
from kernels.compile.llvm_formulas import formula

HALF_PI = 0.5 * math.pi
SPLITTER = 134217729.0  # 2**27 + 1 cuts a double into two halves of 26 bits (Veltkamp)
RUNGS = 16  # the mean of 1 and sqrt(5e-324) takes 13
SETTLED = 1e-18  # relative gap a_n - b_n below which the next mean changes nothing in double precision
TINY_ARGUMENT = 1e-8  # below it the first two terms of each Maclaurin series are exact to rounding


@njit(**INLINE)
def two_sum(x, y):
    """Return the sum of two doubles and its rounding error: ``x + y = s + e`` exactly (Knuth, TAOCP 4.2.2)."""
    s = x + y
    t = s - x
    return s, (x - (s - t)) + (y - t)


@njit(**INLINE)
def two_product(x, y):
    """Return the product of two doubles and its rounding error, ``x y = r + e`` exactly (Dekker 1971).

    Holds while ``|x|, |y| < 1e300`` and the error term, some 1e-32 of the product, does not underflow.
    """
    r = x * y
    t = SPLITTER * x
    xh = t - (t - x)
    xl = x - xh
    t = SPLITTER * y
    yh = t - (t - y)
    yl = y - yh
    return r, ((xh * yh - r) + xh * yl + xl * yh) + xl * yl


@njit(**INLINE)
def double_product(xh, xl, yh, yl):
    """Return the product of the double-doubles (`xh`, `xl`) and (`yh`, `yl`), relative error about 1e-31."""
    r, e = two_product(xh, yh)
    e += xh * yl + xl * yh
    return two_sum(r, e)


@njit(**OPTIONS)
def double_sqrt(xh, xl):
    """Return the square root of a positive double-double, one Newton step from the double root."""
    root = math.sqrt(xh)
    square, e = two_product(root, root)
    return two_sum(root, ((xh - square) - e + xl) / (2.0 * root))


class Ladder(NamedTuple):
    """The means of one modulus."""

    m: float
    rungs: np.ndarray  #: a_n and b_n, shape (2, RUNGS)
    n: int  #: N
    ah: float  #: a_N in double-double; 0 on the separatrix, which has no ladder
    al: float


@njit(**OPTIONS)
def ladder(m, m1):
    """Return the :class:`Ladder` of a parameter and its complement."""
    rungs = np.empty((2, RUNGS))
    if not m1 > 0.0:
        return Ladder(m, rungs, 0, 0.0, 0.0)
    ah, al = 1.0, 0.0
    bh, bl = two_sum(1.0, -m) if m <= 0.5 else (m1, 0.0)
    bh, bl = double_sqrt(bh, bl)
    n = 0
    rungs[0, 0] = ah
    rungs[1, 0] = bh
    while abs((ah - bh) + (al - bl)) > SETTLED * ah and n < RUNGS - 1:
        gh, gl = double_product(ah, al, bh, bl)
        ah, e = two_sum(ah, bh)
        ah, al = two_sum(0.5 * ah, 0.5 * (e + (al + bl)))
        bh, bl = double_sqrt(gh, gl)
        n += 1
        rungs[0, n] = ah
        rungs[1, n] = bh
    return Ladder(m, rungs, n, ah, al)


@njit(**OPTIONS)
def separatrix_functions(u):
    """Return (sn, cn, dn) at m = 1: ``(tanh u, sech u, sech u)``, without overflow; cn and dn underflow past 745."""
    e = math.exp(-abs(u))
    sech = 2.0 * e / (1.0 + e * e)
    return math.tanh(u), sech, sech


@njit(**OPTIONS)
def climb(u, means):
    """Return (sn, cn, dn) of ``u`` from a :class:`Ladder`: the recurrence of the module's docstring.

    Absolute error at most 4e-16 (1 + |u|), and in practice a few 1e-16 for any |u| < 1e15.  dn is right to
    1e-15 (1 + min(|u|, K)) of itself, cn to as much of dn, and sn, for |u| < K, to 1e-15 of itself.
    Source: DLMF 22.7(i), 22.20(ii).
    """
    m, rungs, n, ah, al = means
    if ah == 0.0:
        return separatrix_functions(u)
    if abs(u) < TINY_ARGUMENT:
        return u, 1.0 - 0.5 * u * u, 1.0 - 0.5 * m * u * u
    phi, tail = two_product(u, ah)
    tail += u * al
    sin0, cos0 = math.sin(phi), math.cos(phi)
    sine, cosine = sin0 + tail * cos0, cos0 - tail * sin0
    if sine == 0.0:
        return 0.0, math.copysign(1.0, cosine), 1.0
    C = rungs[0, n] * (cosine / sine)
    dn = 1.0
    for i in range(n, 0, -1):
        q = C * C / rungs[0, i]
        C *= dn
        dn = (q + rungs[1, i - 1]) / (q + rungs[0, i - 1])
    sn = math.copysign(1.0 / math.sqrt(1.0 + C * C), sine)
    return sn, C * sn, dn


@formula
def duplicate(sn, cn, dn, m):
    """Return (`sn`, `cn`, `dn`) of twice the argument, `m` the parameter: DLMF 22.6.5-7, by 1 - cn and 1 - dn."""
    ss, sd, sc = sn * sn, sn * dn, sn * cn
    D = 2.0 / (1.0 - m * ss * ss)
    return sc * dn * D, 1.0 - sd * sd * D, 1.0 - m * sc * sc * D


@formula
def jacobi_short(u, m):
    """Return Jacobi's sn, cn and dn for |u| <= 0.5, straight-line arithmetic for loops over lanes.

    Maclaurin series of sn at u/8, then three duplications.  Relative error below 1e-15.
    Source: DLMF 22.10.1.
    """
    v = 0.125 * u
    x = v * v
    s6 = 1.0 + m * (11069.0 + m * (165826.0 + m * (165826.0 + m * (11069.0 + m))))
    s5 = 1.0 + m * (1228.0 + m * (5478.0 + m * (1228.0 + m)))
    s4 = 1.0 + m * (135.0 + m * (135.0 + m))
    s3 = 1.0 + m * (14.0 + m)
    s = v * (1.0 - x / 6.0 * (1.0 + m - x / 20.0 * (s3 - x / 42.0 * (s4 - x / 72.0 * (s5 - x / 110.0 * s6)))))
    c = np.sqrt(1.0 - s * s)
    d = np.sqrt(1.0 - m * s * s)
    s, c, d = duplicate(s, c, d, m)
    s, c, d = duplicate(s, c, d, m)
    return duplicate(s, c, d, m)


@njit(**OPTIONS)
def K(m, m1):
    """Return the complete integral of the first kind, the quarter period: ``K = pi/(2 agm(1, sqrt(m1)))``.

    Relative error below 3e-16; infinite at m1 = 0.  Source: DLMF 19.8.5.
    """
    if m1 <= 0.0:
        return np.inf
    return HALF_PI / ladder(m, m1).ah
