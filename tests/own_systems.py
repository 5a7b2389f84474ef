"""Systems and definitions as a user writes them outside the tree: gyroscopic terms, first-order equations, a drive."""

SYSTEMS = {
    "gyro": """
from sweeps.mechanics import System

system = System("Saddle on a turning plate")
k = system.parameter("stiffness", "s-2", default=0.4, meaning="stiffness of both axes over the mass")
W = system.parameter("spin_rate", "rad s-1", default=1.5)
x = system.coordinate("x", "m", bounds=(-1, 1))
y = system.coordinate("y", "m", bounds=(-1, 1))
vx, vy = system.velocity(x), system.velocity(y)
system.kinetic_energy(((vx - W * y) ** 2 + (vy + W * x) ** 2) / 2)
system.potential(k * (x**2 - y**2) / 2)
system.equilibrium("centre", {x: 0, y: 0})
""",
    "lorenz": """
from sympy import sqrt
from sweeps.mechanics import System

system = System("Lorenz's convection")
s = system.parameter("sigma", "1", default=10.0, positive=True)
b = system.parameter("b", "1", default=2.0, positive=True)
r = system.parameter("rayleigh", "1", default=20.0, least=1.1)
x, y, z = (system.state(name, "1", bounds=(-99, 99), size=10) for name in "xyz")
system.rate(x, s * (y - x))
system.rate(y, x * (r - z) - y)
system.rate(z, x * y - b * z)
system.equilibrium("rest", {x: 0, y: 0, z: 0})
system.equilibrium("roll", {x: sqrt(b * (r - 1)), y: sqrt(b * (r - 1)), z: r - 1})
""",
    "driven": """
from sympy import cos, pi
from sweeps.mechanics import System

system = System("Driven spring that stiffens")
F = system.parameter("force", "N kg-1", default=0.3)
w = system.parameter("drive", "rad s-1", default=2.0, positive=True)
c = system.parameter("drag", "s-1", default=0.2, least=0.0)
x = system.coordinate("x", "m", bounds=(-2, 2), size=1)
v = system.velocity(x)
system.kinetic_energy(v**2 / 2)
drive = F * cos(w * system.time)
system.potential((1 + drive) * x**2 / 2 + x**4 / 4 - drive * x / 10)
system.dissipation(c * v**2 / 2)
system.period(2 * pi / w)
system.equilibrium("swinging", {x: 0})
""",
}
GRIDS = {
    "gyro": "{stiffness: {start: 0.1, stop: 1.0, num: 4}, spin_rate: [0.5, 1.0, 2.0]}",
    "lorenz": "{sigma: [5.0, 10.0], rayleigh: {start: 2.0, stop: 30.0, num: 5}}",
    "driven": "{force: {start: 0.0, stop: 1.0, num: 4}, drive: {start: 2.0, stop: 4.0, num: 5}}",
}


def write(folder, name):
    """Write a system and its definition into a folder and return the definition's path."""
    (folder / f"{name}.py").write_text(SYSTEMS[name], encoding="utf-8")
    definition = f"title: {name}\nsystem: {name}.py\ngrid: {GRIDS[name]}\nshards: 2\n"
    (folder / f"{name}.yaml").write_text(definition, encoding="utf-8")
    return folder / f"{name}.yaml"
