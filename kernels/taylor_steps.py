"""The Taylor steps of Euler's equations in straight lines: see :mod:`kernels.direct`.

Written by write_taylor_steps.py, and not to be edited.
"""

from kernels.straight import straight

# fmt: off
R2, R3, R4, R5, R6, R7, R8, R9, R10, R11, R12 = (1.0 / n for n in range(2, 13))


@straight
def step_8(a0, b0, c0, ka, kb, kc):
    """One step of order 8; k_i = c_i h."""
    a1 = ka * (b0 * c0)
    b1 = kb * (c0 * a0)
    c1 = kc * (a0 * b0)
    a2 = (ka * R2) * (b0 * c1 + b1 * c0)
    b2 = (kb * R2) * (c0 * a1 + c1 * a0)
    c2 = (kc * R2) * (a0 * b1 + a1 * b0)
    a3 = (ka * R3) * (b1 * c1 + b0 * c2 + b2 * c0)
    b3 = (kb * R3) * (c1 * a1 + c0 * a2 + c2 * a0)
    c3 = (kc * R3) * (a1 * b1 + a0 * b2 + a2 * b0)
    a4 = (ka * R4) * (b1 * c2 + b2 * c1 + b0 * c3 + b3 * c0)
    b4 = (kb * R4) * (c1 * a2 + c2 * a1 + c0 * a3 + c3 * a0)
    c4 = (kc * R4) * (a1 * b2 + a2 * b1 + a0 * b3 + a3 * b0)
    a5 = (ka * R5) * (b2 * c2 + b1 * c3 + b3 * c1 + b0 * c4 + b4 * c0)
    b5 = (kb * R5) * (c2 * a2 + c1 * a3 + c3 * a1 + c0 * a4 + c4 * a0)
    c5 = (kc * R5) * (a2 * b2 + a1 * b3 + a3 * b1 + a0 * b4 + a4 * b0)
    a6 = (ka * R6) * (b2 * c3 + b3 * c2 + b1 * c4 + b4 * c1 + b0 * c5 + b5 * c0)
    b6 = (kb * R6) * (c2 * a3 + c3 * a2 + c1 * a4 + c4 * a1 + c0 * a5 + c5 * a0)
    c6 = (kc * R6) * (a2 * b3 + a3 * b2 + a1 * b4 + a4 * b1 + a0 * b5 + a5 * b0)
    a7 = (ka * R7) * (b3 * c3 + b2 * c4 + b4 * c2 + b1 * c5 + b5 * c1 + b0 * c6 + b6 * c0)
    b7 = (kb * R7) * (c3 * a3 + c2 * a4 + c4 * a2 + c1 * a5 + c5 * a1 + c0 * a6 + c6 * a0)
    c7 = (kc * R7) * (a3 * b3 + a2 * b4 + a4 * b2 + a1 * b5 + a5 * b1 + a0 * b6 + a6 * b0)
    a8 = (ka * R8) * (b3 * c4 + b4 * c3 + b2 * c5 + b5 * c2 + b1 * c6 + b6 * c1 + b0 * c7 + b7 * c0)
    b8 = (kb * R8) * (c3 * a4 + c4 * a3 + c2 * a5 + c5 * a2 + c1 * a6 + c6 * a1 + c0 * a7 + c7 * a0)
    c8 = (kc * R8) * (a3 * b4 + a4 * b3 + a2 * b5 + a5 * b2 + a1 * b6 + a6 * b1 + a0 * b7 + a7 * b0)
    a = (((((((a3 + a2) + a4) + a5) + a6) + a7) + a8) + a1) + a0
    b = (((((((b3 + b2) + b4) + b5) + b6) + b7) + b8) + b1) + b0
    c = (((((((c3 + c2) + c4) + c5) + c6) + c7) + c8) + c1) + c0
    return a, b, c


