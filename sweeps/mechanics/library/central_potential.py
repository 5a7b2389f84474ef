"""A particle in the central potential V = k r^s/s, in spherical polar coordinates, about its circular motion.

The azimuth is cyclic, so its momentum L is a parameter and the effective potential V + L²/(2 m r² sin²θ) remains. The
radial oscillation has √(s + 2) times the orbital rate: twice it in the harmonic well (s = 2), once it in Kepler's
potential (s = −1); the second mode tilts the orbit's plane, at the orbital rate whatever s is.
"""

from sympy import Matrix, cos, pi, sin

from sweeps.mechanics import System, drawing

system = System("Circular motion in a central potential", references="Landau and Lifshitz, Mechanics, section 14")
m = system.parameter("mass", "kg", default=1.0, positive=True)
k = system.parameter("strength", "1", default=1.0, positive=True, meaning="coefficient k of V = k rˢ/s, in J m-s")
s = system.parameter("exponent", "1", default=-1.0, least=-1.95, most=12.0, meaning="exponent s of V = k rˢ/s; not 0")
L = system.parameter(
    "angular_momentum", "kg m2 s-1", default=1.0, positive=True, meaning="azimuthal angular momentum p_φ"
)

circle = (L**2 / (m * k)) ** (1 / (s + 2))
r = system.coordinate("r", "m", bounds=(circle / 4, circle * 4), positive=True, size=circle, meaning="distance")
theta = system.coordinate("theta", "rad", bounds=(pi / 8, 7 * pi / 8), meaning="polar angle")
phi = system.coordinate("phi", "rad", momentum=L, meaning="azimuth")
system.particle(m, (r * sin(theta) * cos(phi), r * sin(theta) * sin(phi), r * cos(theta)))
system.potential(k * r**s / s)

system.equilibrium("circle", {r: circle, theta: pi / 2})

rotation = system.attitude((0, 0, L / (m * r**2 * sin(theta) ** 2)), (0, 0, 1))  # the azimuth
system.draw("body", [(0, 0, 0)])
system.draw("line", [(circle * u, circle * v, 0) for u, v in drawing.circle()])
system.draw("mass", [rotation * Matrix((r * sin(theta), 0, r * cos(theta)))])
