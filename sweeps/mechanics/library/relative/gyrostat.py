"""A gyrostat: a body with a rotor of constant momentum h along axis 2, spins about axis 2.

I ω' = (I ω + h e2) × ω. About it Ω² = [(I2 − I3) W + h] [(I2 − I1) W + h] / (I1 I3): the rotor works as if axis 2 had
h/W more of a moment, so that one fast enough saves the middle axis.
"""

from sympy import Matrix, cos, pi, sin, sqrt

from sweeps.mechanics import System, drawing

system = System("Gyrostat", references="Wittenburg, Dynamics of Multibody Systems, section 4.6; Likins, JPL TR 32-860")
I1 = system.parameter("I1", "kg m2", default=1.0, positive=True, meaning="moment of inertia about axis 1")
I2 = system.parameter("I2", "kg m2", default=2.0, positive=True, meaning="moment of inertia about axis 2")
I3 = system.parameter("I3", "kg m2", default=3.0, positive=True, meaning="moment of inertia about axis 3")
h = system.parameter("rotor_momentum", "kg m2 s-1", default=0.0, meaning="momentum of the rotor, along axis 2")
W = system.parameter("spin_rate", "rad s-1", default=1.0, meaning="spin rate of the body about axis 2")

limit = 3 * abs(W) + abs(h) / I2
w1, w2, w3 = (
    system.state(f"omega{k}", "rad s-1", bounds=(-limit, limit), size=limit, meaning=f"angular velocity about axis {k}")
    for k in (1, 2, 3)
)
L = I2 * w2 + h
system.rate(w1, (L * w3 - I3 * w3 * w2) / I1)
system.rate(w2, (I3 - I1) * w3 * w1 / I2)
system.rate(w3, (I1 * w1 * w2 - L * w1) / I3)
system.conserved((I1 * w1**2 + I2 * w2**2 + I3 * w3**2) / 2, "energy")
system.conserved((I1 * w1) ** 2 + L**2 + (I3 * w3) ** 2, "momentum")

system.equilibrium("spin", {w1: 0, w2: W, w3: 0})

rotation = system.attitude((w1, w2, w3), (I1 * w1, L, I3 * w3))
half = [sqrt(abs(a) / (I1 + I2 + I3)) + 0.05 for a in (I2 + I3 - I1, I3 + I1 - I2, I1 + I2 - I3)]
for face in drawing.box(half, rotation):
    system.draw("face", face)
wheel = [(0.3 * u, half[1] + 0.02, 0.3 * v) for u, v in drawing.circle(corners=16)]
system.draw("face", [rotation * Matrix(point) for point in wheel])
for angle in (0, pi / 2):
    c, s = 0.3 * cos(3 * h * system.time + angle), 0.3 * sin(3 * h * system.time + angle)
    system.draw("line", [rotation * Matrix((k * c, half[1] + 0.04, k * s)) for k in (-1, 1)])
system.draw("mass", [rotation * Matrix((0, 1.3, 0))], "2")
system.draw("line", [(0, 0, 0), (0, 0, 1.5)], "L")
