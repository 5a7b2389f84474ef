import ast
import subprocess
import sys
from pathlib import Path

from kernels import write_taylor_steps as writer


def test_the_steps_are_what_the_script_writes():
    assert writer.WRITTEN.read_text() == writer.text()


def test_the_script_runs_alone_and_needs_no_library(tmp_path):
    copy = tmp_path / "write_taylor_steps.py"
    copy.write_bytes(Path(writer.__file__).read_bytes())
    subprocess.run([sys.executable, "-I", "-S", copy], check=True)
    assert (tmp_path / "taylor_steps.py").read_bytes() == writer.WRITTEN.read_bytes()


def test_a_step_takes_as_many_multiply_adds_as_are_counted():
    # the docstring of kernels.direct: 108, 165 and 234 by the whole step, one a product and one a term's factor
    steps = {f.name: f for f in ast.parse(writer.text()).body if isinstance(f, ast.FunctionDef)}
    assert list(steps) == [f"{kind}step_{order}" for kind in ("", "near_", "nearest_") for order in writer.ORDERS]
    for order, counted in zip(writer.ORDERS, (108, 165, 234), strict=True):
        products = [
            node
            for node in ast.walk(steps[f"step_{order}"])
            if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult) and isinstance(node.right, ast.Name)
        ]
        assert sum(node.right.id[0] in "abc" for node in products) == counted
