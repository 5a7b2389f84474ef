r"""A free rigid body whose moments of inertia change periodically, spun about a principal axis and perturbed.

With the moments :math:`I_i(t)` prescribed along fixed axes of the body and no torque, the angular momentum obeys

.. math:: \dot{\mathbf L} = \mathbf L\times I(t)^{-1}\mathbf L, \qquad
          \dot L_a = \left(\frac1{I_c} - \frac1{I_b}\right) L_b L_c \quad (a, b, c)\text{ cyclic}

so |L| is constant, and a spin about a principal axis a is a solution whatever the moments do. To first order its
perturbation obeys Hill's equations :math:`\dot L_b = -\alpha L_c,\ \dot L_c = \beta L_b` with
:math:`\alpha = L(1/I_c - 1/I_a),\ \beta = L(1/I_b - 1/I_a)`, which have no trace: the determinant is 1.

*Time* is u = nu t, from 0 to 2 pi; kappa = omega0/nu, and L is in units of :math:`I_a\omega_0`. The moments are
:math:`I_i(1 + d_i\cos(u + l_i))`, or their inverses are. *Coordinates*: the perturbation in units of epsilon, so that
none is too small, with :math:`L_b` in units of rho times :math:`L_c`, where :math:`\rho^2` is the ratio of the bounds
on alpha and beta: then neither is larger than the other, and errors of all entries of the matrix are alike.

*Measuring.* Two motions of the full equations start at right angles, along ``phase`` and across it, and are followed
for one period by Taylor steps (:mod:`kernels.taylor`); cos u and sin u are two more components. Their ends give the
monodromy matrix. The equations are even under a half turn about a, so a motion from the opposite start is the same but
for its sign, to the last bit: no even order is left to cancel. Two more motions, an eighth as large, start where the
period ends and are followed backwards by shorter steps: they give the inverse matrix. The difference of both results
holds the finite amplitude, the truncation and a part of the rounding; the rest of the rounding is bounded by the
largest product of what the motions have grown to at an instant and what grows from there to the end.

*Certificate.* The variational flow, with other terms, order and steps; begun at another phase of the period it must
give the same trace.

Source: derived from Euler's equations; Magnus and Winkler, Hill's Equation (1966), for the theory.
"""

import math

import numpy as np

from kernels import floquet, statuses
from kernels.blocks import W, scratch
from kernels.columns import arrays, numbers, rows
from kernels.jit import INLINE, OPTIONS, njit, whole_vectors
from kernels.rigid_body import cyclic
from kernels.straight import straight
from kernels.taylor import convolution, total

EPSILON = float(np.finfo(np.float64).eps)
TWO_PI = 2.0 * math.pi
ORDER, LINEAR_ORDER = 16, 18
MOST_STEPS = 100_000
BINS = 16  # parts of a period, in each of which the largest size is kept
SMALLER, FINER = 0.125, 1.3  # size, and steps, of the backward motions
ELSEWHERE = 0.381966  # of a period: where the variational flow begins again
TOGETHER = 2048  # points, a multiple of W
TOO_WIDE = 0.1  # of the matrix, that the finite amplitude may change

STATES = ("C", "S", "a", "b", "c", "d", "e", "f")  # cos u, sin u, and two motions: L_a, L_b, L_c of each
COEFFICIENTS = tuple(f"{kind}{i}" for i in "123" for kind in "kpq")
WEIGHTS = ("m1", "m2", "m3")
SETTINGS = (*COEFFICIENTS, *WEIGHTS, "steps", "epsilon", "phase")
AT = rows((*STATES, *SETTINGS, "h", "half_turns", "side", "b0", "c0"), 0, W)
FORWARD, BACKWARD = len(AT) * W, (len(AT) + BINS) * W  # largest size in each part of the period
ROWS = len(AT) + 2 * BINS
_STEPS, _RHO = SETTINGS.index("steps"), SETTINGS.index("m3")
FOUND = numbers(
    (
        *("m11", "m12", "m21", "m22", "half_turns", "growth"),  # measured; growth, the largest product of sizes
        *("back11", "back12", "back21", "back22"),  # measured backwards
        *("linear11", "linear12", "linear21", "linear22", "linear_half_turns", "linear_elsewhere"),  # elsewhere: trace
    )
)


