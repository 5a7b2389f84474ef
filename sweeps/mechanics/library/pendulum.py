"""A pendulum on a rigid massless rod: it oscillates about the bottom and runs away from the top."""

from sympy import cos, pi, sin

from sweeps.mechanics import System

system = System("Pendulum", references="Landau and Lifshitz, Mechanics, sections 5 and 21")
m = system.parameter("mass", "kg", default=1.0, positive=True)
length = system.parameter("length", "m", default=1.0, positive=True, meaning="length of the rod")
g = system.parameter("gravity", "m s-2", default=9.80665, positive=True, meaning="gravitational acceleration g")

theta = system.coordinate("theta", "rad", bounds=(-pi, pi), periodic=True, meaning="angle from the downward vertical")
system.particle(m, (length * sin(theta), -length * cos(theta)))
system.potential(-m * g * length * cos(theta))

system.equilibrium("hanging", {theta: 0})
system.equilibrium("upright", {theta: pi})
