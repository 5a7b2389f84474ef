"""L4 and L5 of the restricted problem of three bodies: stable for a mass ratio below Routh's 0.0385208965.

Lengths in units of the bodies' distance; the frame turns with them at n, and gravity is n² times the masses' shares.
Both points are maxima of the potential: Coriolis' force alone keeps a body there.
"""

from sympy import Rational, sqrt

from sweeps.mechanics import System, drawing

system = System("Lagrange points L4 and L5", references="Routh, Proc. London Math. Soc. 6 (1875) 86; Szebehely 1967")
mu = system.parameter("mass_ratio", "1", default=0.01, least=1e-6, most=0.5, meaning="smaller mass over the total")
n = system.parameter("orbital_rate", "rad s-1", default=1.0, positive=True, meaning="rate of the circular orbit")

x = system.coordinate("x", bounds=(-2, 2), meaning="position along the line of the bodies, from their centre of mass")
y = system.coordinate("y", bounds=(-2, 2), meaning="position across that line, in the plane of the orbit")
vx, vy = system.velocity(x), system.velocity(y)
system.kinetic_energy(((vx - n * y) ** 2 + (vy + n * x) ** 2) / 2)
first, second = sqrt((x + mu) ** 2 + y**2), sqrt((x - 1 + mu) ** 2 + y**2)
system.potential(-(n**2) * ((1 - mu) / first + mu / second))

system.equilibrium("L4", {x: Rational(1, 2) - mu, y: sqrt(3) / 2})
system.equilibrium("L5", {x: Rational(1, 2) - mu, y: -sqrt(3) / 2})

for place, label in (((-mu, 0), "1 - μ"), ((1 - mu, 0), "μ")):
    system.draw("body", [place], label)
system.draw("line", drawing.circle(1 - mu))
for side, label in ((1, "L4"), (-1, "L5")):
    system.draw("line", [(-mu, 0), (Rational(1, 2) - mu, side * sqrt(3) / 2), (1 - mu, 0)])
    system.draw("body", [(Rational(1, 2) - mu, side * sqrt(3) / 2)], label)
system.draw("mass", [(x, y)])
