"""Foucault's pendulum: on a turning table (or the Earth) its frequencies part by twice the table's rate.

A bob on a rod of length l, in axes that turn at W about the vertical (on the Earth, its rate times the sine of the
latitude): the eigenvalues are ±i (√(g/l) ± W). Drag against the turning table lets a slow one decay; beyond
W = √(g/l) the bob is carried along and grows, though without drag nothing happens there.
"""

from sympy import sqrt

from sweeps.mechanics import System, drawing

system = System("Foucault's pendulum", references="Landau and Lifshitz, Mechanics, section 39, problem 3")
m = system.parameter("mass", "kg", default=1.0, positive=True)
length = system.parameter("length", "m", default=1.0, positive=True, meaning="length of the rod")
g = system.parameter("gravity", "m s-2", default=9.80665, positive=True, meaning="gravitational acceleration g")
c = system.parameter("drag", "kg s-1", default=0.0, least=0.0, meaning="drag relative to the rotating frame")
W = system.parameter("spin_rate", "rad s-1", default=1.0, meaning="rotation rate of the frame about the vertical")

x = system.coordinate(
    "x", "m", bounds=(-length / 2, length / 2), size=length, meaning="position x in the rotating frame"
)
y = system.coordinate(
    "y", "m", bounds=(-length / 2, length / 2), size=length, meaning="position y in the rotating frame"
)
vx, vy = system.velocity(x), system.velocity(y)
system.plane(x, y)
depth = sqrt(length**2 - x**2 - y**2)
fall = (x * vx + y * vy) / depth
system.kinetic_energy(m * ((vx - W * y) ** 2 + (vy + W * x) ** 2 + fall**2) / 2)
system.potential(-m * g * depth)
system.dissipation(c * (vx**2 + vy**2) / 2)

system.equilibrium("hanging", {x: 0, y: 0})

system.draw("line", [(0, 0, length), (x, y, length - depth)])
system.draw("mass", [(x, y, length - depth)])
system.draw("line", [(length * u / 2, length * v / 2, 0) for u, v in drawing.circle()], "turning table")
