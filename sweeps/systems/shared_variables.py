"""Variables that the tables of several systems share, and how tables are written: `rows`, one variable a row."""

import re
import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Annotated

from kernels import statuses
from sweeps.schema.values import Epsilon, integer
from sweeps.schema.variables import Layout, Parameter, Quantity, Role, Variable, coordinates_of, table

SIZE = Quantity("size", "1", "0 < epsilon < 1", Epsilon)  # of a perturbation, relative
STEPS = Variable("steps_per_sample", "1", "integration steps between two samples", "i4")
TRUSTED = "whether the measurement can be trusted"


def perturbation(default: float, of: str, words: str, more: str = "") -> Parameter:
    """Return the parameter `epsilon`, relative to something; `words` and `more` stand around its bounds in refusals."""
    description = f"size of the perturbation {words}, 0 < epsilon < 1{more}"
    return Parameter("epsilon", SIZE, f"size of the perturbation relative to {of}", default, description)


def rows(*parts: str | Variable) -> dict[str, Variable]:
    """Return name → variable of a table, of which parts are text: one variable a row.

    Its columns, two spaces apart, are name, unit (- for none), type (f8 where left out), meaning and [role]; indented
    lines continue the row above. After "flags:" follow the first number of a flag variable and the meanings from it on,
    and after "comment:" its comment. X_theory, X_exact and X_error of the same table are X's.
    """
    variables, written = {}, []
    for part in parts:
        texts = re.split(r"\n(?! )", textwrap.dedent(part).strip()) if isinstance(part, str) else ()
        made = [_row(text) for text in texts]
        written += [variable.name for variable in made]
        variables |= {variable.name: variable for variable in made or [part]}
    for kind in ("theory", "exact", "error"):
        of = {name: f"{name}_{kind}" for name in written if f"{name}_{kind}" in variables}
        variables |= {name: replace(variables[name], **{kind: other}) for name, other in of.items()}
    return variables


def _row(text: str) -> Variable:
    row, _, comment = re.sub(r"\n +", " ", text).partition(" comment: ")
    row, _, flags = row.partition(" flags: ")
    row, _, role = row.removesuffix("]").partition(" [")
    name, units, *dtype, meaning = re.split(r"  +", row.rstrip())
    first, *words = flags.split() or "0"
    dtype = ["i1"] if words else dtype or ["f8"]
    units = None if units == "-" else units
    return Variable(name, units, meaning, *dtype, tuple(words), comment, int(first), role=Role(role))


def status(last: int = len(statuses.STATUSES) - 1, long_name: str = TRUSTED, comment: str = "") -> Variable:
    """Return the variable `status`, whose meanings are the statuses of the kernels up to number `last`."""
    return Variable("status", None, long_name, "i1", statuses.STATUSES[: last + 1], comment, role=Role.STATUS)


def regime(regimes: tuple[str, ...], comment: str = "", is_determined: bool = False) -> tuple[Variable, Variable]:
    """Return the regime by linear theory and as measured, the meaning of -1 (undetermined) first.

    `is_determined` says whether linear theory determines every regime, so that its flags begin at 0.
    """
    theory = regimes[is_determined:], "", is_determined - 1
    by_theory = Variable("regime_theory", None, "regime, linear theory", "i1", *theory)
    more = {"theory": "regime_theory", "role": Role.HEADLINE}
    measured = Variable("regime", None, "regime, measured", "i1", regimes, comment, -1, **more)
    return by_theory, measured


def with_theory(name: str, units: str, long_name: str, error: str, noun: str = "", comment: str = "", **more) -> tuple:
    """Return a quantity by linear theory, as measured, and its error; `noun` is what the error calls it."""
    theory, over = f"{name}_theory", more.get("over", ())
    return (
        Variable(theory, units, f"{long_name}, linear theory", over=over),
        Variable(name, units, f"{long_name}, measured", comment=comment, theory=theory, error=f"{name}_error", **more),
        Variable(f"{name}_error", units, f"error of the measured {noun or long_name}", comment=error, over=over),
    )


def with_exact(name: str, units: str, long_name: str, noun: str, error: str, comment: str = "") -> tuple:
    """Return a measured quantity, compared with the closed form's `NAME_exact`, and its error."""
    return (
        Variable(name, units, f"{long_name}, measured", comment=comment, exact=f"{name}_exact", error=f"{name}_error"),
        Variable(f"{name}_error", units, f"error of the measured {noun}", comment=error),
    )


# -- of all described systems


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
    numbers = Annotated[int, integer(1, most, f"whole numbers from 1 to {most}")]
    return Layout(
        coordinates_of(nudge) | table(Variable("equilibrium", None, "equilibrium", "str"), last),
        variables,
        tuple(needed),
        {parameter.name: parameter.quantity.item for parameter in nudge} | {last.name: numbers, "equilibrium": str},
        is_open=True,
    )