def _text(order, inverse):
    """Return the text of a Taylor step of both motions.

    The n-th terms of the three differences of inverse moments, times their weights, are E1_n, E2_n, E3_n. In the mode
    `inverse` each is ``k + p cos u + q sin u``; else 1/I_i is ``k_i/(1 + p_i cos u + q_i sin u)``.
    """
    motions = ((*"abc", *"uvw"), (*"def", *"xyz"))
    lines = []
    for n in range(order + 1):
        if n:
            lines += [f"C{n} = -(h * R{n}) * S{n - 1}", f"S{n} = (h * R{n}) * C{n - 1}"]
            for motion in motions:
                for i in range(3):
                    terms = convolution((("+", f"E{i + 1}_", motion[3 + i]),), n - 1)
                    lines.append(f"{motion[i]}{n} = R{n} * ({terms.removeprefix(' + ')})")
        if n == order:
            break
        for i in "123":
            g = f"p{i} * C{n} + q{i} * S{n}"
            if inverse:
                lines.append(f"E{i}_{n} = (m{i} * h) * ({g if n else f'k{i} + ({g})'})")
            elif n == 0:
                lines += [f"G{i} = 1.0 / (1.0 + ({g}))", f"J{i}_0 = k{i} * G{i}"]
            else:
                before = convolution((("+", f"g{i}_", f"J{i}_"),), n).replace(f" + g{i}_0 * J{i}_{n}", "")
                lines += [f"g{i}_{n} = {g}", f"J{i}_{n} = -G{i} * ({before.removeprefix(' + ')})"]
        if not inverse:
            lines += [f"E{i}_{n} = (m{i} * h) * (J{j}_{n} - J{k}_{n})" for i, j, k in ((1, 3, 2), (2, 1, 3), (3, 2, 1))]
        for a, b, c, *products in motions:
            for name, u, v in zip(products, (b, c, a), (c, a, b), strict=True):
                lines.append(f"{name}{n} = {convolution((('+', u, v),), n).removeprefix(' + ')}")
    return "\n".join([*lines, f"return {', '.join(total([f'{x}{n}' for n in range(order + 1)]) for x in STATES)}"])


def _linear_text(order, inverse):
    """Return the text of a step of two solutions (x, y), (v, w) of ``x' = A y, y' = B x`` in units of h.

    A and B are E2 and E3 of :func:`_text`; their terms are those of a sine, by its derivatives in turn.
    """
    lines = ["H1 = h", *(f"H{n} = (H{n - 1} * h) * R{n}" for n in range(2, order))]
    for i in "23" if inverse else "123":
        lines += [f"s{i}_0 = p{i} * C + q{i} * S", f"s{i}_1 = q{i} * C - p{i} * S"]
        lines += [f"s{i}_2 = -s{i}_0", f"s{i}_3 = -s{i}_1"]
        sine = [f"s{i}_0", *(f"H{n} * s{i}_{n % 4}" for n in range(1, order))]
        if inverse:
            terms = [f"k{i} + {sine[0]}", *sine[1:]]
            lines += [f"{'AB'[int(i) - 2]}{n} = (m{i} * h) * ({term})" for n, term in enumerate(terms)]
            continue
        lines += [f"G{i} = k{i} / (1.0 + {sine[0]})", f"V{i} = -1.0 / (1.0 + {sine[0]})"]
        lines += [f"g{i}_{n} = V{i} * ({term})" for n, term in enumerate(sine) if n]
        for n in range(order):
            lines.append(f"J{i}_{n} = " + (" + ".join(f"g{i}_{n - m} * J{i}_{m}" for m in range(n)) or f"G{i}"))
    if not inverse:
        lines += [f"A{n} = (m2 * h) * (J1_{n} - J3_{n})" for n in range(order)]
        lines += [f"B{n} = (m3 * h) * (J2_{n} - J1_{n})" for n in range(order)]
    for n in range(1, order + 1):
        for x, coefficient, y in (("x", "A", "y"), ("y", "B", "x"), ("v", "A", "w"), ("w", "B", "v")):
            lines.append(
                f"{x}{n} = R{n} * (" + " + ".join(f"{y}{m} * {coefficient}{n - 1 - m}" for m in range(n)) + ")"
            )
    sums = (" + ".join(f"{x}{n}" for n in range(order, -1, -1)) for x in "xyvw")
    return "\n".join([*lines, f"return {', '.join(sums)}"])


