"""A free body with a viscous slug, and a rotor if you like: the major-axis rule, which Explorer 1 taught.

I ω' = −ω × (I ω + h e3) − κ (ω − s), J (s' + ω × s) = κ (ω − s): a symmetric body spins about its axis 3, a spherical
slug of moment J within drags, and a rotor holds the momentum h. The momentum of all is conserved, the energy is not:
about the axis of least moment the nutation grows, about that of the greatest it decays. With a rotor it decays where
λ λ0 > 0, λ0 = (I_s W + h)/I_t and λ = λ0 − W (Landon and Iorillo).
"""

from sympy import Matrix, sqrt

from sweeps.mechanics import System, drawing

system = System(
    "Free body with a viscous slug", references="Likins, JPL TR 32-860; Hughes, Spacecraft Attitude Dynamics"
)
It = system.parameter("transverse_moment", "kg m2", default=1.0, positive=True, meaning="transverse moment")
Is = system.parameter("axial_moment", "kg m2", default=0.3, positive=True, meaning="axial moment")
J = system.parameter("slug_moment", "kg m2", default=0.01, positive=True, meaning="moment of the slug")
kappa = system.parameter("drag", "N m s", default=0.005, positive=True, meaning="viscous coefficient of the slug")
h = system.parameter("rotor_momentum", "kg m2 s-1", default=0.0, meaning="momentum of a rotor along the axis")
W = system.parameter("spin_rate", "rad s-1", default=2.0, meaning="spin rate of body and slug")

limit = 3 * abs(W) + abs(h) / It
w1, w2, w3 = (
    system.state(f"omega{k}", "rad s-1", bounds=(-limit, limit), size=limit, meaning=f"angular velocity about axis {k}")
    for k in (1, 2, 3)
)
s1, s2, s3 = (
    system.state(f"slug{k}", "rad s-1", bounds=(-limit, limit), size=limit, meaning=f"slug's velocity about axis {k}")
    for k in (1, 2, 3)
)
L = Is * w3 + h
system.rate(w1, (It * w2 * w3 - L * w2 - kappa * (w1 - s1)) / It)
system.rate(w2, (L * w1 - It * w1 * w3 - kappa * (w2 - s2)) / It)
system.rate(w3, -kappa * (w3 - s3) / Is)
system.rate(s1, kappa / J * (w1 - s1) + w3 * s2 - w2 * s3)
system.rate(s2, kappa / J * (w2 - s2) + w1 * s3 - w3 * s1)
system.rate(s3, kappa / J * (w3 - s3) + w2 * s1 - w1 * s2)
total = (It * w1 + J * s1, It * w2 + J * s2, L + J * s3)
system.conserved(sum(piece**2 for piece in total), "momentum")

system.equilibrium("spin", {w1: 0, w2: 0, w3: W, s1: 0, s2: 0, s3: W})

rotation = system.attitude((w1, w2, w3), total)
wide, half = 0.9 * sqrt(Is / It) + 0.02, 0.9 * sqrt(abs(2 * It - Is) / (2 * It)) + 0.02
for face in drawing.cylinder(wide, -half, half, rotation):
    system.draw("face", face)
for side in ((1, 0), (0, 1), (-1, 0), (0, -1)):
    system.draw("line", [rotation * Matrix((k * wide * side[0], k * wide * side[1], 0)) for k in (1, 1.6)])
system.draw("mass", [rotation * Matrix((0, 0, half + 0.3))], "3")
system.draw("line", [(0, 0, 0), (0, 0, 1.5)], "L")
