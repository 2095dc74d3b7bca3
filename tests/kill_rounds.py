"""Rounds that stop the program by signals at random moments, and look at what it leaves behind.

`python -m tests.kill_rounds --seed 1 --rounds 100 --kind run` prints a line for each round and the counts.
A round starts a command, sends one or two signals, and finds every departure from what is promised (`Round.faults`).
"""

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path

from harness.core.files import TEMPORARY
from harness.results import load_results
from tests.experiment.test_sweep_killed import kept
from tests.short_demo import short_demo

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
ENDED_S = 90.0
"""Time within which a program ends after its last signal [s]; a busy machine is slow."""
ORPHANS_S = 5.0
"""Time within which its processes end after it [s]."""
_MARK = "KILL_ROUND"
"""Environment variable that marks the processes of a round."""
_NOISE = ("Traceback", "Segmentation", "Fatal Python", "Exception ignored", "leaked", "resource_tracker", "core dumped")

OUTSIDE = """
from dataclasses import dataclass
from harness.reconstruct.methods.mean_pose import MeanPose


@dataclass(frozen=True)
class Outside(MeanPose):
    pass
"""
SWEEP = """
schema = 1
scenarios = ["demo"]
clips = ["walking_p1_01", "boxing_p11_01"]
methods = ["mean_pose", "ik:previous"]

[vary]
motion.longest_s = [2.0]
components.echo.share = [0.0, 0.02, 0.04, 0.06]
"""
PLACEMENT = """
schema = 1
kind = "placement"
title = "Which of three places?"
scenario = "demo"
methods = ["mean_pose"]
metric = "joint_angle_mean_deg"

[changes.motion]
source = "builtin"
test = ["walking_p1_01", "walking_p2_01"]
behaviours = ["walking"]
examples = ["walking_p3_01", "walking_p4_01"]
longest_s = 2.0

[[candidate]]
name = "head"
bone = "head"
along = 1.0
around_deg = 0.0

[[candidate]]
name = "hand"
bone = "rhand"
along = 1.0
around_deg = 90.0
pair = "each"

[[candidate]]
name = "ankle"
bone = "rtibia"
along = 0.9
around_deg = 90.0
pair = "each"

[exhaustive]
most = 2
"""


@dataclass
class Round:
    """One command that was stopped, and what was wrong with its end."""

    kind: str
    words: Sequence[str]
    stops: str
    """The signals and their moments."""
    code: int = 0
    early: bool = False
    """Whether the first signal came before the program's first line, where nothing can be promised but tidiness."""
    finished: bool = False
    """Whether the program ended before the signal."""
    faults: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Work:
    """A folder with what the commands of all kinds need."""

    folder: Path
    device: str = ""
    """Address of an emulated device, for `live` and `record`."""

    def command(self, kind: str, out: str) -> list[str]:
        """Words of the program for one kind of command that writes `out`."""
        python, harness = sys.executable, [sys.executable, "-m", "harness"]
        few = ["short.toml", "--methods", "mean_pose,ik:previous"]
        live = ["--port", self.device, "--scenario", "short.toml", "--method", "mean_pose", "--stations", "4"]
        return {
            "run": [*harness, "run", *few, "--no-report", "--out", out],
            "run --jobs 2": [*harness, "run", *few, "--out", out, "--jobs", "2"],
            "run outside": [*harness, "run", "short.toml", "--methods", "outside:Outside,mean_pose", "--out", out],
            "demo": [*harness, "demo", "--out", out],
            "sweep": [*harness, "sweep", "sweep.toml", "--out", out, "--jobs", "2"],
            "sweep --dask": [*harness, "sweep", "sweep.toml", "--out", out, "--dask", "local", "--jobs", "2"],
            "placement": [*harness, "placement", "placement.toml", "--out", out],
            "paper": [python, "-m", "tests.study.papers.tiny", "--out", out],
            "paper --quick": [*harness, "paper", "liu2011", "--quick", "--out", out],
            "report": [*harness, "report", "made"],
            "baseline": [*harness, "baseline", "save", out, "made", "--force"],
            "emulate": [*harness, "emulate", "short.toml", "--pty", out],
            "record": [*harness, "record", self.device, out],
            "live": [*harness, "live", *live, "--bvh", f"{out}.bvh", "--poses", f"{out}.csv", "--force"],
        }[kind]


KINDS_ENDLESS = ("emulate", "record", "live")
KINDS = (
    *("run", "run --jobs 2", "run outside", "demo", "sweep", "sweep --dask", "placement", "paper", "paper --quick"),
    *("report", "baseline", *KINDS_ENDLESS),
)
_LONGEST_S = {"demo": 40.0, "paper --quick": 120.0, "emulate": 6.0, "record": 6.0, "live": 12.0}
"""Latest first signal [s] of kinds whose whole duration nobody waits for."""