def _numbers(order):
    return {f"R{n}": 1.0 / n for n in range(1, order + 1)}


def _steps(inverse):
    """Return both compiled steps of a mode."""
    name = "inverse" if inverse else "moment"
    whole = [*(f"{x}0" for x in STATES), *COEFFICIENTS, *WEIGHTS, "h"]
    linear = ["x0", "y0", "v0", "w0", "C", "S", *COEFFICIENTS, *WEIGHTS, "h"]
    return (
        straight(f"follow_{name}", whole, _text(ORDER, inverse), _numbers(ORDER)),
        straight(f"vary_{name}", linear, _linear_text(LINEAR_ORDER, inverse), _numbers(LINEAR_ORDER)),
    )


@njit(**OPTIONS)
def _load(S, table, first, count, finer, end):
    """Load the settings of a block with ``finer`` times the steps, at the period's start or, backwards, at its end."""
    for lane in range(W):
        i = first + min(lane, count - 1)
        for row in range(len(SETTINGS)):
            S[AT.k1 + row * W + lane] = table[row, i]
        steps = math.ceil(finer * table[_STEPS, i])
        S[AT.steps + lane], S[AT.h + lane] = steps, (-TWO_PI if end else TWO_PI) / max(steps, 1.0)
        S[AT.C + lane], S[AT.S + lane], S[AT.half_turns + lane], S[AT.side + lane] = 1.0, 0.0, 0.0, 0.0


@njit(**OPTIONS)
def _start(S, lane, b, c, e, f):
    """Start two motions of a lane at (b, c) and (e, f) across the spin axis."""
    S[AT.a + lane], S[AT.b + lane], S[AT.c + lane] = 1.0, b, c
    S[AT.d + lane], S[AT.e + lane], S[AT.f + lane] = 1.0, e, f
    S[AT.b0 + lane], S[AT.c0 + lane] = b, c


@njit(**OPTIONS)
def _most(S):
    """Return the largest number of steps of a block's lanes."""
    most = 0.0
    for lane in range(W):
        most = max(most, S[AT.steps + lane])
    return int(most)


@njit(**INLINE)
def _turn(S, lane, b0, c0, b, c):
    """Count the half turns of the first motion in a step from (b0, c0) to (b, c): floor(angle/pi) from its start."""
    side = S[AT.b0 + lane] * c - S[AT.c0 + lane] * b
    before = S[AT.side + lane]
    onward = 1.0 if b0 * c - c0 * b > 0.0 else -1.0
    crossed = onward if before * side < 0.0 else 0.0
    first = -1.0 if (before == 0.0) & (side < 0.0) else 0.0
    S[AT.half_turns + lane] += crossed + first
    S[AT.side + lane] = side


@njit(**OPTIONS)
def _keep_sizes(S, k, sizes, backwards):
    """Keep the largest size of both motions in each part of the period, as they are before the step k."""
    for lane in range(W):
        steps = S[AT.steps + lane]
        if k <= steps:
            part = min(int(BINS * k / max(steps, 1.0)), BINS - 1)
            row = sizes + W * (BINS - 1 - part if backwards else part) + lane
            b, c, e, f = S[AT.b + lane], S[AT.c + lane], S[AT.e + lane], S[AT.f + lane]
            S[row] = max(S[row], math.sqrt(0.5 * (b * b + c * c + e * e + f * f)))


