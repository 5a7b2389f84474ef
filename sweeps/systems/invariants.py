r"""Smooth invariants of described systems: functions of columns that vanish where a regime changes.

They are smooth in the parameters also where eigenvalues or multipliers meet, so that their zeros are found to rounding:

* one mode: Ω²;
* eigenvalues in pairs ±μ, with κ = μ²: :math:`\prod κ`, its derivative by κ (a double zero), and the discriminant
  :math:`\prod(κ_i - κ_j)^2`;
* all further eigenvalues: the largest real part, and :math:`(μ_1 - μ_2)^2` of the two that grow fastest;
* multipliers in pairs μ, 1/μ: det(M ∓ 1), with their derivatives by s = μ + 1/μ, and Krein's discriminant;
* all further multipliers: the growth in a period.

Source: Seyranian and Mailybaev, Multiparameter Stability Theory with Mechanical Applications (2003).
"""

from abc import abstractmethod
from collections.abc import Callable, Mapping
from typing import ClassVar, NamedTuple

import numpy as np

from sweeps.systems.system import Dynamics

MAX_ODD_SUM = 1e-9  # odd power sums of eigenvalues over the rate scale, below which eigenvalues come in pairs ±μ
MAX_RECIPROCITY_RESIDUAL = 1e-9  # residual of the multipliers' pairs; damped multipliers differ by more on a line

Columns = Mapping[str, np.ndarray]


class Invariant(NamedTuple):
    """An invariant of points, or several, shape (invariants, points): by linear theory, as measured, with its error."""

    theory: np.ndarray
    measured: np.ndarray
    error: np.ndarray


class SpectralSystem(Dynamics):
    """A system with eigenvalues, modes or multipliers at each point, and invariants that vanish at changes."""

    modes_are_separate: ClassVar[bool] = False  #: True if each mode of a point has a regime of its own
    num_jumping_invariants: ClassVar[int] = 0  #: number of the last invariants, which jump and have no extremum there
    #: regime that begins → kind of the change; with pairs of multipliers flutter begins by Krein's collision
    change_kinds: Mapping[str, str] = {"unstable": "divergence", "flutter": "flutter"}
    paired_change_kinds: Mapping[str, str] = {}

    @abstractmethod
    def has_pairs(self, columns: Columns) -> np.ndarray:
        """Return True for points with eigenvalues in pairs ±μ, or multipliers in pairs μ, 1/μ, by rounding."""

    @abstractmethod
    def invariants(self, columns: Columns, has_pairs: np.ndarray) -> Invariant:
        """Return the invariants of points; those that decide nothing there are NaN. See `sweeps.systems.invariants`.

        Args:
            columns: of points, with the eigenvalues or multipliers of each.
            has_pairs: True for points on lines of points with pairs.
        """

    @abstractmethod
    def critical_modes(self, columns: Columns) -> tuple[np.ndarray, np.ndarray]:
        """Return number and frequency (rad s-1) of the mode of each point that grows fastest, by linear theory."""


def stack(paired: list[Invariant], unpaired: list[Invariant], has_pairs: np.ndarray) -> Invariant:
    """Return invariants in one; those for pairs, and those without, are NaN at all other points."""
    is_used = [has_pairs] * len(paired) + [~has_pairs] * len(unpaired)
    return Invariant(*(np.where(is_used, np.array(rows), np.nan) for rows in zip(*paired, *unpaired, strict=True)))


def of_column(columns: Columns, name: str, factor: float = 1.0, addition: float = 0.0) -> Invariant:
    """Return a column times a factor, and an addition to it, as an invariant."""
    theory, measured = (addition + factor * columns[name + suffix] for suffix in ("_theory", ""))
    return Invariant(theory, measured, np.abs(factor) * columns[f"{name}_error"])


# -- multipliers


