"""A gyrostat: a body with a rotor inside, whose momentum h along axis 2 is constant, spins about axis 2.

I ω' = (I ω + h e2) × ω. About it Ω² = [(I2 − I3) W + h] [(I2 − I1) W + h] / (I1 I3): the rotor works as if axis 2 had
h/W more of a moment, so that one fast enough saves the middle axis.
"""

from sweeps.mechanics import System

system = System("Gyrostat", references="Wittenburg, Dynamics of Multibody Systems, section 4.6; Likins, JPL TR 32-860")
I1 = system.parameter("I1", "kg m2", default=1.0, positive=True, meaning="moment of inertia about axis 1")
I2 = system.parameter("I2", "kg m2", default=2.0, positive=True, meaning="moment of inertia about axis 2")
I3 = system.parameter("I3", "kg m2", default=3.0, positive=True, meaning="moment of inertia about axis 3")
h = system.parameter("rotor_momentum", "kg m2 s-1", default=0.0, meaning="momentum of the rotor, along axis 2")
W = system.parameter("spin_rate", "rad s-1", default=1.0, meaning="spin rate of the body about axis 2")

turn = 3 * abs(W) + abs(h) / I2
w1, w2, w3 = (
    system.state(f"omega{k}", "rad s-1", bounds=(-turn, turn), size=turn, meaning=f"angular velocity about axis {k}")
    for k in (1, 2, 3)
)
L = I2 * w2 + h
system.rate(w1, (L * w3 - I3 * w3 * w2) / I1)
system.rate(w2, (I3 - I1) * w3 * w1 / I2)
system.rate(w3, (I1 * w1 * w2 - L * w1) / I3)
system.conserved((I1 * w1**2 + I2 * w2**2 + I3 * w3**2) / 2, "energy")
system.conserved((I1 * w1) ** 2 + L**2 + (I3 * w3) ** 2, "momentum")

system.equilibrium("spin", {w1: 0, w2: W, w3: 0})