def _kernels(inverse):
    """Return the compiled function that measures points: (table, out), rows as SETTINGS and FOUND."""
    name = "inverse" if inverse else "moment"
    follow, vary = _steps(inverse)

    @njit(name=f"follow_block_{name}", **OPTIONS)
    def follow_block(S, k):
        """Take the step k of every lane that has one left."""
        whole_vectors()
        for lane in range(W):
            b0, c0 = S[AT.b + lane], S[AT.c + lane]
            C, Z, a, b, c, d, e, f = follow(
                *(S[AT.C + lane], S[AT.S + lane], S[AT.a + lane], b0, c0),
                *(S[AT.d + lane], S[AT.e + lane], S[AT.f + lane]),
                *(S[AT.k1 + lane], S[AT.p1 + lane], S[AT.q1 + lane], S[AT.k2 + lane], S[AT.p2 + lane]),
                *(S[AT.q2 + lane], S[AT.k3 + lane], S[AT.p3 + lane], S[AT.q3 + lane]),
                *(S[AT.m1 + lane], S[AT.m2 + lane], S[AT.m3 + lane], S[AT.h + lane]),
            )
            live = k < S[AT.steps + lane]
            S[AT.C + lane], S[AT.S + lane] = C, Z
            S[AT.a + lane], S[AT.d + lane] = (a if live else S[AT.a + lane]), (d if live else S[AT.d + lane])
            b, c = (b if live else b0), (c if live else c0)
            S[AT.b + lane], S[AT.c + lane] = b, c
            S[AT.e + lane], S[AT.f + lane] = (e if live else S[AT.e + lane]), (f if live else S[AT.f + lane])
            _turn(S, lane, b0, c0, b, c)

    @njit(name=f"vary_block_{name}", **OPTIONS)
    def vary_block(S, k):
        """Take the step k of the variational flow of every lane that has one left; C and S turn by cos h and sin h."""
        whole_vectors()
        for lane in range(W):
            C, Z, x0, y0 = S[AT.C + lane], S[AT.S + lane], S[AT.b + lane], S[AT.c + lane]
            x, y, v, w = vary(
                *(x0, y0, S[AT.e + lane], S[AT.f + lane], C, Z),
                *(S[AT.k1 + lane], S[AT.p1 + lane], S[AT.q1 + lane], S[AT.k2 + lane], S[AT.p2 + lane]),
                *(S[AT.q2 + lane], S[AT.k3 + lane], S[AT.p3 + lane], S[AT.q3 + lane]),
                *(S[AT.m1 + lane], S[AT.m2 + lane], S[AT.m3 + lane], S[AT.h + lane]),
            )
            live = k < S[AT.steps + lane]
            cosine, sine = S[AT.a + lane], S[AT.d + lane]
            S[AT.C + lane], S[AT.S + lane] = cosine * C - sine * Z, sine * C + cosine * Z
            x, y = (x if live else x0), (y if live else y0)
            S[AT.b + lane], S[AT.c + lane] = x, y
            S[AT.e + lane], S[AT.f + lane] = (v if live else S[AT.e + lane]), (w if live else S[AT.f + lane])
            _turn(S, lane, x0, y0, x, y)

    @njit(name=f"vary_period_{name}", **OPTIONS)
    def vary_period(S, table, first, count, finer, begin):
        """Follow the variational flow of a block for one period from the phase ``begin`` on."""
        _load(S, table, first, count, finer, False)
        for lane in range(W):
            _start(S, lane, 1.0, 0.0, 0.0, 1.0)
            S[AT.C + lane], S[AT.S + lane] = math.cos(begin), math.sin(begin)
            S[AT.a + lane], S[AT.d + lane] = math.cos(S[AT.h + lane]), math.sin(S[AT.h + lane])
        for k in range(_most(S)):
            vary_block(S, k)

    @njit(name=f"follow_period_{name}", **OPTIONS)
    def follow_period(S, sizes, backwards):
        """Follow both motions of a block for one period."""
        for row in range(sizes, sizes + BINS * W):
            S[row] = 0.0
        for k in range(_most(S)):
            _keep_sizes(S, k, sizes, backwards)
            follow_block(S, k)
        _keep_sizes(S, _most(S), sizes, backwards)

    @njit(name=f"fill_{name}", nogil=True, **OPTIONS)
    def fill(table, out):
        whole_vectors()
        S = scratch(ROWS)
        for first in range(0, table.shape[1], W):
            count = min(W, table.shape[1] - first)
            _load(S, table, first, count, 1.0, False)
            for lane in range(W):
                cosine, sine, rho = math.cos(S[AT.phase + lane]), math.sin(S[AT.phase + lane]), S[AT.m3 + lane]
                _start(S, lane, cosine / rho, sine, -sine / rho, cosine)
                S[AT.m1 + lane] = S[AT.epsilon + lane] ** 2 * rho
            follow_period(S, FORWARD, False)
            for lane in range(count):
                i = first + lane
                cosine, sine, rho = math.cos(S[AT.phase + lane]), math.sin(S[AT.phase + lane]), S[AT.m3 + lane]
                b, c, e, f = S[AT.b + lane], S[AT.c + lane], S[AT.e + lane], S[AT.f + lane]
                out[FOUND.m11, i], out[FOUND.m12, i] = rho * (b * cosine - e * sine), b * sine + e * cosine
                out[FOUND.m21, i], out[FOUND.m22, i] = rho * (c * cosine - f * sine), c * sine + f * cosine
                out[FOUND.half_turns, i] = S[AT.half_turns + lane]
            _load(S, table, first, count, FINER, True)
            for lane in range(W):
                _start(S, lane, 1.0, 0.0, 0.0, 1.0)
                rho = S[AT.m3 + lane]
                S[AT.m1 + lane] = (SMALLER * S[AT.epsilon + lane] / max(rho, 1.0)) ** 2 * rho
            follow_period(S, BACKWARD, True)
            for lane in range(count):
                i, growth = first + lane, 0.0
                for part in range(0, BINS * W, W):
                    growth = max(growth, S[FORWARD + part + lane] * S[BACKWARD + part + lane])
                out[FOUND.growth, i] = growth
                out[FOUND.back11, i], out[FOUND.back12, i] = S[AT.f + lane], -S[AT.e + lane]
                out[FOUND.back21, i], out[FOUND.back22, i] = -S[AT.c + lane], S[AT.b + lane]
            vary_period(S, table, first, count, 1.0, 0.0)
            for lane in range(count):
                i = first + lane
                out[FOUND.linear11, i], out[FOUND.linear12, i] = S[AT.b + lane], S[AT.e + lane]
                out[FOUND.linear21, i], out[FOUND.linear22, i] = S[AT.c + lane], S[AT.f + lane]
                out[FOUND.linear_half_turns, i] = S[AT.half_turns + lane]
            vary_period(S, table, first, count, FINER, ELSEWHERE * TWO_PI)
            for lane in range(count):
                out[FOUND.linear_elsewhere, first + lane] = S[AT.b + lane] + S[AT.f + lane]

    return fill


