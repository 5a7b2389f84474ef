"""A particle on a surface that turns: a saddle confines it if it turns fast enough, and not if the air resists.

In axes that turn at W, T = m [(x' − W y)² + (y' + W x)²]/2 and V = (kx x² + ky y²)/2. Without drag it is stable for
kx, ky > m W², and again where both are less and the saddle is not too steep; drag relative to the air at rest takes the
second, gyroscopic, region away (Thomson and Tait).
"""

from sympy import cos, sin, sqrt

from sweeps.mechanics import System

system = System("Rotating saddle", references="Thompson, Can. J. Phys. 80 (2002) 1433; Bloch et al. 1994")
m = system.parameter("mass", "kg", default=1.0, positive=True)
kx = system.parameter("stiffness_x", "N m-1", default=1.0, meaning="curvature of the potential along x")
ky = system.parameter("stiffness_y", "N m-1", default=-1.0, meaning="curvature of the potential along y")
c = system.parameter("drag", "kg s-1", default=0.0, least=0.0, meaning="drag relative to the air at rest")
W = system.parameter("spin_rate", "rad s-1", default=2.0, meaning="spin rate of the surface")

x = system.coordinate("x", "m", bounds=(-1, 1), meaning="position x in the rotating frame")
y = system.coordinate("y", "m", bounds=(-1, 1), meaning="position y in the rotating frame")
vx, vy = system.velocity(x) - W * y, system.velocity(y) + W * x
system.kinetic_energy(m * (vx**2 + vy**2) / 2)
system.potential((kx * x**2 + ky * y**2) / 2)
system.dissipation(c * (vx**2 + vy**2) / 2)

system.equilibrium("centre", {x: 0, y: 0})

angle, steep = W * system.time, 0.4 / sqrt(kx**2 + ky**2)


def surface_point(u, v):
    """Return a place of the surface, which turns."""
    return u * cos(angle) - v * sin(angle), u * sin(angle) + v * cos(angle), steep * (kx * u**2 + ky * v**2)


across = [k / 4 for k in range(-4, 5)]
for u in across:
    system.draw("line", [surface_point(u, v) for v in across])
    system.draw("line", [surface_point(v, u) for v in across])
system.draw("mass", [surface_point(x, y)])
