"""The scripts for Slurm, by a real Slurm: two nodes on this machine."""

import os
import shutil
import signal
import socket
import subprocess
import time
from contextlib import ExitStack
from pathlib import Path

import pytest
from farm_job import FARM, FRAMES

PROGRAMS = "munged", "slurmctld", "slurmd", "sbatch", "scontrol", "squeue"
CHUNKS = 8
CONFIGURATION = """
ClusterName=shutter
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmUser=root
SlurmctldPidFile={folder}/slurmctld.pid
SlurmctldLogFile={folder}/slurmctld.log
StateSaveLocation={folder}/state
SlurmdPidFile={folder}/%n.pid
SlurmdLogFile={folder}/%n.log
SlurmdSpoolDir={folder}/spool.%n
AuthInfo=socket={folder}/munge.socket
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
MailProg=/bin/true
SelectType=select/linear
NodeName=n1 NodeHostname={host} NodeAddr=127.0.0.1 Port={ports[1]}
NodeName=n2 NodeHostname={host} NodeAddr=127.0.0.1 Port={ports[2]}
PartitionName=all Nodes=ALL Default=YES
"""


@pytest.fixture(scope="module")
def slurm(tmp_path_factory):
    """Starts Slurm, and munge beside it; the environment in which its commands find it. All is in one folder."""
    path = f"{os.environ['PATH']}:/usr/sbin"
    if os.geteuid() or not all(shutil.which(program, path=path) for program in PROGRAMS):
        pytest.skip("NO SLURM: install Debian's munge, slurmctld, slurmd and slurm-client, and be root")
    folder = tmp_path_factory.mktemp("slurm")
    for name in ("munge", "state", "spool.n1", "spool.n2"):
        (folder / name).mkdir(mode=0o700)
    configuration = folder / "slurm.conf"
    host = socket.gethostname().partition(".")[0]
    configuration.write_text(CONFIGURATION.format(folder=folder, host=host, ports=free_ports(3)))
    environment = os.environ | {"PATH": path, "SLURM_CONF": str(configuration)}
    key = folder / "munge" / "key"
    key.write_bytes(os.urandom(1024))
    key.chmod(0o400)
    munge = ["munged", "--foreground", "--force", f"--socket={folder / 'munge.socket'}"]
    munge += [f"--{name}-file={folder / 'munge' / name}" for name in ("key", "pid", "log", "seed")]
    with ExitStack() as daemons, open(folder / "daemons.log", "w") as log:
        for command in (munge, ["slurmctld", "-D"], ["slurmd", "-D", "-N", "n1"], ["slurmd", "-D", "-N", "n2"]):
            daemon = subprocess.Popen(command, env=environment, stdout=log, stderr=log, start_new_session=True)
            daemons.callback(end, daemon)
            if command is munge:
                wait((folder / "munge.socket").exists)
        wait(lambda: told(environment, "sinfo", "-h", "-o", "%D %t") == "2 idle")
        yield environment
        subprocess.run(["scancel", "--user", str(os.geteuid())], env=environment, check=False)
        wait(lambda: not told(environment, "squeue", "-h"))


def free_ports(count):
    with ExitStack() as sockets:
        found = [sockets.enter_context(socket.socket()) for _ in range(count)]
        for each in found:
            each.bind(("127.0.0.1", 0))
        return [each.getsockname()[1] for each in found]


def end(daemon):
    daemon.terminate()
    try:
        daemon.wait(20)
    except subprocess.TimeoutExpired:
        os.killpg(daemon.pid, signal.SIGKILL)
        daemon.wait()


def told(environment, *command):
    """What a command says. An error, too: where Slurm does not answer, its queue is not empty."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    return subprocess.run(command, env=environment, check=False, **pipes).stdout.strip()


def wait(what, pause=0.5):
    """Waits until it is so, with seconds between two looks; what it is."""
    last = time.monotonic() + 240
    while not (found := what()):
        assert time.monotonic() < last, "waited for too long"
        time.sleep(pause)
    return found


@pytest.fixture
def submit(slurm, job, blender_program):
    """Submits the job; what farm/slurm did."""

    def run(*options, frames=f"1:{FRAMES}", chunk=FRAMES // CHUNKS):
        arguments = job.edit, frames, chunk, job.pictures, job.movie, *options
        command = [FARM / "slurm", *map(str, arguments)]
        environment = slurm | {"BLENDER": str(blender_program)}
        return subprocess.run(command, env=environment, cwd=job.folder, capture_output=True, text=True, timeout=240)

    return run


def claimant(folder):
    """The process that renders a frame, in the task whose id is its whole array's, too."""
    for claim in folder.glob(".claim-*"):
        try:
            pid = int(claim.read_text().split()[2])
            own = dict(each.partition("=")[::2] for each in Path(f"/proc/{pid}/environ").read_text().split("\0"))
        except (OSError, IndexError):  # it has come to its end, or has only begun
            continue
        if own["SLURM_JOB_ID"] == own["SLURM_ARRAY_JOB_ID"]:
            return pid
    return None


def waiting(slurm):
    """The tasks that were put back into the queue."""
    lines = told(slurm, "squeue", "-h", "-r", "-o", "%i %r").splitlines()
    return [line.split()[0] for line in lines if line.endswith("BeginTime")]


def test_a_killed_task_is_run_again_and_gives_the_bits_of_one_process(slurm, submit, job, single):
    submitted = submit()
    assert submitted.returncode == 0, submitted.stderr
    os.kill(wait(lambda: claimant(job.pictures), pause=0.005), signal.SIGKILL)
    (again,) = wait(lambda: waiting(slurm))
    # Slurm itself waits for two minutes. A node refuses a task that starts within the second in which it was killed.
    subprocess.run(["scontrol", "update", f"JobId={again}", "StartTime=now+3"], env=slurm, check=True)
    wait(lambda: not told(slurm, "squeue", "-h"))
    nodes = told(slurm, "squeue", "-h", "-r", "-t", "all", "-n", "edit-frames", "-o", "%N")
    assert set(nodes.split()) == {"n1", "n2"}
    logs = {path: path.read_text() for path in job.folder.glob("slurm-*.out")}
    assert len(logs) == CHUNKS + 2, told(slurm, "scontrol", "show", "jobs", "-o")
    assert sum("Killed" in text for text in logs.values()) == 1
    assert job.movie.exists(), "\n".join(logs.values())
    job.check(single)


@pytest.mark.parametrize(
    ("frames", "chunk", "said"),
    [
        (f"1-{FRAMES}", 4, f'"1-{FRAMES}" and "4" are not FIRST:LAST and CHUNK'),
        ("0001:0099", 0, '"0001:0099" and "0" are not FIRST:LAST and CHUNK'),
        ("9:8", 4, "there are no frames from 9 to 8"),
        ("1:1002", 1, "1002 chunks are more than Slurm's MaxArraySize, 1001; take longer ones"),
    ],
)
def test_what_cannot_be_submitted_is_refused_before_anything_is(slurm, submit, frames, chunk, said):
    done = submit(frames=frames, chunk=chunk)
    assert (done.returncode, done.stderr) == (2, f"farm/slurm: {said}\n")
    assert not told(slurm, "squeue", "-h")


def test_a_fault_ends_the_job_and_is_told(slurm, submit, job):
    (job.folder / "footage.mp4").unlink()
    assert submit("--wait").returncode == 2
    assert not told(slurm, "squeue", "-h")
    (log,) = job.folder.glob("slurm-*.out")
    assert "footage.mp4: no such file" in log.read_text()
    assert not job.movie.exists()
