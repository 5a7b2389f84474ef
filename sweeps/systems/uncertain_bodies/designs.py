"""Draws of standard normals in independent replicates, each evenly spread, so that errors come from the draws alone.

n draws are R replicates of 2^k, 16 ≤ R ≤ 32: each is a Sobol sequence scrambled by itself (Owen's kind, as SciPy has
it), a Latin hypercube, or plain random numbers. Replicates are independent and each is unbiased: the scatter of R
estimates is an honest standard error, whatever the function, where the formula of plain draws would tell too much.

Source: Owen, "Quasi-Monte Carlo sampling" (SIGGRAPH 2003 course); `scipy.stats.qmc`.
"""

import math
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache

import numpy as np

METHODS = ("sobol", "latin", "random")
LEAST, MOST = 64, 4 * 10**6  # draws: of more, a tensor's would take more than a gigabyte
REPLICATES = 16  # at least; fewer than twice as many, and one
NORMAL_95 = 1.959963984540054  # standard deviations on either side that hold 95 % of a normal distribution
HALF_CELL = 2.0**-31  # of SciPy's Sobol numbers, multiples of 2^-30: no draw lies at infinity
INSIDE = (2.0**-54, 1.0 - 2.0**-53)  # where other uniform numbers are kept, for the same reason

Groups = tuple[tuple[int, ...], ...]  # columns of each input


def replicates(draws: int) -> tuple[int, int]:
    """Return the number of replicates and of draws in each: at least `draws` in all, at most a sixteenth more."""
    size = 2 ** int(math.log2(draws / REPLICATES))
    return -(-draws // size), size


def made(draws: int) -> int:
    """Return the number of draws that are made for a requested number."""
    return math.prod(replicates(draws))


@lru_cache(maxsize=4)
def normals(method: str, dimension: int, draws: int, seed: int, stream: int = 0, threads: int = 1) -> np.ndarray:
    """Return standard normals, independent between columns, shape (replicates, size, dimension); not to be written to.

    The method is one of `METHODS`, the number of draws that which is requested, `stream` one of several independent
    sets of the seed.
    """
    from scipy.special import ndtri

    count, size = replicates(draws)
    numbers = np.empty((count, size, dimension))

    def fill(row, seed):
        ndtri(_uniforms(method, dimension, size, np.random.default_rng(seed)), out=row)

    with ThreadPoolExecutor(threads) as pool:
        list((pool.map if threads > 1 else map)(fill, numbers, np.random.SeedSequence([seed, stream]).spawn(count)))
    numbers.flags.writeable = False
    return numbers


def _uniforms(method: str, dimension: int, size: int, rng: np.random.Generator) -> np.ndarray:
    if method == "random":
        return np.clip(rng.random((size, dimension)), *INSIDE)
    from scipy.stats import qmc

    if method == "sobol":
        return qmc.Sobol(dimension, rng=rng).random(size) + HALF_CELL
    return np.clip(qmc.LatinHypercube(dimension, rng=rng).random(size), *INSIDE)


# -- estimates and their standard errors


def mean(parts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean over replicates, the first dimension, and its standard error."""
    return parts.mean(axis=0), parts.std(axis=0, ddof=1) / math.sqrt(len(parts))


def share(parts: np.ndarray, draws: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a probability from the replicates' shares, and its standard error.

    The error is never below the one draw that would change the share. Where all replicates agree, as with no hit or no
    miss, their scatter says nothing: there it is the far end of Wilson's interval of 95 %, over 1.96.
    """
    value, error = mean(parts)
    return value, np.where(error > 0.0, np.hypot(error, 1.0 / draws), wilson_end(draws) / NORMAL_95)


def wilson_end(draws: int) -> float:
    """Return the upper end of Wilson's interval of 95 % for no hit in so many draws (1 - that for no miss).

    Source: Wilson (1927), Journal of the American Statistical Association 22, 209; z^2/(n + z^2) where no draw hits.
    """
    return NORMAL_95**2 / (draws + NORMAL_95**2)


def quantiles(values: np.ndarray, levels: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return quantiles over all draws, and their standard errors from the replicates; infinities are kept.

    Returns:
        Quantiles (the draw at or next above the level), and errors: NaN where a replicate's own is infinite.
    """
    with np.errstate(invalid="ignore"):
        of_replicates = np.stack([_order_statistics(row, levels) for row in values])
        spread = of_replicates.std(axis=0, ddof=1) / math.sqrt(len(values))
    return _order_statistics(values.reshape(-1), levels), spread


def _order_statistics(values: np.ndarray, levels: tuple[float, ...]) -> np.ndarray:
    places = [min(values.size - 1, max(0, math.ceil(level * values.size) - 1)) for level in levels]
    return np.partition(values, places)[places]


# -- which input matters


def sobol_indices(
    function: Callable, groups: Groups, draws: int, seed: int, method: str = "sobol", run: Callable = map
) -> dict[str, np.ndarray]:
    r"""Estimate first-order and total Sobol indices of a function of independent standard normals (Saltelli's design).

    .. math:: S_i = \frac{E[f(B)(f(A_B^i) - f(A))]}{V}, \qquad T_i = \frac{E[(f(A) - f(A_B^i))^2]}{2V}

    A and B are two independent sets of draws, A_B^i is A with the columns of group i from B, V the variance of f. Each
    is a ratio of means over replicates, with the standard error of a ratio estimate.

    Args:
        function: draws, shape (n, dimension) → values, shape (n,) or (n, outputs).
        groups: columns of each input; inputs that depend on each other share a group.
        draws: in A, and in B.
        seed: whole, ≥ 0.
        method: one of `METHODS`.
        run: `map`, or one that calls the function side by side.

    Returns:
        first, first_error, total, total_error, each of shape (groups,) or (groups, outputs); NaN where nothing varies.

    Source: Saltelli et al. (2010), Computer Physics Communications 181, 259: equations (b) and (f) of table 2.
    """
    dimension = sum(map(len, groups))
    both = normals(method, 2 * dimension, draws, seed, stream=1)
    A, B = both[..., :dimension].reshape(-1, dimension), both[..., dimension:].reshape(-1, dimension)
    fA, fB, *fM = map(np.asarray, run(function, _saltelli(A, B, groups)))
    centre = (fA.mean(axis=0) + fB.mean(axis=0)) / 2
    fA, fB = fA - centre, fB - centre
    shape = (*both.shape[:2], *fA.shape[1:])
    variance = ((fA**2 + fB**2) / 2).reshape(shape).mean(axis=1)
    indices = {name: [] for name in ("first", "first_error", "total", "total_error")}
    for values in fM:
        mixed = values - centre
        for name, terms in (("first", fB * (mixed - fA)), ("total", (fA - mixed) ** 2 / 2)):
            value, error = _ratio(terms.reshape(shape).mean(axis=1), variance)
            indices[name].append(value)
            indices[f"{name}_error"].append(error)
    return {name: np.stack(values) for name, values in indices.items()}


def _saltelli(A: np.ndarray, B: np.ndarray, groups: Groups) -> Iterator[np.ndarray]:
    """Yield A, B, and A with the columns of one group after the other from B."""
    yield from (A, B)
    for group in groups:
        yield np.where(np.isin(np.arange(A.shape[1]), group), B, A)


def _ratio(above: np.ndarray, below: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return ratio of two means over replicates and its standard error, to first order."""
    with np.errstate(invalid="ignore", divide="ignore"):
        value = above.mean(axis=0) / below.mean(axis=0)
        error = (above - value * below).std(axis=0, ddof=1) / (below.mean(axis=0) * math.sqrt(len(above)))
    return value, error
