"""Definitions of the smallest maps of each system of bodies, for tests that go through all of them."""

TENSOR = [[2.0, -0.5, 0.0], [-0.5, 2.0, 0.1], [0.0, 0.1, 3.0]]
SMALL = {
    "rigid_body": {"axes": [1, 2], "grid": {"I1": [1.0, 2.0], "I2": 1.5, "I3": 3.0, "omega0": [1.0, -2.0]}},
    "twist": {"grid": {"I1": [0.3, 0.5], "I2": 1.0, "I3": [1.2, 1.4], "chi": [0.1, -0.4], "omega0": 3.0}},
    "tumbling": {"grid": {"I1": [0.2, 0.4], "I2": [0.6, 0.7], "I3": 1.0, "energy": [1.1, 1.6, 2.0], "omega0": 2.0}},
    "dissipative_body": {"grid": {"I1": 1.0, "I2": [1.5, 2.0], "I3": 3.0, "loss": 0.3, "from_angle": [0.1, 1.0]}},
    "observed_periods": {"grid": {"I1": 0.4, "I2": [0.7, 0.9], "I3": 1.0, "P_psi": [0.5, 6.0], "P_phi": 2.0}},
    "uncertain_bodies": {
        "bodies": [{"name": "A", "I1": 1.0, "I2": 1.5, "I3": 2.2}, {"name": "B", "tensor": TENSOR}],
        "grid": {"omega0": [1.0, -2.0]},
        "uncertainty": {"inertia": "5 %", "omega0": "1 %", "phase": "any"},
        "draws": 64,
        "keep": True,
        "twist": True,
    },
    "orbit": {"grid": {"a_over_b": [1.2, 1.3], "b_over_c": 1.25, "eccentricity": [0.0, 0.1]}},
    "pumped_body": {
        "axes": [1, 3],
        "grid": {"I1": 1.0, "I2": [1.5, 2.0], "I3": 2.2, "depth2": 0.2, "frequency": [0.5, 2.0], "omega0": -1.0},
    },
    "symmetric_top": {"grid": {"ratio": [0.5, 1.0, 1.2], "omega3": [-1.0, 2.0], "half_angle": [10.0, 40.0]}},
}