@straight
def step_10(a0, b0, c0, ka, kb, kc):
    """One step of order 10; k_i = c_i h."""
    a1 = ka * (b0 * c0)
    b1 = kb * (c0 * a0)
    c1 = kc * (a0 * b0)
    a2 = (ka * R2) * (b0 * c1 + b1 * c0)
    b2 = (kb * R2) * (c0 * a1 + c1 * a0)
    c2 = (kc * R2) * (a0 * b1 + a1 * b0)
    a3 = (ka * R3) * (b1 * c1 + b0 * c2 + b2 * c0)
    b3 = (kb * R3) * (c1 * a1 + c0 * a2 + c2 * a0)
    c3 = (kc * R3) * (a1 * b1 + a0 * b2 + a2 * b0)
    a4 = (ka * R4) * (b1 * c2 + b2 * c1 + b0 * c3 + b3 * c0)
    b4 = (kb * R4) * (c1 * a2 + c2 * a1 + c0 * a3 + c3 * a0)
    c4 = (kc * R4) * (a1 * b2 + a2 * b1 + a0 * b3 + a3 * b0)
    a5 = (ka * R5) * (b2 * c2 + b1 * c3 + b3 * c1 + b0 * c4 + b4 * c0)
    b5 = (kb * R5) * (c2 * a2 + c1 * a3 + c3 * a1 + c0 * a4 + c4 * a0)
    c5 = (kc * R5) * (a2 * b2 + a1 * b3 + a3 * b1 + a0 * b4 + a4 * b0)
    a6 = (ka * R6) * (b2 * c3 + b3 * c2 + b1 * c4 + b4 * c1 + b0 * c5 + b5 * c0)
    b6 = (kb * R6) * (c2 * a3 + c3 * a2 + c1 * a4 + c4 * a1 + c0 * a5 + c5 * a0)
    c6 = (kc * R6) * (a2 * b3 + a3 * b2 + a1 * b4 + a4 * b1 + a0 * b5 + a5 * b0)
    a7 = (ka * R7) * (b3 * c3 + b2 * c4 + b4 * c2 + b1 * c5 + b5 * c1 + b0 * c6 + b6 * c0)
    b7 = (kb * R7) * (c3 * a3 + c2 * a4 + c4 * a2 + c1 * a5 + c5 * a1 + c0 * a6 + c6 * a0)
    c7 = (kc * R7) * (a3 * b3 + a2 * b4 + a4 * b2 + a1 * b5 + a5 * b1 + a0 * b6 + a6 * b0)
    a8 = (ka * R8) * (b3 * c4 + b4 * c3 + b2 * c5 + b5 * c2 + b1 * c6 + b6 * c1 + b0 * c7 + b7 * c0)
    b8 = (kb * R8) * (c3 * a4 + c4 * a3 + c2 * a5 + c5 * a2 + c1 * a6 + c6 * a1 + c0 * a7 + c7 * a0)
    c8 = (kc * R8) * (a3 * b4 + a4 * b3 + a2 * b5 + a5 * b2 + a1 * b6 + a6 * b1 + a0 * b7 + a7 * b0)
    a9 = (ka * R9) * (b4 * c4 + b3 * c5 + b5 * c3 + b2 * c6 + b6 * c2 + b1 * c7 + b7 * c1 + b0 * c8 + b8 * c0)
    b9 = (kb * R9) * (c4 * a4 + c3 * a5 + c5 * a3 + c2 * a6 + c6 * a2 + c1 * a7 + c7 * a1 + c0 * a8 + c8 * a0)
    c9 = (kc * R9) * (a4 * b4 + a3 * b5 + a5 * b3 + a2 * b6 + a6 * b2 + a1 * b7 + a7 * b1 + a0 * b8 + a8 * b0)
    a10 = (ka * R10) * (b4 * c5 + b5 * c4 + b3 * c6 + b6 * c3 + b2 * c7 + b7 * c2 + b1 * c8 + b8 * c1 + b0 * c9 + b9 *
        c0)
    b10 = (kb * R10) * (c4 * a5 + c5 * a4 + c3 * a6 + c6 * a3 + c2 * a7 + c7 * a2 + c1 * a8 + c8 * a1 + c0 * a9 + c9 *
        a0)
    c10 = (kc * R10) * (a4 * b5 + a5 * b4 + a3 * b6 + a6 * b3 + a2 * b7 + a7 * b2 + a1 * b8 + a8 * b1 + a0 * b9 + a9 *
        b0)
    a = (((((((((a3 + a2) + a4) + a5) + a6) + a7) + a8) + a9) + a10) + a1) + a0
    b = (((((((((b3 + b2) + b4) + b5) + b6) + b7) + b8) + b9) + b10) + b1) + b0
    c = (((((((((c3 + c2) + c4) + c5) + c6) + c7) + c8) + c9) + c10) + c1) + c0
    return a, b, c


