"""An ion in a linear radio-frequency trap: x'' + (a - 2 q cos 2τ) x = 0 and y'' - (a - 2 q cos 2τ) y = 0.

The field that confines it in one plane expels it in the second, half a period later vice versa; τ = Ωt/2.
"""

from sympy import cos, cosh, pi, sinh

from sweeps.mechanics import System

system = System("Paul trap", references="Paul, Rev. Mod. Phys. 62 (1990) 531")
a = system.parameter("a", default=0.0, meaning="constant voltage a")
q = system.parameter("q", default=0.5, meaning="radio-frequency voltage q")

x, y = (system.coordinate(name, bounds=(-1, 1), meaning=f"position along {name}") for name in "xy")
system.kinetic_energy((system.velocity(x) ** 2 + system.velocity(y) ** 2) / 2)
system.potential((a - 2 * q * cos(2 * system.time)) * (x**2 - y**2) / 2)
system.period(pi)

system.equilibrium("centre", {x: 0, y: 0})

for side in (1, -1):  # the four rods, on which the potential is that of the voltage
    arc = [(side * cosh(k / 5), sinh(k / 5)) for k in range(-5, 6)]
    system.draw("line", arc)
    system.draw("line", [(v, u) for u, v in arc])
system.draw("mass", [(x, y)])
