"""Writes taylor_steps.py, the Taylor steps of Euler's equations as straight lines.

    python kernels/write_taylor_steps.py

The terms are derived in :mod:`kernels.direct`. The order of every sum is the speed and the bits: in a term the newest
factors stand last, so that what does not wait for them starts before; in the result the largest terms stand last.
"""

from pathlib import Path
from textwrap import fill

WRITTEN = Path(__file__).with_name("taylor_steps.py")
ORDERS = (8, 10, 12)
AXES = {"a": "bc", "b": "ca", "c": "ab"}  # each component, and the two that turn it
# of the spin, in steps near the axis: the last term that is summed, and the last that turns the others
NEAR = {"": None, "near_": (7, 4), "nearest_": (5, 2)}
HEADER = '''"""The Taylor steps of Euler's equations in straight lines: see :mod:`kernels.direct`.

Written by write_taylor_steps.py, and not to be edited.
"""

from kernels.straight import straight

# fmt: off
R2, R3, R4, R5, R6, R7, R8, R9, R10, R11, R12 = (1.0 / n for n in range(2, 13))
'''


def term(x, n, near):
    """Line of the term x_n = k_x/n times the sum of y_i z_(n-1-i): from the middle out, or by the spin's first few."""
    y, z = AXES[x]
    if near and n > near[1] and x != "a":
        other = y if z == "a" else z
        products = [f"{other}{n - 1 - i} * a{i}" for i in range(near[1], -1, -1)]
    else:
        pairs = [(i, n - 1 - i) for i in range((n - 1) // 2, -1, -1)]
        products = [f"{y}{i} * {z}{j}" for pair in pairs for i, j in dict.fromkeys((pair, pair[::-1]))]
    return f"{x}{n} = {f'(k{x} * R{n})' if n > 1 else f'k{x}'} * ({' + '.join(products)})"


def total(x, last):
    """Line of the sum of the terms 0 to last of a component."""
    first, *terms = (f"{x}{n}" for n in (3, 2, *range(4, last + 1), 1, 0))
    return f"{x} = " + "(" * (last - 1) + first + ")".join(f" + {t}" for t in terms)


def step(order, kind):
    """Text of one step."""
    near = NEAR[kind]
    last = {x: near[0] if near and x == "a" else order for x in AXES}
    terms = [term(x, n, near) for n in range(1, order + 1) for x in AXES if n <= last[x]]
    lines = [*terms, *(total(x, last[x]) for x in AXES), "return a, b, c"]
    name, said = f"{kind}step_{order}", f" {kind[:-1]} the axis a" if near else ""
    body = "\n".join(fill(line, 120, initial_indent=" " * 4, subsequent_indent=" " * 8) for line in lines)
    head = f'    """One step of order {order}{said}; k_i = c_i h."""'
    return f"\n\n@straight\ndef {name}(a0, b0, c0, ka, kb, kc):\n{head}\n{body}\n"


def text():
    """Text of the module."""
    return HEADER + "".join(step(order, kind) for kind in NEAR for order in ORDERS)


if __name__ == "__main__":
    WRITTEN.write_text(text())