@straight
def step_12(a0, b0, c0, ka, kb, kc):
    """One step of order 12; k_i = c_i h."""
    a1 = ka * (b0 * c0)
    b1 = kb * (c0 * a0)
    c1 = kc * (a0 * b0)
    a2 = (ka * R2) * (b0 * c1 + b1 * c0)
    b2 = (kb * R2) * (c0 * a1 + c1 * a0)
    c2 = (kc * R2) * (a0 * b1 + a1 * b0)
    a3 = (ka * R3) * (b1 * c1 + b0 * c2 + b2 * c0)
    b3 = (kb * R3) * (c1 * a1 + c0 * a2 + c2 * a0)
    c3 = (kc * R3) * (a1 * b1 + a0 * b2 + a2 * b0)
    a4 = (ka * R4) * (b1 * c2 + b2 * c1 + b0 * c3 + b3 * c0)
    b4 = (kb * R4) * (c1 * a2 + c2 * a1 + c0 * a3 + c3 * a0)
    c4 = (kc * R4) * (a1 * b2 + a2 * b1 + a0 * b3 + a3 * b0)
    a5 = (ka * R5) * (b2 * c2 + b1 * c3 + b3 * c1 + b0 * c4 + b4 * c0)
    b5 = (kb * R5) * (c2 * a2 + c1 * a3 + c3 * a1 + c0 * a4 + c4 * a0)
    c5 = (kc * R5) * (a2 * b2 + a1 * b3 + a3 * b1 + a0 * b4 + a4 * b0)
    a6 = (ka * R6) * (b2 * c3 + b3 * c2 + b1 * c4 + b4 * c1 + b0 * c5 + b5 * c0)
    b6 = (kb * R6) * (c2 * a3 + c3 * a2 + c1 * a4 + c4 * a1 + c0 * a5 + c5 * a0)
    c6 = (kc * R6) * (a2 * b3 + a3 * b2 + a1 * b4 + a4 * b1 + a0 * b5 + a5 * b0)
    a7 = (ka * R7) * (b3 * c3 + b2 * c4 + b4 * c2 + b1 * c5 + b5 * c1 + b0 * c6 + b6 * c0)
    b7 = (kb * R7) * (c3 * a3 + c2 * a4 + c4 * a2 + c1 * a5 + c5 * a1 + c0 * a6 + c6 * a0)
    c7 = (kc * R7) * (a3 * b3 + a2 * b4 + a4 * b2 + a1 * b5 + a5 * b1 + a0 * b6 + a6 * b0)
    a8 = (ka * R8) * (b3 * c4 + b4 * c3 + b2 * c5 + b5 * c2 + b1 * c6 + b6 * c1 + b0 * c7 + b7 * c0)
    b8 = (kb * R8) * (c3 * a4 + c4 * a3 + c2 * a5 + c5 * a2 + c1 * a6 + c6 * a1 + c0 * a7 + c7 * a0)
    c8 = (kc * R8) * (a3 * b4 + a4 * b3 + a2 * b5 + a5 * b2 + a1 * b6 + a6 * b1 + a0 * b7 + a7 * b0)
    a9 = (ka * R9) * (b4 * c4 + b3 * c5 + b5 * c3 + b2 * c6 + b6 * c2 + b1 * c7 + b7 * c1 + b0 * c8 + b8 * c0)
    b9 = (kb * R9) * (c4 * a4 + c3 * a5 + c5 * a3 + c2 * a6 + c6 * a2 + c1 * a7 + c7 * a1 + c0 * a8 + c8 * a0)
    c9 = (kc * R9) * (a4 * b4 + a3 * b5 + a5 * b3 + a2 * b6 + a6 * b2 + a1 * b7 + a7 * b1 + a0 * b8 + a8 * b0)
    a10 = (ka * R10) * (b4 * c5 + b5 * c4 + b3 * c6 + b6 * c3 + b2 * c7 + b7 * c2 + b1 * c8 + b8 * c1 + b0 * c9 + b9 *
        c0)
    b10 = (kb * R10) * (c4 * a5 + c5 * a4 + c3 * a6 + c6 * a3 + c2 * a7 + c7 * a2 + c1 * a8 + c8 * a1 + c0 * a9 + c9 *
        a0)
    c10 = (kc * R10) * (a4 * b5 + a5 * b4 + a3 * b6 + a6 * b3 + a2 * b7 + a7 * b2 + a1 * b8 + a8 * b1 + a0 * b9 + a9 *
        b0)
    a11 = (ka * R11) * (b5 * c5 + b4 * c6 + b6 * c4 + b3 * c7 + b7 * c3 + b2 * c8 + b8 * c2 + b1 * c9 + b9 * c1 + b0 *
        c10 + b10 * c0)
    b11 = (kb * R11) * (c5 * a5 + c4 * a6 + c6 * a4 + c3 * a7 + c7 * a3 + c2 * a8 + c8 * a2 + c1 * a9 + c9 * a1 + c0 *
        a10 + c10 * a0)
    c11 = (kc * R11) * (a5 * b5 + a4 * b6 + a6 * b4 + a3 * b7 + a7 * b3 + a2 * b8 + a8 * b2 + a1 * b9 + a9 * b1 + a0 *
        b10 + a10 * b0)
    a12 = (ka * R12) * (b5 * c6 + b6 * c5 + b4 * c7 + b7 * c4 + b3 * c8 + b8 * c3 + b2 * c9 + b9 * c2 + b1 * c10 + b10 *
        c1 + b0 * c11 + b11 * c0)
    b12 = (kb * R12) * (c5 * a6 + c6 * a5 + c4 * a7 + c7 * a4 + c3 * a8 + c8 * a3 + c2 * a9 + c9 * a2 + c1 * a10 + c10 *
        a1 + c0 * a11 + c11 * a0)
    c12 = (kc * R12) * (a5 * b6 + a6 * b5 + a4 * b7 + a7 * b4 + a3 * b8 + a8 * b3 + a2 * b9 + a9 * b2 + a1 * b10 + a10 *
        b1 + a0 * b11 + a11 * b0)
    a = (((((((((((a3 + a2) + a4) + a5) + a6) + a7) + a8) + a9) + a10) + a11) + a12) + a1) + a0
    b = (((((((((((b3 + b2) + b4) + b5) + b6) + b7) + b8) + b9) + b10) + b11) + b12) + b1) + b0
    c = (((((((((((c3 + c2) + c4) + c5) + c6) + c7) + c8) + c9) + c10) + c11) + c12) + c1) + c0
    return a, b, c


