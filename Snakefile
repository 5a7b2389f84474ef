"""From a definition to its stability map and pictures:  snakemake --cores 2

kernels → shards → stability_map.nc → figures and report.html, all below results/<sweep>/.
A sweep of your own:  snakemake --cores 2 --config definition=PATH
"""

import shlex
import sys
from pathlib import Path

from sweeps.points import catalogue
from sweeps.pipeline import claims, up_to_date
from sweeps.schema.refusals import DefinitionError
from sweeps.pipeline.targets import (
    command_line_targets,
    compile_notices,
    is_to_run,
    refuse_unknown,
    threads_of_shard,
)
from sweeps.systems import is_file

# the interpreter that runs this workflow also runs its jobs; one that Ctrl-C ends says nothing more
shell.prefix(
    f"trap 'exit 130' INT; PATH={shlex.quote(str(Path(sys.executable).parent))}:$PATH; "
)

try:
    DEFAULT, PLANS = catalogue.plan_targets(config, command_line_targets())
except DefinitionError as refused:
    print(refused, file=sys.stderr)
    sys.exit(2)


wildcard_constraints:
    sweep="|".join(re.escape(name) for name in PLANS),
    k=r"[1-9]\d*",
    n=r"[1-9]\d*",


localrules:
    all,
    handbook,


rule all:
    input:
        f"results/{DEFAULT}/stability_map.nc",
        f"results/{DEFAULT}/figures",
        f"results/{DEFAULT}/report.html",


rule shard:
    output:
        temp("results/{sweep}/shards/{k}-of-{n}.nc"),
    log:
        "results/{sweep}/logs/shard-{k}-of-{n}.log",
    benchmark:
        "results/{sweep}/benchmarks/shard-{k}-of-{n}.tsv"
    threads: lambda wildcards: threads_of_shard(workflow, int(wildcards.n))
    resources:
        mem_mb=1000,
    params:
        kernels=lambda wildcards: PLANS[wildcards.sweep].sweep.system.fingerprint(),
        # a definition counts by its text, not by its date
        path=lambda wildcards: PLANS[wildcards.sweep].path,
        digest=lambda wildcards: PLANS[wildcards.sweep].sweep.definition.digest,
    message:
        "Measuring shard {wildcards.k} of {wildcards.n} of {wildcards.sweep}"
    shell:
        "python -m sweeps shard {params.path:q} {wildcards.k} {wildcards.n}"
        " --threads {threads} --digest {params.digest} --output {output:q}"
        " > {log:q} 2>&1 || {{ tail -n 20 {log:q} >&2; exit 1; }}"


rule merge:
    input:
        shards=lambda wildcards: expand(
            "results/{sweep}/shards/{k}-of-{n}.nc",
            sweep=wildcards.sweep,
            k=range(1, PLANS[wildcards.sweep].sweep.shards + 1),
            n=PLANS[wildcards.sweep].sweep.shards,
        ),
    output:
        report(
            "results/{sweep}/stability_map.nc",
            caption="sweeps/captions/map.rst",
            category="{sweep}",
        ),
    log:
        "results/{sweep}/logs/merge.log",
    benchmark:
        "results/{sweep}/benchmarks/merge.tsv"
    threads: 2
    resources:
        mem_mb=1000,
    params:
        # the names of thousands of shards would be too long for one command
        folder="results/{sweep}/shards",
        path=lambda wildcards: PLANS[wildcards.sweep].path,
        digest=lambda wildcards: PLANS[wildcards.sweep].sweep.definition.digest,
        shows=lambda wildcards: PLANS[wildcards.sweep].sweep.system.caption,
    message:
        "Merging the shards of {wildcards.sweep} into its map"
    shell:
        "python -m sweeps merge --renew {params.path:q} {params.folder:q}"
        " --threads {threads} --digest {params.digest} --output {output:q}"
        " > {log:q} 2>&1 || {{ tail -n 20 {log:q} >&2; exit 1; }}"


rule figures:
    input:
        rules.merge.output,
    output:
        report(
            directory("results/{sweep}/figures"),
            patterns=["{figure}.png"],
            caption="sweeps/captions/figure.rst",
            category="{sweep}",
        ),
    log:
        "results/{sweep}/logs/figures.log",
    benchmark:
        "results/{sweep}/benchmarks/figures.tsv"
    threads: 1
    resources:
        mem_mb=1000,
    message:
        "Drawing the figures of {wildcards.sweep}"
    shell:
        "python -m sweeps figures {input:q} --output {output:q} > {log:q} 2>&1 || {{ tail -n 20 {log:q} >&2; exit 1; }}"


rule report:
    input:
        rules.merge.output,
    output:
        report(
            "results/{sweep}/report.html",
            caption="sweeps/captions/report.rst",
            category="{sweep}",
        ),
    log:
        "results/{sweep}/logs/report.log",
    benchmark:
        "results/{sweep}/benchmarks/report.tsv"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        # a Python file is run because the definition names it, never because the map does
        definition=lambda wildcards: (
            ["--definition", PLANS[wildcards.sweep].path]
            if is_file(PLANS[wildcards.sweep].sweep.definition.system)
            else []
        ),
    message:
        "Writing the report of {wildcards.sweep}"
    shell:
        "python -m sweeps report {input:q} {params.definition:q} --output {output:q} > {log:q} 2>&1 || {{ tail -n 20 {log:q} >&2; exit 1; }}"


rule handbook:
    input:
        pages=[
            path
            for path in sorted(Path("sweeps/handbook").rglob("*"))
            if path.suffix in (".md", ".py", ".yaml", ".css", ".js")
        ],
        definitions=sorted(Path("sweeps/definitions").glob("*.yaml")),
        told=[
            "CHANGELOG.md",
            "CITATION.cff",
            "CONTRIBUTING.md",
            "results/README.md",
            "sweeps/mechanics/README.md",
            "tests/benchmarks/README.md",
        ],
    output:
        directory("results/handbook"),
    log:
        "results/.logs/handbook.log",
    benchmark:
        "results/.benchmarks/handbook.tsv"
    threads: 2
    resources:
        mem_mb=2000,
    message:
        "Making the handbook from maps of its own"
    shell:
        "python -m sweeps.handbook --output {output:q} 2>&1 | tee {log:q}"


onsuccess:
    for name in PLANS:
        up_to_date.record(Path("results") / name)


try:
    refuse_unknown(command_line_targets(), workflow.rules, PLANS)
    if workflow.is_main_process and is_to_run():
        claims.claim(PLANS)
        for name, plan in PLANS.items():
            claims.assign_to_definition(Path("results") / name, plan.path)
            up_to_date.remove_damaged(Path("results") / name)
        claims.replace_locks(workflow)
        for notice in compile_notices(PLANS.values()):
            print(notice, file=sys.stderr)
except DefinitionError as refused:
    print(refused, file=sys.stderr)
    sys.exit(2)
