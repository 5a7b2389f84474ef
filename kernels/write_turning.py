"""Writes turning.py, the Taylor steps with the attitude beside the angular velocity, as straight lines.

python kernels/write_turning.py
"""

from pathlib import Path

WRITTEN = Path(__file__).with_name("turning.py")

HEADER = r'''r"""The direct integrator with the attitude beside the angular velocity: Taylor steps of order 12.

With q the unit quaternion from body to space, scalar first, and n a vector fixed in space, in body axes:

.. math:: \dot\omega_a = c_a\,\omega_b\omega_c, \qquad \dot q = \tfrac12\,q\,(0, \omega), \qquad \dot n = n\times\omega

All are quadratic, so each term of the power series within a step is a convolution of earlier ones, as in
:mod:`kernels.direct`. Truncation of the quaternion at order N is about :math:`(|\omega|h/2)^{N+1}/(N+1)!`.

Written by write_turning.py, and not to be edited.

Source: Jorba and Zou, Experimental Mathematics 14 (2005) 99, for the method.
"""

from kernels.straight import straight

R2, R3, R4, R5, R6, R7, R8, R9, R10, R11, R12 = (1.0 / n for n in range(2, 13))
'''
ORDER = 12
OMEGA = {"a": [("", "b", "c")], "b": [("", "c", "a")], "c": [("", "a", "b")]}
QUATERNION = {
    "w": [("-", "x", "a"), ("-", "y", "b"), ("-", "z", "c")],
    "x": [("", "w", "a"), ("", "y", "c"), ("-", "z", "b")],
    "y": [("", "w", "b"), ("", "z", "a"), ("-", "x", "c")],
    "z": [("", "w", "c"), ("", "x", "b"), ("-", "y", "a")],
}
VECTOR = {
    "x": [("", "y", "c"), ("-", "z", "b")],
    "y": [("", "z", "a"), ("-", "x", "c")],
    "z": [("", "x", "b"), ("-", "y", "a")],
}


def pairs(n):
    """Pairs (i, n - i), those with the newest terms last: what does not wait for them starts before."""
    return sorted(((i, n - i) for i in range(n + 1)), key=lambda pair: max(pair))


def convolution(terms, n):
    """The sum of one right-hand side, as text that begins with a sign where its first term is negative."""
    text = ""
    for i, j in pairs(n):
        for sign, u, v in terms:
            text += f" {sign or '+'} {u}{i} * {v}{j}"
    return text.removeprefix(" + ").replace(" - ", "-", 1) if text.startswith(" - ") else text.removeprefix(" + ")


def wrapped(left, text, width=112):
    """One assignment, broken where the line is too long."""
    if len(left) + len(text) + 7 <= width:
        return [f"    {left}({text})"]
    lines, line = [f"    {left}("], "       "
    for word in text.split(" "):
        if len(line) + len(word) + 1 > width:
            lines.append(line)
            line = "       "
        line += " " + word
    return [*lines, line, "    )"]


def total(name):
    """The sum of the terms, the largest last."""
    return (
        "(" * (ORDER - 1)
        + f"{name}{3}"
        + "".join(f" + {name}{n})" for n in [2, *range(4, ORDER + 1), 1])
        + f" + {name}0"
    )


def step(title, doc, carried, scale):
    """One step as text: omega, and what is carried with it at ``scale`` times its right-hand side."""
    names = ", ".join(f"{name}0" for name in [*OMEGA, *carried])
    lines = ["@straight", f"def {title}({names}, ka, kb, kc, {scale}):", f'    """{doc}"""', "    # fmt: off"]
    for n in range(ORDER):
        part = f" * R{n + 1}" if n else ""
        for name, terms in OMEGA.items():
            lines += wrapped(
                f"{name}{n + 1} = " + (f"(k{name}{part}) * " if n else f"k{name} * "), convolution(terms, n)
            )
        for name, terms in carried.items():
            lines += wrapped(
                f"{name}{n + 1} = " + (f"({scale}{part}) * " if n else f"{scale} * "), convolution(terms, n)
            )
    lines += ["    return (", *(f"        {total(name)}," for name in [*OMEGA, *carried]), "    )", "    # fmt: on"]
    return "\n".join(lines)


def text():
    """Text of the module."""
    turn = step(
        "turn_12", "One step of omega and the quaternion (w, x, y, z); k = c h, half = h/2.", QUATERNION, "half"
    )
    carry = step("carry_12", "One step of omega and a space-fixed vector (x, y, z); k = c h.", VECTOR, "h")
    return f"{HEADER}\n\n{turn}\n\n\n{carry}\n"


if __name__ == "__main__":
    WRITTEN.write_text(text())
