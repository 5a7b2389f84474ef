"""Linear systems of more coordinates than a described system has, by their eigenvalues."""

from collections.abc import Collection
from types import ModuleType
from typing import TYPE_CHECKING

from sweeps.schema.refusals import DescriptionError
from sweeps.schema.variables import Variable
from sweeps.systems.described import MECHANICS, hash_sources
from sweeps.systems.relative_equilibrium import system
from sweeps.systems.system import Example

if TYPE_CHECKING:
    from sweeps import mechanics


class LinearSystem(system.RelativeEquilibrium):
    """A linear system given by its matrices, measured without generated code."""

    samples_per_second = 150_000
    method_text = "direct integration of the linear equations of motion"
    kernels = ("flow.jacobians", "flow.matrices", "flow.flows")
    library = MECHANICS / "library" / "linear"
    compile_seconds = 0.0

    @property
    def tables(self) -> ModuleType:
        """The tables of relative equilibria."""
        return system

    @staticmethod
    def describes(description: "mechanics.System") -> bool:
        """Return True if a description has matrices of many coordinates."""
        return description.linear_matrices is not None

    @classmethod
    def holds(cls, variables: Collection[str]) -> bool:
        """Return True for variables of relative equilibria without positions, which are 0 here."""
        return super().holds(variables) and not any(name.endswith("_equilibrium") for name in variables)

    def _model(self):
        from sweeps.mechanics.linear_model import LinearModel

        return LinearModel(self.description)

    def check(self, definition, grid) -> None:
        """Refuse masses that are not positive definite at any of some points of the grid."""
        from sweeps.mechanics.modes import is_positive_definite

        if not is_positive_definite(self.mechanism.landscape.a(self._check_values(grid, 16), ())).any():
            raise DescriptionError(f"{self.name}: M: is not positive definite; allowed: positive definite masses")

    def proofs(self, grid) -> tuple[str, ...]:
        """Return no symmetry: none is used."""
        return ()

    def fingerprint(self) -> str:
        """Return a hash of the kernels, the sources of this package's mechanics, and the description."""
        return hash_sources(self.kernels, None, self.source)

    def examples(self, definition=None) -> tuple[Example, ...]:
        """Return the kernels' compiled examples alone: there is no generated code."""
        return self.compiled

    def variables(self, definition=None) -> dict[str, Variable]:
        """Return name → variable, without the positions of the equilibrium, which are 0."""
        places = () if definition is None else self.places()
        return {name: variable for name, variable in super().variables(definition).items() if name not in places}

    def _measured_shapes(self, points, theory, integration):
        """Return the shapes of the integrated propagators of points."""
        return self.mechanism.mode_shapes(theory)

    def _load_code(self):
        """Return at once: there is no generated code to load."""

    def reference(self) -> None:
        """Return None: theory is that of LAPACK."""
        return None


KIND = LinearSystem