@straight
def near_step_8(a0, b0, c0, ka, kb, kc):
    """One step of order 8 near the axis a; k_i = c_i h."""
    a1 = ka * (b0 * c0)
    b1 = kb * (c0 * a0)
    c1 = kc * (a0 * b0)
    a2 = (ka * R2) * (b0 * c1 + b1 * c0)
    b2 = (kb * R2) * (c0 * a1 + c1 * a0)
    c2 = (kc * R2) * (a0 * b1 + a1 * b0)
    a3 = (ka * R3) * (b1 * c1 + b0 * c2 + b2 * c0)
    b3 = (kb * R3) * (c1 * a1 + c0 * a2 + c2 * a0)
    c3 = (kc * R3) * (a1 * b1 + a0 * b2 + a2 * b0)
    a4 = (ka * R4) * (b1 * c2 + b2 * c1 + b0 * c3 + b3 * c0)
    b4 = (kb * R4) * (c1 * a2 + c2 * a1 + c0 * a3 + c3 * a0)
    c4 = (kc * R4) * (a1 * b2 + a2 * b1 + a0 * b3 + a3 * b0)
    a5 = (ka * R5) * (b2 * c2 + b1 * c3 + b3 * c1 + b0 * c4 + b4 * c0)
    b5 = (kb * R5) * (c0 * a4 + c1 * a3 + c2 * a2 + c3 * a1 + c4 * a0)
    c5 = (kc * R5) * (b0 * a4 + b1 * a3 + b2 * a2 + b3 * a1 + b4 * a0)
    a6 = (ka * R6) * (b2 * c3 + b3 * c2 + b1 * c4 + b4 * c1 + b0 * c5 + b5 * c0)
    b6 = (kb * R6) * (c1 * a4 + c2 * a3 + c3 * a2 + c4 * a1 + c5 * a0)
    c6 = (kc * R6) * (b1 * a4 + b2 * a3 + b3 * a2 + b4 * a1 + b5 * a0)
    a7 = (ka * R7) * (b3 * c3 + b2 * c4 + b4 * c2 + b1 * c5 + b5 * c1 + b0 * c6 + b6 * c0)
    b7 = (kb * R7) * (c2 * a4 + c3 * a3 + c4 * a2 + c5 * a1 + c6 * a0)
    c7 = (kc * R7) * (b2 * a4 + b3 * a3 + b4 * a2 + b5 * a1 + b6 * a0)
    b8 = (kb * R8) * (c3 * a4 + c4 * a3 + c5 * a2 + c6 * a1 + c7 * a0)
    c8 = (kc * R8) * (b3 * a4 + b4 * a3 + b5 * a2 + b6 * a1 + b7 * a0)
    a = ((((((a3 + a2) + a4) + a5) + a6) + a7) + a1) + a0
    b = (((((((b3 + b2) + b4) + b5) + b6) + b7) + b8) + b1) + b0
    c = (((((((c3 + c2) + c4) + c5) + c6) + c7) + c8) + c1) + c0
    return a, b, c