def of_multipliers(columns: Columns) -> list[Invariant]:
    """Return the invariants of multipliers in pairs; none of more than four multipliers.

    Some points may have two multipliers, and the map's further ones be missing there.
    """
    of_two = [of_column(columns, "trace", sign, 2.0) for sign in (-1.0, 1.0)]  # det(M - 1) and det(M + 1)
    if "krein_discriminant" in columns:
        names = ("det_minus_identity", "det_plus_identity", "krein_discriminant")
        double_zeros = [of_column(columns, "first_invariant", sign, 4.0) for sign in (-1.0, 1.0)]
        of_four = [*(of_column(columns, name) for name in names), *double_zeros]
        has_two = np.isnan(columns["multiplier_real_theory"][:, 2:]).all(axis=1)
        pairs = zip(of_two, of_four, strict=False)
        return [Invariant(*(np.where(has_two, x, y) for x, y in zip(*pair, strict=True))) for pair in pairs] + of_four[
            2:
        ]
    return of_two if columns["multiplier_real"].shape[1] == 2 else []


# -- eigenvalues


def eigenvalues(columns: Columns, suffix: str = "_theory") -> np.ndarray:
    """Return the eigenvalues of points, complex, shape (points, n), over the rate scale."""
    scale = np.where(columns["rate_scale"] > 0.0, columns["rate_scale"], np.nan)
    return (columns[f"eigenvalue_real{suffix}"] + 1j * columns[f"eigenvalue_imag{suffix}"]) / scale[:, None]


def odd_power_sums(columns: Columns) -> np.ndarray:
    """Return the largest odd power sum of the eigenvalues of each point; all are 0 if eigenvalues come in pairs ±μ."""
    values = eigenvalues(columns)
    return np.max([np.abs((values**power).sum(axis=1)) for power in range(1, values.shape[1] + 1, 2)], axis=0)


def of_paired_eigenvalues(columns: Columns) -> list[Invariant]:
    """Return the invariants of eigenvalues in pairs ±μ."""
    if "discriminant" in columns:
        return [of_column(columns, name) for name in ("product_of_squares", "discriminant", "sum_of_squares")]

    def product(values):
        return (values[:, -(values.shape[1] // 2) :] ** 2).prod(axis=1)

    def discriminant(values):
        squares = values[:, -(values.shape[1] // 2) :] ** 2
        first, second = np.triu_indices(squares.shape[1], 1)
        return ((squares[:, first] - squares[:, second]) ** 2).prod(axis=1)

    return [_of_function(columns, product), _of_function(columns, discriminant)]


def squared_difference(columns: Columns) -> Invariant:
    """Return the squared difference of the two eigenvalues that grow fastest: negative for a complex pair."""
    if columns["eigenvalue_real"].shape[1] < 2:
        return Invariant(*np.full((3, len(columns["status"])), np.nan))

    def square(values):
        fastest = np.argsort(-values.real, axis=1, kind="stable")[:, :2]
        pair = np.take_along_axis(values, fastest, axis=1)
        return (pair[:, 0] - pair[:, 1]) ** 2

    return _of_function(columns, square)


def _of_function(columns: Columns, function: Callable[[np.ndarray], np.ndarray]) -> Invariant:
    """Return the invariant of a function of the eigenvalues over the rate scale; its error adds up their shifts."""
    measured = eigenvalues(columns, "")
    errors = (
        np.hypot(columns["eigenvalue_real_error"], columns["eigenvalue_imag_error"]) / columns["rate_scale"][:, None]
    )
    value, error = function(measured), np.zeros(len(measured))
    for column in range(measured.shape[1]):
        shift = np.zeros(measured.shape)
        shift[:, column] = errors[:, column]
        changes = [np.abs(function(measured + unit * shift) - value) for unit in (1.0, -1.0, 1.0j, -1.0j)]
        error += np.max(changes, axis=0)
    return Invariant(function(eigenvalues(columns)).real, value.real, error)


def fastest_mode(growth: np.ndarray, frequency: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return number (from 1) and frequency of each point's mode that grows fastest; arguments of shape (points, n)."""
    fastest = np.nan_to_num(np.where(frequency >= 0.0, growth, -np.inf), nan=-np.inf).argmax(axis=1)
    return fastest + 1, np.take_along_axis(np.abs(frequency), fastest[:, None], axis=1)[:, 0]
