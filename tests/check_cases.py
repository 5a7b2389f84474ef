"""Free rotations in 60 digits, by closed forms and a Taylor series: makes the check cases that ship.

`PYTHONPATH=.:tests python tests/check_cases.py` writes `sweeps/systems/rigid_body/check_cases.nc` in a few minutes. All
ways, three for different moments, else two, begin at exact decimals; the series shares no formula but Euler's equations
with the closed forms. Rows are written if they agree to 1e-40.

Signs: J w' = (J w) x w with moments J, q' = q (0, w)/2, q scalar first, from the body to space. Of the principal axes,
s is the intermediate one, d that which the angular momentum encircles, c the third; m1 = 1 - m.
"""

from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import NamedTuple

import mpmath as mp
import numpy as np
from precise import Textbook, taylor

DIGITS, AGREEMENT, ROWS = 60, 1e-40, 1001
TAYLOR_ORDER = 44  # order of the Taylor series: its rows agree with the closed forms to 8e-44 at least
PATH = Path(__file__).parents[1] / "sweeps/systems/rigid_body/check_cases.nc"
BOUND = 2.0**-52  # rad: each part of a quaternion is rounded by 2^-54, hence the attitude by four times that


class Case(NamedTuple):
    """A check case; all numbers are exact in decimal and in binary."""

    name: str
    title: str
    moments: tuple[str, str, str]
    omega: tuple[str, str, str]
    step: str  # s, between rows
    unit: str = "rad s-1"  # of omega


CASES = (
    Case("sphere", "sphere: ten rotations about a fixed axis", ("1", "1", "1"), ("0.25", "-0.5", "0.75"), "0"),
    Case("plate", "plate (I1 + I2 = I3): five flips", ("1", "2", "3"), ("0.125", "1", "0.0625"), "0"),
    Case("separatrix_2", "near the separatrix, 1 - m = 1/101: five flips", ("1", "2", "3"),
         ("0.09375", "0.9375", "0"), "0"),
    Case("separatrix_6", "near the separatrix, 1 - m = 1/(1 + 1e6): five flips", ("1", "2", "3"),
         ("0.0009765625", "0.9765625", "0"), "0"),
    Case("separatrix_12", "near the separatrix, 1 - m = 1/(1 + 1e12): five flips", ("1", "2", "3"),
         ("9.5367431640625e-7", "0.95367431640625", "0"), "0"),
    Case("short_axis", "short-axis mode: ten wobbles", ("2", "3", "4"), ("0.5", "-0.25", "1"), "0"),
    Case("long_axis", "long-axis mode: ten wobbles", ("2", "3", "4"), ("1", "0.25", "-0.125"), "0"),
    Case("rod", "rod, I1 = I2/64: ten wobbles", ("1", "64", "64"), ("1", "0.5", "0.25"), "0"),
    Case("brick", "brick of NASA's check case 2, relative to inertial axes; moments in 1e-9 slug ft2: ten wobbles",
         ("1894220", "6211019", "7194665"), ("10", "20", "30"), "0.1875", "deg s-1"),
    Case("racket", "tennis racket (Wilson T-2000), moments in 1e-5 kg m2: five flips", ("121", "1638", "1748"),
         ("0.0625", "8", "-0.03125"), "0"),
    Case("cubesat", "6U CubeSat, a uniform box of 10 x 20 x 30 units, about its intermediate axis: five flips",
         ("500", "1000", "1300"), ("-0.0078125", "0.125", "0.00390625"), "0"),
    Case("wobble", "wobble of 1e-8 of the spin: ten wobbles", ("2", "3", "4"),
         ("5.9604644775390625e-8", "0", "5.9604644775390625"), "0"),
    Case("retrograde", "spin against axis 1, moments not ascending: ten wobbles", ("5", "2", "4"),
         ("-1", "0.25", "0.375"), "0"),
)  # fmt: skip


def start_of(case):
    """Moments and angular velocity, rad/s, as arrays of mpmath's numbers."""
    factor = mp.pi / 180 if case.unit == "deg s-1" else mp.mpf(1)
    return np.array([mp.mpf(x) for x in case.moments]), np.array([mp.mpf(x) * factor for x in case.omega])


def span(case):
    """Duration of five flips, ten wobbles or ten rotations, s."""
    J, w = start_of(case)
    if J[0] == J[1] == J[2]:
        return 20 * mp.pi / mp.norm(w)
    if len(set(case.moments)) == 2:
        a = next(i for i in range(3) if case.moments.count(case.moments[i]) == 1)
        return 20 * mp.pi / abs(w[a] * (J[a] - J[a - 1]) / J[a - 1])
    top = Textbook(J, w)
    return (10 if "flips" in case.title else 40) * top.K / top.p


