"""A bead on a parabolic wire y = x²/(2 l): its kinetic energy, and so a(q), depends on where it is.

The wire turns about its axis. Below the spin rate √(g/l) the bottom is stable, above it is not; at it every place is
an equilibrium, which is said (`flat`) and not guessed.
"""

from sympy import cos, sin

from sweeps.mechanics import System

system = System("Bead on a parabolic wire", references="Landau and Lifshitz, Mechanics, section 21")
m = system.parameter("mass", "kg", default=1.0, positive=True)
length = system.parameter("length", "m", default=1.0, positive=True, meaning="radius of curvature at the bottom")
g = system.parameter("gravity", "m s-2", default=9.80665, positive=True, meaning="gravitational acceleration g")
spin = system.parameter("spin_rate", "rad s-1", default=0.0, meaning="spin rate of the wire about its axis")

x = system.coordinate("x", "m", bounds=(-3 * length, 4 * length), size=length, meaning="distance from the axis")
y = x**2 / (2 * length)
system.particle(m, (x * cos(spin * system.time), x * sin(spin * system.time), y))
system.potential(m * g * y)

system.equilibrium("bottom", {x: 0})

system.draw("line", [(k * length / 5, (k * length / 5) ** 2 / (2 * length)) for k in range(-10, 11)])
system.draw("line", [(0, -length / 4), (0, length)])
system.draw("mass", [(x, y)])
