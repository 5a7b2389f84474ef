"""Ranges of the parameters of the systems of small oscillations that ship."""

LIBRARY = {  # name → parameter → range of its values
    "pendulum": {"length": (0.1, 5.0), "gravity": (1.0, 20.0)},
    "bead_on_hoop": {"radius": (0.1, 5.0), "spin_rate": (0.0, 10.0)},
    "central_potential": {"exponent": (-1.5, 4.0), "angular_momentum": (0.1, 5.0)},
    "spherical_pendulum": {"angular_momentum": (0.1, 20.0)},
    "bead_on_wire": {"length": (0.1, 3.0), "spin_rate": (0.0, 5.0)},
    "double_well": {"alpha": (0.1, 5.0), "beta": (0.1, 5.0)},
    "double_pendulum": {"mass2": (0.1, 5.0), "length2": (0.2, 5.0)},
    "linear_triatomic": {"inner_mass": (1e-27, 1e-25), "stiffness": (100.0, 2000.0)},
}
