"""A pendulum on a rod with a pivot that is shaken to and fro: upside down is stable if it is fast enough.

The pivot moves by A cos νt along a line that leans by `direction` from the vertical. Shaken vertically, hanging and
inverted are equilibria at all times; else the pendulum swings about them with the pivot's period.
"""

from sympy import cos, pi, sin

from sweeps.mechanics import System

system = System("Kapitza's pendulum", references="Kapitza, Sov. Phys. JETP 21 (1951) 588; Butikov, AJP 86 (2018) 257")
L = system.parameter("length", "m", default=1.0, positive=True, meaning="length of the rod")
g = system.parameter("gravity", "m s-2", default=9.80665, positive=True, meaning="gravitational acceleration")
A = system.parameter("amplitude", "m", default=0.1, least=0.0, meaning="amplitude of the pivot")
nu = system.parameter("frequency", "rad s-1", default=60.0, positive=True, meaning="angular frequency of the pivot")
lean = system.parameter("direction", "rad", default=0.0, meaning="angle of the shaking from the vertical")
c = system.parameter("damping", "s-1", default=0.0, least=0.0, meaning="twice the rate of decay of small oscillations")

theta = system.coordinate("theta", "rad", bounds=(-pi, pi), periodic=True, size=1, meaning="angle from hanging")
pivot_height = A * cos(nu * system.time)
x, y = pivot_height * sin(lean) + L * sin(theta), pivot_height * cos(lean) - L * cos(theta)
system.particle(1, (x, y))
system.potential(g * y)
system.dissipation(c * L**2 * system.velocity(theta) ** 2 / 2)
system.period(2 * pi / nu)

system.equilibrium("inverted", {theta: pi})
system.equilibrium("hanging", {theta: 0})

pivot = (pivot_height * sin(lean), pivot_height * cos(lean))
system.draw("line", [pivot, (x, y)])
system.draw("line", [(-L * sin(lean) / 4, -L * cos(lean) / 4), (L * sin(lean) / 4, L * cos(lean) / 4)])
system.draw("body", [pivot])
system.draw("mass", [(x, y)])
