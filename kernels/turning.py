r"""The direct integrator with the attitude beside the angular velocity: Taylor steps of order 12.

With q the unit quaternion from body to space, scalar first, and n a vector fixed in space, in body axes:

.. math:: \dot\omega_a = c_a\,\omega_b\omega_c, \qquad \dot q = \tfrac12\,q\,(0, \omega), \qquad \dot n = n\times\omega

All are quadratic, so each term of the power series within a step is a convolution of earlier ones, as in
:mod:`kernels.direct`. Truncation of the quaternion at order N is about :math:`(|\omega|h/2)^{N+1}/(N+1)!`.

Written by write_turning.py, and not to be edited.

Source: Jorba and Zou, Experimental Mathematics 14 (2005) 99, for the method.
"""

from kernels.straight import straight

R2, R3, R4, R5, R6, R7, R8, R9, R10, R11, R12 = (1.0 / n for n in range(2, 13))


@straight
def turn_12(a0, b0, c0, w0, x0, y0, z0, ka, kb, kc, half):
    """One step of omega and the quaternion (w, x, y, z); k = c h, half = h/2."""
    # fmt: off
    a1 = ka * (b0 * c0)
    b1 = kb * (c0 * a0)
    c1 = kc * (a0 * b0)
    w1 = half * (-x0 * a0 - y0 * b0 - z0 * c0)
    x1 = half * (w0 * a0 + y0 * c0 - z0 * b0)
    y1 = half * (w0 * b0 + z0 * a0 - x0 * c0)
    z1 = half * (w0 * c0 + x0 * b0 - y0 * a0)
    a2 = (ka * R2) * (b0 * c1 + b1 * c0)
    b2 = (kb * R2) * (c0 * a1 + c1 * a0)
    c2 = (kc * R2) * (a0 * b1 + a1 * b0)
    w2 = (half * R2) * (-x0 * a1 - y0 * b1 - z0 * c1 - x1 * a0 - y1 * b0 - z1 * c0)
    x2 = (half * R2) * (w0 * a1 + y0 * c1 - z0 * b1 + w1 * a0 + y1 * c0 - z1 * b0)
    y2 = (half * R2) * (w0 * b1 + z0 * a1 - x0 * c1 + w1 * b0 + z1 * a0 - x1 * c0)
    z2 = (half * R2) * (w0 * c1 + x0 * b1 - y0 * a1 + w1 * c0 + x1 * b0 - y1 * a0)
    a3 = (ka * R3) * (b1 * c1 + b0 * c2 + b2 * c0)
    b3 = (kb * R3) * (c1 * a1 + c0 * a2 + c2 * a0)
    c3 = (kc * R3) * (a1 * b1 + a0 * b2 + a2 * b0)
    w3 = (half * R3) * (
        -x1 * a1 - y1 * b1 - z1 * c1 - x0 * a2 - y0 * b2 - z0 * c2 - x2 * a0 - y2 * b0 - z2 * c0
    )
    x3 = (half * R3) * (
        w1 * a1 + y1 * c1 - z1 * b1 + w0 * a2 + y0 * c2 - z0 * b2 + w2 * a0 + y2 * c0 - z2 * b0
    )
    y3 = (half * R3) * (
        w1 * b1 + z1 * a1 - x1 * c1 + w0 * b2 + z0 * a2 - x0 * c2 + w2 * b0 + z2 * a0 - x2 * c0
    )
    z3 = (half * R3) * (
        w1 * c1 + x1 * b1 - y1 * a1 + w0 * c2 + x0 * b2 - y0 * a2 + w2 * c0 + x2 * b0 - y2 * a0
    )
    a4 = (ka * R4) * (b1 * c2 + b2 * c1 + b0 * c3 + b3 * c0)
    b4 = (kb * R4) * (c1 * a2 + c2 * a1 + c0 * a3 + c3 * a0)
    c4 = (kc * R4) * (a1 * b2 + a2 * b1 + a0 * b3 + a3 * b0)
    w4 = (half * R4) * (
        -x1 * a2 - y1 * b2 - z1 * c2 - x2 * a1 - y2 * b1 - z2 * c1 - x0 * a3 - y0 * b3 - z0 * c3 - x3 * a0 - y3
        * b0 - z3 * c0
    )
    x4 = (half * R4) * (
        w1 * a2 + y1 * c2 - z1 * b2 + w2 * a1 + y2 * c1 - z2 * b1 + w0 * a3 + y0 * c3 - z0 * b3 + w3 * a0 + y3 *
        c0 - z3 * b0
    )
    y4 = (half * R4) * (
        w1 * b2 + z1 * a2 - x1 * c2 + w2 * b1 + z2 * a1 - x2 * c1 + w0 * b3 + z0 * a3 - x0 * c3 + w3 * b0 + z3 *
        a0 - x3 * c0
    )
    z4 = (half * R4) * (
        w1 * c2 + x1 * b2 - y1 * a2 + w2 * c1 + x2 * b1 - y2 * a1 + w0 * c3 + x0 * b3 - y0 * a3 + w3 * c0 + x3 *
        b0 - y3 * a0
    )
    a5 = (ka * R5) * (b2 * c2 + b1 * c3 + b3 * c1 + b0 * c4 + b4 * c0)
    b5 = (kb * R5) * (c2 * a2 + c1 * a3 + c3 * a1 + c0 * a4 + c4 * a0)
    c5 = (kc * R5) * (a2 * b2 + a1 * b3 + a3 * b1 + a0 * b4 + a4 * b0)
    w5 = (half * R5) * (
        -x2 * a2 - y2 * b2 - z2 * c2 - x1 * a3 - y1 * b3 - z1 * c3 - x3 * a1 - y3 * b1 - z3 * c1 - x0 * a4 - y0
        * b4 - z0 * c4 - x4 * a0 - y4 * b0 - z4 * c0
    )
    x5 = (half * R5) * (
        w2 * a2 + y2 * c2 - z2 * b2 + w1 * a3 + y1 * c3 - z1 * b3 + w3 * a1 + y3 * c1 - z3 * b1 + w0 * a4 + y0 *
        c4 - z0 * b4 + w4 * a0 + y4 * c0 - z4 * b0
    )
    y5 = (half * R5) * (
        w2 * b2 + z2 * a2 - x2 * c2 + w1 * b3 + z1 * a3 - x1 * c3 + w3 * b1 + z3 * a1 - x3 * c1 + w0 * b4 + z0 *
        a4 - x0 * c4 + w4 * b0 + z4 * a0 - x4 * c0
    )
    z5 = (half * R5) * (
        w2 * c2 + x2 * b2 - y2 * a2 + w1 * c3 + x1 * b3 - y1 * a3 + w3 * c1 + x3 * b1 - y3 * a1 + w0 * c4 + x0 *
        b4 - y0 * a4 + w4 * c0 + x4 * b0 - y4 * a0
    )
    a6 = (ka * R6) * (b2 * c3 + b3 * c2 + b1 * c4 + b4 * c1 + b0 * c5 + b5 * c0)
    b6 = (kb * R6) * (c2 * a3 + c3 * a2 + c1 * a4 + c4 * a1 + c0 * a5 + c5 * a0)
    c6 = (kc * R6) * (a2 * b3 + a3 * b2 + a1 * b4 + a4 * b1 + a0 * b5 + a5 * b0)
    w6 = (half * R6) * (
        -x2 * a3 - y2 * b3 - z2 * c3 - x3 * a2 - y3 * b2 - z3 * c2 - x1 * a4 - y1 * b4 - z1 * c4 - x4 * a1 - y4
        * b1 - z4 * c1 - x0 * a5 - y0 * b5 - z0 * c5 - x5 * a0 - y5 * b0 - z5 * c0
    )
    x6 = (half * R6) * (
        w2 * a3 + y2 * c3 - z2 * b3 + w3 * a2 + y3 * c2 - z3 * b2 + w1 * a4 + y1 * c4 - z1 * b4 + w4 * a1 + y4 *
        c1 - z4 * b1 + w0 * a5 + y0 * c5 - z0 * b5 + w5 * a0 + y5 * c0 - z5 * b0
    )
    y6 = (half * R6) * (
        w2 * b3 + z2 * a3 - x2 * c3 + w3 * b2 + z3 * a2 - x3 * c2 + w1 * b4 + z1 * a4 - x1 * c4 + w4 * b1 + z4 *
        a1 - x4 * c1 + w0 * b5 + z0 * a5 - x0 * c5 + w5 * b0 + z5 * a0 - x5 * c0
    )
    z6 = (half * R6) * (
        w2 * c3 + x2 * b3 - y2 * a3 + w3 * c2 + x3 * b2 - y3 * a2 + w1 * c4 + x1 * b4 - y1 * a4 + w4 * c1 + x4 *
        b1 - y4 * a1 + w0 * c5 + x0 * b5 - y0 * a5 + w5 * c0 + x5 * b0 - y5 * a0
    )
    a7 = (ka * R7) * (b3 * c3 + b2 * c4 + b4 * c2 + b1 * c5 + b5 * c1 + b0 * c6 + b6 * c0)
    b7 = (kb * R7) * (c3 * a3 + c2 * a4 + c4 * a2 + c1 * a5 + c5 * a1 + c0 * a6 + c6 * a0)
    c7 = (kc * R7) * (a3 * b3 + a2 * b4 + a4 * b2 + a1 * b5 + a5 * b1 + a0 * b6 + a6 * b0)
    w7 = (half * R7) * (
        -x3 * a3 - y3 * b3 - z3 * c3 - x2 * a4 - y2 * b4 - z2 * c4 - x4 * a2 - y4 * b2 - z4 * c2 - x1 * a5 - y1
        * b5 - z1 * c5 - x5 * a1 - y5 * b1 - z5 * c1 - x0 * a6 - y0 * b6 - z0 * c6 - x6 * a0 - y6 * b0 - z6 * c0
    )
    x7 = (half * R7) * (
        w3 * a3 + y3 * c3 - z3 * b3 + w2 * a4 + y2 * c4 - z2 * b4 + w4 * a2 + y4 * c2 - z4 * b2 + w1 * a5 + y1 *
        c5 - z1 * b5 + w5 * a1 + y5 * c1 - z5 * b1 + w0 * a6 + y0 * c6 - z0 * b6 + w6 * a0 + y6 * c0 - z6 * b0
    )
    y7 = (half * R7) * (
        w3 * b3 + z3 * a3 - x3 * c3 + w2 * b4 + z2 * a4 - x2 * c4 + w4 * b2 + z4 * a2 - x4 * c2 + w1 * b5 + z1 *
        a5 - x1 * c5 + w5 * b1 + z5 * a1 - x5 * c1 + w0 * b6 + z0 * a6 - x0 * c6 + w6 * b0 + z6 * a0 - x6 * c0
    )
    z7 = (half * R7) * (
        w3 * c3 + x3 * b3 - y3 * a3 + w2 * c4 + x2 * b4 - y2 * a4 + w4 * c2 + x4 * b2 - y4 * a2 + w1 * c5 + x1 *
        b5 - y1 * a5 + w5 * c1 + x5 * b1 - y5 * a1 + w0 * c6 + x0 * b6 - y0 * a6 + w6 * c0 + x6 * b0 - y6 * a0
    )
    a8 = (ka * R8) * (b3 * c4 + b4 * c3 + b2 * c5 + b5 * c2 + b1 * c6 + b6 * c1 + b0 * c7 + b7 * c0)
    b8 = (kb * R8) * (c3 * a4 + c4 * a3 + c2 * a5 + c5 * a2 + c1 * a6 + c6 * a1 + c0 * a7 + c7 * a0)
    c8 = (kc * R8) * (a3 * b4 + a4 * b3 + a2 * b5 + a5 * b2 + a1 * b6 + a6 * b1 + a0 * b7 + a7 * b0)
    w8 = (half * R8) * (
        -x3 * a4 - y3 * b4 - z3 * c4 - x4 * a3 - y4 * b3 - z4 * c3 - x2 * a5 - y2 * b5 - z2 * c5 - x5 * a2 - y5
        * b2 - z5 * c2 - x1 * a6 - y1 * b6 - z1 * c6 - x6 * a1 - y6 * b1 - z6 * c1 - x0 * a7 - y0 * b7 - z0 * c7
        - x7 * a0 - y7 * b0 - z7 * c0
    )
    x8 = (half * R8) * (
        w3 * a4 + y3 * c4 - z3 * b4 + w4 * a3 + y4 * c3 - z4 * b3 + w2 * a5 + y2 * c5 - z2 * b5 + w5 * a2 + y5 *
        c2 - z5 * b2 + w1 * a6 + y1 * c6 - z1 * b6 + w6 * a1 + y6 * c1 - z6 * b1 + w0 * a7 + y0 * c7 - z0 * b7 +
        w7 * a0 + y7 * c0 - z7 * b0
    )
    y8 = (half * R8) * (
        w3 * b4 + z3 * a4 - x3 * c4 + w4 * b3 + z4 * a3 - x4 * c3 + w2 * b5 + z2 * a5 - x2 * c5 + w5 * b2 + z5 *
        a2 - x5 * c2 + w1 * b6 + z1 * a6 - x1 * c6 + w6 * b1 + z6 * a1 - x6 * c1 + w0 * b7 + z0 * a7 - x0 * c7 +
        w7 * b0 + z7 * a0 - x7 * c0
    )
    z8 = (half * R8) * (
        w3 * c4 + x3 * b4 - y3 * a4 + w4 * c3 + x4 * b3 - y4 * a3 + w2 * c5 + x2 * b5 - y2 * a5 + w5 * c2 + x5 *
        b2 - y5 * a2 + w1 * c6 + x1 * b6 - y1 * a6 + w6 * c1 + x6 * b1 - y6 * a1 + w0 * c7 + x0 * b7 - y0 * a7 +
        w7 * c0 + x7 * b0 - y7 * a0
    )
    a9 = (ka * R9) * (b4 * c4 + b3 * c5 + b5 * c3 + b2 * c6 + b6 * c2 + b1 * c7 + b7 * c1 + b0 * c8 + b8 * c0)
    b9 = (kb * R9) * (c4 * a4 + c3 * a5 + c5 * a3 + c2 * a6 + c6 * a2 + c1 * a7 + c7 * a1 + c0 * a8 + c8 * a0)
    c9 = (kc * R9) * (a4 * b4 + a3 * b5 + a5 * b3 + a2 * b6 + a6 * b2 + a1 * b7 + a7 * b1 + a0 * b8 + a8 * b0)
    w9 = (half * R9) * (
        -x4 * a4 - y4 * b4 - z4 * c4 - x3 * a5 - y3 * b5 - z3 * c5 - x5 * a3 - y5 * b3 - z5 * c3 - x2 * a6 - y2
        * b6 - z2 * c6 - x6 * a2 - y6 * b2 - z6 * c2 - x1 * a7 - y1 * b7 - z1 * c7 - x7 * a1 - y7 * b1 - z7 * c1
        - x0 * a8 - y0 * b8 - z0 * c8 - x8 * a0 - y8 * b0 - z8 * c0
    )
    x9 = (half * R9) * (
        w4 * a4 + y4 * c4 - z4 * b4 + w3 * a5 + y3 * c5 - z3 * b5 + w5 * a3 + y5 * c3 - z5 * b3 + w2 * a6 + y2 *
        c6 - z2 * b6 + w6 * a2 + y6 * c2 - z6 * b2 + w1 * a7 + y1 * c7 - z1 * b7 + w7 * a1 + y7 * c1 - z7 * b1 +
        w0 * a8 + y0 * c8 - z0 * b8 + w8 * a0 + y8 * c0 - z8 * b0
    )
    y9 = (half * R9) * (
        w4 * b4 + z4 * a4 - x4 * c4 + w3 * b5 + z3 * a5 - x3 * c5 + w5 * b3 + z5 * a3 - x5 * c3 + w2 * b6 + z2 *
        a6 - x2 * c6 + w6 * b2 + z6 * a2 - x6 * c2 + w1 * b7 + z1 * a7 - x1 * c7 + w7 * b1 + z7 * a1 - x7 * c1 +
        w0 * b8 + z0 * a8 - x0 * c8 + w8 * b0 + z8 * a0 - x8 * c0
    )
    z9 = (half * R9) * (
        w4 * c4 + x4 * b4 - y4 * a4 + w3 * c5 + x3 * b5 - y3 * a5 + w5 * c3 + x5 * b3 - y5 * a3 + w2 * c6 + x2 *
        b6 - y2 * a6 + w6 * c2 + x6 * b2 - y6 * a2 + w1 * c7 + x1 * b7 - y1 * a7 + w7 * c1 + x7 * b1 - y7 * a1 +
        w0 * c8 + x0 * b8 - y0 * a8 + w8 * c0 + x8 * b0 - y8 * a0
    )
    a10 = (ka * R10) * (
        b4 * c5 + b5 * c4 + b3 * c6 + b6 * c3 + b2 * c7 + b7 * c2 + b1 * c8 + b8 * c1 + b0 * c9 + b9 * c0
    )
    b10 = (kb * R10) * (
        c4 * a5 + c5 * a4 + c3 * a6 + c6 * a3 + c2 * a7 + c7 * a2 + c1 * a8 + c8 * a1 + c0 * a9 + c9 * a0
    )
    c10 = (kc * R10) * (
        a4 * b5 + a5 * b4 + a3 * b6 + a6 * b3 + a2 * b7 + a7 * b2 + a1 * b8 + a8 * b1 + a0 * b9 + a9 * b0
    )
    w10 = (half * R10) * (
        -x4 * a5 - y4 * b5 - z4 * c5 - x5 * a4 - y5 * b4 - z5 * c4 - x3 * a6 - y3 * b6 - z3 * c6 - x6 * a3 - y6
        * b3 - z6 * c3 - x2 * a7 - y2 * b7 - z2 * c7 - x7 * a2 - y7 * b2 - z7 * c2 - x1 * a8 - y1 * b8 - z1 * c8
        - x8 * a1 - y8 * b1 - z8 * c1 - x0 * a9 - y0 * b9 - z0 * c9 - x9 * a0 - y9 * b0 - z9 * c0
    )
    x10 = (half * R10) * (
        w4 * a5 + y4 * c5 - z4 * b5 + w5 * a4 + y5 * c4 - z5 * b4 + w3 * a6 + y3 * c6 - z3 * b6 + w6 * a3 + y6 *
        c3 - z6 * b3 + w2 * a7 + y2 * c7 - z2 * b7 + w7 * a2 + y7 * c2 - z7 * b2 + w1 * a8 + y1 * c8 - z1 * b8 +
        w8 * a1 + y8 * c1 - z8 * b1 + w0 * a9 + y0 * c9 - z0 * b9 + w9 * a0 + y9 * c0 - z9 * b0
    )
    y10 = (half * R10) * (
        w4 * b5 + z4 * a5 - x4 * c5 + w5 * b4 + z5 * a4 - x5 * c4 + w3 * b6 + z3 * a6 - x3 * c6 + w6 * b3 + z6 *
        a3 - x6 * c3 + w2 * b7 + z2 * a7 - x2 * c7 + w7 * b2 + z7 * a2 - x7 * c2 + w1 * b8 + z1 * a8 - x1 * c8 +
        w8 * b1 + z8 * a1 - x8 * c1 + w0 * b9 + z0 * a9 - x0 * c9 + w9 * b0 + z9 * a0 - x9 * c0
    )
    z10 = (half * R10) * (
        w4 * c5 + x4 * b5 - y4 * a5 + w5 * c4 + x5 * b4 - y5 * a4 + w3 * c6 + x3 * b6 - y3 * a6 + w6 * c3 + x6 *
        b3 - y6 * a3 + w2 * c7 + x2 * b7 - y2 * a7 + w7 * c2 + x7 * b2 - y7 * a2 + w1 * c8 + x1 * b8 - y1 * a8 +
        w8 * c1 + x8 * b1 - y8 * a1 + w0 * c9 + x0 * b9 - y0 * a9 + w9 * c0 + x9 * b0 - y9 * a0
    )
    a11 = (ka * R11) * (
        b5 * c5 + b4 * c6 + b6 * c4 + b3 * c7 + b7 * c3 + b2 * c8 + b8 * c2 + b1 * c9 + b9 * c1 + b0 * c10 + b10
        * c0
    )
    b11 = (kb * R11) * (
        c5 * a5 + c4 * a6 + c6 * a4 + c3 * a7 + c7 * a3 + c2 * a8 + c8 * a2 + c1 * a9 + c9 * a1 + c0 * a10 + c10
        * a0
    )
    c11 = (kc * R11) * (
        a5 * b5 + a4 * b6 + a6 * b4 + a3 * b7 + a7 * b3 + a2 * b8 + a8 * b2 + a1 * b9 + a9 * b1 + a0 * b10 + a10
        * b0
    )
    w11 = (half * R11) * (
        -x5 * a5 - y5 * b5 - z5 * c5 - x4 * a6 - y4 * b6 - z4 * c6 - x6 * a4 - y6 * b4 - z6 * c4 - x3 * a7 - y3
        * b7 - z3 * c7 - x7 * a3 - y7 * b3 - z7 * c3 - x2 * a8 - y2 * b8 - z2 * c8 - x8 * a2 - y8 * b2 - z8 * c2
        - x1 * a9 - y1 * b9 - z1 * c9 - x9 * a1 - y9 * b1 - z9 * c1 - x0 * a10 - y0 * b10 - z0 * c10 - x10 * a0
        - y10 * b0 - z10 * c0
    )
    x11 = (half * R11) * (
        w5 * a5 + y5 * c5 - z5 * b5 + w4 * a6 + y4 * c6 - z4 * b6 + w6 * a4 + y6 * c4 - z6 * b4 + w3 * a7 + y3 *
        c7 - z3 * b7 + w7 * a3 + y7 * c3 - z7 * b3 + w2 * a8 + y2 * c8 - z2 * b8 + w8 * a2 + y8 * c2 - z8 * b2 +
        w1 * a9 + y1 * c9 - z1 * b9 + w9 * a1 + y9 * c1 - z9 * b1 + w0 * a10 + y0 * c10 - z0 * b10 + w10 * a0 +
        y10 * c0 - z10 * b0
    )
    y11 = (half * R11) * (
        w5 * b5 + z5 * a5 - x5 * c5 + w4 * b6 + z4 * a6 - x4 * c6 + w6 * b4 + z6 * a4 - x6 * c4 + w3 * b7 + z3 *
        a7 - x3 * c7 + w7 * b3 + z7 * a3 - x7 * c3 + w2 * b8 + z2 * a8 - x2 * c8 + w8 * b2 + z8 * a2 - x8 * c2 +
        w1 * b9 + z1 * a9 - x1 * c9 + w9 * b1 + z9 * a1 - x9 * c1 + w0 * b10 + z0 * a10 - x0 * c10 + w10 * b0 +
        z10 * a0 - x10 * c0
    )
    z11 = (half * R11) * (
        w5 * c5 + x5 * b5 - y5 * a5 + w4 * c6 + x4 * b6 - y4 * a6 + w6 * c4 + x6 * b4 - y6 * a4 + w3 * c7 + x3 *
        b7 - y3 * a7 + w7 * c3 + x7 * b3 - y7 * a3 + w2 * c8 + x2 * b8 - y2 * a8 + w8 * c2 + x8 * b2 - y8 * a2 +
        w1 * c9 + x1 * b9 - y1 * a9 + w9 * c1 + x9 * b1 - y9 * a1 + w0 * c10 + x0 * b10 - y0 * a10 + w10 * c0 +
        x10 * b0 - y10 * a0
    )
    a12 = (ka * R12) * (
        b5 * c6 + b6 * c5 + b4 * c7 + b7 * c4 + b3 * c8 + b8 * c3 + b2 * c9 + b9 * c2 + b1 * c10 + b10 * c1 + b0
        * c11 + b11 * c0
    )
    b12 = (kb * R12) * (
        c5 * a6 + c6 * a5 + c4 * a7 + c7 * a4 + c3 * a8 + c8 * a3 + c2 * a9 + c9 * a2 + c1 * a10 + c10 * a1 + c0
        * a11 + c11 * a0
    )
    c12 = (kc * R12) * (
        a5 * b6 + a6 * b5 + a4 * b7 + a7 * b4 + a3 * b8 + a8 * b3 + a2 * b9 + a9 * b2 + a1 * b10 + a10 * b1 + a0
        * b11 + a11 * b0
    )
    w12 = (half * R12) * (
        -x5 * a6 - y5 * b6 - z5 * c6 - x6 * a5 - y6 * b5 - z6 * c5 - x4 * a7 - y4 * b7 - z4 * c7 - x7 * a4 - y7
        * b4 - z7 * c4 - x3 * a8 - y3 * b8 - z3 * c8 - x8 * a3 - y8 * b3 - z8 * c3 - x2 * a9 - y2 * b9 - z2 * c9
        - x9 * a2 - y9 * b2 - z9 * c2 - x1 * a10 - y1 * b10 - z1 * c10 - x10 * a1 - y10 * b1 - z10 * c1 - x0 *
        a11 - y0 * b11 - z0 * c11 - x11 * a0 - y11 * b0 - z11 * c0
    )
    x12 = (half * R12) * (
        w5 * a6 + y5 * c6 - z5 * b6 + w6 * a5 + y6 * c5 - z6 * b5 + w4 * a7 + y4 * c7 - z4 * b7 + w7 * a4 + y7 *
        c4 - z7 * b4 + w3 * a8 + y3 * c8 - z3 * b8 + w8 * a3 + y8 * c3 - z8 * b3 + w2 * a9 + y2 * c9 - z2 * b9 +
        w9 * a2 + y9 * c2 - z9 * b2 + w1 * a10 + y1 * c10 - z1 * b10 + w10 * a1 + y10 * c1 - z10 * b1 + w0 * a11
        + y0 * c11 - z0 * b11 + w11 * a0 + y11 * c0 - z11 * b0
    )
    y12 = (half * R12) * (
        w5 * b6 + z5 * a6 - x5 * c6 + w6 * b5 + z6 * a5 - x6 * c5 + w4 * b7 + z4 * a7 - x4 * c7 + w7 * b4 + z7 *
        a4 - x7 * c4 + w3 * b8 + z3 * a8 - x3 * c8 + w8 * b3 + z8 * a3 - x8 * c3 + w2 * b9 + z2 * a9 - x2 * c9 +
        w9 * b2 + z9 * a2 - x9 * c2 + w1 * b10 + z1 * a10 - x1 * c10 + w10 * b1 + z10 * a1 - x10 * c1 + w0 * b11
        + z0 * a11 - x0 * c11 + w11 * b0 + z11 * a0 - x11 * c0
    )
    z12 = (half * R12) * (
        w5 * c6 + x5 * b6 - y5 * a6 + w6 * c5 + x6 * b5 - y6 * a5 + w4 * c7 + x4 * b7 - y4 * a7 + w7 * c4 + x7 *
        b4 - y7 * a4 + w3 * c8 + x3 * b8 - y3 * a8 + w8 * c3 + x8 * b3 - y8 * a3 + w2 * c9 + x2 * b9 - y2 * a9 +
        w9 * c2 + x9 * b2 - y9 * a2 + w1 * c10 + x1 * b10 - y1 * a10 + w10 * c1 + x10 * b1 - y10 * a1 + w0 * c11
        + x0 * b11 - y0 * a11 + w11 * c0 + x11 * b0 - y11 * a0
    )
    return (
        (((((((((((a3 + a2) + a4) + a5) + a6) + a7) + a8) + a9) + a10) + a11) + a12) + a1) + a0,
        (((((((((((b3 + b2) + b4) + b5) + b6) + b7) + b8) + b9) + b10) + b11) + b12) + b1) + b0,
        (((((((((((c3 + c2) + c4) + c5) + c6) + c7) + c8) + c9) + c10) + c11) + c12) + c1) + c0,
        (((((((((((w3 + w2) + w4) + w5) + w6) + w7) + w8) + w9) + w10) + w11) + w12) + w1) + w0,
        (((((((((((x3 + x2) + x4) + x5) + x6) + x7) + x8) + x9) + x10) + x11) + x12) + x1) + x0,
        (((((((((((y3 + y2) + y4) + y5) + y6) + y7) + y8) + y9) + y10) + y11) + y12) + y1) + y0,
        (((((((((((z3 + z2) + z4) + z5) + z6) + z7) + z8) + z9) + z10) + z11) + z12) + z1) + z0,
    )
    # fmt: on


