"""Well-known bodies to choose on a page and by name: `polhode body "Explorer 1"`."""


def _box(mass: float, *sides: float) -> list[float]:
    """Return moments of a uniform box, kg m2, from its mass, kg, and sides, m, the longest first."""
    a, b, c = sides
    return [mass / 12 * (b * b + c * c), mass / 12 * (a * a + c * c), mass / 12 * (a * a + b * b)]


# Racket, phone and Earth as in the definition `bodies`. Explorer 1: 13.97 kg, 2.05 m by 0.165 m, 750 rpm. Bodies with
# a mass, kg, are uniform boxes.
PRESETS = [
    {"name": name, "moments": moments, "omega0": omega0, "axis": axis, "mass": mass}
    for name, moments, omega0, axis, mass in (
        ("tennis racket", [0.00121, 0.01638, 0.01748], 10.0, 2, None),
        ("phone", [7.4181040233333e-5, 3.0975441516667e-4, 3.8236311326667e-4], 10.0, 2, 0.17228),
        ("book", _box(0.8, 0.24, 0.17, 0.03), 6.0, 2, 0.8),
        ("Earth", [8.0101e37, 8.0103e37, 8.0365e37], 7.292115e-5, 3, None),
        ("3U CubeSat", _box(4.0, 0.34, 0.1, 0.1), 0.1, 3, 4.0),
        ("Explorer 1", [13.97 / 2 * 0.0825**2, *[13.97 / 12 * (3 * 0.0825**2 + 2.05**2)] * 2], 78.5, 1, None),
    )
]