@contextmanager
def prepared_work(folder: Path, *, device: bool = False) -> Iterator[Work]:
    """A folder with a scenario, a sweep, a placement and a finished run; and with an emulated device."""
    short_demo(folder / "short.toml")
    (folder / "sweep.toml").write_text(SWEEP, encoding="utf-8")
    (folder / "placement.toml").write_text(PLACEMENT, encoding="utf-8")
    (folder / "outside.py").write_text(OUTSIDE, encoding="utf-8")
    work = Work(folder)
    finish(work, "run", "made")
    if not device:
        yield work
        return
    command = [sys.executable, "-m", "harness", "emulate", "short.toml", "--tcp", "127.0.0.1:0"]
    with _environment() as environment:
        program = subprocess.Popen(
            command, cwd=folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )
        with program:
            assert program.stderr is not None
            said = [program.stderr.readline() for _ in range(3)][1:]
            try:
                yield Work(folder, said[1].split()[3].rstrip(",;"))
            finally:
                program.terminate()


@contextmanager
def _environment() -> Iterator[dict[str, str]]:
    """An environment with an empty temporary folder of its own and a mark on its processes."""
    with tempfile.TemporaryDirectory(prefix="kill-round-", ignore_cleanup_errors=True) as folder:
        kept = {name: value for name, value in os.environ.items() if name != "HARNESS_MOCAP"}
        yield {**kept, "TMPDIR": folder, _MARK: folder, "PYTHONFAULTHANDLER": "1", "MPLBACKEND": "agg"}


def kill_round(work: Work, kind: str, out: str, draw: random.Random, whole_s: float) -> Round:
    """Start a command, stop it by signals at random moments within `whole_s`, and look at what it left."""
    words = work.command(kind, out)
    first, group, background = draw.choice(SIGNALS), draw.random() < 0.5, draw.random() < 0.2
    again = draw.choice(SIGNALS) if draw.random() < 0.4 else None
    if background:  # a shell lets jobs in the background ignore SIGINT
        first = signal.SIGTERM if first is signal.SIGINT else first
        again = signal.SIGTERM if again is signal.SIGINT else again
    at_s = draw.uniform(0.0, 0.3) if draw.random() < 0.2 else draw.uniform(0.0, whole_s)
    gap_s = draw.choice([draw.uniform(0.0, 0.05), draw.uniform(0.0, 3.0)])
    stops = f"{first.name} at {at_s:.2f} s" + (f", {again.name} {1e3 * gap_s:.0f} ms later" if again else "")
    stops += (", group" if group else "") + (", background" if background else "")
    result = Round(kind, words, stops)

    def prepare() -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN if background else signal.SIG_DFL)
        signal.signal(signal.SIGHUP, signal.SIG_DFL)  # it is ignored below `nohup`

    with _environment() as environment, open(work.folder / "talk.txt", "w+b") as talk:
        program = subprocess.Popen(
            words,
            cwd=work.folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=talk,
            stderr=talk,
            start_new_session=True,
            preexec_fn=prepare,
        )
        try:
            time.sleep(at_s)
            result.finished = program.poll() is not None or b"\npass" in Path(talk.name).read_bytes()
            result.early = not _handles_signals(program.pid)
            send: Callable[[int, int], None] = os.killpg if group else os.kill
            with suppress(ProcessLookupError):
                send(program.pid, first)
                if again:
                    time.sleep(gap_s)
                    send(program.pid, again)
            result.code = program.wait(ENDED_S)
        except subprocess.TimeoutExpired:
            result.faults.append(f"did not end within {ENDED_S:g} s")
        finally:
            orphans = _wait_for_orphans(environment[_MARK])
            for pid in orphans:
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            program.wait()
        result.faults += [f"orphan: {name}" for name in orphans.values()]
        left = [path.name for path in Path(environment["TMPDIR"]).iterdir()]
        result.faults += [f"left in the temporary folder: {name}" for name in left]
        talk.seek(0)
        said = talk.read().decode("utf-8", "replace")
    result.faults += [f"left: {path}" for path in work.folder.rglob("*") if TEMPORARY in path.name]
    if kind == "emulate" and os.path.lexists(work.folder / out):
        result.faults.append(f"left: the link {out}")
    if kind == "record" and result.code == 0 and not (work.folder / out).exists():
        result.faults.append("pass without a file")
    _judge(result, said)
    return result


def _judge(result: Round, said: str) -> None:
    """Add what is wrong with the exit code and the text."""
    expected = {0} if result.finished else {0, 130}  # 0: the result was there already, or Ctrl-C is the normal end
    if result.early:
        expected |= {-number for number in SIGNALS} | {0, 1, 130}
    if result.code not in expected:
        result.faults.append(f"exit code {result.code}")
    if not result.early:
        result.faults += [f"said {noise!r}: {said[-1500:]}" for noise in _NOISE if noise in said]
        last = said.strip().splitlines()[-1:] or [""]
        if last[0] not in ("pass", "interrupted"):
            result.faults.append(f"the last lines are {said[-500:]!r}")
        if result.code == 130 and "stopped" not in said:
            result.faults.append("no summary")


