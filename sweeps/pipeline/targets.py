"""Targets of a call of `snakemake`, read before the workflow is built.

Snakemake passes its config to a Snakefile but not its targets; its own parser reads them from the command line.
"""

import difflib
import re
import sys
from argparse import Namespace
from collections.abc import Iterable, Iterator
from importlib.util import find_spec
from pathlib import Path

from snakemake.cli import get_argument_parser

from sweeps.points import compile_kernels
from sweeps.points.catalogue import Plan
from sweeps.schema.refusals import DefinitionError, cut_text

# options with which Snakemake makes none of the workflow's files
SHOWING_OPTIONS = (
    *("dryrun", "lint", "list_rules", "list_target_rules", "summary", "detailed_summary", "print_compilation"),
    *("dag", "rulegraph", "filegraph", "d3dag", "report", "unlock", "cleanup_metadata", "cleanup_shadow", "archive"),
    *("containerize", "export_cwl", "generate_unit_tests", "list_changes", "list_input_changes", "list_params_changes"),
)


def _arguments() -> Namespace | None:
    """Return the arguments of the running `snakemake` command; None outside of one."""
    if not Path(sys.argv[0]).name.startswith(("snakemake", "__main__")):
        return None
    try:
        return get_argument_parser().parse_known_args(sys.argv[1:])[0]
    except SystemExit:  # Snakemake itself has accepted these arguments, or will report the error
        return Namespace(targets=(), dryrun=True)


def command_line_targets() -> list[str]:
    """Return the targets of the running `snakemake` command; none outside of a command line."""
    arguments = _arguments()
    return [str(target) for target in arguments.targets or ()] if arguments else []


def is_to_run() -> bool:
    """Return True if the running `snakemake` command makes files, rather than showing or planning."""
    arguments = _arguments()
    return arguments is None or not any(getattr(arguments, name, None) for name in SHOWING_OPTIONS)


def require_slurm() -> None:
    """End the program with a message and status 2 if Snakemake's plugin for Slurm is missing.

    Called from the profile: Snakemake itself would only list its installed executors.
    """
    if find_spec("snakemake_executor_plugin_slurm") is None:
        print("--profile: .slurm needs a plugin that is not here; allowed: pip install -e '.[slurm]'", file=sys.stderr)
        sys.exit(2)


def threads_of_shard(workflow, count: int) -> int:
    """Return the threads for each of `count` shards: a share of this machine's processors, or 1 on a cluster."""
    return max(1, workflow.cores // count) if workflow.local_exec else 1


def compile_notices(plans: Iterable[Plan]) -> Iterator[str]:
    """Yield a notice for each sweep without a map if its first shard will compile kernels."""
    for sweep in (plan.sweep for plan in plans):
        if not Path(f"results/{sweep.name}/stability_map.nc").exists() and (
            line := compile_kernels.compile_notice(sweep)
        ):
            yield line


def refuse_unknown(targets: Iterable[str], rules: Iterable, sweeps: Iterable[str]) -> None:
    """Refuse files below results/ that no rule makes.

    Args:
        targets: the files.
        rules: of the workflow.
        sweeps: names of the sweeps.

    Raises:
        DefinitionError: naming the first such file and the allowed files.
    """
    rules, sweeps = list(rules), list(sweeps)
    for target in (str(target).removeprefix("./") for target in targets):
        folder, _, inner_path = target.partition("/")
        if folder != "results" or any(rule.is_producer(target) for rule in rules):
            continue
        name, _, file = inner_path.partition("/")
        files = _rule_outputs(rules)
        similar = difflib.get_close_matches(file, files, n=1)
        suggestion = f" (did you mean results/{name}/{similar[0]}?)" if similar else ""
        allowed = [f"results/{sweep}/{file}" for sweep in ([name] if name in sweeps else sweeps) for file in files]
        problem = f"target: {cut_text(repr(target))} is made by no rule{suggestion}"
        raise DefinitionError(f"{problem}; allowed: {', '.join(allowed)}")


def _rule_outputs(rules: list) -> list[str]:
    """Return the files that rules make of any sweep, below results/<sweep>/."""
    outputs = [re.match(r"results/\{sweep(?:,[^}]*)?\}/([^{]*)$", str(output)) for r in rules for output in r.output]
    return [output[1] for output in outputs if output]
