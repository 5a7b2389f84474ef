"""What a first run waits for: the default sweep's kernels, compiled into an empty cache, and where the time goes.

    python tests/benchmarks/compiling.py [--rounds N]

Processor seconds of one process, least of the rounds: kernels that only kernels call as parts (as a first run does it)
and whole (as Numba does). Below, the parts' time by what is done in it: *LLVM* optimises and makes machine code;
*Numba* finds types and writes intermediate code, in Python; *cache* reads and writes files. Two processes share the
list, and each imports Numba first, so that the wall is not below half the sum beside the imports, nor below the last
kernel's own time, which links all others.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile

ONCE = """
import json, sys, time
begun = time.process_time()
import kernels
from numba.core import caching, codegen, compiler_machinery, dispatcher
from sweeps import systems
from sweeps.run import warmup

spent, inside = {}, []

def timed(owner, name, label):
    do = getattr(owner, name)

    def done(*given, **more):
        begun = time.process_time()
        inside.append(0.0)
        try:
            return do(*given, **more)
        finally:
            taken = time.process_time() - begun
            spent[label] = spent.get(label, 0.0) + taken - inside.pop()
            if inside:
                inside[-1] += taken

    setattr(owner, name, done)

timed(codegen.CPUCodeLibrary, "_optimize_functions", "LLVM, functions")
timed(codegen.CPUCodeLibrary, "_optimize_final_module", "LLVM, modules")
timed(codegen.JITCodeLibrary, "_finalize_specific", "LLVM, machine code")
timed(codegen.CPUCodeLibrary, "finalize", "LLVM, linking")
timed(codegen.CPUCodeLibrary, "add_ir_module", "Numba, text for LLVM")
timed(dispatcher._FunctionCompiler, "compile", "Numba, types and code")
timed(caching.Cache, "save_overload", "cache")
timed(caching.Cache, "load_overload", "cache")
todo = systems.compilations(False)
spent["imports"] = time.process_time() - begun
warmup._run(todo, parts=sys.argv[1] == "parts")
spent["the rest"] = time.process_time() - begun - sum(spent.values())
print(json.dumps(spent))
"""


def compiled(how):
    """What a process spends on it, s by kind; ``how`` is "parts" or "whole"."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "NUMBA_CACHE_DIR": folder}
        done = subprocess.run(
            [sys.executable, "-c", ONCE, how], env=environment, stdout=subprocess.PIPE, text=True, check=True
        )
    return json.loads(done.stdout)


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--rounds", type=int, default=3)
    rounds = parser.parse_args().rounds
    found = {"parts": [], "whole": []}
    for _ in range(rounds):
        for how, times in found.items():
            times.append(compiled(how))
    least = {how: min(times, key=lambda spent: sum(spent.values())) for how, times in found.items()}
    parts, whole = (sum(least[how].values()) for how in ("parts", "whole"))
    print(f"as parts {parts:.1f} s, whole {whole:.1f} s: {parts / whole:.2f}")
    for kind, seconds in sorted(least["parts"].items(), key=lambda item: -item[1]):
        print(f"{seconds:6.1f} s  {kind} ({least['whole'].get(kind, 0.0):.1f})")


if __name__ == "__main__":
    main()
