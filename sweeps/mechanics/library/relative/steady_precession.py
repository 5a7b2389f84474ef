"""A heavy symmetric top in steady precession at a tilt: two rates of it, or none.

With w3 the spin about the figure axis (constant) and P = m g l, a precession at the tilt θ has the rate φ' where
I1 cos θ φ'² − I3 w3 φ' + P = 0: a slow and a fast one, where I3² w3² > 4 I1 P cos θ. About either the top nods.
"""

from sympy import Matrix, cos, pi, sin, sqrt

from sweeps.mechanics import System, drawing

system = System("Steady precession of a top", references="Goldstein, Classical Mechanics, section 5.7")
I1 = system.parameter("I1", "kg m2", default=1.0, positive=True, meaning="transverse moment")
I3 = system.parameter("I3", "kg m2", default=0.6, positive=True, meaning="moment about the figure axis")
P = system.parameter("moment_of_weight", "N m", default=2.0, positive=True, meaning="m g l")
tilt = system.parameter(
    "tilt", "rad", default=0.5, least=0.01, most=3.13, meaning="angle of the axis from the vertical"
)
w3 = system.parameter("spin_rate", "rad s-1", default=6.0, meaning="spin rate about the figure axis")

rate = sqrt(P / I1) + I3 * abs(w3) / I1
theta = system.state("theta", "rad", bounds=(0, pi), meaning="angle of the axis from the vertical")
nutation = system.state("nutation_rate", "rad s-1", bounds=(-rate, rate), size=rate, meaning="nutation rate")
most = 4 * rate / sqrt(cos(tilt) ** 2 + 0.0001)
max_rate = system.state("precession", "rad s-1", bounds=(-most, most), size=rate, meaning="precession rate")
system.rate(theta, nutation)
system.rate(nutation, (max_rate**2 * cos(theta) - I3 * w3 / I1 * max_rate + P / I1) * sin(theta))
system.rate(max_rate, (I3 * w3 / I1 - 2 * max_rate * cos(theta)) * nutation / sin(theta))
system.conserved(I1 * max_rate * sin(theta) ** 2 + I3 * w3 * cos(theta), "vertical_momentum")
energy = I1 * (nutation**2 + max_rate**2 * sin(theta) ** 2) / 2 + P * cos(theta)
system.conserved(energy, "energy")

root = sqrt((I3 * w3) ** 2 - 4 * I1 * P * cos(tilt))
sense = w3 / abs(w3)
system.equilibrium("slow", {theta: tilt, nutation: 0, max_rate: 2 * P / (I3 * w3 + sense * root)})
system.equilibrium("fast", {theta: tilt, nutation: 0, max_rate: (I3 * w3 + sense * root) / (2 * I1 * cos(tilt))})

rotation = system.attitude((nutation, max_rate * sin(theta), max_rate * cos(theta)), (0, sin(theta), cos(theta)))
for face in drawing.cylinder(0.45, 0, 0.8, rotation, tip=0.02):
    system.draw("face", face)
spun = (w3 - max_rate * cos(theta)) * system.time
system.draw("line", [rotation * Matrix((0.45 * k * cos(spun), 0.45 * k * sin(spun), 0.81)) for k in (0, 1)])
system.draw("mass", [rotation * Matrix((0, 0, 1.1))])
system.draw("line", [(0, 0, 0), (0, 0, 1.3)])
