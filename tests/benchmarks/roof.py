"""What this machine's cores can do in double precision, and how many operations the direct integrator asks of them."""

import numpy as np
from contenders import Direct
from numba import njit

from kernels import taylor

CHAINS, LINKS, LANES, PASSES = 12, 64, 256, 64
FLOPS = 2 * CHAINS * LINKS * LANES * PASSES  # of one call of multiply_adds


@njit(forceinline=True)
def _link(x, m, a):
    """One multiply-add of each of twelve chains that do not wait for each other."""
    x0, x1, x2, x3, x4, x5, x6, x7, x8, x9, x10, x11 = x
    return (
        x0 * m + a, x1 * m + a, x2 * m + a, x3 * m + a, x4 * m + a, x5 * m + a,
        x6 * m + a, x7 * m + a, x8 * m + a, x9 * m + a, x10 * m + a, x11 * m + a,
    )  # fmt: skip


def _twice(links):
    @njit(forceinline=True)
    def both(x, m, a):
        return links(links(x, m, a), m, a)

    return both


_links = _link
for _ in range(LINKS.bit_length() - 1):
    _links = _twice(_links)


@njit(nogil=True, fastmath={"contract"}, error_model="numpy")
def multiply_adds(S, m, a):
    """Fused multiply-adds in the shape of the house's kernels: lanes innermost, chains in registers; S (12, LANES)."""
    for _ in range(PASSES):
        for lane in range(LANES):
            x = (
                S[0, lane], S[1, lane], S[2, lane], S[3, lane], S[4, lane], S[5, lane],
                S[6, lane], S[7, lane], S[8, lane], S[9, lane], S[10, lane], S[11, lane],
            )  # fmt: skip
            (
                S[0, lane], S[1, lane], S[2, lane], S[3, lane], S[4, lane], S[5, lane],
                S[6, lane], S[7, lane], S[8, lane], S[9, lane], S[10, lane], S[11, lane],
            ) = _links(x, m, a)  # fmt: skip


def strike(calls, pool, threads):
    """Run so many calls on each thread; the chains tend to 1, so nothing overflows and nothing is denormal."""

    def work(_):
        S = np.linspace(0.5, 1.5, CHAINS * LANES).reshape(CHAINS, LANES)
        for _ in range(calls):
            multiply_adds(S, 0.999, 0.001)

    list(pool.map(work, range(threads)))


class Counted:
    """A number that counts the multiplications and additions it takes part in."""

    operations = 0

    def _count(self, _):
        Counted.operations += 1
        return self

    __mul__ = __rmul__ = __add__ = __radd__ = __sub__ = __rsub__ = _count


def step_flops(step):
    """Multiplications and additions of one Taylor step, counted by running it."""
    Counted.operations = 0
    step(*(Counted() for _ in range(6)))
    return Counted.operations


def run_flops(bodies, tolerance, intervals):
    """Operations of the Taylor steps of all bodies' runs: nothing of samples, padding and reduction is counted."""
    flops, total = [step_flops(step) for step in taylor.STEPS], 0
    for i in range(len(bodies)):
        number, steps = Direct.step(bodies[i : i + 1], tolerance)
        total += flops[number] * steps * intervals
    return total
