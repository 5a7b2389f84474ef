"""Mathieu's equation, y'' + 2 c y' + (a - 2 q cos 2t) y = 0: the chart of Ince and Strutt."""

from sympy import cos, pi, sqrt

from sweeps.mechanics import System, drawing

system = System("Mathieu's equation", references="McLachlan, Theory and Application of Mathieu Functions (1947)")
a = system.parameter("a", default=1.0, meaning="mean stiffness a")
q = system.parameter("q", default=0.1, meaning="half the amplitude q of the stiffness")
c = system.parameter("damping", default=0.0, least=0.0, meaning="rate of decay c without modulation")

y = system.coordinate("y", bounds=(-1, 1), meaning="displacement y")
system.kinetic_energy(system.velocity(y) ** 2 / 2)
system.potential((a - 2 * q * cos(2 * system.time)) * y**2 / 2)
system.dissipation(c * system.velocity(y) ** 2)
system.period(pi)

system.equilibrium("rest", {y: 0})

stiff = (a - 2 * q * cos(2 * system.time)) / (1 + sqrt(a**2 + 4 * q**2))  # the spring's width shows it
system.draw("line", drawing.spring(-2, y, 0.2 + 0.15 * stiff))
system.draw("line", [(-2, -0.6), (-2, 0.6)])
system.draw("mass", [(y, 0)])
