import math

import pytest

from sweeps.points import catalogue
from sweeps.points.loading import read_definition
from sweeps.systems.rigid_body import spin_outcomes


def test_angles_are_told_to_machines_in_rad():
    path = catalogue.find_definition("bodies")
    body = next(
        body for name, body in spin_outcomes.bodies_by_name(read_definition(path), path).items() if "acket" in name
    )
    tilts = [
        axis["max_tilt"] for axis in spin_outcomes.predict_body(body, spin_outcomes.spin_setting(body, body))[0]["axes"]
    ]
    assert tilts[1] == pytest.approx(math.pi, rel=1e-5)  # it flips
    assert max(tilts[0], tilts[2]) < 1e-5
