"""Processes that are killed at random moments of every stage: no point lost, none wrong, nothing left behind.

POLHODE_KILLS=100 pytest -n 0 -m faults tests/pipeline/test_kills.py

runs as many kills; without the setting, as many as show each stage. A kill is a signal (STOP is followed by CONT) to
one process, or to the whole group, of the workflow or of `run`, some moment after a stage has begun; the next goes on.
"""

import os
import random
import re
import shutil
import signal
import sys
import time
from contextlib import suppress

import psutil
import pytest
import test_faults
from workspaces import assert_whole, wait_for

import sweeps
from sweeps.pipeline import claims, up_to_date

pytestmark = [pytest.mark.slow, pytest.mark.faults]
clear_results = test_faults.clear_results

KILLS = int(os.environ.get("POLHODE_KILLS", 10))
SHARDS = 3
ROUND = 20  # kills, and then a whole run
# few variables and one axis, so that pictures are soon drawn
DEFINITION = """\
axes: [2]
grid:
  I1: {start: 0.5, stop: 1.5, num: 20}
  I2: {start: 0.5, stop: 1.5, num: 20}
  I3: [0.8, 1.0]
  omega0: [1.0, -10.0]
integration: {variables: [omega_squared, regime, status]}
shards: %d
"""
SIGNALS = [signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGSTOP]
STAGES = ["compile", "shard", "merge", "figures", "report"]
SAYS = {  # messages of `run` at the start of a stage, in one process
    "compile": "compiling the kernels",
    "shard": "points",
    "merge": "merging",
    "figures": "broken/figures",
    "report": "broken/report.html",
}
PROGRAMS = {"compile": ["-P", "-m", "sweeps.points.compile_worker"]}  # below a shard
NOTES = {claims.CLAIM, claims.DEFINITION, up_to_date.NOTE}
MADE = {*NOTES, "stability_map.nc", "figures", "report.html", "logs", "benchmarks"}


def victim(run, kind):
    """Return the process of that kind below a run of the workflow, once it exists; None if the run ends before."""

    def find_process():
        try:
            below = psutil.Process(run.pid).children(recursive=True)
        except psutil.NoSuchProcess:
            return None
        for process in below:
            try:
                words = process.cmdline()
            except psutil.Error:
                continue
            if words[1:4] == PROGRAMS.get(kind, ["-m", "sweeps", kind]):
                return process
        return None

    return wait_for(find_process, run)


