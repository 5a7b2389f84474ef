"""A particle in the double well V = −α x²/2 + β x⁴/4: two wells at ±√(α/β) and the hill between them."""

from sympy import sqrt

from sweeps.mechanics import System

system = System("Double well", references="Landau and Lifshitz, Mechanics, sections 21 and 28")
m = system.parameter("mass", "kg", default=1.0, positive=True)
alpha = system.parameter("alpha", "N m-1", default=1.0, positive=True, meaning="steepness of the hill")
beta = system.parameter("beta", "N m-3", default=1.0, positive=True, meaning="stiffness of the walls")

well = sqrt(alpha / beta)
x = system.coordinate("x", "m", bounds=(-3 * well, 3 * well), size=well, meaning="place")
system.kinetic_energy(m * system.velocity(x) ** 2 / 2)
system.potential(-alpha * x**2 / 2 + beta * x**4 / 4)

system.equilibrium("hill", {x: 0})
system.equilibrium("right", {x: well})
system.equilibrium("left", {x: -well})

system.draw("line", [(k * well / 10, ((k / 10) ** 4 / 2 - (k / 10) ** 2) * well) for k in range(-16, 17)])
system.draw("mass", [(x, (x**4 / well**4 / 2 - x**2 / well**2) * well)])