fill_inverse, fill_moment = _kernels(True), _kernels(False)


def table(points, inverse, tolerance):
    """Return the settings of points, and a bound on the absolute terms of both rates a period.

    Parameters
    ----------
    points : mapping of str to numpy.ndarray, shape (n,)
        As of :func:`survey`.
    inverse : bool
        Whether the inverses of the moments are modulated.
    tolerance : float
        Truncation allowed over the period, relative to the largest size.

    Returns
    -------
    numpy.ndarray, shape (rows of SETTINGS, n); numpy.ndarray, shape (n,)
        Points that cannot be followed have 0 steps.
    """
    size = points["I1"].size
    at = np.stack(cyclic(points["axis"])), np.arange(size)
    moments, depths, lags = (np.stack([points[f"{name}{i}"] for i in (1, 2, 3)])[at] for name in ("I", "depth", "lag"))
    kappa = points["omega0"] / points["frequency"]
    k, p, q = kappa * (moments[0] / moments), depths * np.cos(lags), -depths * np.sin(lags)
    first, second = [2, 0, 1], [1, 2, 0]  # of the differences J_c - J_b, J_a - J_c, J_b - J_a
    if inverse:
        bounds = np.abs(k) * np.abs(depths)
        terms = bounds[first] + bounds[second]
        coefficients = np.stack(
            [
                k[first] * ((moments[second] - moments[first]) / moments[second]),
                k[first] * p[first] - k[second] * p[second],
                k[first] * q[first] - k[second] * q[second],
            ]
        )
        bounds = np.abs(coefficients[0]) + np.hypot(coefficients[1], coefficients[2])
        terms += np.abs(coefficients[0])
        pole = np.inf
    else:
        least, most = np.abs(k) / (1.0 + np.abs(depths)), np.abs(k) / (1.0 - np.abs(depths))
        bounds = np.maximum(most[first] - least[second], most[second] - least[first])
        terms = most[first] + most[second]
        coefficients = np.stack([k, p, q])
        with np.errstate(divide="ignore"):
            pole = np.arccosh(1.0 / np.abs(depths).max(axis=0))  # distance of the nearest pole of 1/I
    with np.errstate(divide="ignore", invalid="ignore"):
        rho = np.sqrt(bounds[1] / bounds[2])
        rho = np.where((rho > 0.0) & np.isfinite(rho), rho, 1.0)
        linear, other = np.maximum(bounds[1] / rho, bounds[2] * rho), np.sqrt(bounds[0] * bounds[1:].max(axis=0))
        # what is left out of the coupling to the spin is smaller by epsilon squared
        rate = np.maximum(linear, points["epsilon"] ** (2.0 / (ORDER + 1)) * other)
        share = (tolerance / 30.0) ** (1.0 / (ORDER + 1))
        reach = share * math.factorial(ORDER + 1) ** (1.0 / (ORDER + 1))
        steps = np.ceil(TWO_PI * ((rate + 1.5) / reach + 1.0 / (share * pole)))
    steps = np.where(steps <= MOST_STEPS, steps, 0.0)
    settings = [*coefficients.swapaxes(0, 1).reshape(9, size), np.zeros(size), 1.0 / rho, rho, steps]
    return np.stack([*settings, points["epsilon"], points["phase"]]), TWO_PI * np.maximum(
        terms[1] / rho, terms[2] * rho
    )


