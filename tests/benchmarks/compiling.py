"""What a first run waits for: the default sweep's kernels, compiled into an empty cache, and where the time goes.

    python tests/benchmarks/compiling.py [--rounds N]

Processor seconds of one process, least of the rounds: kernels that only kernels call as parts (as a first run does it)
and whole (as Numba does). Below, the parts' time by what is done in it: *LLVM* optimises and makes machine code;
*Numba* finds types and writes intermediate code, in Python; *cache* reads and writes files. Two processes share the
list, and each imports Numba first: the bound is half the sum, with the imports twice, and no wall clock on two cores
goes below it. The piece that takes longest links all others and is shared with nobody.
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
from sweeps.run import warmup  # last: it keeps what is timed here

todo = systems.compilations(False)
spent["imports"] = time.process_time() - begun
longest = [0.0]

def piece_by_piece():
    for compilation in todo:
        began = time.process_time()
        yield compilation
        longest.append(time.process_time() - began)

warmup._run(piece_by_piece(), parts=sys.argv[1] == "parts")
spent["the rest"] = time.process_time() - begun - sum(spent.values())
print(json.dumps({"spent": spent, "longest": max(longest)}))
"""


def compiled(how):
    """What a process spends on it, s by kind, and on the longest piece; ``how`` is "parts" or "whole"."""
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
    all_least = {how: min(times, key=lambda told: sum(told["spent"].values())) for how, times in found.items()}
    least = {how: told["spent"] for how, told in all_least.items()}
    parts, whole = (sum(least[how].values()) for how in ("parts", "whole"))
    print(f"as parts {parts:.1f} s, whole {whole:.1f} s: {parts / whole:.2f}")
    bound, longest = (parts + least["parts"]["imports"]) / 2, all_least["parts"]["longest"]
    print(f"on two cores no less than {bound:.1f} s by the wall; {longest:.1f} s for the piece that takes longest")
    for kind, seconds in sorted(least["parts"].items(), key=lambda item: -item[1]):
        print(f"{seconds:6.1f} s  {kind} ({least['whole'].get(kind, 0.0):.1f})")


if __name__ == "__main__":
    main()
