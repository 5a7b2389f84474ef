"""A disc on a turning shaft that is stiffer in one direction than across it, seen from the room.

Its stiffness turns with it: k (1 + d) along one axis of the shaft and k (1 - d) along the second, so the equations have
the period of a half turn. In axes that turn along they are constant: between √(k (1 - d)/m) and √(k (1 + d)/m) the
whirl grows.
"""

from sympy import cos, pi, sin

from sweeps.mechanics import System, drawing

system = System("Asymmetric shaft", references="Genta, Dynamics of Rotating Systems (2005), chapter 6")
m = system.parameter("mass", "kg", default=1.0, positive=True, meaning="mass of the disc")
k = system.parameter("stiffness", "N m-1", default=1.0, positive=True, meaning="mean stiffness of the shaft")
d = system.parameter("asymmetry", default=0.2, least=0.0, most=1.0, meaning="asymmetry of the stiffness")
W = system.parameter("spin_rate", "rad s-1", default=0.5, positive=True, meaning="spin rate of the shaft")

x, y = (system.coordinate(name, "m", bounds=(-1, 1), meaning=f"position of the disc along {name}") for name in "xy")
rotation = 2 * W * system.time
system.kinetic_energy(m * (system.velocity(x) ** 2 + system.velocity(y) ** 2) / 2)
system.potential(k * (x**2 + y**2 + d * ((x**2 - y**2) * cos(rotation) + 2 * x * y * sin(rotation))) / 2)
system.period(pi / W)

system.equilibrium("centred", {x: 0, y: 0})

for kind, points in drawing.shaft(x, y, W * system.time, 0.4).items():
    system.draw("face" if kind == "face" else "line", points)