def _handles_signals(pid: int) -> bool:
    """Whether a process has a handler of SIGTERM, or ignores it; also True when it has ended."""
    try:
        status = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return True
    masks = [int(line.split()[1], 16) for line in status.splitlines() if line.startswith(("SigCgt", "SigIgn"))]
    return "State:\tZ" in status or any(mask >> (signal.SIGTERM - 1) & 1 for mask in masks)


def _wait_for_orphans(mark: str) -> dict[int, str]:
    """Processes with the mark that are still there after a while, and their command lines."""
    end_s = time.monotonic() + ORPHANS_S
    while (found := _marked(mark)) and time.monotonic() < end_s:
        time.sleep(0.05)
    return found


def _marked(mark: str) -> dict[int, str]:
    found, wanted = {}, f"{_MARK}={mark}".encode()
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            if wanted in (folder / "environ").read_bytes():
                command = (folder / "cmdline").read_bytes().replace(b"\0", b" ").decode("utf-8", "replace")
                found[int(folder.name)] = command[:200]
    return found


def duration_s(work: Work, kind: str, out: str) -> float:
    """Duration of an undisturbed command; a constant for those that take long or never end."""
    if kind in _LONGEST_S:
        return _LONGEST_S[kind]
    start_s = time.monotonic()
    finish(work, kind, out)
    return time.monotonic() - start_s


def kill_rounds(work: Work, kind: str, count: int, seed: int) -> Iterator[Round]:
    """So many rounds of one kind. A folder is resumed from round to round until its work is finished.

    After the last round the work is finished undisturbed, and compared with work that was never disturbed.
    """
    draw, number = random.Random(f"{seed} {kind}"), 0  # noqa: S311  # moments, no secrets
    name = kind.replace(" ", "").replace("-", "")
    whole_s = duration_s(work, kind, f"calm{name}")
    for _ in range(count):
        ended = kill_round(work, kind, f"{name}{number}", draw, whole_s)
        number += ended.finished or kind in KINDS_ENDLESS
        yield ended
    if kind in KINDS_ENDLESS:
        return
    last = Round(kind, work.command(kind, f"{name}{number}"), "resumed")
    for out in (f"{name}{number}", f"calm{name}"):
        finish(work, kind, out)
    if contents(work, kind, f"{name}{number}") != contents(work, kind, f"calm{name}"):
        last.faults.append("other bytes than without signals")
    yield last


def contents(work: Work, kind: str, out: str) -> dict[str, object]:
    """What a finished command has written, but for times: cells, or the files of a page or a baseline."""
    if kind == "report":
        return {"report.html": (work.folder / "made" / "report.html").read_bytes()}
    if kind == "baseline":
        folder = work.folder / "results" / "baselines" / out
        load_results(folder)  # checks the digests
        files: dict[str, object] = {path.name: path.read_bytes() for path in folder.iterdir()}
        first, digest, name, *others = (folder / "cells.json").read_bytes().splitlines()
        assert digest.startswith(b' "sha256": ')
        assert name == b' "name": "%b",' % out.encode(), "a baseline states its name"
        return files | {"cells.json": [first, *others]}
    folders = sorted((work.folder / out).rglob("cells"))
    assert folders
    return {str(folder.parent.relative_to(work.folder / out)): kept(folder.parent) for folder in folders}


def finish(work: Work, kind: str, out: str) -> None:
    """Give a command once more, undisturbed."""
    with _environment() as environment:
        done = subprocess.run(work.command(kind, out), cwd=work.folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def main() -> int:
    parser = argparse.ArgumentParser(description="Stop commands by signals at random moments.")
    parser.add_argument("--kind", action="append", choices=KINDS)
    parser.add_argument("--rounds", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    folder, failed, early, total = Path(tempfile.mkdtemp(prefix="kill-rounds-")), 0, 0, 0
    try:
        kinds = [k for k in options.kind or KINDS if "dask" not in k or find_spec("distributed")]
        with prepared_work(folder, device=any(kind in ("record", "live") for kind in kinds)) as work:
            for kind in kinds:
                for ended in kill_rounds(work, kind, options.rounds, options.seed):
                    total, early, failed = total + 1, early + ended.early, failed + bool(ended.faults)
                    state = "late" if ended.finished else "done" if ended.code == 0 else "ok"
                    state = "FAULT" if ended.faults else "early" if ended.early else state
                    print(f"{state:5} {kind}: {ended.stops}: {ended.code}", *ended.faults, sep="\n      ", flush=True)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    print(f"{total} rounds, {early} before the program's first line, {failed} with faults")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
