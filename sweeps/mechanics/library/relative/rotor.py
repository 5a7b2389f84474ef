"""A disc on a shaft in bearings that damp from outside, while the shaft's material damps from within.

R = c_e v²/2 in the bearings and c_i (v relative to axes that turn with the shaft)²/2 in the shaft. Above a critical
speed internal damping drives the whirl: with equal stiffness, where W > √(k/m) (1 + c_e/c_i); unequal bearings help.
"""

from sweeps.mechanics import System, drawing

system = System("Rotor with internal damping", references="Kimball, Gen. Electr. Rev. 27 (1924) 244; Genta, chapter 4")
m = system.parameter("mass", "kg", default=1.0, positive=True, meaning="mass of the disc")
kx = system.parameter("stiffness_x", "N m-1", default=1.0, positive=True, meaning="stiffness along x")
ky = system.parameter("stiffness_y", "N m-1", default=1.0, positive=True, meaning="stiffness along y")
outer = system.parameter("bearing_damping", "kg s-1", default=0.05, least=0.0, meaning="damping in the bearings")
inner = system.parameter("internal_damping", "kg s-1", default=0.02, least=0.0, meaning="damping within the shaft")
W = system.parameter("spin_rate", "rad s-1", default=2.0, meaning="spin rate of the shaft")

x = system.coordinate("x", "m", bounds=(-1, 1), meaning="position of the disc along x")
y = system.coordinate("y", "m", bounds=(-1, 1), meaning="position of the disc along y")
vx, vy = system.velocity(x), system.velocity(y)
system.plane(x, y)
system.kinetic_energy(m * (vx**2 + vy**2) / 2)
system.potential((kx * x**2 + ky * y**2) / 2)
system.dissipation(outer * (vx**2 + vy**2) / 2)
system.dissipation(inner * ((vx + W * y) ** 2 + (vy - W * x) ** 2) / 2)

system.equilibrium("centred", {x: 0, y: 0})

for kind, points in drawing.shaft(x, y, W * system.time).items():
    system.draw("face" if kind == "face" else "line", points)
