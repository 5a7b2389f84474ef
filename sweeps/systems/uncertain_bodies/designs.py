"""Sampling designs: standard normals in independent, evenly distributed replicates, whose scatter gives errors.

n draws are R replicates of 2^k, 16 ≤ R ≤ 32: each is a Sobol sequence with its own scrambling (Owen's, by SciPy), a
Latin hypercube, or plain random numbers. Replicates are independent and unbiased: the scatter of R estimates is a valid
standard error for any function, while the formula for plain draws would be too large.

Source: Owen, "Quasi-Monte Carlo sampling" (SIGGRAPH 2003 course); `scipy.stats.qmc`.
"""

import math
from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import Annotated

import numpy as np

from sweeps.schema.values import choice, integer

QUANTILES = (0.01, 0.05, 0.5, 0.95, 0.99)
METHODS = ("sobol", "latin", "random")
MIN_DRAWS, MAX_DRAWS = 64, 4 * 10**6  # number of draws; more draws of a tensor would take more than a gigabyte
MIN_REPLICATES = 16  # least number of replicates, enough for a standard error; the largest is twice this number
MAX_DOUBT = 0.01  # probability below which (or above its complement) a regime is certain
NORMAL_95 = 1.959963984540054  # standard deviations; a normal distribution has 95 % of its probability within them
HALF_CELL = 2.0**-31  # half the spacing of SciPy's Sobol numbers; added, so that no normal is infinite
UNIFORM_BOUNDS = (2.0**-54, 1.0 - 2.0**-53)  # bounds on all further uniform numbers, for the same reason

Draws = Annotated[int, integer(MIN_DRAWS, MAX_DRAWS, f"a whole number from {MIN_DRAWS} to {MAX_DRAWS:,}")]
Seed = Annotated[int, integer(0, 2**63 - 1, "a whole number, 0 or more")]
Method = Annotated[str, choice(METHODS)]
Groups = tuple[tuple[int, ...], ...]  # the columns of normals of each input