@straight
def near_step_10(a0, b0, c0, ka, kb, kc):
    """One step of order 10 near the axis a; k_i = c_i h."""
    a1 = ka * (b0 * c0)
    b1 = kb * (c0 * a0)
    c1 = kc * (a0 * b0)
    a2 = (ka * R2) * (b0 * c1 + b1 * c0)
    b2 = (kb * R2) * (c0 * a1 + c1 * a0)
    c2 = (kc * R2) * (a0 * b1 + a1 * b0)
    a3 = (ka * R3) * (b1 * c1 + b0 * c2 + b2 * c0)
    b3 = (kb * R3) * (c1 * a1 + c0 * a2 + c2 * a0)
    c3 = (kc * R3) * (a1 * b1 + a0 * b2 + a2 * b0)
    a4 = (ka * R4) * (b1 * c2 + b2 * c1 + b0 * c3 + b3 * c0)
    b4 = (kb * R4) * (c1 * a2 + c2 * a1 + c0 * a3 + c3 * a0)
    c4 = (kc * R4) * (a1 * b2 + a2 * b1 + a0 * b3 + a3 * b0)
    a5 = (ka * R5) * (b2 * c2 + b1 * c3 + b3 * c1 + b0 * c4 + b4 * c0)
    b5 = (kb * R5) * (c0 * a4 + c1 * a3 + c2 * a2 + c3 * a1 + c4 * a0)
    c5 = (kc * R5) * (b0 * a4 + b1 * a3 + b2 * a2 + b3 * a1 + b4 * a0)
    a6 = (ka * R6) * (b2 * c3 + b3 * c2 + b1 * c4 + b4 * c1 + b0 * c5 + b5 * c0)
    b6 = (kb * R6) * (c1 * a4 + c2 * a3 + c3 * a2 + c4 * a1 + c5 * a0)
    c6 = (kc * R6) * (b1 * a4 + b2 * a3 + b3 * a2 + b4 * a1 + b5 * a0)
    a7 = (ka * R7) * (b3 * c3 + b2 * c4 + b4 * c2 + b1 * c5 + b5 * c1 + b0 * c6 + b6 * c0)
    b7 = (kb * R7) * (c2 * a4 + c3 * a3 + c4 * a2 + c5 * a1 + c6 * a0)
    c7 = (kc * R7) * (b2 * a4 + b3 * a3 + b4 * a2 + b5 * a1 + b6 * a0)
    b8 = (kb * R8) * (c3 * a4 + c4 * a3 + c5 * a2 + c6 * a1 + c7 * a0)
    c8 = (kc * R8) * (b3 * a4 + b4 * a3 + b5 * a2 + b6 * a1 + b7 * a0)
    b9 = (kb * R9) * (c4 * a4 + c5 * a3 + c6 * a2 + c7 * a1 + c8 * a0)
    c9 = (kc * R9) * (b4 * a4 + b5 * a3 + b6 * a2 + b7 * a1 + b8 * a0)
    b10 = (kb * R10) * (c5 * a4 + c6 * a3 + c7 * a2 + c8 * a1 + c9 * a0)
    c10 = (kc * R10) * (b5 * a4 + b6 * a3 + b7 * a2 + b8 * a1 + b9 * a0)
    a = ((((((a3 + a2) + a4) + a5) + a6) + a7) + a1) + a0
    b = (((((((((b3 + b2) + b4) + b5) + b6) + b7) + b8) + b9) + b10) + b1) + b0
    c = (((((((((c3 + c2) + c4) + c5) + c6) + c7) + c8) + c9) + c10) + c1) + c0
    return a, b, c


