"""Variables and layouts that the maps of all described systems share."""

from collections.abc import Iterable, Mapping
from typing import Annotated

from sweeps.schema.values import whole
from sweeps.schema.variables import Layout, Parameter, Variable, coordinates_of, table
from sweeps.systems.shared_variables import STEPS, status


def of_runs(terms: str, which: str = "") -> tuple[str | Variable, ...]:
    """Return the rows of each run: bound on rates, window, steps, status, and what is known of the equilibria.

    The bound on rates comes from `terms`; `which` of several runs is the one whose samples are counted.
    """
    measured = f"""
    rate_scale    s-1  bound on every possible rate at the equilibrium, which sets the length of the run
        comment: from the absolute values of the terms of {terms}, not from predicted rates
    samples_used  1  i4  number of samples inside the measurement window{which}
    window_end    s  time of the last sample inside the measurement window
    """
    equilibria = """
    equilibria_certified  -  whether all equilibria of the point are found
        flags: 0 proved undecided_rounding undecided_too_large undecided_family
        comment: proved: by interval arithmetic; undecided where rounding hides whether one is single, several or none,
        where the bounds are too large to be searched to the end, and where equilibria form a family
    family_dimension      1  i1  dimension of the family of equilibria that the equilibrium lies in; 0 for one that is
        isolated
        comment: each direction along the family has an eigenvalue 0 of its own
    """
    return measured, STEPS, status(), equilibria


def layout(
    nudge: Iterable[Parameter], last: Variable, most: int, variables: Mapping[str, Variable], needed: Iterable[str]
) -> Layout:
    """Return the layout of maps of equilibria, beside the parameters of the system described.

    `nudge` are the parameters of the perturbation; the coordinate `last` numbers modes or eigenvalues, at most `most`;
    every map has the variables that are `needed`.
    """
    numbers = Annotated[int, whole(1, most, f"whole numbers from 1 to {most}")]
    return Layout(
        coordinates_of(nudge) | table(Variable("equilibrium", None, "equilibrium", "str"), last),
        variables,
        tuple(needed),
        {parameter.name: parameter.quantity.item for parameter in nudge} | {last.name: numbers, "equilibrium": str},
        is_open=True,
    )
