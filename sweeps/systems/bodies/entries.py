"""A body as a program gives it, as the entry of a definition."""

from collections.abc import Mapping

import numpy as np

from sweeps.schema.refusals import DefinitionError, display
from sweeps.systems.bodies.variables import MOMENTS

FORMS = "three moments, a tensor of 3 rows of 3, a body's mapping as in a definition, or a body's name"


def entry(body: object) -> dict:
    """Return the entry of a definition for a body's mapping, its three moments or its tensor of inertia.

    Numbers may be text with a unit, "12 kg cm2".
    """
    if isinstance(body, Mapping):
        return dict(body)
    values = np.array(body, dtype=object) if isinstance(body, list | tuple | np.ndarray) else np.empty(0)
    if values.shape == (3,):
        return dict(zip(MOMENTS, map(_plain, values), strict=True))
    if values.shape == (3, 3):
        return {"tensor": [[_plain(value) for value in row] for row in values]}
    raise DefinitionError(f"body: {display(body)} is not a body; allowed: {FORMS}")


def _plain(value: object) -> object:
    return value.item() if isinstance(value, np.generic) else value
