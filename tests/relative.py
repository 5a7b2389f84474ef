"""Relative equilibria that ship: random points, and their characteristic polynomials as books give them."""

import described
import numpy as np

MOMENTS = ("I1", "I2", "I3")
RANGES = {  # name → parameter → range of its values
    "sleeping_top": dict.fromkeys(MOMENTS, (0.3, 2.0)) | {"moment_of_weight": (-3.0, 3.0), "spin_rate": (-4.0, 4.0)},
    "gyrostat": dict.fromkeys(MOMENTS, (0.3, 3.0)) | {"rotor_momentum": (-4.0, 4.0), "spin_rate": (-3.0, 3.0)},
    "gravity_gradient": {"k1": (-0.95, 0.95), "k3": (-0.95, 0.95), "orbital_rate": (0.5, 2.0)},
    "gravity_gradient_damped": {"k1": (-0.9, 0.9), "k3": (-0.9, 0.9), "slug": (0.005, 0.1), "drag": (0.005, 0.1)},
    "viscous_slug": {"axial_moment": (0.2, 1.8), "slug_moment": (0.005, 0.1), "drag": (0.002, 0.1),
                     "rotor_momentum": (-1.0, 1.0), "spin_rate": (0.2, 3.0)},
    "lagrange_points": {"mass_ratio": (1e-4, 0.5), "orbital_rate": (0.5, 2.0)},
    "rotating_saddle": {"stiffness_x": (-3.0, 3.0), "stiffness_y": (-3.0, 3.0), "drag": (0.0, 0.5),
                        "spin_rate": (-2.0, 2.0)},
    "foucault": {"length": (0.5, 2.0), "gravity": (1.0, 12.0), "drag": (0.0, 0.5), "spin_rate": (-4.0, 4.0)},
    "steady_precession": {"moment_of_weight": (0.5, 3.0), "tilt": (0.1, 3.0), "spin_rate": (4.0, 12.0)},
    "rotor": {"stiffness_x": (0.5, 2.0), "stiffness_y": (0.5, 2.0), "bearing_damping": (0.0, 0.2),
              "internal_damping": (0.0, 0.2), "spin_rate": (-4.0, 4.0)},
}  # fmt: skip


def theory_at(name, **values):
    """Return theory of the first equilibrium of a shipped system; values are numbers or arrays of one length."""
    model = described.model_of(name)
    columns = [values.get(k, p.default) for k, p in model.system.parameters.items()]
    *columns, equilibrium = np.broadcast_arrays(*map(np.atleast_1d, columns), np.zeros(1, dtype=int))
    return model.theory(dict(zip(model.system.parameters, columns, strict=True)) | {"equilibrium": equilibrium})


def check_errors(columns, which=slice(None)):
    """Check that the errors of eigenvalues cover the distance to theory, at points."""
    for component in ("real", "imag"):
        value, theory, error = (columns[f"eigenvalue_{component}{end}"][which] for end in ("", "_theory", "_error"))
        assert (np.abs(value - theory) <= error).all()


def _product(*factors):
    result = np.ones(1)
    for factor in factors:
        result = np.polymul(result, factor)
    return result


def _sleeping_top(p):
    I1, I2, I3, P, W = (p[k] for k in ("I1", "I2", "I3", "moment_of_weight", "spin_rate"))
    block1, block2 = [I1, 0, (I3 - I2) * W**2 - P], [I2, 0, (I3 - I1) * W**2 - P]
    return np.polyadd(_product(block1, block2), [(I1 + I2 - I3) ** 2 * W**2, 0, 0])


def _gyrostat(p):
    I1, I2, I3, h, W = (p[k] for k in ("I1", "I2", "I3", "rotor_momentum", "spin_rate"))
    return [1, 0, ((I2 - I3) * W + h) * ((I2 - I1) * W + h) / (I1 * I3)]


def _gravity_gradient(p):
    k1, k3, n = p["k1"], p["k3"], p["orbital_rate"]
    I1, I3 = (1 - k3) / (1 - k1 * k3), (1 - k1) / (1 - k1 * k3)
    pitch = [1, 0, 3 * n**2 * (I1 - I3)]
    return _product(pitch, [1, 0, (1 + 3 * k1 + k1 * k3) * n**2, 0, 4 * k1 * k3 * n**4])


