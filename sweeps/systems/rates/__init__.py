"""Variables and a section of the page of systems with a signed square of a rate Ω².

Variables are those of linear theory, of the measurement and its extrapolation to zero amplitude, and errors; the
section shows the limit of linear theory.
"""

from dataclasses import replace
from pathlib import Path

from sweeps.schema.variables import Variable
from sweeps.systems.shared_variables import parse_rows

FILES = tuple(Path(__file__).parent / name for name in ("perturbations.html", "rates.js"))


def rate_variables(reduced: str, by: str, size: str, window: str, sparse: bool = False) -> dict[str, Variable]:
    """Return name → variable, from Ω² to the slope of the logarithm.

    Args:
        reduced: words for the reduction of the measurement to an infinitesimal perturbation.
        by: the same in one word.
        size: words for the quantity with the logarithm that has the slope.
        window: words for the reference of the window's upper end, 0.01.
        sparse: True if most points of a map do not grow.
    """
    variables = parse_rows(
        "omega_squared_theory  s-2  Ω² (negative: unstable), linear theory",
        _measured_rows("omega_squared", "s-2", "Ω²", " (negative: unstable), measured [measurement]", reduced, by),
        """
        amplitude_shift     s-2  finite-amplitude shift of Ω²
        growth_rate_theory  s-1  growth rate, linear theory; 0 where not unstable
        """,
        _measured_rows("growth_rate", "s-1", "growth rate", ", measured; 0 where not unstable", reduced, by),
        "frequency_theory  rad s-1  angular frequency, linear theory; 0 where not stable",
        _measured_rows("frequency", "rad s-1", "angular frequency", ", measured; 0 where not stable", reduced, by),
        f"""
        growth_rate_logslope        s-1  growth rate from the slope of the logarithm of {size} (naive method)
            comment: missing where its window (2 to 1000 times the start, below 0.01 {window}) holds fewer than two
            e-folds
        growth_rate_logslope_error  s-1  error of the growth rate from the log slope
            comment: its distance from the extrapolated growth rate, and the error of that rate
        """,
    )
    for name, column in variables.items():
        quantity = name.removesuffix("_reduced")  # both are compared with the same theory
        has_theory = f"{quantity}_theory" in variables
        theory, zero_is_none = f"{quantity}_theory" if has_theory else "", has_theory and quantity != "omega_squared"
        variables[name] = replace(
            column, theory=theory, zero_is_none=zero_is_none, sparse=sparse and name.startswith("growth")
        )
    slope = replace(variables["growth_rate_logslope"], theory="growth_rate_theory", aside=True)
    return variables | {"growth_rate_logslope": slope}


def _measured_rows(name: str, units: str, noun: str, more: str, reduced: str, by: str) -> str:
    """Return the rows of a measured rate, its scatter and error, and the same reduced."""
    return f"""
    {name}                {units}  {noun}{more}
    {name}_stderr         {units}  standard error of the measured {noun}
        comment: scatter of the samples only, without the bias of a finite amplitude
    {name}_error          {units}  error of the measured {noun}
        comment: bounds the distance from linear theory: scatter, integration error, bias of the finite amplitude, and
        rounding
    {name}_reduced        {units}  {noun} extrapolated to zero amplitude
        comment: the measurement for an infinitesimal perturbation: {reduced}
    {name}_reduced_error  {units}  error of the extrapolated {noun}
        comment: as omega_squared_error, with the amplitude bias that the {by} leaves
    """