@straight
def near_step_12(a0, b0, c0, ka, kb, kc):
    """One step of order 12 near the axis a; k_i = c_i h."""
    a1 = ka * (b0 * c0)
    b1 = kb * (c0 * a0)
    c1 = kc * (a0 * b0)
    a2 = (ka * R2) * (b0 * c1 + b1 * c0)
    b2 = (kb * R2) * (c0 * a1 + c1 * a0)
    c2 = (kc * R2) * (a0 * b1 + a1 * b0)
    a3 = (ka * R3) * (b1 * c1 + b0 * c2 + b2 * c0)
    b3 = (kb * R3) * (c1 * a1 + c0 * a2 + c2 * a0)
    c3 = (kc * R3) * (a1 * b1 + a0 * b2 + a2 * b0)
    a4 = (ka * R4) * (b1 * c2 + b2 * c1 + b0 * c3 + b3 * c0)
    b4 = (kb * R4) * (c1 * a2 + c2 * a1 + c0 * a3 + c3 * a0)
    c4 = (kc * R4) * (a1 * b2 + a2 * b1 + a0 * b3 + a3 * b0)
    a5 = (ka * R5) * (b2 * c2 + b1 * c3 + b3 * c1 + b0 * c4 + b4 * c0)
    b5 = (kb * R5) * (c0 * a4 + c1 * a3 + c2 * a2 + c3 * a1 + c4 * a0)
    c5 = (kc * R5) * (b0 * a4 + b1 * a3 + b2 * a2 + b3 * a1 + b4 * a0)
    a6 = (ka * R6) * (b2 * c3 + b3 * c2 + b1 * c4 + b4 * c1 + b0 * c5 + b5 * c0)
    b6 = (kb * R6) * (c1 * a4 + c2 * a3 + c3 * a2 + c4 * a1 + c5 * a0)
    c6 = (kc * R6) * (b1 * a4 + b2 * a3 + b3 * a2 + b4 * a1 + b5 * a0)
    a7 = (ka * R7) * (b3 * c3 + b2 * c4 + b4 * c2 + b1 * c5 + b5 * c1 + b0 * c6 + b6 * c0)
    b7 = (kb * R7) * (c2 * a4 + c3 * a3 + c4 * a2 + c5 * a1 + c6 * a0)
    c7 = (kc * R7) * (b2 * a4 + b3 * a3 + b4 * a2 + b5 * a1 + b6 * a0)
    b8 = (kb * R8) * (c3 * a4 + c4 * a3 + c5 * a2 + c6 * a1 + c7 * a0)
    c8 = (kc * R8) * (b3 * a4 + b4 * a3 + b5 * a2 + b6 * a1 + b7 * a0)
    b9 = (kb * R9) * (c4 * a4 + c5 * a3 + c6 * a2 + c7 * a1 + c8 * a0)
    c9 = (kc * R9) * (b4 * a4 + b5 * a3 + b6 * a2 + b7 * a1 + b8 * a0)
    b10 = (kb * R10) * (c5 * a4 + c6 * a3 + c7 * a2 + c8 * a1 + c9 * a0)
    c10 = (kc * R10) * (b5 * a4 + b6 * a3 + b7 * a2 + b8 * a1 + b9 * a0)
    b11 = (kb * R11) * (c6 * a4 + c7 * a3 + c8 * a2 + c9 * a1 + c10 * a0)
    c11 = (kc * R11) * (b6 * a4 + b7 * a3 + b8 * a2 + b9 * a1 + b10 * a0)
    b12 = (kb * R12) * (c7 * a4 + c8 * a3 + c9 * a2 + c10 * a1 + c11 * a0)
    c12 = (kc * R12) * (b7 * a4 + b8 * a3 + b9 * a2 + b10 * a1 + b11 * a0)
    a = ((((((a3 + a2) + a4) + a5) + a6) + a7) + a1) + a0
    b = (((((((((((b3 + b2) + b4) + b5) + b6) + b7) + b8) + b9) + b10) + b11) + b12) + b1) + b0
    c = (((((((((((c3 + c2) + c4) + c5) + c6) + c7) + c8) + c9) + c10) + c11) + c12) + c1) + c0
    return a, b, c


