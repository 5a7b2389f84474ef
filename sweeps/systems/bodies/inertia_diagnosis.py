r"""Diagnosis of a tensor of inertia that no rigid body has, or that is improbable for the body's mass and size.

The second moments about the centre of mass, :math:`S = \tfrac12\,\mathrm{tr}(T)\,1 - T`, have no negative eigenvalue.
If the mass m and points that enclose the body are known, S is also bounded from above: coordinates between l and h with
the mean 0 have a variance of at most h |l|, so that for every direction n

.. math:: n^\mathsf{T} S\, n \le m\, \max_x (n\cdot x)\, \max_x (-n\cdot x),

where x are the points relative to the centre of mass. Each known cause of a wrong tensor is undone as a repair; a cause
is listed if the repaired tensor fulfils all of this. The order is that of the sum of two logarithms: how frequent the
cause is, and how likely a body has the repaired tensor.

Source: Bhatia and Davis, American Mathematical Monthly 107 (2000) 353, for the variance; Wensing, Kim and Slotine,
IEEE Robotics and Automation Letters 3 (2018) 60, for S.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import permutations
from typing import Any, NamedTuple

import numpy as np

from kernels.free.triangle import FLATNESS_TOLERANCE
from sweeps.systems.bodies.inertia import DENSITIES, MAX_ASYMMETRY, second_moments

CAUSES = (
    "power_of_ten", "units", "about_origin", "product_sign", "one_sided", "axes_swapped", "parallel_axis_twice",
    "parallel_axis_sign", "negative", "degenerate", "mass_mismatch", "short_moment",
)  # fmt: skip
MAX_CAUSES = 4  # number of causes that are listed
MIN_MOMENT = 4 * np.finfo(float).eps  # rounding of a moment relative to the greatest one
MISSING_MOMENT = 1e-6  # moment relative to the greatest one, below which one of an impossible tensor counts as missing
MIN_FILLING = 1 / 200  # least sum of second moments relative to its bound; a uniform box has 1/3, a heavy core 1/30
USUAL_FILLING = 0.3  # second moment along an axis relative to its bound, of built bodies; a uniform box has 1/3
MIN_SQUARE = 1e-3  # second moment relative to its bound or the greatest, below which bodies count as equally flat
MIN_DENSITY = 0.1  # kg m-3, least mass relative to the box around a body, as of a frame of rods
USUAL_DENSITY = 500.0  # kg m-3, mass of built bodies relative to the box around them
MAX_SHORTAGE = 0.2  # largest relative shortage of I1 + I2 compared with I3 that counts as an inaccuracy
USUAL_SHORTAGE = 0.03  # relative change of moments by which the likelihood of an inaccuracy falls by a factor e
SHORTAGE_FACTORS = (1.0, 1.02, 1.06, 1.2, 1.5, 2.0, 3.0)  # trials in units of the least change, which gives a flat body
EXPONENTS = (-6, -5, -4, -3, -2, -1, 1, 2, 3, 4, 5, 6)  # powers of ten by which one entry may be wrong
UPPER = ((0, 0, 0, 1, 1, 2), (0, 1, 2, 1, 2, 2))  # rows and columns of ixx, ixy, ixz, iyy, iyz, izz
#: orders in which URDF, MJCF and Voigt's notation write ixx, ixy, ixz, iyy, iyz, izz, as indices of these
ENTRY_ORDERS = ([0, 1, 2, 3, 4, 5], [0, 3, 5, 1, 2, 4], [0, 3, 5, 4, 2, 1])
# unit → its factor, of units that are mistaken for kg m2, m or kg
TENSOR_UNITS = {"g m2": 1e-3, "kg cm2": 1e-4, "kg mm2": 1e-6, "g cm2": 1e-7, "g mm2": 1e-9, "lb in2": 2.9263965343e-4}
LENGTH_UNITS = {"mm": 1e-3, "cm": 1e-2, "in": 0.0254, "km": 1e3}
MASS_UNITS = {"g": 1e-3, "t": 1e3, "lb": 0.45359237}


class Evidence(NamedTuple):
    """Known properties of a body in addition to its tensor of inertia, in the axes of the tensor."""

    mass: float | None = None  #: kg
    offset: np.ndarray | None = None  #: centre of mass relative to the origin of the link, m, shape (3,)
    points: np.ndarray | None = None  #: points that enclose the body, relative to the centre of mass, m, shape (n, 3)
    rotation: np.ndarray | None = None  #: rotation matrix from the axes of the tensor to those of the link, (3, 3)


NOTHING = Evidence()


class TensorFit(NamedTuple):
    """How well a tensor fits a rigid body of known mass and size."""

    problems: tuple[str, ...]  #: violated conditions, a sentence each
    log_likelihood: float = -math.inf  #: logarithm of the relative likelihood of such a body
    is_possible: bool = False  #: False if no rigid body has the tensor


class Repair(NamedTuple):
    """A cause of a wrong tensor, undone."""

    cause: str  #: one of `CAUSES`
    text: str  #: the change, a phrase
    log_frequency: float  #: logarithm of the relative frequency of the cause in this form
    tensor: np.ndarray  #: repaired tensor, kg m2, shape (3, 3)
    evidence: Evidence | None = None  #: mass and size, if the repair changes these


class Diagnosis(NamedTuple):
    """Problems of a tensor of inertia, their possible causes, and the nearest possible body."""

    fit: TensorFit  #: its problems
    repairs: tuple[Repair, ...]  #: causes, most likely first, at most `MAX_CAUSES`
    weights: tuple[float, ...]  #: relative likelihood of each cause, 1 in all
    nearest: np.ndarray  #: nearest tensor of a rigid body, kg m2, shape (3, 3)

    @property
    def facts(self) -> dict[str, Any]:
        """The diagnosis as plain values, in SI units."""
        causes = [
            {"cause": repair.cause, "repair": repair.text, "weight": weight, **_tensor_facts(repair.tensor)}
            for repair, weight in zip(self.repairs, self.weights, strict=True)
        ]
        problems = {"possible": self.fit.is_possible, "problems": self.fit.problems}
        return problems | {"causes": causes, "nearest": _tensor_facts(self.nearest)}

    @property
    def lines(self) -> Iterator[str]:
        """The diagnosis in words."""
        yield from self.fit.problems
        for repair, weight in zip(self.repairs, self.weights, strict=True):
            yield f"{repair.cause} ({100 * weight:.0f} %): {repair.text}; I = {_format_moments(repair.tensor)}"
        if self.fit.problems and not self.repairs:
            yield "no single known cause explains this"
        if not self.fit.is_possible:
            yield f"nearest possible body (least squares of the nine entries): I = {_format_moments(self.nearest)}"


def _tensor_facts(tensor: np.ndarray) -> dict[str, list]:
    return {"tensor": tensor.tolist(), "moments": np.linalg.eigvalsh(tensor).tolist()}


def _format_moments(tensor: np.ndarray) -> str:
    return ", ".join(f"{moment:.4g}" for moment in np.linalg.eigvalsh(tensor)) + " kg m²"


def nearest_possible(tensor: np.ndarray) -> np.ndarray:
    r"""Return the tensor of a rigid body that is nearest to a 3 by 3 matrix, in the Frobenius norm of the difference.

    The possible tensors are a convex set that depends on the moments alone, so the nearest one has the principal axes
    of the symmetric part. Its moments are sums of two second moments s ≥ 0: a problem of non-negative least squares.
    """
    from scipy.optimize import nnls

    moments, axes = np.linalg.eigh((tensor + tensor.T) / 2)
    size, sums = np.abs(moments).max() or 1.0, 1.0 - np.eye(3)
    return size * (axes * (sums @ nnls(sums, moments / size)[0])) @ axes.T


def check_tensor(tensor: np.ndarray, evidence: Evidence = NOTHING) -> TensorFit:
    """Return the violated conditions of a tensor about the centre of mass, kg m2, shape (3, 3), and its likelihood."""
    if np.abs(tensor - tensor.T).max() > MAX_ASYMMETRY * np.abs(tensor).max():
        return TensorFit(("the tensor is not symmetric",))
    moments = np.linalg.eigvalsh(tensor)
    squares, directions = np.linalg.eigh(second_moments(tensor))
    if not moments[0] > MIN_MOMENT * abs(moments[2]):
        return TensorFit((f"the principal moments {_format_moments(tensor)} are not all positive",))
    if squares[0] < -FLATNESS_TOLERANCE * moments.sum():
        text = f"I1 + I2 = {moments[:2].sum():.4g} < I3 = {moments[2]:.4g} kg m²"
        return TensorFit((f"no rigid body has {text}, short by {100 * (1 - moments[:2].sum() / moments[2]):.3g} %",))
    if evidence.mass is not None and evidence.points is not None:
        return _check_size(tensor, np.hstack([directions, np.eye(3)]), evidence.mass, evidence.points)
    logarithms = np.log(np.maximum(squares / squares[2], MIN_SQUARE))
    return TensorFit((), -float(np.var(logarithms)) * 3 / 8, True)  # a standard deviation of two of each logarithm


def _check_size(tensor: np.ndarray, directions: np.ndarray, mass: float, points: np.ndarray) -> TensorFit:
    """Return the fit of a possible tensor to a mass, kg, and enclosing points, m, along principal axes and x, y, z."""
    if not mass > 0:
        return TensorFit((f"the mass {mass:.4g} kg is not positive",), is_possible=True)
    heights = points @ directions
    edges = np.ptp(points @ np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2].T, axis=0)
    bounds = np.maximum(heights.max(axis=0), 0.0) * np.maximum(-heights.min(axis=0), 0.0)
    bounds = mass * np.maximum(bounds, 1e-6 * bounds.max())  # a plate counts as 1e-3 of its length thick
    squares = np.einsum("ij,ik,kj->j", directions, second_moments(tensor), directions)
    filling, density, problems = squares / bounds, mass / (np.prod(edges) or math.inf) or USUAL_DENSITY, []
    if filling.max() > 1 + 1e-6:
        text = f"{mass:.4g} kg within this size have at most 1/{filling.max():.3g} of the second moment along"
        problems.append(f"{text} {np.round(directions[:, filling.argmax()], 3).tolist()}")
    if squares[3:].sum() < MIN_FILLING * bounds[3:].sum():
        share = 100 * math.sqrt(squares[3:].sum() / bounds[3:].sum())
        problems.append(f"the radius of gyration is {share:.2g} % of the largest within this size, unlikely small")
    if not MIN_DENSITY <= density <= DENSITIES[1]:
        problems.append(f"{mass:.4g} kg within this size have an unlikely density of {density:.3g} kg/m³")
    deviations = np.log(np.maximum(filling[:3], MIN_SQUARE) / USUAL_FILLING)
    likelihood = -0.5 * float(deviations @ deviations + (math.log(density / USUAL_DENSITY) / 2) ** 2)
    return TensorFit(tuple(problems), -math.inf if problems else likelihood, True)


@np.errstate(all="ignore")  # repairs of moments near the largest double overflow, and are passed over
def diagnose(tensor: Sequence | np.ndarray, evidence: Evidence = NOTHING) -> Diagnosis:
    """Return problems, causes and the nearest possible body of a tensor of inertia.

    Args:
        tensor: about the centre of mass, kg m2, 3 rows of 3; it may be asymmetric.
        evidence: mass, centre of mass and size, as far as known.
    """
    matrix = np.array(tensor, dtype=float)
    fit = check_tensor(matrix, evidence)
    scores: dict[str, tuple[float, Repair]] = {}
    if not fit.problems:
        return Diagnosis(fit, (), (), matrix)
    for repair in (each for each in _all_repairs(matrix, evidence) if np.isfinite(each.tensor).all()):
        score = repair.log_frequency + check_tensor(repair.tensor, repair.evidence or evidence).log_likelihood
        if score > -math.inf and (repair.cause not in scores or score > scores[repair.cause][0]):
            scores[repair.cause] = score, repair
    if not scores and not fit.is_possible and evidence.points is not None:  # the size may be wrong, too
        return diagnose(matrix, evidence._replace(points=None))
    if not matrix.any() and not scores:
        scores["degenerate"] = 0.0, Repair("degenerate", "no moment is given: mass and size are needed", 0.0, matrix)
    ranked = sorted(scores.values(), key=lambda pair: -pair[0])[:MAX_CAUSES]
    weights = np.exp([score - ranked[0][0] for score, repair in ranked])
    shares = tuple((weights / weights.sum()).tolist())
    return Diagnosis(fit, tuple(repair for score, repair in ranked), shares, nearest_possible(matrix))


def _all_repairs(tensor: np.ndarray, evidence: Evidence) -> Iterator[Repair]:
    """Yield a tensor with each known cause undone, in each of its forms."""
    mass, offset, points, rotation = evidence
    if np.abs(tensor - tensor.T).max() > MAX_ASYMMETRY * np.abs(tensor).max():
        yield from _asymmetric_repairs(tensor)
        return
    yield from _entry_repairs(tensor)
    yield from _axes_repairs(tensor)
    yield from _moment_repairs(tensor, evidence)
    if rotation is not None and not np.allclose(rotation, np.eye(3)):
        yield from _unrotated(tensor, rotation)
    if mass is not None and offset is not None:
        term = mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))
        if np.abs(term).max() > 1e-6 * np.abs(tensor).max():
            yield Repair("about_origin", "about the link's origin, not the centre of mass", -0.5, tensor - term)
            yield Repair("parallel_axis_twice", "parallel-axis term added twice", -0.75, tensor - 2 * term)
            yield Repair("parallel_axis_sign", "parallel-axis term subtracted", -1.0, tensor + term)
    if mass is not None and points is not None:
        yield from _unit_repairs(tensor, evidence, mass, points)


def _asymmetric_repairs(tensor: np.ndarray) -> Iterator[Repair]:
    """Yield the symmetric factor of the polar decomposition, the tensor if the matrix is R I or I Rᵀ.

    If entries across the diagonal differ by a sign or by powers of ten, both triangles are repairs too.
    """
    from scipy.linalg import polar
    from scipy.spatial.transform import Rotation

    upper, lower = (matrix[[0, 0, 1], [1, 2, 2]] for matrix in (tensor, tensor.T))
    if ((upper != 0) == (lower != 0)).all():
        exponents = np.log10(np.abs(upper[upper != 0] / lower[lower != 0]))
        is_sign = bool((np.abs(exponents) < 1e-3).all())
        if (np.abs(exponents - np.rint(exponents)) < 1e-3).all():
            text = f"entries across the diagonal differ by {'a sign' if is_sign else 'a power of ten'}"
            for triangle in (np.triu(tensor), np.triu(tensor.T)):
                matrix = triangle + np.triu(triangle, 1).T
                yield Repair("product_sign" if is_sign else "power_of_ten", text, 0.0, matrix)
    for side, text in (("left", "R I"), ("right", "I Rᵀ")):
        rotation, matrix = polar(tensor, side=side)
        if np.linalg.det(rotation) > 0:
            angle = math.degrees(Rotation.from_matrix(rotation).magnitude())
            text = f"{text} in place of R I Rᵀ, R by {angle:.4g}°"
            yield Repair("one_sided", text, -1.0, (matrix + matrix.T) / 2)


def _from_upper(entries: np.ndarray) -> np.ndarray:
    """Return the symmetric matrix of the entries ixx, ixy, ixz, iyy, iyz, izz."""
    return np.asarray(entries)[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]]


def _unrotated(tensor: np.ndarray, rotation: np.ndarray) -> Iterator[Repair]:
    """Yield the tensor R I Rᵀ if R I has been written; a robot file contains its upper triangle alone."""
    system = np.array([(rotation @ _from_upper(row))[UPPER] for row in np.eye(6)]).T
    if np.linalg.cond(system) < 1e6:
        matrix = rotation @ _from_upper(np.linalg.solve(system, tensor[UPPER])) @ rotation.T
        yield Repair("one_sided", "R I in place of R I Rᵀ, R the rotation of the inertial frame", -2.5, matrix)


def _entry_repairs(tensor: np.ndarray) -> Iterator[Repair]:
    """Yield a tensor with one entry scaled by a power of ten, with other signs, or its entries in another order."""
    entries = tensor[UPPER]
    for place in np.flatnonzero(entries):
        name, is_place = "i" + "xyz"[UPPER[0][place]] + "xyz"[UPPER[1][place]], np.arange(6) == place
        for exponent in EXPONENTS:
            matrix = _from_upper(np.where(is_place, 10.0**exponent * entries, entries))
            text = f"{name} times 1e{exponent} is {10.0**exponent * entries[place]:.6g}"
            yield Repair("power_of_ten", text, -3.5 - 0.15 * abs(exponent), matrix)
        if name[1] != name[2]:
            matrix = _from_upper(np.where(is_place, -entries, entries))
            yield Repair("product_sign", f"{name} with the other sign", -2.5, matrix)
    diagonal = np.diag(np.diag(tensor))
    text = "off-diagonal entries with the other sign: they are minus the products of inertia"
    yield Repair("product_sign", text, -1.0, 2 * diagonal - tensor)
    if (diagonal < 0).any():
        yield Repair("negative", "negative moments as positive", -0.5, tensor - diagonal + np.abs(diagonal))
        yield Repair("negative", "all entries with the other sign", -0.5, -tensor)


def _axes_repairs(tensor: np.ndarray) -> Iterator[Repair]:
    """Yield a tensor with its axes, its moments alone, or its six entries in another order."""
    from scipy.spatial.transform import Rotation

    for rotation in Rotation.create_group("O").as_matrix().round():
        names = ", ".join("xyz"[index] for index in np.abs(rotation).argmax(axis=1))
        if names != "x, y, z":
            yield Repair("axes_swapped", f"axes in the order {names}", -2.0, rotation @ tensor @ rotation.T)
    diagonal, entries = np.diag(tensor), tensor[UPPER]
    for moments in permutations(diagonal):
        matrix = tensor + np.diag(np.array(moments) - diagonal)
        yield Repair("axes_swapped", "moments in another order", -3.0, matrix)
    for order, written in permutations(ENTRY_ORDERS, 2):
        matrix = _from_upper(entries[written][np.argsort(order)])
        yield Repair("axes_swapped", "six entries in another order (of URDF, MJCF or Voigt)", -3.0, matrix)


def _moment_repairs(tensor: np.ndarray, evidence: Evidence) -> Iterator[Repair]:
    """Yield a tensor with two moments that were a few per cent short, and the body in place of a degenerate tensor."""
    moments, axes = np.linalg.eigh(tensor)
    largest, sum_of_two = np.abs(moments).max(), moments[:2].sum()
    if moments[0] > 0 and 0 < (shortage := 1 - sum_of_two / moments[2]) <= MAX_SHORTAGE:
        for change in np.array(SHORTAGE_FACTORS) * shortage / (1 - shortage):
            matrix = (axes * (moments * [1 + change, 1 + change, 1])) @ axes.T
            text = f"I1 + I2 short by {100 * shortage:.3g} %: both raised by {100 * change:.3g} %"
            yield Repair("short_moment", text, -0.5 - change / USUAL_SHORTAGE, (matrix + matrix.T) / 2)
    is_placeholder = largest > 0 and np.ptp(moments) == 0 and math.log10(largest).is_integer()
    if np.abs(moments).min() <= MISSING_MOMENT * largest or is_placeholder:
        matrix, text = nearest_possible(tensor), "a moment is missing: the nearest possible body"
        if evidence.mass is not None and evidence.points is not None:
            squares = np.ptp(evidence.points, axis=0) ** 2
            matrix = evidence.mass / 12 * np.diag(squares.sum() - squares)
            text = "a placeholder: a uniform box of this mass and size"
        yield Repair("degenerate", text, 0.0, matrix)


def _unit_repairs(tensor: np.ndarray, evidence: Evidence, mass: float, points: np.ndarray) -> Iterator[Repair]:
    """Yield a tensor, a size and a mass in another unit, and the mass that fits tensor and size best."""
    for unit, factor in TENSOR_UNITS.items():
        yield Repair("units", f"a tensor in {unit}", -2.0, factor * tensor)
        yield Repair("units", f"a tensor divided by {1 / factor:.4g} as from {unit}", -3.0, tensor / factor)
    for unit, factor in LENGTH_UNITS.items():
        yield Repair("units", f"a size in {unit}", -3.0, tensor, evidence._replace(points=factor * points))
    bound = USUAL_FILLING * (points.max(axis=0) * -points.min(axis=0)).sum()
    masses = [factor * mass for factor in MASS_UNITS.values()] + [mass / factor for factor in MASS_UNITS.values()]
    for number, fitting in enumerate([*masses, np.trace(second_moments(tensor)) / (bound or math.inf)]):
        log_frequency = -2.0 if number < len(masses) else -4.0
        text = f"a mass of {fitting:.4g} kg"
        yield Repair("mass_mismatch", text, log_frequency, tensor, evidence._replace(mass=float(fitting)))
