"""Variables that several systems share, and `parse_rows`, which reads a table of variables from text."""

import re
import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Annotated, Any

from kernels.estimator import statuses
from sweeps.schema.values import Epsilon, integer
from sweeps.schema.variables import Layout, Parameter, Quantity, Role, Variable, coordinates_of, table

SIZE = Quantity("size", "1", "0 < epsilon < 1", Epsilon)  # relative size of a perturbation
STEPS = Variable("steps_per_sample", "1", "integration steps between two samples", "i4")
TRUSTED = "whether the measurement can be trusted"


def make_epsilon(default: float, reference: str, relation: str, suffix: str = "") -> Parameter:
    """Return the parameter `epsilon`; refusals print its bounds between `relation` and `suffix`.

    Args:
        default: default value of epsilon.
        reference: words for the quantity to which the size is relative.
        relation: words for the size's reference in refusals.
        suffix: words after the bounds.
    """
    description = f"size of the perturbation {relation}, 0 < epsilon < 1{suffix}"
    return Parameter("epsilon", SIZE, f"size of the perturbation relative to {reference}", default, description)


def parse_rows(*parts: str | Variable) -> dict[str, Variable]:
    """Return name → variable of a table. Its parts are variables, or text with one variable a row.

    Columns of the text, two spaces apart: name, unit (- for none), type (left out: f8), meaning and [role]; indented
    lines continue the row above. "flags:" precedes the first number of a flag variable and its meanings in order,
    "comment:" its comment. X_theory, X_exact and X_error of the same table are related to X.
    """
    variables: dict[str, Variable] = {}
    names: list[str] = []
    for part in parts:
        if isinstance(part, Variable):
            variables[part.name] = part
            continue
        parsed = [_parse_row(text) for text in re.split(r"\n(?! )", textwrap.dedent(part).strip())]
        names += [variable.name for variable in parsed]
        variables |= {variable.name: variable for variable in parsed}
    for kind in ("theory", "exact", "error"):
        related_names = {name: f"{name}_{kind}" for name in names if f"{name}_{kind}" in variables}
        variables |= {
            name: replace(variables[name], **{kind: related_name}) for name, related_name in related_names.items()
        }
    return variables


def _parse_row(text: str) -> Variable:
    """Return the variable that a row of `parse_rows` describes."""
    row, _, comment = re.sub(r"\n +", " ", text).partition(" comment: ")
    row, _, flags = row.partition(" flags: ")
    row, _, role = row.removesuffix("]").partition(" [")
    name, units, *dtypes, meaning = re.split(r"  +", row.rstrip())
    first, *words = flags.split() or ["0"]
    (dtype,) = ["i1"] if words else dtypes or ["f8"]
    unit = None if units == "-" else units
    return Variable(name, unit, meaning, dtype, tuple(words), comment, int(first), role=Role(role))


def make_status(last: int = len(statuses.STATUSES) - 1, long_name: str = TRUSTED, comment: str = "") -> Variable:
    """Return the variable `status` with the meanings of the kernels' statuses.

    Args:
        last: last number of a status that the system gives.
        long_name: question that the status answers.
        comment: comment of the variable.
    """
    return Variable("status", None, long_name, "i1", statuses.STATUSES[: last + 1], comment, role=Role.STATUS)


def regime_pair(regimes: tuple[str, ...], comment: str = "", from_zero: bool = False) -> tuple[Variable, Variable]:
    """Return the regime by linear theory and as measured, the meaning of -1 (undetermined) first.

    Args:
        regimes: names of the regimes.
        comment: comment of the measured regime.
        from_zero: True if linear theory determines every regime, so that its flags begin at 0.
    """
    theory = regimes[from_zero:], "", from_zero - 1
    by_theory = Variable("regime_theory", None, "regime, linear theory", "i1", *theory)
    roles: dict[str, Any] = {"theory": "regime_theory", "role": Role.HEADLINE}
    measured = Variable("regime", None, "regime, measured", "i1", regimes, comment, -1, **roles)
    return by_theory, measured


def with_theory(name: str, units: str, long_name: str, error: str, noun: str = "", comment: str = "", **more) -> tuple:
    """Return the variables of a quantity by linear theory, as measured, and of its error.

    Args:
        name: name of the measured variable.
        units: units of all three.
        long_name: words for the quantity.
        error: comment of the error.
        noun: words for the quantity in the error's name; left out, `long_name`.
        comment: comment of the measured variable.
        more: further fields of the measured variable.
    """
    theory, over = f"{name}_theory", more.get("over", ())
    return (
        Variable(theory, units, f"{long_name}, linear theory", over=over),
        Variable(name, units, f"{long_name}, measured", comment=comment, theory=theory, error=f"{name}_error", **more),
        Variable(f"{name}_error", units, f"error of the measured {noun or long_name}", comment=error, over=over),
    )


def with_exact(name: str, units: str, long_name: str, noun: str, error: str, comment: str = "") -> tuple:
    """Return the variables of a measured quantity, compared with the closed form's `NAME_exact`, and of its error.

    Args:
        name: name of the measured variable.
        units: units of both.
        long_name: words for the quantity.
        noun: words for the quantity in the error's name.
        error: comment of the error.
        comment: comment of the measured variable.
    """
    return (
        Variable(name, units, f"{long_name}, measured", comment=comment, exact=f"{name}_exact", error=f"{name}_error"),
        Variable(f"{name}_error", units, f"error of the measured {noun}", comment=error),
    )


# -- variables of all described systems


def run_rows(terms: str, which: str = "") -> tuple[str | Variable, ...]:
    """Return the rows of each run: bound on rates, window, steps, status, and certificates of the equilibria.

    The bound on rates comes from `terms`; `which` names the run that `samples_used` counts, if there are several.
    """
    run_table = f"""
    rate_scale    s-1  bound on every possible rate at the equilibrium, which sets the length of the run
        comment: from the absolute values of the terms of {terms}, not from predicted rates
    samples_used  1  i4  number of samples inside the measurement window{which}
    window_end    s  time of the last sample inside the measurement window
    """
    search_table = """
    equilibria_certified  -  whether all equilibria of the point are found
        flags: 0 proved undecided_rounding undecided_too_large undecided_family
        comment: proved: by interval arithmetic; undecided where rounding hides whether one is single, several or none,
        where the bounds are too large to be searched to the end, and where equilibria form a family
    family_dimension      1  i1  dimension of the family of equilibria that the equilibrium lies in; 0 for one that is
        isolated
        comment: each direction along the family has an eigenvalue 0 of its own
    """
    return run_table, STEPS, make_status(), search_table


def make_layout(
    perturbation: Iterable[Parameter],
    last: Variable,
    max_number: int,
    variables: Mapping[str, Variable],
    required_names: Iterable[str],
) -> Layout:
    """Return the layout of maps of equilibria, without the parameters of the described system.

    Args:
        perturbation: parameters of the perturbation.
        last: coordinate that numbers modes or eigenvalues.
        max_number: largest number of modes or eigenvalues.
        variables: name → variable that a map may have.
        required_names: names of the variables that every map has.
    """
    numbers = Annotated[int, integer(1, max_number, f"whole numbers from 1 to {max_number}")]
    return Layout(
        coordinates_of(perturbation) | table(Variable("equilibrium", None, "equilibrium", "str"), last),
        variables,
        tuple(required_names),
        {parameter.name: parameter.quantity.item for parameter in perturbation}
        | {last.name: numbers, "equilibrium": str},
        is_open=True,
    )