@straight
def nearest_step_8(a0, b0, c0, ka, kb, kc):
    """One step of order 8 nearest the axis a; k_i = c_i h."""
    a1 = ka * (b0 * c0)
    b1 = kb * (c0 * a0)
    c1 = kc * (a0 * b0)
    a2 = (ka * R2) * (b0 * c1 + b1 * c0)
    b2 = (kb * R2) * (c0 * a1 + c1 * a0)
    c2 = (kc * R2) * (a0 * b1 + a1 * b0)
    a3 = (ka * R3) * (b1 * c1 + b0 * c2 + b2 * c0)
    b3 = (kb * R3) * (c0 * a2 + c1 * a1 + c2 * a0)
    c3 = (kc * R3) * (b0 * a2 + b1 * a1 + b2 * a0)
    a4 = (ka * R4) * (b1 * c2 + b2 * c1 + b0 * c3 + b3 * c0)
    b4 = (kb * R4) * (c1 * a2 + c2 * a1 + c3 * a0)
    c4 = (kc * R4) * (b1 * a2 + b2 * a1 + b3 * a0)
    a5 = (ka * R5) * (b2 * c2 + b1 * c3 + b3 * c1 + b0 * c4 + b4 * c0)
    b5 = (kb * R5) * (c2 * a2 + c3 * a1 + c4 * a0)
    c5 = (kc * R5) * (b2 * a2 + b3 * a1 + b4 * a0)
    b6 = (kb * R6) * (c3 * a2 + c4 * a1 + c5 * a0)
    c6 = (kc * R6) * (b3 * a2 + b4 * a1 + b5 * a0)
    b7 = (kb * R7) * (c4 * a2 + c5 * a1 + c6 * a0)
    c7 = (kc * R7) * (b4 * a2 + b5 * a1 + b6 * a0)
    b8 = (kb * R8) * (c5 * a2 + c6 * a1 + c7 * a0)
    c8 = (kc * R8) * (b5 * a2 + b6 * a1 + b7 * a0)
    a = ((((a3 + a2) + a4) + a5) + a1) + a0
    b = (((((((b3 + b2) + b4) + b5) + b6) + b7) + b8) + b1) + b0
    c = (((((((c3 + c2) + c4) + c5) + c6) + c7) + c8) + c1) + c0
    return a, b, c


@straight
def nearest_step_10(a0, b0, c0, ka, kb, kc):
    """One step of order 10 nearest the axis a; k_i = c_i h."""
    a1 = ka * (b0 * c0)
    b1 = kb * (c0 * a0)
    c1 = kc * (a0 * b0)
    a2 = (ka * R2) * (b0 * c1 + b1 * c0)
    b2 = (kb * R2) * (c0 * a1 + c1 * a0)
    c2 = (kc * R2) * (a0 * b1 + a1 * b0)
    a3 = (ka * R3) * (b1 * c1 + b0 * c2 + b2 * c0)
    b3 = (kb * R3) * (c0 * a2 + c1 * a1 + c2 * a0)
    c3 = (kc * R3) * (b0 * a2 + b1 * a1 + b2 * a0)
    a4 = (ka * R4) * (b1 * c2 + b2 * c1 + b0 * c3 + b3 * c0)
    b4 = (kb * R4) * (c1 * a2 + c2 * a1 + c3 * a0)
    c4 = (kc * R4) * (b1 * a2 + b2 * a1 + b3 * a0)
    a5 = (ka * R5) * (b2 * c2 + b1 * c3 + b3 * c1 + b0 * c4 + b4 * c0)
    b5 = (kb * R5) * (c2 * a2 + c3 * a1 + c4 * a0)
    c5 = (kc * R5) * (b2 * a2 + b3 * a1 + b4 * a0)
    b6 = (kb * R6) * (c3 * a2 + c4 * a1 + c5 * a0)
    c6 = (kc * R6) * (b3 * a2 + b4 * a1 + b5 * a0)
    b7 = (kb * R7) * (c4 * a2 + c5 * a1 + c6 * a0)
    c7 = (kc * R7) * (b4 * a2 + b5 * a1 + b6 * a0)
    b8 = (kb * R8) * (c5 * a2 + c6 * a1 + c7 * a0)
    c8 = (kc * R8) * (b5 * a2 + b6 * a1 + b7 * a0)
    b9 = (kb * R9) * (c6 * a2 + c7 * a1 + c8 * a0)
    c9 = (kc * R9) * (b6 * a2 + b7 * a1 + b8 * a0)
    b10 = (kb * R10) * (c7 * a2 + c8 * a1 + c9 * a0)
    c10 = (kc * R10) * (b7 * a2 + b8 * a1 + b9 * a0)
    a = ((((a3 + a2) + a4) + a5) + a1) + a0
    b = (((((((((b3 + b2) + b4) + b5) + b6) + b7) + b8) + b9) + b10) + b1) + b0
    c = (((((((((c3 + c2) + c4) + c5) + c6) + c7) + c8) + c9) + c10) + c1) + c0
    return a, b, c


