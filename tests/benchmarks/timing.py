"""The least time of some work in one process, and rates that fresh processes print."""

import subprocess
import sys
import time


def min_times(rounds, *works, clock=time.process_time):
    """Return the least time of each piece of work, s; all take turns, so that a busy machine moves them alike."""
    times = [float("inf")] * len(works)
    for _ in range(rounds):
        for i, work in enumerate(works):
            begin = clock()
            work()
            times[i] = min(times[i], clock() - begin)
    return times


def print_results(commands):
    """Return the output of fresh processes, run in sequence: words → the numbers behind them, one a process."""
    rates = {}
    for command in commands:
        output = subprocess.run([sys.executable, *command], check=True, stdout=subprocess.PIPE, text=True).stdout
        for line in output.splitlines():
            words, _, number = line.rpartition(": ")
            rates.setdefault(words, []).append(float(number))
    return rates


def compare_rates(rates, peer, unit):
    """Return the rate of the fastest process in words, relative to a peer's, and the slowness of further ones."""
    best = max(rates)
    return f"{best:,.0f} {unit}, {best / peer:.2f} times heyoka.py; others to {1.0 - min(rates) / best:.0%} less"
