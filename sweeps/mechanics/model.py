"""Points of a system in, columns out: linear theory beside what is measured, which does not know it."""

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from kernels import measure, statuses
from kernels import oscillations as kernel
from kernels.blocks import W
from kernels.runs import Runs, Sampling
from sweeps.mechanics import equilibria, modes, scales
from sweeps.mechanics.degenerate import Degenerate
from sweeps.mechanics.derivation import derive
from sweeps.mechanics.description import System
from sweeps.mechanics.first_order import code
from sweeps.mechanics.landscape import Landscape
from sweeps.mechanics.problem import changed
from sweeps.mechanics.taylor import Code

CHUNK = 16384
EVEN = 1e-9  # third derivatives smaller than this, in the system's own units, make no second run
FINE = 0.05  # of 1/S: a step of a motion that goes far
LEAST_SHARE = 1e-6  # of a nudge: a mode with less of it is left to rounding and to the others' cubes


class Model:
    """A system's equations, its generated kernel, and what it makes of points.

    Args:
        system: the description.

    Raises:
        DescriptionError: for what is wrong with it.
    """

    def __init__(self, system: System):
        self.system = system
        self.equations = derive(system)
        self.n = self.equations.n
        self.names = tuple(system.parameters)

    @cached_property
    def landscape(self) -> Landscape:
        """V's derivatives and a_ij, in NumPy."""
        return Landscape(self.equations)

    @cached_property
    def code(self) -> Code:
        """The generated kernel."""
        return code(self.equations)

    @cached_property
    def degenerate(self) -> Degenerate:
        """V's higher terms, of a system of one coordinate."""
        return Degenerate(self.equations)

    def equilibria(self, parameters: list[np.ndarray]) -> equilibria.Found:
        """All equilibria of points, of which each parameter's values are given."""
        return equilibria.find(self.landscape, parameters)

    # -- theory

    def theory(self, points: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """What linear theory says of points.

        Args:
            points: each parameter, `equilibrium` (slot from 0), `mode` (from 1), `epsilon`, `phase`: shape (points,).

        Returns:
            `place` (points, n), `flat`, `crowded`, `certified`, `decided`, `omega_squared` (s-2), `modes` (points, n,
            n), `a` (points, n, n), `terms` (points, n, n), `sizes` (points, n), `scale` (s-1), `uncertain` (by how much
            rounding of the place moves ω², over S²), `parameters` (a list of arrays); NaN where there is no
            equilibrium.
        """
        rows = len(points["equilibrium"])
        parameters = [np.asarray(points[name], dtype=np.float64) for name in self.names] or [np.zeros(rows)]
        first, inverse = _runs(parameters, len(points["equilibrium"]))
        found = self.equilibria([p[first] for p in parameters])
        slot = np.asarray(points["equilibrium"])
        group, back = _runs([inverse, slot])
        chosen, place = [p[group] for p in parameters], found.places[inverse[group], slot[group]]
        linear = self._linear(chosen, place)
        linear = {name: array[back] for name, array in linear.items()}
        mode = np.asarray(points["mode"]) - 1
        squares, uncertain = (
            np.take_along_axis(linear.pop(name), mode[:, None], axis=1)[:, 0] for name in ("squares", "uncertain")
        )
        return linear | {
            "place": place[back],
            "flat": found.flat[inverse],
            "crowded": found.crowded[inverse],
            "certified": found.certified[inverse],
            "decided": found.decided[inverse],
            "omega_squared": squares,
            "uncertain": uncertain,
            "parameters": parameters,
        }

    def _linear(self, parameters, place):
        q, nowhere = list(place.T), np.isnan(place).any(axis=1)
        with np.errstate(all="ignore"):
            hessian, a = self.landscape.hessian(parameters, q), self.landscape.a(parameters, q)
            terms = self.landscape.hessian_terms(parameters, q)
            for matrix in (hessian, a, terms):
                matrix[nowhere] = np.nan  # where V″ is constant too
            sizes = scales.sizes(self.landscape, parameters, place, terms)
            terms, vanished = scales.bounding_terms(self.landscape, parameters, place, terms, sizes)
            hessian[vanished] = 0.0  # a place is known to a rounding, and V″ there to no better
            third = self._third(parameters, q)
            error = self.landscape.place_error(parameters, place)
        squares, vectors = modes.normal_modes(hessian, a)
        S = modes.scale(terms, a)
        pulled, heavier = (
            changed(lambda x, matrix=matrix: matrix(parameters, list(x.T)), place, error)
            for matrix in (self.landscape.hessian, self.landscape.a)
        )
        changes = pulled / (S * S)[:, None, None] + heavier
        uncertain = np.nan_to_num(np.einsum("pik,pij,pjk->pk", np.abs(vectors), changes, np.abs(vectors)))
        # in units of the sizes: V‴ beside V″, a' beside a
        unit = sizes.max(axis=1, initial=0.0)
        count = third.shape[1] - self._first_of_a
        with np.errstate(all="ignore"):
            cubic = third[:, : self._first_of_a].max(axis=1, initial=0.0) * unit / np.abs(terms).max(axis=(1, 2))
            bent = third[:, -count:].max(axis=1, initial=0.0) * unit / np.abs(a).max(axis=(1, 2)) if count else 0.0
        twice = ~(np.maximum(np.nan_to_num(cubic), bent) <= EVEN)
        linear = {"squares": squares, "modes": vectors, "a": a, "scale": S, "sizes": sizes, "twice": twice}
        return linear | {"terms": terms, "positive": modes.positive(a), "uncertain": uncertain}

    def _third(self, parameters, q):
        third = self.landscape.third(parameters, q)
        return np.abs(np.stack(third, axis=-1)) if third else np.full((len(q[0]), self._first_of_a), np.inf)

    @property
    def _first_of_a(self):
        n = self.n
        return n * (n + 1) * (n + 2) // 6

    # -- motion

    def measured(self, points, theory, cycles: float, samples_per_cycle: int, tolerance: float, direction=None):
        """What motions show of points; of theory only places, modes (as directions) and the scale are used.

        Args:
            points: as of :meth:`theory`.
            theory: what it returned.
            cycles: length of the run, in 2π/S.
            samples_per_cycle: samples in 2π/S; the spacing is 0.5/S at most.
            tolerance: relative error allowed.
            direction: of the nudge, one number a coordinate; None nudges along the mode.

        Returns:
            `raw` (points, len(kernel.RAW)), `status` (int8), `intervals`, `spacing`, `reach` (the signed size of the
            mode's part of the nudge, relative to the whole) and `share` (of the norm that the kinetic matrix makes).
        """
        intervals, spacing = round(cycles * samples_per_cycle), min(2.0 * np.pi / samples_per_cycle, 0.5)
        size = len(points["epsilon"])
        raw, status = np.full((size, len(kernel.RAW)), np.nan), np.full(size, statuses.NO_EQUILIBRIUM, dtype=np.int8)
        here = ~np.isnan(theory["place"]).any(axis=1)
        status[theory["flat"]], status[theory["crowded"]] = statuses.FLAT, statuses.TOO_MANY_EQUILIBRIA
        unsound = here & ~np.isfinite(theory["scale"] * theory["modes"].sum(axis=(1, 2)))
        unbound = np.where(theory["positive"], statuses.NON_FINITE, statuses.KINETIC_ENERGY_NOT_POSITIVE)
        status[unsound] = unbound[unsound]
        wide = self._too_wide(points, theory, np.flatnonzero(here & ~unsound))
        status[wide], unsound[wide] = statuses.PERTURBATION_TOO_LARGE, True
        which = np.flatnonzero(here & ~unsound)
        reach, share = np.ones(size), np.ones(size)
        for start in range(0, which.size, CHUNK):
            part = which[start : start + CHUNK]
            nudge = self._nudge(points, theory, part, direction)
            reach[part], share[part] = nudge["reach"], np.maximum(nudge["start"], LEAST_SHARE)
            nudged = nudge["start"] >= LEAST_SHARE
            status[part[~nudged]] = statuses.NOT_PERTURBED
            if not nudged.all():
                part, nudge = part[nudged], {name: values[nudged] for name, values in nudge.items()}
            raw[part] = self._run(points, theory, part, nudge, Sampling(intervals, spacing, tolerance))
            status[part] = kernel.status(raw[part], intervals, tolerance, spacing)
        wide = (status == statuses.OK) & kernel.is_too_wide(raw, theory["scale"], spacing)
        raw[wide], status[wide] = np.nan, statuses.PERTURBATION_TOO_LARGE
        found = {"raw": raw, "status": status, "intervals": intervals, "spacing": spacing}
        return found | {"reach": reach, "share": share}

    def _too_wide(self, points, theory, which):
        """The points, of those given, whose nudge leaves the neighbourhood of their place."""
        epsilon = np.asarray(points["epsilon"], dtype=np.float64)[which]
        chosen = [p[which] for p in theory["parameters"]]
        nudge = epsilon[:, None] * theory["sizes"][which]
        return which[scales.too_wide(self.landscape, chosen, theory["place"][which], theory["terms"][which], nudge)]

    def _nudge(self, points, theory, part, direction):
        """The nudge of relative size one and how modes see it.

        Returns:
            `along` (points, n); `projection` (points, n, n) to the modes' shares of it, the point's own first;
            `start`, the size of its own share; `reach`, the signed relative size of its part; `allowed`.
        """
        a, sizes = theory["a"][part], theory["sizes"][part]
        vectors = self._nudged_first(theory["modes"][part], np.asarray(points["mode"])[part] - 1)
        own = vectors[:, :, 0]
        unit = 1.0 / np.abs(own / sizes).max(axis=1)
        one = np.ones(part.size)
        if direction is None:
            projection = np.einsum("pjk,pji->pki", vectors, a) / unit[:, None, None]
            along = own * unit[:, None]
            return {"along": along, "projection": projection, "start": one, "reach": one, "allowed": 0.0 * one}
        along = np.asarray(direction, dtype=np.float64) / np.abs(direction).max()
        along = along / np.abs(along / sizes).max(axis=1)[:, None]
        norm = np.sqrt(np.einsum("pi,pij,pj->p", along, a, along))
        projection = np.einsum("pjk,pji->pki", vectors, a) / norm[:, None, None]
        share = np.einsum("pi,pi->p", projection[:, 0], along)
        allowed = np.full(part.size, measure.WINDOW)
        reach = share * norm / unit
        return {"along": along, "projection": projection, "start": np.abs(share), "reach": reach, "allowed": allowed}

    def _run(self, points, theory, part, nudge, sampling):
        parameters = [p[part] for p in theory["parameters"]]
        epsilon = np.asarray(points["epsilon"], dtype=np.float64)[part]
        phase = np.asarray(points["phase"], dtype=np.float64)[part]
        S, mode = theory["scale"][part], np.asarray(points["mode"])[part] - 1
        x = np.concatenate([nudge["along"] * np.cos(phase)[:, None], nudge["along"] * (-S * np.sin(phase))[:, None]], 1)
        signs = (1.0, -1.0) if theory["twice"][part].any() else (1.0, 1.0)  # the second is not read
        motions = [(size * epsilon, sign * x.T) for size in kernel.SIZES for sign in signs]
        begin = self.code.starts(parameters, theory["place"][part], motions)
        twice = theory["twice"][part].astype(np.int64)
        family = self.n * np.asarray(points["equilibrium"], dtype=np.int64)[part] + mode
        project, uncertain = np.ascontiguousarray(nudge["projection"]), theory["uncertain"][part]
        runs = Runs(begin, project, S, epsilon, uncertain, twice, family)
        sizes = np.stack([nudge["start"], nudge["allowed"]], axis=1)
        return kernel.run(self.code.integrator(), runs, sizes, sampling)

    def motion(self, parameters: list[float], place, shift, duration: float, frames: int) -> np.ndarray:
        """The full motion from rest at some places, however far from an equilibrium.

        Args:
            parameters: their values, in the description's order.
            place: where deviations are counted from, shape (runs, n).
            shift: the deviations at the start, shape (runs, n).
            duration: s.
            frames: intervals of the duration.

        Returns:
            Coordinates at the intervals' ends, shape (runs, frames + 1, n).
        """
        runs, code = len(place), self.code
        given = [np.full(runs, value) for value in parameters] or [np.zeros(runs)]
        start = code.starts(given, place, [(np.ones(runs), [*shift.T, *np.zeros(shift.T.shape)])])[:, 0]
        q = np.empty((runs, frames + 1, self.n))
        q[:, 0] = place + shift
        terms = self.landscape.hessian_terms(given, list(place.T))
        S = np.nanmax(modes.scale(terms, self.landscape.a(given, list(place.T))))
        steps = max(1, int(np.ceil(duration / frames * S / FINE)))
        lanes = np.minimum(np.arange(W), runs - 1)
        for first in range(0, runs, W):
            rows = np.ascontiguousarray(start[np.minimum(first + lanes, runs - 1)].T)
            rows[code.step_row] = duration / frames / steps
            for k in range(1, frames + 1):
                self.code.module().advance(rows.reshape(-1), steps)
                part = slice(first, min(first + W, runs))
                q[part, k] = place[part] + rows[: self.n, : part.stop - first].T
        return q

    @staticmethod
    def _nudged_first(vectors, mode):
        """Modes with the nudged one first, then the others in their order."""
        n = vectors.shape[2]
        others = np.broadcast_to(np.arange(n), (mode.size, n))
        order = np.argsort(np.where(others == mode[:, None], -1, others), axis=1, kind="stable")
        return np.take_along_axis(vectors, order[:, None, :], axis=2)

    # -- both

    def survey(
        self,
        points,
        cycles: float = 4,
        samples_per_cycle: int = 16,
        tolerance: float = 1e-10,
        direction=None,
        degenerate: bool = False,
    ):
        """All columns of points, in units; see `sweeps.systems.oscillator.system`."""
        theory = self.theory(points)
        measured = self.measured(points, theory, cycles, samples_per_cycle, tolerance, direction)
        columns = self._columns(points, theory, measured)
        return columns | self._at_amplitude(points, theory, columns["regime_theory"]) if degenerate else columns

    def _at_amplitude(self, points, theory, regime):
        """Frequencies at the nudge's amplitude where V″ vanishes; see `sweeps.mechanics.degenerate`."""
        epsilon, phase = (np.asarray(points[name], dtype=np.float64) for name in ("epsilon", "phase"))
        size, place = theory["sizes"][:, 0], theory["place"][:, 0]
        x, v = epsilon * size * np.cos(phase), epsilon * size * theory["scale"] * np.sin(phase)
        found = self.degenerate.oscillations(theory["parameters"], place, x, v)
        found["degenerate_amplitude"] = found["degenerate_amplitude"] / size
        marginal = regime == kernel.MARGINAL
        nothing = {name: 0 if values.dtype == np.int8 else np.nan for name, values in found.items()}
        return {name: np.where(marginal, values, nothing[name]).astype(values.dtype) for name, values in found.items()}

    def _columns(self, points, theory, measured):
        raw, S = measured["raw"], theory["scale"]
        reduced = raw[:, kernel.RAW.reduced]
        epsilon, phase = (np.asarray(points[name], dtype=np.float64) for name in ("epsilon", "phase"))
        known = np.isfinite(raw[:, kernel.RAW.rate2])
        with np.errstate(invalid="ignore"):
            uncertain = theory["uncertain"] * S * S
            error, left = (x + uncertain for x in kernel.errors(raw, S, measured["spacing"], measured["share"]))
            regime = kernel.regime(reduced, left)
            predicted = kernel.regime(theory["omega_squared"], 32.0 * kernel.EPSILON * S * S + uncertain)
        regime = np.where(known, regime, -1).astype(np.int8)
        predicted = np.where(np.isfinite(theory["omega_squared"]), predicted, -1).astype(np.int8)
        columns = {
            "omega_squared_theory": theory["omega_squared"],
            "omega_squared": raw[:, kernel.RAW.rate2],
            "omega_squared_stderr": raw[:, kernel.RAW.stderr],
            "omega_squared_error": error,
            "omega_squared_reduced": reduced,
            "omega_squared_reduced_error": left,
            "amplitude_shift": raw[:, kernel.RAW.rate2] - reduced,
            **_rates("_theory", theory["omega_squared"], predicted),
            **_rates("", raw[:, kernel.RAW.rate2], regime),
            **_rate_errors("", raw[:, kernel.RAW.rate2], error, regime),
            **_rates("_reduced", reduced, regime),
            **_rate_errors("_reduced", reduced, left, regime),
            **_log_slope(raw, regime),
            "regime_theory": predicted,
            "regime": regime,
            "rate_scale": S,
            "samples_used": np.nan_to_num(raw[:, kernel.RAW.samples]).astype(np.int32),
            "window_end": (raw[:, kernel.RAW.samples] - 1.0) * measured["spacing"] / S,
            "steps_per_sample": np.nan_to_num(raw[:, kernel.RAW.steps]).astype(np.int32),
            "status": measured["status"],
            "equilibria_certified": theory["certified"],
            "energy_drift": raw[:, kernel.RAW.energy_drift],
        }
        columns["growth_rate_logslope_error"] = (
            np.abs(columns["growth_rate_logslope"] - columns["growth_rate_reduced"])
            + columns["growth_rate_reduced_error"]
        )
        for name in ("growth_rate", "frequency"):
            columns[f"{name}_stderr"] = _rate_stderr(raw[:, kernel.RAW.stderr], columns[name])
        amplitude, angle = _lecture_solution(epsilon * measured["reach"], phase, S, columns["frequency"])
        columns |= {"amplitude": amplitude, "initial_phase": angle}
        if self.system.follow:
            columns["branches_decided"] = (~theory["decided"]).astype(np.int8)
        for i, c in enumerate(self.system.kept):
            columns[f"{c.name}_equilibrium"] = theory["place"][:, i]
        return columns


def _runs(arrays, size=None):
    """Numbers of the first point of each run of equal neighbours, and each point's run; all alike if nothing tells."""
    size = len(arrays[0]) if arrays else size
    change = np.arange(size) == 0 if not arrays else np.ones(size, dtype=bool)
    if arrays and size > 1:
        change[1:] = np.any([x[1:] != x[:-1] for x in arrays], axis=0)
    return np.flatnonzero(change), np.cumsum(change) - 1


def _rates(suffix, squares, regime):
    missing = np.where(regime < 0, np.nan, 0.0)
    found = {}
    for name, told, sign in (("growth_rate", kernel.UNSTABLE, -1.0), ("frequency", kernel.STABLE, 1.0)):
        with np.errstate(invalid="ignore"):
            rate = np.sqrt(np.maximum(sign * squares, 0.0))
        found[f"{name}{suffix}"] = np.where(regime == told, rate, missing)
    return found


def _rate_errors(suffix, squares, error, regime):
    """Errors of the rates, to the farther end of the square's interval; missing where the regime has no such rate.

    Where it is marginal both rates are 0, and may be what the interval allows.
    """
    found = {}
    for name, told, sign in (("growth_rate", kernel.UNSTABLE, -1.0), ("frequency", kernel.STABLE, 1.0)):
        square = np.where(regime == told, sign * squares, np.nan)
        with np.errstate(invalid="ignore"):
            low, rate, high = (np.sqrt(np.maximum(x, 0.0)) for x in (square - error, square, square + error))
            farther = np.maximum(rate - low, high - rate)
            upper = np.sqrt(np.maximum(sign * squares + error, 0.0))
        found[f"{name}{suffix}_error"] = np.where(regime == kernel.MARGINAL, upper, farther)
    return found


def _log_slope(raw, regime):
    """The lecture's estimator, where its window held at least two e-folds."""
    e_folds = np.where(regime == kernel.UNSTABLE, raw[:, kernel.RAW.e_folds], np.nan)
    told = e_folds >= measure.LEAST_EFOLDS
    return {"growth_rate_logslope": np.where(told, raw[:, kernel.RAW.log_slope], np.nan), "e_folds": e_folds}


def _rate_stderr(stderr, rate):
    return np.divide(0.5 * stderr, rate, out=np.full_like(rate, np.nan), where=rate > 0.0)


def _lecture_solution(size, phase, S, frequency):
    """Amplitude a and phase α of η = a cos(ωt + α), with the measured ω, from η(0) = s cos φ, η̇(0) = −s S sin φ."""
    with np.errstate(all="ignore"):
        ratio = np.where(frequency > 0.0, S / frequency, np.nan)
        sense = np.where(size < 0.0, -1.0, 1.0)
        sine, cosine = sense * ratio * np.sin(phase), sense * np.cos(phase)
        return np.abs(size) * np.hypot(cosine, sine), np.where(np.isnan(ratio), np.nan, np.arctan2(sine, cosine))
