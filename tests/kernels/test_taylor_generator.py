import ast

from kernels.free import taylor
from kernels.near_axis import propagators


def test_a_step_takes_as_many_multiply_adds_as_are_counted():
    # the docstring of kernels.free.direct: 108, 165 and 234 by the whole step, one a product and one a term's factor
    for order, expected in zip(taylor.ORDERS, (108, 165, 234), strict=True):
        products = [
            node
            for node in ast.walk(
                ast.parse("def step():\n " + taylor.step_lines(taylor.EULER, order).replace("\n", "\n "))
            )
            if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult) and isinstance(node.right, ast.Name)
        ]
        assert sum(node.right.id[0] in "abc" for node in products) == expected


def test_the_lines_of_a_low_order_are_those_of_the_equations():
    lines = taylor.step_lines(taylor.EULER | taylor.VECTOR, 4).split("\n")
    assert "a1 = ka * (b0 * c0)" in lines
    assert "b3 = (kb * R3) * (c1 * a1 + c0 * a2 + c2 * a0)" in lines
    assert "x2 = (h * R2) * (y0 * c1 - z0 * b1 + y1 * c0 - z1 * b0)" in lines
    # the last terms occur in the sums alone
    last = "(ka * R4) * (b1 * c2 + b2 * c1 + b0 * c3 + b3 * c0)"
    assert lines[-1].startswith(f"return (((a3 + a2) + {last}) + a1) + a0, (((b3 + b2) + (kb * R4) * (")


def test_a_step_has_the_number_of_its_name():
    for number, step in enumerate(taylor.STEPS):
        spin, order = step.__name__.split("step_")
        assert getattr(propagators, f"{spin or 'taylor_'}{order}".upper()) == number
        assert propagators.ORDER[number] == float(order)
        assert (propagators.IS_NEAR[number], propagators.IS_NEAREST[number]) == (spin == "near_", spin == "nearest_")