@straight
def nearest_step_12(a0, b0, c0, ka, kb, kc):
    """One step of order 12 nearest the axis a; k_i = c_i h."""
    a1 = ka * (b0 * c0)
    b1 = kb * (c0 * a0)
    c1 = kc * (a0 * b0)
    a2 = (ka * R2) * (b0 * c1 + b1 * c0)
    b2 = (kb * R2) * (c0 * a1 + c1 * a0)
    c2 = (kc * R2) * (a0 * b1 + a1 * b0)
    a3 = (ka * R3) * (b1 * c1 + b0 * c2 + b2 * c0)
    b3 = (kb * R3) * (c0 * a2 + c1 * a1 + c2 * a0)
    c3 = (kc * R3) * (b0 * a2 + b1 * a1 + b2 * a0)
    a4 = (ka * R4) * (b1 * c2 + b2 * c1 + b0 * c3 + b3 * c0)
    b4 = (kb * R4) * (c1 * a2 + c2 * a1 + c3 * a0)
    c4 = (kc * R4) * (b1 * a2 + b2 * a1 + b3 * a0)
    a5 = (ka * R5) * (b2 * c2 + b1 * c3 + b3 * c1 + b0 * c4 + b4 * c0)
    b5 = (kb * R5) * (c2 * a2 + c3 * a1 + c4 * a0)
    c5 = (kc * R5) * (b2 * a2 + b3 * a1 + b4 * a0)
    b6 = (kb * R6) * (c3 * a2 + c4 * a1 + c5 * a0)
    c6 = (kc * R6) * (b3 * a2 + b4 * a1 + b5 * a0)
    b7 = (kb * R7) * (c4 * a2 + c5 * a1 + c6 * a0)
    c7 = (kc * R7) * (b4 * a2 + b5 * a1 + b6 * a0)
    b8 = (kb * R8) * (c5 * a2 + c6 * a1 + c7 * a0)
    c8 = (kc * R8) * (b5 * a2 + b6 * a1 + b7 * a0)
    b9 = (kb * R9) * (c6 * a2 + c7 * a1 + c8 * a0)
    c9 = (kc * R9) * (b6 * a2 + b7 * a1 + b8 * a0)
    b10 = (kb * R10) * (c7 * a2 + c8 * a1 + c9 * a0)
    c10 = (kc * R10) * (b7 * a2 + b8 * a1 + b9 * a0)
    b11 = (kb * R11) * (c8 * a2 + c9 * a1 + c10 * a0)
    c11 = (kc * R11) * (b8 * a2 + b9 * a1 + b10 * a0)
    b12 = (kb * R12) * (c9 * a2 + c10 * a1 + c11 * a0)
    c12 = (kc * R12) * (b9 * a2 + b10 * a1 + b11 * a0)
    a = ((((a3 + a2) + a4) + a5) + a1) + a0
    b = (((((((((((b3 + b2) + b4) + b5) + b6) + b7) + b8) + b9) + b10) + b11) + b12) + b1) + b0
    c = (((((((((((c3 + c2) + c4) + c5) + c6) + c7) + c8) + c9) + c10) + c11) + c12) + c1) + c0
    return a, b, c
