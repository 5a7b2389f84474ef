"""A spherical pendulum (r = l) about its conical motion, by the reduced potential.

The azimuth is cyclic; its momentum L determines the cone's angle. About the cone at θ0 the lecture's result is
ω² = (g/l)(1 + 3 cos²θ0)/cos θ0.
"""

from sympy import Matrix, atan, cos, pi, sin

from sweeps.mechanics import System

system = System("Conical motion of a spherical pendulum", references="Landau and Lifshitz, Mechanics, section 14")
m = system.parameter("mass", "kg", default=1.0, positive=True)
length = system.parameter("length", "m", default=1.0, positive=True, meaning="length of the rod")
g = system.parameter("gravity", "m s-2", default=9.80665, positive=True, meaning="gravitational acceleration g")
L = system.parameter(
    "angular_momentum", "kg m2 s-1", default=1.0, positive=True, meaning="azimuthal angular momentum p_φ"
)

theta = system.coordinate("theta", "rad", bounds=(0.001, pi - 0.001), meaning="angle from the downward vertical")
phi = system.coordinate("phi", "rad", momentum=L, meaning="azimuth")
system.particle(m, (length * sin(theta) * cos(phi), length * sin(theta) * sin(phi), -length * cos(theta)))
system.potential(-m * g * length * cos(theta))

system.equilibrium("cone", {theta: atan((L**2 / (m**2 * g * length**3)) ** 0.25)})  # both ends, and near between

rotation = system.attitude((0, 0, L / (m * (length * sin(theta)) ** 2)), (0, 0, 1))  # the azimuth
bob = rotation * Matrix((length * sin(theta), 0, -length * cos(theta)))
system.draw("line", [(0, 0, 0), bob])
system.draw("line", [(0, 0, 0), (0, 0, -length)])
system.draw("mass", [bob])