def replicates(draws: int) -> tuple[int, int]:
    """Return the number of replicates and of draws in each: at least `draws` in all, at most a sixteenth more."""
    size = 2 ** int(math.log2(draws / MIN_REPLICATES))
    return -(-draws // size), size


def count_draws(draws: int) -> int:
    """Return the actual number of draws for a requested number."""
    return math.prod(replicates(draws))


@lru_cache(maxsize=4)
def normals(method: str, dimension: int, draws: int, seed: int, stream: int = 0) -> np.ndarray:
    """Return standard normals, independent between columns, shape (replicates, size, dimension), read-only.

    Args:
        method: a name in `METHODS`.
        dimension: number of columns.
        draws: requested number of draws.
        seed: seed of the random numbers.
        stream: number of an independent set of the seed.
    """
    numbers = np.stack(list(iterate_normals(method, dimension, draws, seed, stream)))
    numbers.flags.writeable = False
    return numbers


def iterate_normals(method: str, dimension: int, draws: int, seed: int, stream: int = 0) -> Iterator[np.ndarray]:
    """Yield the replicates of `normals`, shape (size, dimension), one at a time."""
    from scipy.special import ndtri

    count, size = replicates(draws)
    for sequence in np.random.SeedSequence([seed, stream]).spawn(count):
        yield ndtri(_uniforms(method, dimension, size, np.random.default_rng(sequence)))


def _uniforms(method: str, dimension: int, size: int, rng: np.random.Generator) -> np.ndarray:
    """Return uniform samples inside (0, 1), shape (size, dimension), by the method sobol, latin or random."""
    if method == "random":
        return np.clip(rng.random((size, dimension)), *UNIFORM_BOUNDS)
    from scipy.stats import qmc

    if method == "sobol":
        return qmc.Sobol(dimension, rng=rng).random(size) + HALF_CELL
    return np.clip(qmc.LatinHypercube(dimension, rng=rng).random(size), *UNIFORM_BOUNDS)


# -- estimates and their standard errors


def log_normal_factors(deviation: float, normals: np.ndarray) -> np.ndarray:
    """Return log-normal factors of mean 1 and a relative standard deviation, from standard normals."""
    variance = math.log1p(deviation**2)
    return np.exp(math.sqrt(variance) * normals - variance / 2)


def mean(estimates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean over replicates, the first dimension, and its standard error."""
    return estimates.mean(axis=0), estimates.std(axis=0, ddof=1) / math.sqrt(len(estimates))


def probability(fractions: np.ndarray, draws: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a probability from the replicates' fractions, and its standard error.

    The error is at least 1/draws. If all replicates agree, for instance without a hit, their scatter is 0, and the
    error is the far end of Wilson's 95 % interval, over 1.96.
    """
    value, error = mean(fractions)
    return value, np.where(error > 0.0, np.hypot(error, 1.0 / draws), wilson_end(draws) / NORMAL_95)


def wilson_end(draws: int) -> float:
    """Return the upper end of Wilson's 95 % interval without a hit (1 - this without a miss).

    Source: Wilson (1927), Journal of the American Statistical Association 22, 209; z^2/(n + z^2) without a hit.
    """
    return NORMAL_95**2 / (draws + NORMAL_95**2)


def format_probability(value: float, error: float, draws: int, is_percent: bool = False) -> str:
    """Return a probability with its standard error, "= 0.4758 ± 0.0009"; of no hit or no miss, its bound."""
    scale, unit = (100, " %") if is_percent else (1, "")
    if value in (0.0, 1.0):  # the opposite end of the interval of 95 %
        bound = scale * wilson_end(draws)
        digits = 2 - math.floor(math.log10(bound))
        return f"< {bound:.2g}{unit} (95 %)" if value == 0.0 else f"> {scale - bound:.{digits}g}{unit} (95 %)"
    digits = max(0 if is_percent else 2, 1 - math.floor(math.log10(scale * error)))
    return f"= {scale * value:.{digits}f}{unit} ± {scale * error:.{digits}f}{unit}"


def quantiles(values: np.ndarray, levels: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return quantiles over all draws, and their standard errors from the replicates; infinities are kept.

    Returns:
        Quantiles (the draw at or next above the level), and errors, NaN if the quantile of a replicate is infinite.
    """
    with np.errstate(invalid="ignore"):
        replicate_quantiles = np.stack([_order_statistics(row, levels) for row in values])
        spread = replicate_quantiles.std(axis=0, ddof=1) / math.sqrt(len(values))
    return _order_statistics(values.reshape(-1), levels), spread


def _order_statistics(values: np.ndarray, levels: tuple[float, ...]) -> np.ndarray:
    places = [min(values.size - 1, max(0, math.ceil(level * values.size) - 1)) for level in levels]
    return np.partition(values, places)[places]


# -- sensitivities


def sobol_indices(
    function: Callable, groups: Groups, draws: int, seed: int, method: str = "sobol", run: Callable = map
) -> dict[str, np.ndarray]:
    r"""Estimate first-order and total Sobol indices of a function of independent standard normals (Saltelli's design).

    .. math:: S_i = \frac{E[f(B)(f(A_B^i) - f(A))]}{V}, \qquad T_i = \frac{E[(f(A) - f(A_B^i))^2]}{2V}

    A and B are two independent sets of draws, A_B^i is A with the columns of group i from B, V the variance of f. Each
    index is a ratio of means over replicates, with the standard error of a ratio estimate.

    Args:
        function: draws, shape (n, dimension) → values, shape (n,) or (n, outputs).
        groups: columns of each input; dependent inputs share a group.
        draws: number of draws in A, and in B.
        seed: seed of the random numbers, an integer ≥ 0.
        method: a name in `METHODS`.
        run: `map`, or a parallel one.

    Returns:
        first, first_error, total, total_error, each of shape (groups,) or (groups, outputs); NaN if f is constant.

    Source: Saltelli et al. (2010), Computer Physics Communications 181, 259: equations (b) and (f) of table 2.
    """
    dimension = sum(map(len, groups))
    normals_AB = normals(method, 2 * dimension, draws, seed, stream=1)
    A, B = normals_AB[..., :dimension].reshape(-1, dimension), normals_AB[..., dimension:].reshape(-1, dimension)
    fA, fB, *fM = map(np.asarray, run(function, _saltelli(A, B, groups)))
    centre = (fA.mean(axis=0) + fB.mean(axis=0)) / 2
    fA, fB = fA - centre, fB - centre
    shape = (*normals_AB.shape[:2], *fA.shape[1:])
    variance = ((fA**2 + fB**2) / 2).reshape(shape).mean(axis=1)
    indices: dict[str, list] = {name: [] for name in ("first", "first_error", "total", "total_error")}
    for values in fM:
        f_AB = values - centre
        for name, terms in (("first", fB * (f_AB - fA)), ("total", (fA - f_AB) ** 2 / 2)):
            value, error = _ratio(terms.reshape(shape).mean(axis=1), variance)
            indices[name].append(value)
            indices[f"{name}_error"].append(error)
    return {name: np.stack(values) for name, values in indices.items()}


def _saltelli(A: np.ndarray, B: np.ndarray, groups: Groups) -> Iterator[np.ndarray]:
    """Yield A, B, and for each group A with the group's columns from B."""
    yield from (A, B)
    for group in groups:
        yield np.where(np.isin(np.arange(A.shape[1]), group), B, A)


def _ratio(numerator: np.ndarray, denominator: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the ratio of two means over replicates and its standard error, to first order."""
    with np.errstate(invalid="ignore", divide="ignore"):
        value = numerator.mean(axis=0) / denominator.mean(axis=0)
        error = (numerator - value * denominator).std(axis=0, ddof=1) / (
            denominator.mean(axis=0) * math.sqrt(len(numerator))
        )
    return value, error
