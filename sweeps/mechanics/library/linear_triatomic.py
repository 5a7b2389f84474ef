"""A linear triatomic molecule A-B-A along its line: it moves as a whole, stretches evenly, and stretches oddly.

V depends on the distances alone, so the molecule's equilibria form a line: the first atom is fixed while they are
searched, and the mode along the line is flat (ω² = 0). The bonds are Morse's, so V‴ does not vanish.
"""

from sympy import exp, sqrt

from sweeps.mechanics import System, drawing

system = System("Linear triatomic molecule", references="Landau and Lifshitz, Mechanics, section 24, problem 1")
outer = system.parameter("outer_mass", "kg", default=2.6566962e-26, positive=True, meaning="mass of each atom A")
inner = system.parameter("inner_mass", "kg", default=1.9926467e-26, positive=True, meaning="mass of the atom B")
k = system.parameter("stiffness", "N m-1", default=1600.0, positive=True, meaning="V″ of a bond")
b = system.parameter("bond", "m", default=1.16e-10, positive=True, meaning="length of a bond")
depth = system.parameter("depth", "J", default=8.8e-19, positive=True, meaning="energy that breaks a bond")

x1 = system.coordinate("x1", "m", bounds=(-b, b), size=b, hold=0, meaning="position of the first atom A")
x2 = system.coordinate("x2", "m", bounds=(b / 2, 3 * b / 2), size=b, meaning="position of the atom B")
x3 = system.coordinate("x3", "m", bounds=(3 * b / 2, 5 * b / 2), size=b, meaning="position of the second atom A")
for mass, place in ((outer, x1), (inner, x2), (outer, x3)):
    system.particle(mass, (place,))
width = sqrt(k / (2 * depth))
for stretch in (x2 - x1 - b, x3 - x2 - b):
    system.potential(depth * (1 - exp(-width * stretch)) ** 2)

system.equilibrium("straight", {x1: 0, x2: b, x3: 2 * b})

for start, end in ((x1, x2), (x2, x3)):
    system.draw("line", drawing.spring(start - b, end - b, b / 8))
for place in (x1, x2, x3):
    system.draw("mass", [(place - b, 0)])