@straight
def carry_12(a0, b0, c0, x0, y0, z0, ka, kb, kc, h):
    """One step of omega and a space-fixed vector (x, y, z); k = c h."""
    # fmt: off
    a1 = ka * (b0 * c0)
    b1 = kb * (c0 * a0)
    c1 = kc * (a0 * b0)
    x1 = h * (y0 * c0 - z0 * b0)
    y1 = h * (z0 * a0 - x0 * c0)
    z1 = h * (x0 * b0 - y0 * a0)
    a2 = (ka * R2) * (b0 * c1 + b1 * c0)
    b2 = (kb * R2) * (c0 * a1 + c1 * a0)
    c2 = (kc * R2) * (a0 * b1 + a1 * b0)
    x2 = (h * R2) * (y0 * c1 - z0 * b1 + y1 * c0 - z1 * b0)
    y2 = (h * R2) * (z0 * a1 - x0 * c1 + z1 * a0 - x1 * c0)
    z2 = (h * R2) * (x0 * b1 - y0 * a1 + x1 * b0 - y1 * a0)
    a3 = (ka * R3) * (b1 * c1 + b0 * c2 + b2 * c0)
    b3 = (kb * R3) * (c1 * a1 + c0 * a2 + c2 * a0)
    c3 = (kc * R3) * (a1 * b1 + a0 * b2 + a2 * b0)
    x3 = (h * R3) * (y1 * c1 - z1 * b1 + y0 * c2 - z0 * b2 + y2 * c0 - z2 * b0)
    y3 = (h * R3) * (z1 * a1 - x1 * c1 + z0 * a2 - x0 * c2 + z2 * a0 - x2 * c0)
    z3 = (h * R3) * (x1 * b1 - y1 * a1 + x0 * b2 - y0 * a2 + x2 * b0 - y2 * a0)
    a4 = (ka * R4) * (b1 * c2 + b2 * c1 + b0 * c3 + b3 * c0)
    b4 = (kb * R4) * (c1 * a2 + c2 * a1 + c0 * a3 + c3 * a0)
    c4 = (kc * R4) * (a1 * b2 + a2 * b1 + a0 * b3 + a3 * b0)
    x4 = (h * R4) * (y1 * c2 - z1 * b2 + y2 * c1 - z2 * b1 + y0 * c3 - z0 * b3 + y3 * c0 - z3 * b0)
    y4 = (h * R4) * (z1 * a2 - x1 * c2 + z2 * a1 - x2 * c1 + z0 * a3 - x0 * c3 + z3 * a0 - x3 * c0)
    z4 = (h * R4) * (x1 * b2 - y1 * a2 + x2 * b1 - y2 * a1 + x0 * b3 - y0 * a3 + x3 * b0 - y3 * a0)
    a5 = (ka * R5) * (b2 * c2 + b1 * c3 + b3 * c1 + b0 * c4 + b4 * c0)
    b5 = (kb * R5) * (c2 * a2 + c1 * a3 + c3 * a1 + c0 * a4 + c4 * a0)
    c5 = (kc * R5) * (a2 * b2 + a1 * b3 + a3 * b1 + a0 * b4 + a4 * b0)
    x5 = (h * R5) * (
        y2 * c2 - z2 * b2 + y1 * c3 - z1 * b3 + y3 * c1 - z3 * b1 + y0 * c4 - z0 * b4 + y4 * c0 - z4 * b0
    )
    y5 = (h * R5) * (
        z2 * a2 - x2 * c2 + z1 * a3 - x1 * c3 + z3 * a1 - x3 * c1 + z0 * a4 - x0 * c4 + z4 * a0 - x4 * c0
    )
    z5 = (h * R5) * (
        x2 * b2 - y2 * a2 + x1 * b3 - y1 * a3 + x3 * b1 - y3 * a1 + x0 * b4 - y0 * a4 + x4 * b0 - y4 * a0
    )
    a6 = (ka * R6) * (b2 * c3 + b3 * c2 + b1 * c4 + b4 * c1 + b0 * c5 + b5 * c0)
    b6 = (kb * R6) * (c2 * a3 + c3 * a2 + c1 * a4 + c4 * a1 + c0 * a5 + c5 * a0)
    c6 = (kc * R6) * (a2 * b3 + a3 * b2 + a1 * b4 + a4 * b1 + a0 * b5 + a5 * b0)
    x6 = (h * R6) * (
        y2 * c3 - z2 * b3 + y3 * c2 - z3 * b2 + y1 * c4 - z1 * b4 + y4 * c1 - z4 * b1 + y0 * c5 - z0 * b5 + y5 *
        c0 - z5 * b0
    )
    y6 = (h * R6) * (
        z2 * a3 - x2 * c3 + z3 * a2 - x3 * c2 + z1 * a4 - x1 * c4 + z4 * a1 - x4 * c1 + z0 * a5 - x0 * c5 + z5 *
        a0 - x5 * c0
    )
    z6 = (h * R6) * (
        x2 * b3 - y2 * a3 + x3 * b2 - y3 * a2 + x1 * b4 - y1 * a4 + x4 * b1 - y4 * a1 + x0 * b5 - y0 * a5 + x5 *
        b0 - y5 * a0
    )
    a7 = (ka * R7) * (b3 * c3 + b2 * c4 + b4 * c2 + b1 * c5 + b5 * c1 + b0 * c6 + b6 * c0)
    b7 = (kb * R7) * (c3 * a3 + c2 * a4 + c4 * a2 + c1 * a5 + c5 * a1 + c0 * a6 + c6 * a0)
    c7 = (kc * R7) * (a3 * b3 + a2 * b4 + a4 * b2 + a1 * b5 + a5 * b1 + a0 * b6 + a6 * b0)
    x7 = (h * R7) * (
        y3 * c3 - z3 * b3 + y2 * c4 - z2 * b4 + y4 * c2 - z4 * b2 + y1 * c5 - z1 * b5 + y5 * c1 - z5 * b1 + y0 *
        c6 - z0 * b6 + y6 * c0 - z6 * b0
    )
    y7 = (h * R7) * (
        z3 * a3 - x3 * c3 + z2 * a4 - x2 * c4 + z4 * a2 - x4 * c2 + z1 * a5 - x1 * c5 + z5 * a1 - x5 * c1 + z0 *
        a6 - x0 * c6 + z6 * a0 - x6 * c0
    )
    z7 = (h * R7) * (
        x3 * b3 - y3 * a3 + x2 * b4 - y2 * a4 + x4 * b2 - y4 * a2 + x1 * b5 - y1 * a5 + x5 * b1 - y5 * a1 + x0 *
        b6 - y0 * a6 + x6 * b0 - y6 * a0
    )
    a8 = (ka * R8) * (b3 * c4 + b4 * c3 + b2 * c5 + b5 * c2 + b1 * c6 + b6 * c1 + b0 * c7 + b7 * c0)
    b8 = (kb * R8) * (c3 * a4 + c4 * a3 + c2 * a5 + c5 * a2 + c1 * a6 + c6 * a1 + c0 * a7 + c7 * a0)
    c8 = (kc * R8) * (a3 * b4 + a4 * b3 + a2 * b5 + a5 * b2 + a1 * b6 + a6 * b1 + a0 * b7 + a7 * b0)
    x8 = (h * R8) * (
        y3 * c4 - z3 * b4 + y4 * c3 - z4 * b3 + y2 * c5 - z2 * b5 + y5 * c2 - z5 * b2 + y1 * c6 - z1 * b6 + y6 *
        c1 - z6 * b1 + y0 * c7 - z0 * b7 + y7 * c0 - z7 * b0
    )
    y8 = (h * R8) * (
        z3 * a4 - x3 * c4 + z4 * a3 - x4 * c3 + z2 * a5 - x2 * c5 + z5 * a2 - x5 * c2 + z1 * a6 - x1 * c6 + z6 *
        a1 - x6 * c1 + z0 * a7 - x0 * c7 + z7 * a0 - x7 * c0
    )
    z8 = (h * R8) * (
        x3 * b4 - y3 * a4 + x4 * b3 - y4 * a3 + x2 * b5 - y2 * a5 + x5 * b2 - y5 * a2 + x1 * b6 - y1 * a6 + x6 *
        b1 - y6 * a1 + x0 * b7 - y0 * a7 + x7 * b0 - y7 * a0
    )
    a9 = (ka * R9) * (b4 * c4 + b3 * c5 + b5 * c3 + b2 * c6 + b6 * c2 + b1 * c7 + b7 * c1 + b0 * c8 + b8 * c0)
    b9 = (kb * R9) * (c4 * a4 + c3 * a5 + c5 * a3 + c2 * a6 + c6 * a2 + c1 * a7 + c7 * a1 + c0 * a8 + c8 * a0)
    c9 = (kc * R9) * (a4 * b4 + a3 * b5 + a5 * b3 + a2 * b6 + a6 * b2 + a1 * b7 + a7 * b1 + a0 * b8 + a8 * b0)
    x9 = (h * R9) * (
        y4 * c4 - z4 * b4 + y3 * c5 - z3 * b5 + y5 * c3 - z5 * b3 + y2 * c6 - z2 * b6 + y6 * c2 - z6 * b2 + y1 *
        c7 - z1 * b7 + y7 * c1 - z7 * b1 + y0 * c8 - z0 * b8 + y8 * c0 - z8 * b0
    )
    y9 = (h * R9) * (
        z4 * a4 - x4 * c4 + z3 * a5 - x3 * c5 + z5 * a3 - x5 * c3 + z2 * a6 - x2 * c6 + z6 * a2 - x6 * c2 + z1 *
        a7 - x1 * c7 + z7 * a1 - x7 * c1 + z0 * a8 - x0 * c8 + z8 * a0 - x8 * c0
    )
    z9 = (h * R9) * (
        x4 * b4 - y4 * a4 + x3 * b5 - y3 * a5 + x5 * b3 - y5 * a3 + x2 * b6 - y2 * a6 + x6 * b2 - y6 * a2 + x1 *
        b7 - y1 * a7 + x7 * b1 - y7 * a1 + x0 * b8 - y0 * a8 + x8 * b0 - y8 * a0
    )
    a10 = (ka * R10) * (
        b4 * c5 + b5 * c4 + b3 * c6 + b6 * c3 + b2 * c7 + b7 * c2 + b1 * c8 + b8 * c1 + b0 * c9 + b9 * c0
    )
    b10 = (kb * R10) * (
        c4 * a5 + c5 * a4 + c3 * a6 + c6 * a3 + c2 * a7 + c7 * a2 + c1 * a8 + c8 * a1 + c0 * a9 + c9 * a0
    )
    c10 = (kc * R10) * (
        a4 * b5 + a5 * b4 + a3 * b6 + a6 * b3 + a2 * b7 + a7 * b2 + a1 * b8 + a8 * b1 + a0 * b9 + a9 * b0
    )
    x10 = (h * R10) * (
        y4 * c5 - z4 * b5 + y5 * c4 - z5 * b4 + y3 * c6 - z3 * b6 + y6 * c3 - z6 * b3 + y2 * c7 - z2 * b7 + y7 *
        c2 - z7 * b2 + y1 * c8 - z1 * b8 + y8 * c1 - z8 * b1 + y0 * c9 - z0 * b9 + y9 * c0 - z9 * b0
    )
    y10 = (h * R10) * (
        z4 * a5 - x4 * c5 + z5 * a4 - x5 * c4 + z3 * a6 - x3 * c6 + z6 * a3 - x6 * c3 + z2 * a7 - x2 * c7 + z7 *
        a2 - x7 * c2 + z1 * a8 - x1 * c8 + z8 * a1 - x8 * c1 + z0 * a9 - x0 * c9 + z9 * a0 - x9 * c0
    )
    z10 = (h * R10) * (
        x4 * b5 - y4 * a5 + x5 * b4 - y5 * a4 + x3 * b6 - y3 * a6 + x6 * b3 - y6 * a3 + x2 * b7 - y2 * a7 + x7 *
        b2 - y7 * a2 + x1 * b8 - y1 * a8 + x8 * b1 - y8 * a1 + x0 * b9 - y0 * a9 + x9 * b0 - y9 * a0
    )
    a11 = (ka * R11) * (
        b5 * c5 + b4 * c6 + b6 * c4 + b3 * c7 + b7 * c3 + b2 * c8 + b8 * c2 + b1 * c9 + b9 * c1 + b0 * c10 + b10
        * c0
    )
    b11 = (kb * R11) * (
        c5 * a5 + c4 * a6 + c6 * a4 + c3 * a7 + c7 * a3 + c2 * a8 + c8 * a2 + c1 * a9 + c9 * a1 + c0 * a10 + c10
        * a0
    )
    c11 = (kc * R11) * (
        a5 * b5 + a4 * b6 + a6 * b4 + a3 * b7 + a7 * b3 + a2 * b8 + a8 * b2 + a1 * b9 + a9 * b1 + a0 * b10 + a10
        * b0
    )
    x11 = (h * R11) * (
        y5 * c5 - z5 * b5 + y4 * c6 - z4 * b6 + y6 * c4 - z6 * b4 + y3 * c7 - z3 * b7 + y7 * c3 - z7 * b3 + y2 *
        c8 - z2 * b8 + y8 * c2 - z8 * b2 + y1 * c9 - z1 * b9 + y9 * c1 - z9 * b1 + y0 * c10 - z0 * b10 + y10 *
        c0 - z10 * b0
    )
    y11 = (h * R11) * (
        z5 * a5 - x5 * c5 + z4 * a6 - x4 * c6 + z6 * a4 - x6 * c4 + z3 * a7 - x3 * c7 + z7 * a3 - x7 * c3 + z2 *
        a8 - x2 * c8 + z8 * a2 - x8 * c2 + z1 * a9 - x1 * c9 + z9 * a1 - x9 * c1 + z0 * a10 - x0 * c10 + z10 *
        a0 - x10 * c0
    )
    z11 = (h * R11) * (
        x5 * b5 - y5 * a5 + x4 * b6 - y4 * a6 + x6 * b4 - y6 * a4 + x3 * b7 - y3 * a7 + x7 * b3 - y7 * a3 + x2 *
        b8 - y2 * a8 + x8 * b2 - y8 * a2 + x1 * b9 - y1 * a9 + x9 * b1 - y9 * a1 + x0 * b10 - y0 * a10 + x10 *
        b0 - y10 * a0
    )
    a12 = (ka * R12) * (
        b5 * c6 + b6 * c5 + b4 * c7 + b7 * c4 + b3 * c8 + b8 * c3 + b2 * c9 + b9 * c2 + b1 * c10 + b10 * c1 + b0
        * c11 + b11 * c0
    )
    b12 = (kb * R12) * (
        c5 * a6 + c6 * a5 + c4 * a7 + c7 * a4 + c3 * a8 + c8 * a3 + c2 * a9 + c9 * a2 + c1 * a10 + c10 * a1 + c0
        * a11 + c11 * a0
    )
    c12 = (kc * R12) * (
        a5 * b6 + a6 * b5 + a4 * b7 + a7 * b4 + a3 * b8 + a8 * b3 + a2 * b9 + a9 * b2 + a1 * b10 + a10 * b1 + a0
        * b11 + a11 * b0
    )
    x12 = (h * R12) * (
        y5 * c6 - z5 * b6 + y6 * c5 - z6 * b5 + y4 * c7 - z4 * b7 + y7 * c4 - z7 * b4 + y3 * c8 - z3 * b8 + y8 *
        c3 - z8 * b3 + y2 * c9 - z2 * b9 + y9 * c2 - z9 * b2 + y1 * c10 - z1 * b10 + y10 * c1 - z10 * b1 + y0 *
        c11 - z0 * b11 + y11 * c0 - z11 * b0
    )
    y12 = (h * R12) * (
        z5 * a6 - x5 * c6 + z6 * a5 - x6 * c5 + z4 * a7 - x4 * c7 + z7 * a4 - x7 * c4 + z3 * a8 - x3 * c8 + z8 *
        a3 - x8 * c3 + z2 * a9 - x2 * c9 + z9 * a2 - x9 * c2 + z1 * a10 - x1 * c10 + z10 * a1 - x10 * c1 + z0 *
        a11 - x0 * c11 + z11 * a0 - x11 * c0
    )
    z12 = (h * R12) * (
        x5 * b6 - y5 * a6 + x6 * b5 - y6 * a5 + x4 * b7 - y4 * a7 + x7 * b4 - y7 * a4 + x3 * b8 - y3 * a8 + x8 *
        b3 - y8 * a3 + x2 * b9 - y2 * a9 + x9 * b2 - y9 * a2 + x1 * b10 - y1 * a10 + x10 * b1 - y10 * a1 + x0 *
        b11 - y0 * a11 + x11 * b0 - y11 * a0
    )
    return (
        (((((((((((a3 + a2) + a4) + a5) + a6) + a7) + a8) + a9) + a10) + a11) + a12) + a1) + a0,
        (((((((((((b3 + b2) + b4) + b5) + b6) + b7) + b8) + b9) + b10) + b11) + b12) + b1) + b0,
        (((((((((((c3 + c2) + c4) + c5) + c6) + c7) + c8) + c9) + c10) + c11) + c12) + c1) + c0,
        (((((((((((x3 + x2) + x4) + x5) + x6) + x7) + x8) + x9) + x10) + x11) + x12) + x1) + x0,
        (((((((((((y3 + y2) + y4) + y5) + y6) + y7) + y8) + y9) + y10) + y11) + y12) + y1) + y0,
        (((((((((((z3 + z2) + z4) + z5) + z6) + z7) + z8) + z9) + z10) + z11) + z12) + z1) + z0,
    )
    # fmt: on
