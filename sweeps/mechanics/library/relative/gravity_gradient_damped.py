"""The satellite of `gravity_gradient` with a viscous slug: the effect of damping on its two stable regions.

The slug is a sphere of moment J (here in units of the roll moment) that turns at s within the body, and drags with
κ (ω − s): it takes no torque from the Earth. Lagrange's region decays. In DeBra and Delp's, which gyroscopic forces
stabilise, the slightest damping makes the motion grow (Thomson and Tait; Chetaev).
"""

from sympy import cos, pi, sin, tan

from sweeps.mechanics import System, drawing

system = System("Damped satellite in the gravity gradient", references="Merkin, Theory of Stability, chapter 6")
k1 = system.parameter("k1", "1", default=0.7, least=-0.9999, most=0.9999, meaning="(I2 - I3)/I1")
k3 = system.parameter("k3", "1", default=0.3, least=-0.9999, most=0.9999, meaning="(I2 - I1)/I3")
n = system.parameter("orbital_rate", "rad s-1", default=1.0, positive=True, meaning="rate of the circular orbit")
slug = system.parameter("slug", "1", default=0.01, positive=True, meaning="moment of the slug over that of roll")
drag = system.parameter(
    "drag", "1", default=0.02, positive=True, meaning="viscous coefficient over roll moment and rate"
)

I1, k2 = (1 - k3) / (1 - k1 * k3), (k3 - k1) / (1 - k1 * k3)  # in units of the pitch moment; k2 is (I3 - I1)/I2
w1, w2, w3 = (
    system.state(f"omega{k}", "rad s-1", bounds=(-4 * n, 4 * n), size=n, meaning=f"angular velocity about axis {k}")
    for k in (1, 2, 3)
)
s1, s2, s3 = (
    system.state(f"slug{k}", "rad s-1", bounds=(-4 * n, 4 * n), size=n, meaning=f"slug's velocity about axis {k}")
    for k in (1, 2, 3)
)
roll, pitch, yaw = (
    system.state(name, "rad", bounds=(-pi / 3, pi / 3), meaning=f"{name} angle") for name in ("roll", "pitch", "yaw")
)
c1, c2, c3 = -sin(pitch), sin(roll) * cos(pitch), cos(roll) * cos(pitch)
o1 = -n * cos(pitch) * sin(yaw)
o2 = -n * (sin(roll) * sin(pitch) * sin(yaw) + cos(roll) * cos(yaw))
o3 = -n * (cos(roll) * sin(pitch) * sin(yaw) - sin(roll) * cos(yaw))
# by the ratios: differences of moments would cancel
system.rate(w1, k1 * (w2 * w3 - 3 * n**2 * c2 * c3) - drag * n * (w1 - s1))
system.rate(w2, k2 * (w3 * w1 - 3 * n**2 * c3 * c1) - drag * n * I1 * (w2 - s2))
system.rate(w3, -k3 * (w1 * w2 - 3 * n**2 * c1 * c2) - drag * n * (1 - k3) / (1 - k1) * (w3 - s3))
relax = drag * n / slug
system.rate(s1, relax * (w1 - s1) + w3 * s2 - w2 * s3)
system.rate(s2, relax * (w2 - s2) + w1 * s3 - w3 * s1)
system.rate(s3, relax * (w3 - s3) + w2 * s1 - w1 * s2)
shaft_torque = (w2 - o2) * sin(roll) + (w3 - o3) * cos(roll)
system.rate(roll, w1 - o1 + shaft_torque * tan(pitch))
system.rate(pitch, (w2 - o2) * cos(roll) - (w3 - o3) * sin(roll))
system.rate(yaw, shaft_torque / cos(pitch))

still = {w1: 0, w2: -n, w3: 0, s1: 0, s2: -n, s3: 0, roll: 0, pitch: 0, yaw: 0}
system.equilibrium("earth_pointing", still)

I2, I3 = 1, (1 - k1) / (1 - k1 * k3)
for piece in drawing.satellite((I1, I2, I3), roll, pitch, yaw):
    system.draw(*piece)
