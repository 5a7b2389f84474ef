"""A child on a swing, who raises and lowers the body: the length of the pendulum is L (1 + d cos νt)."""

from sympy import cos, pi, sin

from sweeps.mechanics import System

system = System("Swing", references="Case and Swanson, Am. J. Phys. 58 (1990) 463")
L = system.parameter("length", "m", default=2.5, positive=True, meaning="mean length")
g = system.parameter("gravity", "m s-2", default=9.80665, positive=True, meaning="gravitational acceleration")
d = system.parameter("depth", default=0.05, least=0.0, most=0.9, meaning="depth of the modulation of the length")
nu = system.parameter("frequency", "rad s-1", default=4.0, positive=True, meaning="angular frequency of the pumping")
c = system.parameter("damping", "s-1", default=0.0, least=0.0, meaning="twice the rate of decay without pumping")

theta = system.coordinate("theta", "rad", bounds=(-pi, pi), periodic=True, size=1, meaning="angle from the vertical")
length = L * (1 + d * cos(nu * system.time))
system.particle(1, (length * sin(theta), -length * cos(theta)))
system.potential(-g * length * cos(theta))
system.dissipation(c * length**2 * system.velocity(theta) ** 2 / 2)
system.period(2 * pi / nu)

system.equilibrium("hanging", {theta: 0})

system.draw("line", [(0, 0), (length * sin(theta), -length * cos(theta))])
system.draw("line", [(-L / 4, 0), (L / 4, 0)])
system.draw("mass", [(length * sin(theta), -length * cos(theta))])