def _gravity_gradient_damped(p):
    """From the equations in rotation matrices and a complex step, shape-by-shape as a book writes them."""
    k1, k3, n = p["k1"], p["k3"], p["orbital_rate"]
    moments = np.array([(1 - k3) / (1 - k1 * k3), 1, (1 - k1) / (1 - k1 * k3)])
    J, kappa = p["slug"] * moments[0], p["drag"] * moments[0] * n

    def rates(x):
        w, s, (a, b, c) = x[:3], x[3:6], x[6:]
        R1 = np.array([[1, 0, 0], [0, np.cos(a), np.sin(a)], [0, -np.sin(a), np.cos(a)]])
        R2 = np.array([[np.cos(b), 0, -np.sin(b)], [0, 1, 0], [np.sin(b), 0, np.cos(b)]])
        R3 = np.array([[np.cos(c), np.sin(c), 0], [-np.sin(c), np.cos(c), 0], [0, 0, 1]])
        C = R1 @ R2 @ R3
        nadir, frame = C[:, 2], -n * C[:, 1]
        axes = np.array([[1, 0, 0], R1[:, 1], (R1 @ R2)[:, 2]]).T
        torque = np.cross(moments * w, w) + 3 * n**2 * np.cross(nadir, moments * nadir) - kappa * (w - s)
        slug = kappa / J * (w - s) - np.cross(w, s)
        return np.concatenate([torque / moments, slug, np.linalg.solve(axes, w - frame)])

    equilibrium = np.array([0, -n, 0, 0, -n, 0, 0, 0, 0], dtype=complex)
    A = np.array([rates(equilibrium + 1e-30j * e).imag / 1e-30 for e in np.eye(9)]).T
    return np.poly(A)


def _viscous_slug(p):
    It, Is, J, kappa, h, W = (
        p[k] for k in ("transverse_moment", "axial_moment", "slug_moment", "drag", "rotor_momentum", "spin_rate")
    )
    slug = kappa / J + 1j * W
    A = np.array([[(1j * (Is * W + h - It * W) - kappa) / It, kappa / It], [slug, -slug]])
    pair = np.poly(A)
    return _product(pair, pair.conj(), [1, kappa * (1 / Is + 1 / J)]).real


def _lagrange_points(p):
    mu, n = p["mass_ratio"], p["orbital_rate"]
    return [1, 0, n**2, 0, 27 / 4 * mu * (1 - mu) * n**4]


def _rotating_saddle(p):
    kx, ky, c, W = (p[k] for k in ("stiffness_x", "stiffness_y", "drag", "spin_rate"))
    return np.polyadd(_product([1, c, kx - W**2], [1, c, ky - W**2]), _product([2 * W, c * W], [2 * W, c * W]))


def _foucault(p):
    c, W, square = p["drag"], p["spin_rate"], p["gravity"] / p["length"]
    return np.polyadd(_product([1, c, square - W**2], [1, c, square - W**2]), [4 * W**2, 0, 0])


def _steady_precession(p, slot):
    a, b, tilt = 0.6 * p["spin_rate"], p["moment_of_weight"], p["tilt"]
    rates = np.roots([np.cos(tilt), -a, b])
    rate = rates[np.argsort(np.abs(rates))[slot]]
    return [1, 0, (a - 2 * rate * np.cos(tilt)) ** 2 + (rate * np.sin(tilt)) ** 2]


def _rotor(p):
    kx, ky, outer, inner, W = (
        p[k] for k in ("stiffness_x", "stiffness_y", "bearing_damping", "internal_damping", "spin_rate")
    )
    c = outer + inner
    return np.polyadd(_product([1, c, kx], [1, c, ky]), [(inner * W) ** 2])


POLYNOMIALS = {name: globals()[f"_{name}"] for name in RANGES}


def polynomial(name, point, slot):
    """Coefficients of det(λ - A), highest first, monic."""
    c = POLYNOMIALS[name](point, slot) if name == "steady_precession" else POLYNOMIALS[name](point)
    return np.asarray(c) / c[0]
