"""The least time of some work in one process, and rates that fresh processes print."""

import subprocess
import sys
import time


def least(rounds, *works, clock=time.process_time):
    """Return the least time of each piece of work, s; all take turns, so that a busy machine moves them alike."""
    found = [float("inf")] * len(works)
    for _ in range(rounds):
        for i, work in enumerate(works):
            begun = clock()
            work()
            found[i] = min(found[i], clock() - begun)
    return found


def printed(commands):
    """Return what fresh processes print, one after the other: words → the numbers behind them, one a process."""
    rates = {}
    for command in commands:
        said = subprocess.run([sys.executable, *command], check=True, stdout=subprocess.PIPE, text=True).stdout
        for line in said.splitlines():
            words, _, number = line.rpartition(": ")
            rates.setdefault(words, []).append(float(number))
    return rates


def beside(rates, peer, unit):
    """Return the rate of the fastest process in words, beside a peer's, and by how much other processes are slower."""
    best = max(rates)
    return f"{best:,.0f} {unit}, {best / peer:.2f} times heyoka.py; others to {1.0 - min(rates) / best:.0%} less"
