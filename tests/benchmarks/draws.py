"""How long people wait who ask about a body that is not known exactly: a million draws, three axes, the answer.

    python tests/benchmarks/draws.py --draws 1e6 --rounds 3

Each answer is a process of its own, from its start to its last line, on all processors it may use. Processor seconds
tell what a busy machine hides: of them `start` are those of an answer from 64 draws, which no second processor shares;
`two cores` is start + (the rest)/2, what the wall would say on two that nobody else uses, if all the rest is shared.
"""

import argparse
import os
import statistics
import subprocess
import sys
import time

BODIES = {
    "moments": ["--moments", "1.5", "2.5", "3.0"],
    "tensor": ["--tensor", "2", "-0.5", "0", "-0.5", "2", "0.1", "0", "0.1", "3"],
}
LEAST = 64


def asked(body, draws):
    """Asks once: wall seconds, processor seconds, largest resident set in MB."""
    command = [sys.executable, "-m", "sweeps", "body", *BODIES[body], "--uncertainty", "5%", "--draws", str(draws)]
    begun = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit("a process failed: " + " ".join(command[3:]))
    return time.perf_counter() - begun, used.ru_utime + used.ru_stime, used.ru_maxrss / 1e3


def main(arguments=None):
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--draws", type=float, default=1e6, help="bodies to draw (default a million)")
    parser.add_argument("--rounds", type=int, default=3, help="times that each is asked (default 3); medians are told")
    args = parser.parse_args(arguments)
    print("| body | draws | wall s | core s | start, core s | two cores, s | MB |")
    print("|" + "---|" * 7)
    for body in BODIES:
        asked(body, LEAST)  # compiles what is not there yet
        start = statistics.median(asked(body, LEAST)[1] for _ in range(args.rounds))
        found = [asked(body, round(args.draws)) for _ in range(args.rounds)]
        wall, busy, memory = (statistics.median(column) for column in zip(*found, strict=True))
        cells = [body, f"{args.draws:.3g}", f"{wall:.1f}", f"{busy:.1f}", f"{start:.1f}"]
        print("| " + " | ".join([*cells, f"{(start + busy) / 2:.1f}", f"{memory:.0f}"]) + " |", flush=True)


if __name__ == "__main__":
    main()