class Series:
    """A series of kills in one copy of the sources, each of a run that continues the interrupted run before."""

    def __init__(self, workspace, seed):
        self.workspace, self.rng = workspace, random.Random(seed)
        (workspace.folder / "broken.yaml").write_text(DEFINITION % SHARDS)
        self.hash = sweeps.survey(workspace.folder / "broken.yaml").attrs["content_hash"]
        self.results = workspace.folder / "results/broken"
        self.pictures, self.is_compiled = None, True
        self.log = workspace.folder / "said.log"
        self.began = time.monotonic()

    def start(self, entry):
        words = [sys.executable, "-m", *{"workflow": ["snakemake"], "run": ["sweeps", "run", "broken.yaml"]}[entry]]
        words += ["--cores", "2"] + ["--config", "definition=broken.yaml"] * (entry == "workflow")
        return self.workspace.process(words, self.log, start_new_session=True)

    def working_process(self, run, entry, stage):
        """Return the process that works at a stage, once it does; None if the run ends before."""
        if entry == "run":
            has_begun = wait_for(lambda: SAYS[stage] in self.log.read_text(), run)
            return psutil.Process(run.pid) if has_begun else None
        return victim(run, stage)

    def make_room(self, entry, stage):
        """Remove the output of a stage, and keep that of earlier stages."""
        if stage == "compile":
            self.forget_compiled()
            shutil.rmtree(self.results / "shards", ignore_errors=True)
        if stage in STAGES[:3]:
            self.workspace.map.unlink(missing_ok=True)
        if stage == "figures":
            shutil.rmtree(self.results / "figures", ignore_errors=True)
        if stage == "report":
            (self.results / "report.html").unlink(missing_ok=True)

    def forget_compiled(self):
        """Remove the marks of complete code from the cache and, once a round, the code of one file."""
        cache = next((self.workspace.folder / ".cache/polhode").glob("*-*"))
        shutil.rmtree(cache / "ready", ignore_errors=True)
        if self.is_compiled:
            for path in cache.glob("code/linear.*"):
                path.unlink()
        self.is_compiled = False

    def kill(self, entry, stage, number, scope):
        """Sends a signal in a stage: whether that came to pass."""
        self.make_room(entry, stage)
        shutil.rmtree(self.results / "logs", ignore_errors=True)
        before = set(self.workspace.finished_shards())
        run = self.start(entry)
        is_killed, process = False, self.working_process(run, entry, stage)
        if process is not None:
            is_killed = self.send(run, process, number, scope)
            if is_killed and number == signal.SIGSTOP and stage in STAGES[:3]:  # further processes go on to their end
                time.sleep(self.rng.uniform(0.0, 1.0))
                with suppress(ProcessLookupError):
                    os.killpg(run.pid, signal.SIGTERM)
        status = run.wait()
        output = self.log.read_text()
        # a job that is interrupted before its first function is called: the workflow repeats Python's message
        of_python = number == signal.SIGINT and not re.search(r'File ".*/(sweeps|kernels)/.*, in (?!<module>)', output)
        assert "Traceback" not in output or of_python, output
        assert is_killed or status in (0, 1, 2), output
        assert number != signal.SIGSTOP or stage in STAGES[:3] or status == 0, output
        repeated_shards = [k for k in before if f"Measuring shard {k} of" in output]
        assert not repeated_shards or stage == "compile", output  # none is computed twice
        for log in self.results.glob("logs/*.log"):  # Python itself reports an interrupt before our first line
            assert "Traceback" not in log.read_text() or number == signal.SIGINT, log.read_text()
        return is_killed

    def send(self, run, process, number, scope):
        send = process.send_signal if scope == "process" else lambda number: os.killpg(run.pid, number)
        try:
            process.wait(self.rng.uniform(0.0, 1.2))
            return False
        except psutil.TimeoutExpired:
            pass
        with suppress(psutil.NoSuchProcess, ProcessLookupError):
            send(number)
            if number == signal.SIGSTOP:
                time.sleep(self.rng.uniform(0.0, 1.0))
                send(signal.SIGCONT)
            return True
        return False

    def finish(self, entry):
        """A run that nothing disturbs: everything is there, right, and nothing else is."""
        finished_shards = self.workspace.finished_shards()
        run = self.start(entry)
        assert run.wait() == 0, self.log.read_text()
        output = self.log.read_text()
        assert not [k for k in finished_shards if f"Measuring shard {k} of" in output]
        self.workspace.settle()
        assert_whole(self.workspace, self.hash)
        assert {path.name for path in self.results.iterdir()} <= MADE
        pictures = sorted(path.name for path in (self.results / "figures").glob("[!.]*"))
        self.pictures = self.pictures or pictures
        assert pictures == self.pictures != []
        assert not list(self.workspace.folder.glob("**/.*.part"))


def plan(number):
    """A number of kills: five in a row differ in stage and signal; 25 are all pairs; the ways alternate.

    In rounds; each goes through the stages in the order of a run.
    """
    ways = [(entry, scope) for entry in ("workflow", "run") for scope in ("process", "group")]
    kills = [(*ways[(k + k // 4) % 4], STAGES[k % 5], SIGNALS[(k + k // 5) % 5]) for k in range(number)]
    for k in range(0, number, ROUND):
        yield sorted(kills[k : k + ROUND], key=lambda kill: STAGES.index(kill[2]))


def test_kills_lose_no_point_change_none_and_leave_nothing(workspace):
    series = Series(workspace, KILLS)
    for kills in plan(KILLS):
        workspace.clear()
        series.is_compiled = True
        for entry, scope, stage, number in kills:
            for _ in range(5):  # if the victim has ended before that moment, another moment
                if series.kill(entry, stage, number, scope):
                    break
            else:
                pytest.fail(f"{entry}: {stage} was not killed in five attempts")
            print(entry, scope, stage, number.name, f"{time.monotonic() - series.began:.0f} s", flush=True)
        series.finish(series.rng.choice(["workflow", "run"]))
