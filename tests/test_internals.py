"""Internals of foreign projects that Polhode uses: few, each with its reason, and nothing else."""

import ast
from pathlib import Path

import legibility

ROOT = Path(__file__).parents[1]
INTERNAL = (
    "numba.core",
    "llvmlite.ir",
    "numpy._",
    "matplotlib._",
    "xarray.core",
    "snakemake.",
)  # modules, by how they begin
PUBLIC = {"_exit"}  # private-looking name of os that its documentation lists
OURS = ("kernels", "sweeps")
REASONS = {
    "kernels/compile/jit.py: kernel._cache": "Numba has no public way to give a dispatcher a cache",
    "kernels/compile/cache.py: numba.core.compiler": "what is stored is Numba's result of compiling",
    "kernels/compile/cache.py: CompileResult._rebuild": "made from what _reduce gave, as in Numba's cache",
    "kernels/compile/cache.py: numba.core.serialize": "as Numba's own cache writes it",
    "kernels/compile/cache.py: numba.core.sigutils": "a signature is given as a text or as types",
    "kernels/compile/llvm_formulas.py: llvmlite.ir": "LLVM's instructions: Numba's documented way to extend it",
    "kernels/compile/jit.py: numba.core": "the class of kernels that refuse Python, and documented passes of compilers",
    "kernels/compile/llvm_formulas.py: numba.core": "cgutils, the helpers of that way",
    "sweeps/maps/validation.py: xarray.core": "indexing.LazilyIndexedArray, documented for authors of backends",
    "sweeps/pipeline/claims.py: workflow._prepare_dag": "Snakemake has no setting against its lock in a Snakefile",
    "sweeps/pipeline/targets.py: snakemake.cli": "Snakemake tells a Snakefile its config, but not its targets",
}


def uses(path):
    """Internal modules that a file imports, and private names that it imports or assigns of foreign objects."""
    nodes, name = legibility.nodes_of(path), path.relative_to(ROOT).as_posix()
    imports = set()
    for node in nodes:
        if isinstance(node, ast.ImportFrom) and node.module and not node.level and not node.module.startswith(OURS):
            imports |= {alias.asname or alias.name for alias in node.names}
            if node.module.startswith(INTERNAL):
                yield f"{name}: {node.module}"
            yield from (f"{name}: {node.module}.{a.name}" for a in node.names if is_private(a.name))
            yield from (f"{name}: llvmlite.ir" for a in node.names if (node.module, a.name) == ("llvmlite", "ir"))
        elif isinstance(node, ast.Import):
            imports |= {(alias.asname or alias.name).partition(".")[0] for alias in node.names}
            yield from (f"{name}: {alias.name}" for alias in node.names if alias.name.startswith(INTERNAL))
    for node in nodes:
        if isinstance(node, ast.Attribute) and is_private(node.attr) and isinstance(node.value, ast.Name):
            is_own = node.value.id in ("self", "cls", "super", "other")
            is_assigned = isinstance(node.ctx, ast.Store) and not is_own
            if is_assigned or node.value.id in imports:
                yield f"{name}: {node.value.id}.{node.attr}"


def is_private(name):
    return name.startswith("_") and not name.startswith("__") and name not in PUBLIC


def test_internals_of_other_projects_are_these_and_each_has_a_reason():
    files = [path for folder in OURS for path in sorted((ROOT / folder).rglob("*.py"))]
    internals = {use for path in files for use in uses(path)}
    assert internals == set(REASONS)
    assert len(REASONS) <= 12
