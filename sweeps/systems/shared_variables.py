"""Variables that the tables of several systems share, and how tables are written: `rows`, one variable a row."""

import re
import textwrap
from dataclasses import replace

from kernels import statuses
from sweeps.schema.values import Epsilon
from sweeps.schema.variables import Parameter, Quantity, Role, Variable

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
