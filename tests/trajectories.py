"""Trajectories for tests of `certify`: exact motions, engines that integrate them, and files of every kind."""

import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from kernels.free import exact

BRICK = np.array([0.001894220, 0.006211019, 0.007194665])  # NASA's check case 2, slug ft2
BRICK_START = np.radians([10.0, 20.0, 30.0])


def exact_rows(moments, start, times, q0=(1.0, 0.0, 0.0, 0.0)):
    """Columns of the exact motion: t, q (scalar first) and w."""
    q = Rotation.from_quat(q0, scalar_first=True) * Rotation.from_quat(
        exact.attitude(moments, start, times), scalar_first=True
    )
    return {"t": times, "q": q.as_quat(scalar_first=True), "w": exact.rotation(moments, start, times)}


def integrate_rows(moments, start, q0, times, change=None, turning=lambda w, f: w, side=1, method="DOP853", rtol=1e-12):
    """Return rows by a method of SciPy: w' = f + change(w, q), q' = q v/2 or (side -1) v q/2, v = turning(w, f)."""

    def derivative(_, y):
        w, q = y[:3], y[3:]
        f = np.cross(moments * w, w) / moments
        v = turning(w, f)
        turn = [-q[1:] @ v, *(q[0] * v + side * np.cross(q[1:], v))]
        return np.concatenate([f + (change(w, q) if change else 0.0), 0.5 * np.array(turn)])

    y = solve_ivp(derivative, times[[0, -1]], [*start, *q0], method, times, rtol=rtol, atol=0.1 * rtol).y.T
    return {"t": times, "w": y[:, :3], "q": y[:, 3:] / np.linalg.norm(y[:, 3:], axis=1, keepdims=True)}


def split_rows(moments, start, q0, times, step=2e-3):
    """Return rows by turns about the principal axes 1, 2, 3, 2, 1 (McLachlan and Reich): symplectic, of order 2."""
    L, q, rows = moments * start, Rotation.from_quat(q0, scalar_first=True), []
    for span in np.diff(times, prepend=times[0]):
        steps = math.ceil(span / step)
        for axis, part in steps * ((0, 0.5), (1, 0.5), (2, 1.0), (1, 0.5), (0, 0.5)):
            turn = Rotation.from_rotvec(part * span / steps * L[axis] / moments[axis] * np.eye(3)[axis])
            L, q = turn.inv().apply(L), q * turn
        rows.append((L / moments, q.as_quat(scalar_first=True)))
    w, q = map(np.array, zip(*rows, strict=True))
    return {"t": times, "w": w, "q": q}


def table(rows):
    """Name → column, as `sweeps.certify` takes it."""
    columns = {"time": rows["t"]}
    for name, first in (("q", 0), ("w", 1)):
        if name in rows:
            columns |= {f"{name}{i}": column for i, column in enumerate(rows[name].T, first)}
    return columns


def write_csv(path, columns, digits="%.17g"):
    """Writes a CSV file of some columns and returns its path."""
    lines = [",".join(columns), *(",".join(digits % x for x in row) for row in np.column_stack([*columns.values()]))]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def write_aem(path, rows, digits="%.17g", direction="A2B", order="LAST", epoch="2026-01-01T00:00:00", rates=False):
    """Writes a quaternion AEM in keyword-value notation and returns its path."""
    kind = "QUATERNION/ANGVEL" if rates else "QUATERNION"
    head = ["CCSDS_AEM_VERS = 2.0", "CREATION_DATE = 2026-01-01T00:00:00", "ORIGINATOR = TEST", "", "META_START"]
    head += ["OBJECT_NAME = BRICK", "REF_FRAME_A = EME2000", "REF_FRAME_B = SC_BODY_1", f"ATTITUDE_DIR = {direction}"]
    head += [f"QUATERNION_TYPE = {order}", f"ATTITUDE_TYPE = {kind}", "META_STOP", "", "DATA_START", "COMMENT a line"]
    q = rows["q"] if order == "FIRST" else np.roll(rows["q"], -1, axis=1)
    begin = np.datetime64(epoch)
    seconds = np.floor(rows["t"]).astype(int)
    lines = []
    for k, t in enumerate(rows["t"]):
        at = str(begin + np.timedelta64(int(seconds[k]), "s")) + f"{t - seconds[k]:.15f}"[1:]
        values = [*q[k], *(np.degrees(rows["w"][k]) if rates else ())]
        lines.append(" ".join([at, *(digits % x for x in values)]))
    path.write_text("\n".join([*head, *lines, "DATA_STOP", ""]), encoding="ascii")
    return path
