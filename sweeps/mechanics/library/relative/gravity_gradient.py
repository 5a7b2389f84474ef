"""A satellite in the Earth's gravity gradient, on a circular orbit: Lagrange's and DeBra and Delp's regions.

Axes 1 (roll) along the velocity, 2 (pitch) along minus the orbit's normal, 3 (yaw) to the Earth; n is the orbital rate,
k1 = (I2 − I3)/I1 and k3 = (I2 − I1)/I3. I ω' = I ω × ω + 3 n² c × I c with c the nadir, and Cardan angles. Lagrange's
region, 0 < k3 < k1, is a minimum of the energy; DeBra and Delp's, k3 < k1 < 0, is stable by gyroscopic forces alone.
"""

from sympy import cos, pi, sin, tan

from sweeps.mechanics import System, drawing

system = System("Satellite in the gravity gradient", references="DeBra and Delp, J. Astronaut. Sci. 8 (1961) 14")
k1 = system.parameter("k1", "1", default=0.7, least=-0.9999, most=0.9999, meaning="(I2 - I3)/I1")
k3 = system.parameter("k3", "1", default=0.3, least=-0.9999, most=0.9999, meaning="(I2 - I1)/I3")
n = system.parameter("orbital_rate", "rad s-1", default=1.0, positive=True, meaning="rate of the circular orbit")

I1, I2, I3 = (1 - k3) / (1 - k1 * k3), 1, (1 - k1) / (1 - k1 * k3)  # the pitch moment is the unit
k2 = (k3 - k1) / (1 - k1 * k3)  # (I3 - I1)/I2
w1, w2, w3 = (
    system.state(f"omega{k}", "rad s-1", bounds=(-4 * n, 4 * n), size=n, meaning=f"angular velocity about axis {k}")
    for k in (1, 2, 3)
)
roll, pitch, yaw = (
    system.state(name, "rad", bounds=(-pi / 3, pi / 3), meaning=f"{name} angle") for name in ("roll", "pitch", "yaw")
)
c1, c2, c3 = -sin(pitch), sin(roll) * cos(pitch), cos(roll) * cos(pitch)  # the nadir
o1 = -n * cos(pitch) * sin(yaw)  # the orbital frame's angular velocity
o2 = -n * (sin(roll) * sin(pitch) * sin(yaw) + cos(roll) * cos(yaw))
o3 = -n * (cos(roll) * sin(pitch) * sin(yaw) - sin(roll) * cos(yaw))
system.rate(w1, k1 * (w2 * w3 - 3 * n**2 * c2 * c3))  # by the ratios: differences of moments would cancel
system.rate(w2, k2 * (w3 * w1 - 3 * n**2 * c3 * c1))
system.rate(w3, -k3 * (w1 * w2 - 3 * n**2 * c1 * c2))
shaft_torque = (w2 - o2) * sin(roll) + (w3 - o3) * cos(roll)
system.rate(roll, w1 - o1 + shaft_torque * tan(pitch))
system.rate(pitch, (w2 - o2) * cos(roll) - (w3 - o3) * sin(roll))
system.rate(yaw, shaft_torque / cos(pitch))
energy = I1 * (w1**2 / 2 - o1 * w1) + I2 * (w2**2 / 2 - o2 * w2) + I3 * (w3**2 / 2 - o3 * w3)
system.conserved(energy + 3 * n**2 * (I1 * c1**2 + I2 * c2**2 + I3 * c3**2) / 2, "energy")

system.equilibrium("earth_pointing", {w1: 0, w2: -n, w3: 0, roll: 0, pitch: 0, yaw: 0})

for piece in drawing.satellite((I1, I2, I3), roll, pitch, yaw):
    system.draw(*piece)