def step_of(case):
    """A time between rows that is exact in decimal and in binary, the least of nine bits that covers the span."""
    if mp.mpf(case.step):
        return Fraction(case.step)
    least = span(case) / (ROWS - 1)
    unit = Fraction(2) ** (int(mp.floor(mp.log(least, 2))) - 8)
    return int(mp.ceil(least / mp.mpf(unit.numerator) * unit.denominator)) * unit


def azimuth_by_third_kind(top):
    """Return the azimuth of axis d about L as a function of the phase u, by an elliptic integral of the third kind."""
    Is, Ic, Id = (top.moments[axis] for axis in top.roles)
    n = -Id * (Is - Ic) / (Ic * (Id - Is))
    complete = mp.elliprf(0, top.m1, 1) + n / 3 * mp.elliprj(0, top.m1, 1, 1 - n)

    def azimuth(u):
        turns = mp.nint(u / (2 * top.K))
        v = u - 2 * turns * top.K
        sn, cn, dn = (mp.ellipfun(kind, v, m=top.m) for kind in ("sn", "cn", "dn"))
        third = sn * mp.elliprf(cn**2, dn**2, 1) + n / 3 * sn**3 * mp.elliprj(cn**2, dn**2, 1, 1 - n * sn**2)
        return top.L / Id * (u / top.p + (Id / Ic - 1) * (third + 2 * turns * complete) / top.p)

    return azimuth


def azimuth_by_theta_functions(top):
    """Return the same by Jacobi's theta functions: Landau and Lifshitz, section 37, with both signs changed."""
    _, Ic, Id = (top.moments[axis] for axis in top.roles)
    nome, LL = mp.exp(-mp.pi * mp.ellipk(top.m1) / top.K), top.L**2
    twice_energy = sum(moment * rate**2 for moment, rate in zip(top.moments, top.start, strict=True))
    tangent = mp.sqrt(Id * (LL - twice_energy * Ic) / (Ic * (twice_energy * Id - LL)))
    # sn(i x | m) = i tan(am(x | 1 - m)): x = 2 alpha K
    alpha = mp.sign(Id - Ic) * mp.ellipf(mp.atan(tangent), top.m1) / (2 * top.K)
    log_slope = mp.jtheta(4, 1j * mp.pi * alpha, nome, 1) / mp.jtheta(4, 1j * mp.pi * alpha, nome)
    mean = top.L / Ic + (1j * top.p * mp.pi / (2 * top.K) * log_slope).real

    def azimuth(u):  # the argument is that of a real function of i alpha: a conjugate
        return mean * u / top.p - mp.arg(mp.jtheta(4, mp.pi * u / (2 * top.K) - 1j * mp.pi * alpha, nome))

    return azimuth


def closed_form(J, w0, times, azimuth):
    """Rows of q and w by a closed form of three different moments; `azimuth` is a function above."""
    top = Textbook(J, w0)
    angle, d = azimuth(top), top.roles[2]
    along, e, f = _frame(J * w0, d)
    rows = []
    for t in times:
        w, turn = np.array(top(t)), angle(top.u0 + top.p * t) - angle(top.u0)
        space = np.array([along, mp.cos(turn) * e + mp.sin(turn) * f, mp.cos(turn) * f - mp.sin(turn) * e])
        rows.append([*quaternion(space.T @ _frame(J * w, d)), *w])
    return rows


def _frame(L, d):
    """Unit vectors: along L, along the part of axis d normal to L, and their cross product."""
    m = L / mp.norm(L)
    e = np.eye(3, dtype=int)[d] - m[d] * m
    e /= mp.norm(e)
    return np.array([m, e, np.cross(m, e)])


def quaternion(R):
    """Unit quaternion, scalar first, of a rotation matrix."""
    sizes = [1 + np.trace(R), *(1 + 2 * R[i, i] - np.trace(R) for i in range(3))]
    k = int(np.argmax(sizes))
    lower = [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]
    q = [sizes[0], *lower] if k == 0 else [lower[k - 1], *(R[k - 1] + R[:, k - 1])]
    q[k] = sizes[k]
    return np.array(q) / (2 * mp.sqrt(sizes[k]))


def product(p, q):
    return [p[0] * q[0] - p[1:] @ q[1:], *(p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:]))]


def turned(vector, t):
    """Quaternion of the rotation by |vector| t about a vector."""
    size = mp.norm(vector)
    return np.array([mp.cos(size * t / 2), *(mp.sin(size * t / 2) * vector / size)])


