"""A double pendulum: two modes about each of its four equilibria."""

from sympy import cos, pi, sin

from sweeps.mechanics import System

system = System("Double pendulum", references="Landau and Lifshitz, Mechanics, section 5, problem 1, and section 23")
m1 = system.parameter("mass1", "kg", default=1.0, positive=True, meaning="upper mass")
m2 = system.parameter("mass2", "kg", default=1.0, positive=True, meaning="lower mass")
l1 = system.parameter("length1", "m", default=1.0, positive=True, meaning="length of the upper rod")
l2 = system.parameter("length2", "m", default=1.0, positive=True, meaning="length of the lower rod")
g = system.parameter("gravity", "m s-2", default=9.80665, positive=True, meaning="gravitational acceleration g")

upper = system.coordinate("theta1", "rad", bounds=(-pi, pi), periodic=True, meaning="angle of the upper rod")
lower = system.coordinate("theta2", "rad", bounds=(-pi, pi), periodic=True, meaning="angle of the lower rod")
x1, y1 = l1 * sin(upper), -l1 * cos(upper)
x2, y2 = x1 + l2 * sin(lower), y1 - l2 * cos(lower)
system.particle(m1, (x1, y1))
system.particle(m2, (x2, y2))
system.potential(m1 * g * y1 + m2 * g * y2)

system.equilibrium("hanging", {upper: 0, lower: 0})
system.equilibrium("lower_upright", {upper: 0, lower: pi})
system.equilibrium("upper_upright", {upper: pi, lower: 0})
system.equilibrium("upright", {upper: pi, lower: pi})
