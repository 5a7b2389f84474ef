"""The column that says whether a point's equilibria are all that are there, of every described system."""

from sweeps.schema.variables import Variable

REASONS = ("proved", "undecided_rounding", "undecided_too_large", "undecided_family")  # of sweeps.mechanics.equilibria

CERTIFIED = Variable(
    "equilibria_certified",
    None,
    "whether all equilibria of the point are found",
    "i1",
    REASONS,
    comment="proved: by interval arithmetic; undecided where rounding hides whether one is single, several or none, "
    "where the bounds are too large to be searched to the end, and where equilibria form a family",
)
