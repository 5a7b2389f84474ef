"""A top that sleeps: a body about a fixed point spins about the vertical, its centre of mass straight above or below.

Euler's and Poisson's equations in the body's axes, I ω' = I ω × ω + P γ × e3, γ' = γ × ω, with γ the vertical and
P = m g l. A symmetric top sleeps where I3² W² > 4 I1 P; P = 0 is the free body, whose own map is this one's edge, and
P < 0 hangs.
"""

from sympy import Matrix

from sweeps.mechanics import System, drawing

system = System("Sleeping top", references="Landau and Lifshitz, Mechanics, section 35; Lewis et al., Math. Mod. 1992")
I1 = system.parameter("I1", "kg m2", default=1.0, positive=True, meaning="moment of inertia about axis 1")
I2 = system.parameter("I2", "kg m2", default=1.0, positive=True, meaning="moment of inertia about axis 2")
I3 = system.parameter("I3", "kg m2", default=0.6, positive=True, meaning="moment of inertia about the spin axis")
P = system.parameter("moment_of_weight", "N m", default=2.0, meaning="m g l: weight times height of the centre of mass")
W = system.parameter("spin_rate", "rad s-1", default=3.0, meaning="spin rate about the vertical")

limit = 3 * abs(W) + 1  # how far the search for the equilibrium may look
w1, w2, w3 = (
    system.state(f"omega{k}", "rad s-1", bounds=(-limit, limit), size=limit, meaning=f"angular velocity about axis {k}")
    for k in (1, 2, 3)
)
g1, g2, g3 = (system.state(f"gamma{k}", bounds=(-2, 2), meaning=f"vertical along axis {k}") for k in (1, 2, 3))
system.rate(w1, ((I2 - I3) * w2 * w3 + P * g2) / I1)
system.rate(w2, ((I3 - I1) * w3 * w1 - P * g1) / I2)
system.rate(w3, (I1 - I2) * w1 * w2 / I3)
system.rate(g1, g2 * w3 - g3 * w2)
system.rate(g2, g3 * w1 - g1 * w3)
system.rate(g3, g1 * w2 - g2 * w1)
system.conserved(g1**2 + g2**2 + g3**2, "vertical")
system.conserved(I1 * w1 * g1 + I2 * w2 * g2 + I3 * w3 * g3, "vertical_momentum")

system.equilibrium("sleeping", {w1: 0, w2: 0, w3: W, g1: 0, g2: 0, g3: 1})

rotation, side = system.attitude((w1, w2, w3), (g1, g2, g3)), (P + 1e-9) / abs(P + 1e-9)  # it hangs where P < 0
for face in drawing.cylinder(0.45, 0, 0.8 * side, rotation, tip=0.02):
    system.draw("face", face)
system.draw("line", [rotation * Matrix((0.45 * k, 0, 0.81 * side)) for k in (0, 1)])
system.draw("mass", [rotation * Matrix((0, 0, 1.1 * side))])
system.draw("line", [(0, 0, 0), (0, 0, 1.3 * side)])
