"""A bead on a hoop that turns about its vertical diameter: a pitchfork where the spin rate squared is g/R.

Below it the bottom is stable; above it the bottom is unstable, and the bead rests at cos θ = g/(R Ω²) on either side.
"""

from sympy import acos, cos, pi, sin

from sweeps.mechanics import System, drawing

system = System("Bead on a rotating hoop", references="Goldstein, Classical Mechanics, section 2.7")
m = system.parameter("mass", "kg", default=1.0, positive=True)
g = system.parameter("gravity", "m s-2", default=9.80665, positive=True, meaning="gravitational acceleration g")
R = system.parameter("radius", "m", default=1.0, positive=True, meaning="radius of the hoop")
spin = system.parameter("spin_rate", "rad s-1", default=5.0, meaning="spin rate of the hoop")

theta = system.coordinate("theta", "rad", bounds=(-pi, pi), periodic=True, meaning="angle from the downward vertical")
angle = spin * system.time
system.particle(m, (R * sin(theta) * cos(angle), R * sin(theta) * sin(angle), -R * cos(theta)))
system.potential(-m * g * R * cos(theta))

tilt = acos(g / (R * spin**2))
system.equilibrium("bottom", {theta: 0})
system.equilibrium("top", {theta: pi})
system.equilibrium("right", {theta: tilt})
system.equilibrium("left", {theta: -tilt})

system.draw("line", drawing.circle(R))
system.draw("line", [(0, -1.3 * R), (0, 1.3 * R)])
system.draw("mass", [(R * sin(theta), -R * cos(theta))])