def two_turns(J, w0, times):
    """Rows of a body with two equal moments, or three: a turn about L, then one about the axis of symmetry."""
    a = next((i for i in range(3) if [*J].count(J[i]) == 1), 0)
    b, c = (a + 1) % 3, (a + 2) % 3
    slip = w0[a] * (J[a] - J[b]) / J[b]  # (w_b + i w_c)' = i slip (w_b + i w_c)
    along = np.array([mp.mpf(i == a) for i in range(3)])
    rows = []
    for t in times:
        w = w0.copy()
        w[b] = w0[b] * mp.cos(slip * t) - w0[c] * mp.sin(slip * t)
        w[c] = w0[c] * mp.cos(slip * t) + w0[b] * mp.sin(slip * t)
        rows.append([*product(turned(J * w0 / J[b], t), turned(along, -slip * t)), *w])
    return rows


def closed_forms(case):
    """The closed forms of a case, functions of moments, start and times: two for three different moments."""
    if len(set(case.moments)) < 3:
        return (two_turns,)
    return tuple(partial(closed_form, azimuth=each) for each in (azimuth_by_third_kind, azimuth_by_theta_functions))


def distance(rows, others):
    """Largest difference of any entry; of q and -q those that are nearer."""
    one, other = np.array(rows), np.array(others)
    signs = np.sign((one[:, :4] * other[:, :4]).sum(axis=1).astype(float))[:, None]
    return max(np.abs(one[:, :4] - signs * other[:, :4]).max(), np.abs(one[:, 4:] - other[:, 4:]).max())


def times_of(case):
    """Times of the rows, exact."""
    step = step_of(case)
    return [mp.mpf(step.numerator) * i / step.denominator for i in range(ROWS)]


def make(case, stride=1):
    """Rows of a case in mpmath's numbers, q continuous, w in the case's unit; refused if the ways do not agree.

    The Taylor series makes all rows; the closed forms are compared with each stride-th one.
    """
    mp.mp.dps = DIGITS
    start, times = start_of(case), times_of(case)
    found = [[*row[3:], *row[:3]] for row in taylor(*start, times, TAYLOR_ORDER, with_attitude=True)]
    apart = [distance(found[::stride], form(*start, times[::stride])) for form in closed_forms(case)]
    if max(apart) > AGREEMENT:
        raise ValueError(f"{case.name}: {[mp.nstr(x, 3) for x in apart]} apart")
    factor = mp.pi / 180 if case.unit == "deg s-1" else 1
    return [[*row[:4], *(x / factor for x in row[4:])] for row in found], max(apart)


def main():
    """Make all cases, and write their file."""
    import xarray as xr

    import sweeps

    q, omega, conditioning = (np.empty((len(CASES), ROWS, n)) for n in (4, 3, 1))
    for i, case in enumerate(CASES):
        rows, apart = make(case)
        rows = np.array(rows, dtype=np.float64)
        q[i], omega[i] = rows[:, :4], rows[:, 4:]
        table = dict(zip(("q0", "q1", "q2", "q3", "w1", "w2", "w3"), rows.T, strict=True))
        table["time"] = np.arange(ROWS) * float(step_of(case))
        options = {"rate_unit": "deg/s"} if case.unit == "deg s-1" else {}
        facts = sweeps.certify(table, [float(x) for x in case.moments], **options).attrs
        conditioning[i] = facts["conditioning_rad"]
        print(f"{case.name:14} {mp.nstr(apart, 2):10} {facts['verdict']:16} conditioning {conditioning[i, 0, 0]:.2g}")
    names = {"title": [case.title for case in CASES], "unit": [case.unit for case in CASES]}
    columns = {name: ("case", np.array(values, dtype=object)) for name, values in names.items()}
    columns |= {"step": ("case", [float(step_of(case)) for case in CASES], {"units": "s"})}
    columns |= {"moments": (("case", "i"), [[float(x) for x in case.moments] for case in CASES])}
    columns |= {"conditioning_rad": ("case", conditioning[:, 0, 0]), "error_bound_rad": ((), BOUND)}
    columns |= {"q": (("case", "time", "k"), q), "omega": (("case", "time", "i"), omega)}
    ds = xr.Dataset(columns, {"case": [case.name for case in CASES]})
    deflated = {name: {"zlib": True, "shuffle": True, "complevel": 9} for name in ("q", "omega")}
    ds.to_netcdf(PATH, engine="netcdf4", encoding=deflated)


if __name__ == "__main__":
    main()