def survey(points, inverse=False, tolerance=1e-12):
    """Return all columns of points.

    Parameters
    ----------
    points : mapping of str to array_like, shape (n,)
        axis (1, 2 or 3), I1, I2, I3 (common unit, > 0), depth1, depth2, depth3 (below 1 in size), lag1, lag2, lag3
        (rad), frequency (rad s-1, > 0), omega0 (rad s-1, not 0), epsilon and phase (rad).
    inverse : bool
        Whether 1/I_i is modulated, and not I_i.
    tolerance : float
        Truncation allowed over the period, relative to the largest size.

    Returns
    -------
    dict of str to numpy.ndarray
        Columns of :func:`kernels.floquet.columns` as measured, with ``_error``, and those of the variational flow with
        ``_theory``; determinant_residual, reciprocity_residual, phase_residual, propagation_error, steps, status.
    """
    names = [
        *(f"{name}{i}" for name in ("I", "depth", "lag") for i in (1, 2, 3)),
        "frequency",
        "omega0",
        "epsilon",
        "phase",
    ]
    given, points = points, dict(zip(names, arrays(*(points[name] for name in names)), strict=True))
    points["axis"] = np.broadcast_to(given["axis"], points["I1"].shape)
    parts = []
    for first in range(0, points["I1"].size, TOGETHER):
        part = {name: values[first : first + TOGETHER] for name, values in points.items()}
        parts.append(_measured(part, inverse, tolerance))
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _measured(points, inverse, tolerance):
    """Return the columns of some points, few enough for the cache."""
    period = TWO_PI / points["frequency"]
    settings, terms = table(points, inverse, tolerance)
    found = np.empty((len(FOUND), period.size))
    (fill_inverse if inverse else fill_moment)(settings, found)
    measured, back, linear = (
        found[first : first + 4].T.reshape(-1, 2, 2) for first in (FOUND.m11, FOUND.back11, FOUND.linear11)
    )
    steps = settings[_STEPS]
    rounding = EPSILON * (8.0 + 2.0 * np.sqrt(steps) + terms) * found[FOUND.growth]
    apart = np.abs(measured - back)
    shared = apart.max(axis=(1, 2))
    error = 1.5 * apart + 0.6 * shared[:, None, None] + (rounding * np.maximum(settings[_RHO], 1.0))[:, None, None]
    with np.errstate(all="ignore"):
        wide = ~(shared <= TOO_WIDE * np.abs(measured).max(axis=(1, 2)))
    followed, sound = steps > 0.0, np.isfinite(found).all(axis=0)
    lost = ~followed | ~sound | wide
    measured[lost], error[lost], linear[~followed] = np.nan, np.nan, np.nan
    elsewhere = np.abs(found[FOUND.linear_elsewhere] - np.trace(linear, axis1=1, axis2=2))
    exact = np.broadcast_to((rounding + elsewhere)[:, None, None], linear.shape)
    turns = found[FOUND.half_turns], found[FOUND.linear_half_turns]
    columns, certified = floquet.compared(floquet.Matrices(measured, error, linear, exact, elsewhere, *turns), period)
    columns["steps"] = steps.astype(np.int32)
    status = np.where(certified, statuses.OK, statuses.NOT_CONVERGED)
    status = np.select(
        [~followed, ~sound, wide],
        [statuses.NOT_CONVERGED, statuses.NON_FINITE, statuses.PERTURBATION_TOO_LARGE],
        status,
    )
    columns["status"] = status.astype(np.int8)
    return columns
