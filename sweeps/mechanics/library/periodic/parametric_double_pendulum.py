"""Two rods in a chain with a spring in their joint and a pivot that is shaken vertically: combination resonances.

Without the spring the shaking drives each mode alone. With it the modes are coupled, and a shaking at the sum of their
frequencies makes both grow together: multipliers of opposite signature meet on the unit circle.
"""

from sympy import cos, pi, sin

from sweeps.mechanics import System

system = System(
    "Double pendulum on a shaken pivot", references="Yakubovich and Starzhinskii (1975), chapter 5; Krein (1950)"
)
m = [system.parameter(f"mass_{i}", "kg", default=1.0, positive=True, meaning=f"mass {i}") for i in (1, 2)]
L = [system.parameter(f"length_{i}", "m", default=1.0, positive=True, meaning=f"length of rod {i}") for i in (1, 2)]
g = system.parameter("gravity", "m s-2", default=9.80665, positive=True, meaning="gravitational acceleration")
k = system.parameter("stiffness", "N m rad-1", default=10.0, least=0.0, meaning="stiffness of the joint")
A = system.parameter("amplitude", "m", default=0.05, least=0.0, meaning="amplitude of the pivot")
nu = system.parameter("frequency", "rad s-1", default=12.0, positive=True, meaning="angular frequency of the pivot")

theta = [
    system.coordinate(f"theta_{i}", "rad", bounds=(-pi, pi), periodic=True, size=1, meaning=f"angle of rod {i}")
    for i in (1, 2)
]
x, y = 0, A * cos(nu * system.time)
for mass, length, angle in zip(m, L, theta, strict=True):
    system.draw("body", [(x, y)])
    system.draw("line", [(x, y), (x + length * sin(angle), y - length * cos(angle))])
    x, y = x + length * sin(angle), y - length * cos(angle)
    system.draw("mass", [(x, y)])
    system.particle(mass, (x, y))
    system.potential(mass * g * y)
system.potential(k * (theta[1] - theta[0]) ** 2 / 2)
system.period(2 * pi / nu)

system.equilibrium("hanging", {theta[0]: 0, theta[1]: 0})
