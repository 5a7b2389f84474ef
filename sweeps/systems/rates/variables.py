"""The columns of a signed square of a rate: by linear theory, as measured, reduced to no amplitude, with errors."""

from sweeps.schema.variables import Role, Variable, table

_ERROR = (
    "bounds the distance from linear theory: scatter, integration error, bias of the finite amplitude, and rounding"
)
_SCATTER = "scatter of the samples only, without the bias of a finite amplitude"
_AMPLITUDES = "as omega_squared_error, with the amplitude bias that the {} leaves"


def columns(reduced: str, by: str, size: str, window: str, sparse: bool = False) -> dict[str, Variable]:
    """Return name → variable, from Ω² to the slope of the logarithm.

    Args:
        reduced: how the measurement is reduced to an infinitesimal perturbation.
        by: the same in one word.
        size: what grows, of which the logarithm is taken.
        window: below 0.01 of what that is done.
        sparse: whether most points of its maps do not grow.
    """
    grows = {"sparse": sparse}
    return table(
        Variable("omega_squared_theory", "s-2", "Ω² (negative: unstable), linear theory"),
        *_measured("omega_squared", "s-2", "Ω²", "", reduced, by, role=Role.MEASUREMENT),
        Variable("amplitude_shift", "s-2", "finite-amplitude shift of Ω²"),
        Variable("growth_rate_theory", "s-1", "growth rate, linear theory; 0 where not unstable", **grows),
        *_measured("growth_rate", "s-1", "growth rate", "; 0 where not unstable", reduced, by, **grows),
        Variable("frequency_theory", "rad s-1", "angular frequency, linear theory; 0 where not stable"),
        *_measured("frequency", "rad s-1", "angular frequency", "; 0 where not stable", reduced, by),
        Variable(
            "growth_rate_logslope",
            "s-1",
            f"growth rate from the slope of the logarithm of {size} (naive method)",
            comment=f"missing where its window (2 to 1000 times the start, below 0.01 {window}) holds fewer "
            "than two e-folds",
            theory="growth_rate_theory",
            error="growth_rate_logslope_error",
            aside=True,
            **grows,
        ),
        Variable(
            "growth_rate_logslope_error",
            "s-1",
            "error of the growth rate from the log slope",
            comment="its distance from the extrapolated growth rate, and the error of that rate",
            **grows,
        ),
    )


def _measured(name, units, long_name, unless, reduced, by, sparse=False, role=Role.NONE):
    """Return the variables of a measured rate, its scatter and error, and the same reduced."""
    theory, sign = f"{name}_theory", " (negative: unstable)" if long_name == "Ω²" else ""
    of = {"theory": theory, "sparse": sparse, "zero_is_none": bool(unless)}
    return (
        Variable(name, units, f"{long_name}{sign}, measured{unless}", error=f"{name}_error", role=role, **of),
        Variable(
            f"{name}_stderr", units, f"standard error of the measured {long_name}", comment=_SCATTER, sparse=sparse
        ),
        Variable(f"{name}_error", units, f"error of the measured {long_name}", comment=_ERROR, sparse=sparse),
        Variable(
            f"{name}_reduced",
            units,
            f"{long_name} extrapolated to zero amplitude",
            comment=f"the measurement for an infinitesimal perturbation: {reduced}",
            error=f"{name}_reduced_error",
            **of,
        ),
        Variable(
            f"{name}_reduced_error",
            units,
            f"error of the extrapolated {long_name}",
            comment=_AMPLITUDES.format(by),
            sparse=sparse,
        ),
    )
