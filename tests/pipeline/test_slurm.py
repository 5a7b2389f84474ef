"""Shards as jobs of a real Slurm: one controller and one node on this machine, started here for the test."""

import copy
import getpass
import importlib.util
import os
import platform
import shutil
import socket
import subprocess
import time

import psutil
import pytest
from test_workflow import ROOT
from workspaces import SHARDS, assert_whole, wait_for

PROGRAMS = ("slurmctld", "slurmd", "munged", "sbatch", "srun", "squeue", "scancel")
MISSING = [program for program in PROGRAMS if shutil.which(program) is None]
PLUGIN = importlib.util.find_spec("snakemake_executor_plugin_slurm")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.faults,
    pytest.mark.slurm,
    pytest.mark.skipif(bool(MISSING), reason=f"Slurm is not installed here: {', '.join(MISSING)}"),
    pytest.mark.skipif(PLUGIN is None, reason="its plugin is not installed: pip install -e '.[slurm]'"),
]

PATIENCE = 120.0  # s until Slurm has started
CONFIGURATION = """\
ClusterName=loopback
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=sched_interval=2,bf_interval=2
MinJobAge=300
ReturnToService=2
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
NodeName={host} NodeAddr=127.0.0.1 CPUs={processors} RealMemory={memory} State=UNKNOWN
PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def free_ports():
    with socket.socket() as socket_a, socket.socket() as socket_b:
        socket_a.bind(("127.0.0.1", 0))
        socket_b.bind(("127.0.0.1", 0))
        return socket_a.getsockname()[1], socket_b.getsockname()[1]


class Cluster:
    def __init__(self, folder):
        self.folder = folder
        self.environment = {**os.environ, "SLURM_CONF": str(folder / "slurm.conf")}
        self.host = platform.node().split(".")[0]
        self.processes = []

    def __enter__(self):
        for name in ("state", "spool", "bin"):
            (self.folder / name).mkdir()
        self.folder.chmod(0o755)
        key = self.folder / "key"
        key.write_bytes(os.urandom(128))
        key.chmod(0o400)
        memory = min(
            4000, psutil.virtual_memory().total // 2**20
        )  # MiB; a node with less memory than it declares is not used
        settings = {"host": self.host, "ports": free_ports(), "user": getpass.getuser(), "processors": os.cpu_count()}
        text = CONFIGURATION.format(folder=self.folder, memory=memory, **settings)
        (self.folder / "slurm.conf").write_text(text)
        # jobs of Snakemake's plugin drop Slurm's variables; a cluster has its file in /etc/slurm, and this one has not
        wrapper = self.folder / "bin/srun"
        wrapper.write_text(f'#!/bin/sh\nSLURM_CONF={self.folder}/slurm.conf exec {shutil.which("srun")} "$@"\n')
        wrapper.chmod(0o755)
        places = [f"--{n}-file={self.folder}/munged.{n}" for n in ("pid", "log", "seed")]
        munge_command = [
            "munged",
            "-F",
            "--force",
            f"--key-file={key}",
            f"--socket={self.folder}/munge.socket",
            *places,
        ]
        self.start(munge_command)
        self.wait_for((self.folder / "munge.socket").exists)
        self.start(["slurmctld", "-D", "-i"])
        self.start(["slurmd", "-D", "-N", self.host])
        self.wait_for(lambda: "idle" in self.ask("sinfo", "-h", "-o", "%t"))
        return self

    def wait_for(self, condition):
        """Waits for a step of the start; skip if a program of Slurm finds this machine unfit."""
        end = time.monotonic() + PATIENCE
        while not condition():
            dead_programs = [process.args[0] for process in self.processes if process.poll() is not None]
            if dead_programs or time.monotonic() > end:
                self.__exit__()
                output = "".join(path.read_text()[-500:] for path in sorted(self.folder.glob("*.out")))
                pytest.skip(f"Slurm does not start here: {' '.join([*dead_programs, output]).strip()}")
            time.sleep(0.1)

    def start(self, command):
        with (self.folder / f"{command[0]}.out").open("w") as output:
            process = subprocess.Popen(command, env=self.environment, stdout=output, stderr=subprocess.STDOUT)
        self.processes.append(process)

    def ask(self, *command):
        time.sleep(0.2)
        answer = subprocess.run(command, env=self.environment, capture_output=True, text=True, check=False)
        return answer.stdout

    def __exit__(self, *failure):
        for process in reversed(self.processes):
            process.terminate()
            try:
                process.wait(60)
            except subprocess.TimeoutExpired:
                process.kill()


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    with Cluster(tmp_path_factory.mktemp("slurm")) as cluster:
        yield cluster


def test_a_job_killed_on_the_cluster_changes_no_bit(cluster, workspace):
    workspace = copy.copy(workspace)
    workspace.settle()
    workspace.clear()
    workspace.define()
    shutil.copytree(ROOT / ".slurm", workspace.folder / ".slurm")
    workspace.environment = workspace.environment | {
        "SLURM_CONF": cluster.environment["SLURM_CONF"],
        "PATH": f"{cluster.folder}/bin:{os.environ['PATH']}",
    }
    quick = ("--slurm-init-seconds-before-status-checks", "2", "--slurm-status-command", "squeue")
    log = workspace.folder / "said.log"
    run = workspace.start(log, "--profile", ".slurm", *quick)
    queue_command = ("squeue", "-h", "-t", "running", "-o", "%i %k")
    shard = wait_for(
        lambda: [line.split()[0] for line in cluster.ask(*queue_command).splitlines() if "shard" in line], run
    )
    assert shard, log.read_text()
    cluster.ask("scancel", "--signal=KILL", "--full", shard[0])
    run.wait()
    output = log.read_text()
    assert run.returncode == 0, output
    assert f"SLURM-job '{shard[0]}' failed" in output
    assert output.count("has been submitted with SLURM jobid") == SHARDS + 2  # one shard twice, and the merge
    assert_whole(workspace)
