"""Copies of the sources in which the workflow runs, is broken off, and runs again."""

import os
import shutil
import subprocess
import sys
import time

import compiled
import psutil

import sweeps
from sweeps.maps import verify

SHARDS = 4
TEXT = """\
title: A sweep to be broken off
grid:
  I1: {start: 0.5, stop: 1.5, num: 20}
  I2: {start: 0.5, stop: 1.5, num: 20}
  I3: [0.8, 1.0]
  omega0: [1.0, -10.0]
shards: %d
"""
TARGET = "results/broken/stability_map.nc"
PATIENCE = 600.0  # s, the longest wait for an expected state on a slow machine


class Workspace:
    """A copy of the sources with results and a compiler cache of its own."""

    def __init__(self, folder):
        self.folder = compiled.copy_sources(folder.resolve())
        compiled.share(self.folder, self.folder / ".cache")
        self.define()
        self.map = self.folder / TARGET
        self.shards = self.folder / "results/broken/shards"
        self.environment = compiled.environment_of(self.folder)

    def define(self, shards=SHARDS):
        """Writes the definition anew; into how many shards the work is cut changes no number."""
        (self.folder / "broken.yaml").write_text(TEXT % shards)

    def start(self, log=None, *options):
        """Start the workflow without waiting; its output goes to the file `log`, or to communicate()."""
        command = [sys.executable, "-m", "snakemake", *(options or ("--cores", "2"))]
        return self.process([*command, "--config", "definition=broken.yaml", "--", TARGET], log)

    def process(self, command, log=None, **options):
        output = subprocess.PIPE if log is None else log.open("w")
        try:
            return subprocess.Popen(
                command,
                cwd=self.folder,
                env=self.environment,
                stdout=output,
                stderr=subprocess.STDOUT,
                text=True,
                **options,
            )
        finally:
            if log is not None:
                output.close()

    def run(self):
        """Run the workflow to its end and return (exit status, output)."""
        process = self.start()
        output, _ = process.communicate()
        return process.returncode, output

    def ask(self, code, **settings):
        """Return the output of Python code in this copy."""
        answer = compiled.run(self.folder, "-c", code, **settings)
        assert answer.returncode == 0, answer.stderr
        assert "Traceback" not in answer.stderr
        return answer.stdout.strip()

    def clear(self):
        shutil.rmtree(self.folder / "results", ignore_errors=True)

    def finished_shards(self):
        """Numbers of the finished shards."""
        return [path.name.partition("-")[0] for path in self.shards.glob("[0-9]*.nc")]

    def content(self):
        with sweeps.open_map(self.map) as ds:
            return ds.attrs["content_hash"]

    def until_shards(self, process, count):
        wait_for(lambda: len(list(self.shards.glob("[0-9]*.nc"))) >= count, process)

    def orphans(self):
        """Processes that work in this workspace."""
        processes = []
        for process in psutil.process_iter():
            try:
                if process.cwd() == str(self.folder) and process.pid != os.getpid():
                    processes.append(process)
            except psutil.Error:
                continue
        return processes

    def settle(self):
        """Wait for processes that killed runs have left."""
        _, alive = psutil.wait_procs(self.orphans(), timeout=PATIENCE)
        assert not alive


def wait_for(condition, process=None):
    end = time.monotonic() + PATIENCE
    while not (result := condition()):
        if process is not None and process.poll() is not None:
            return None
        assert time.monotonic() < end
        time.sleep(0.05)
    return result


def assert_whole(workspace, expected=None):
    """Assert that the map is that of the undisturbed run, and that no file of a killed process remains."""
    assert workspace.content() == (expected or workspace.hash)
    assert [check for check in verify.verify(workspace.map, points=20, any_kernels=True) if check.findings] == []
    assert not list(workspace.folder.glob("results/broken/**/.*.part"))
    assert not list(workspace.shards.glob("[0-9]*.nc"))
