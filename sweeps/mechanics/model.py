"""A described system x' = f(x, t; p): its equations, its generated integrators, its equilibria and its motions.

The measurements near equilibria are in `normal_modes` (of natural systems, mode by mode) and in `relative` (of all
other systems, by eigenvalues).
"""

import threading
from functools import cached_property
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np

from kernels.estimator import statuses
from sweeps.mechanics import equilibria
from sweeps.mechanics.degenerate import Degenerate
from sweeps.mechanics.derivation import derive
from sweeps.mechanics.description import System
from sweeps.mechanics.first_order import graph
from sweeps.mechanics.landscape import Landscape
from sweeps.mechanics.series import Moving
from sweeps.mechanics.symmetries import Symmetries
from sweeps.mechanics.taylor import Code
from sweeps.schema.refusals import DescriptionError

if TYPE_CHECKING:
    from sweeps.mechanics.jumps import Jumps
    from sweeps.mechanics.periodic import Variation
    from sweeps.mechanics.perturbed import PerturbedCode
    from sweeps.mechanics.steepness import Steepness

RANK = 1e-9  # singular values of the conserved quantities' gradients below it are none


class Model:
    """A system's equations and generated code, and its points.

    With a `block` of states, which are independent of all others to first order, the multipliers of a periodic motion
    are those of the block, by its variational flow; if there are others, the block vanishes in the motion. The first
    half of the block are coordinates, the second momenta in their order, or velocities.
    """

    def __init__(self, system: System, block: tuple[int, ...] | None = None):
        self.system, self.block = system, block
        self.equations = derive(system)
        self.names = tuple(system.parameters)
        energy = ("energy",) if self.equations.conservative else ()
        self.quantities = tuple(system.conserved_quantities) or energy  #: names of the conserved quantities
        self._lock = threading.Lock()
        self._perturbed: dict[bool, PerturbedCode] = {}

    @cached_property
    def landscape(self) -> Landscape:
        """Forces, slopes and sizes, in NumPy."""
        return Landscape(self.equations)

    @cached_property
    def code(self) -> Code:
        """The generated kernel of motions near equilibria."""
        return Code(graph(self.equations))

    @cached_property
    def moving(self) -> Moving:
        """The generated kernel of any motion."""
        return Moving(graph(self.equations, near=False))

    def perturbed_code(self, still: bool) -> "PerturbedCode":
        """Return the generated kernel of perturbations of a motion: at rest at all times, or not."""
        from sweeps.mechanics.perturbed import PerturbedCode, TangentCode

        still = still and self.block is None
        with self._lock:
            if still not in self._perturbed:
                rates = graph(self.equations, near=False)
                code = PerturbedCode(rates, still) if self.block is None else TangentCode(rates, self.block)
                self._perturbed[still] = code
            return self._perturbed[still]

    @property
    def is_linear(self) -> bool:
        """True if the equations are proved to be linear; False for a block, whose tangent flow is linear anyway."""
        return self.block is None and self.perturbed_code(False).linear

    def perturbed(self, still: bool) -> "PerturbedCode":
        """Return the same, compiled, after the steps of a base motion that moves: one thread loads them for all."""
        code = self.perturbed_code(still)
        with self._lock:
            code.module()
            self.variation.kernels(still)
            if not still:
                self.moving.module()
        return code

    @cached_property
    def variation(self) -> "Variation":
        """Rates and Jacobian at any time, in NumPy."""
        from sweeps.mechanics.periodic import Variation

        return Variation(self.equations, self.block)

    @cached_property
    def steepness(self) -> "Steepness":
        """How steep the equations' functions of the time are."""
        from sweeps.mechanics.steepness import Steepness

        return Steepness(self.equations)

    @cached_property
    def symmetries(self) -> Symmetries:
        """Facts about all motions that the equations prove near equilibria."""
        return Symmetries(self.equations)

    @cached_property
    def jumps(self) -> "Jumps":
        """When the equations' functions of the time jump."""
        from sweeps.mechanics.jumps import Jumps

        return Jumps(self.equations)

    def with_switches(self, parameters: list[np.ndarray]) -> list[np.ndarray]:
        """Return parameters and, for each switch of the equations, zeros."""
        missing = len(self.equations.parameters) - len(parameters)
        return [*parameters, *[np.zeros(np.shape(parameters[0]))] * missing]

    @cached_property
    def degenerate(self) -> Degenerate:
        """V's higher terms, of a system of one coordinate."""
        return Degenerate(self.equations)

    @cached_property
    def n(self) -> int:
        """Number of eigenvalues: states less the conserved quantities that are independent, at the defaults."""
        N = self.equations.n
        if not self.system.conserved_quantities:
            return N
        parameters = self.parameters({p.name: [p.default] for p in self.system.parameters.values()}, 1)
        parameters = self.with_switches(parameters)
        with np.errstate(all="ignore"):
            (places,) = self.landscape.starts(parameters) if self.system.labels else self.equilibria(parameters).places
            point_parameters, x = [np.repeat(p, len(places)) for p in parameters], list(places.T)
            slopes, _ = self.landscape.conserved_slopes(point_parameters, x, self.landscape.sizes(point_parameters, x))
        finite = slopes[np.isfinite(slopes).all((1, 2))]
        if not finite.size:
            raise DescriptionError("conserved: infinite at every place that is named; allowed: finite quantities")
        singular = np.linalg.svd(finite[0], compute_uv=False)
        return N - int((singular > RANK * singular.max(initial=0.0)).sum())

    @property
    def measurement(self) -> ModuleType:
        """Functions `theory(model, points)` and `survey(model, points, …)`: of modes, where the system is natural."""
        if self.equations.natural:
            from sweeps.mechanics import normal_modes

            return normal_modes
        from sweeps.mechanics import relative

        return relative

    def theory(self, points) -> dict:
        """Return the predictions of linear theory for points; see `measurement`."""
        return self.measurement.theory(self, points)

    def survey(self, points, *settings, **further) -> dict[str, np.ndarray]:
        """Return all columns of points, in units; see `measurement`."""
        return self.measurement.survey(self, points, *settings, **further)

    def parameters(self, points, size: int) -> list[np.ndarray]:
        """Return one array (size,) for each parameter, in the description's order; zeros if there are none."""
        return [np.asarray(points[name], dtype=np.float64) for name in self.names] or [np.zeros(size)]

    def equilibria(self, parameters: list[np.ndarray]) -> equilibria.Equilibria:
        """Find all equilibria of points, given by the values of each parameter."""
        return equilibria.find(self.landscape, parameters)

    def columns_of_runs(self, theory, measured, samples, steps) -> dict[str, np.ndarray]:
        """Return the columns about runs and equilibria that every measurement has.

        Args:
            theory: result of :meth:`place_columns` with the scale.
            measured: status and spacing of the samples.
            samples: number of samples used, (points,).
            steps: steps per sample, (points,).
        """
        return {
            "rate_scale": theory["scale"],
            "samples_used": np.nan_to_num(samples).astype(np.int32),
            "window_end": (samples - 1.0) * measured["spacing"] / theory["scale"],
            "steps_per_sample": np.nan_to_num(steps).astype(np.int32),
            "status": measured["status"],
            "equilibria_certified": theory["certified"],
            "family_dimension": theory["dimension"],
            **{f"{p.name}_equilibrium": theory["place"][:, i] for i, p in enumerate(self.equations.places)},
        }

    def place_columns(self, parameters: list[np.ndarray], slot: np.ndarray) -> dict[str, np.ndarray]:
        """Return the equilibrium in a slot of each point.

        Returns:
            `place` (points, m), NaN if there is none; `place_uncertainty`, `dimension`, `certified` and
            `is_order_decided` as of `equilibria.Equilibria`; `status`, OK or why there is none.
        """
        zeros, each = self.equilibria(parameters), np.arange(slot.size)
        place, undecided = zeros.places[each, slot], ~zeros.is_absent[each, slot]
        cases = [~np.isnan(place).any(axis=1), zeros.is_flat, zeros.is_crowded, undecided]
        kinds = [statuses.OK, statuses.FLAT, statuses.TOO_MANY_EQUILIBRIA, statuses.EQUILIBRIUM_UNDECIDED]
        return {
            "place": place,
            "place_uncertainty": zeros.uncertainty[each, slot],
            "dimension": zeros.dimension[each, slot],
            "certified": zeros.certified,
            "is_order_decided": zeros.is_order_decided,
            "status": np.select(cases, kinds, statuses.NO_EQUILIBRIUM).astype(np.int8),
        }

    def proofs(self, parameters: list[np.ndarray]) -> tuple[str, ...]:
        """Return a line for each symmetry that is proved and used at some of the points, with how many they are."""
        uses = self._symmetries_of_equilibria if self.system.given_period is None else self._symmetries_of_periods
        of = "{} (at {:,} of {:,} looked at)"
        pairs = ((words, holds.sum(), holds.size) for words, holds in uses(parameters))
        return tuple(words if count == all_ else of.format(words, count, all_) for words, count, all_ in pairs if count)

    def _symmetries_of_equilibria(self, parameters):
        """Yield (sentence, True for equilibria with a proof) for each symmetry of a system without a period."""
        from sweeps.mechanics import relative

        always = np.ones(1, dtype=bool)
        if self.equations.natural:
            yield "forces are those of a potential: each mode has one real rate², which oscillates or grows", always
        else:
            point, slot = np.nonzero(~np.isnan(self.equilibria(parameters).places).any(axis=-1))
            at = [p[point] for p in parameters]
            base = self.place_columns(at, slot)
            place, slopes = base["place"], self.landscape.slopes(at, list(base["place"].T))
            has_pairs = relative.has_paired_jacobian(self, *slopes) & self.symmetries.has_pairs(at, place, slopes[1])
            yield "time reversal: eigenvalues come in pairs ±μ", has_pairs
            yield (
                "stable by a definite conserved quantity",
                relative.is_proved_stable(self, at, place, base["place_uncertainty"]),
            )
        if self.quantities:
            zeros = self.equations.n - self.n
            note = f"; {zeros} of {self.equations.n} eigenvalues, which are zero, are left out" if zeros else ""
            yield f"conserved: {', '.join(self.quantities)}, whose drift is watched{note}", always

    def _symmetries_of_periods(self, parameters):
        """Yield (sentence, True for points with a proof) for each symmetry of a system with a period."""
        variation, parameters = self.variation, self.with_switches(parameters)
        linear, odd = (np.array([flags]) for flags in (self.perturbed_code(True).linear, variation.is_odd))
        yield "linear about an equilibrium at all times: followed with one size and from one side", linear
        yield "odd about the origin: followed from one side where it is an equilibrium", odd & ~linear
        _, reciprocal, even = variation.prove_symmetries(parameters)
        yield "Hamilton's equations, or no divergence: multipliers come in pairs μ, 1/μ", reciprocal
        yield "even in the time: about an equilibrium half a period gives the whole", even
