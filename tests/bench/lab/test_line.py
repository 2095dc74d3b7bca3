"""Planted faults over a real line: an emulator in another process plays them, and `harness record` records them.

The driver sets the device's clock to zero, so that old stamps cannot be planted. The clock of an emulator's motion is
not the host's, so that latency is not measured.
"""

import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from harness.bench.lab.captures import EARLIER, NO_FAULTS, PLANTED_FAULTS, planted_numbers
from harness.bench.lab.outcomes import CaptureOutcome, stored_checks
from harness.bench.lab.truth import is_sized
from harness.core.working_folder import python_command, python_environment
from harness.mocap.synthetic import RIG_TAKES
from harness.stream.recording import CaptureReader
from harness.study.trust.capture_readings import read_capture
from harness.study.trust.characterization import characterize_capture
from harness.study.trust.truth_source import TruthSource, load_truth
from harness.study.trust.validation import session_unit, validate_capture
from tests.bench.lab.scenario_files import write_scenario

pytestmark = pytest.mark.slow
SEEDS = (1, 2, 3)
MOTION_S, WAIT_S = 60.0, 120.0
STATIONS = "left_hand,right_hand,left_ankle,right_ankle,torso,head"
KINDS = [kind for kind in PLANTED_FAULTS if kind not in ("stamps", "latency", EARLIER)]


@contextmanager
def _emulator(scenario: Path, link: Path) -> Iterator[None]:
    command = python_command("-m", "harness", "emulate", str(scenario), "--pty", str(link), "--stations", "6")
    with subprocess.Popen(command, env=python_environment(), stdout=subprocess.DEVNULL) as program:
        until_s = time.monotonic() + WAIT_S
        while not link.exists():
            assert program.poll() is None
            assert time.monotonic() < until_s
            time.sleep(0.1)
        yield
        program.send_signal(signal.SIGINT)


def _record(folder: Path, kind: str, seeds: tuple[int, ...]) -> list[Path]:
    """Captures of one kind, all at the same time, each from an emulator of its own."""
    fault, captures, recorders = PLANTED_FAULTS[kind], [], []
    take = RIG_TAKES.get(fault.take)
    seconds = MOTION_S if take is None else min(fault.seconds, take.static_s)
    with ExitStack() as emulators:
        for seed in seeds:
            link, capture = folder / f"{kind}_{seed}", folder / f"{kind}_{seed}.rec"
            emulators.enter_context(_emulator(write_scenario(folder, kind, seed), link))
            words = ["record", str(link), str(capture), "--stations", STATIONS, "--seconds", str(seconds)]
            recorders.append(subprocess.Popen(python_command("-m", "harness", *words), env=python_environment()))
            captures.append(capture)
        assert [recorder.wait(seconds + WAIT_S) for recorder in recorders] == [0] * len(seeds)
    return captures


def _outcome(folder: Path, kind: str, seed: int, capture: Path, earlier: Path | None) -> CaptureOutcome:
    if PLANTED_FAULTS[kind].verb == "characterize":
        return CaptureOutcome(kind, seed, "", stored_checks(characterize_capture(CaptureReader(capture)).checks))
    source = TruthSource("boxing_p1_01", str(write_scenario(folder, EARLIER, seed)))
    expected = None
    if earlier is not None:
        before = read_capture(CaptureReader(earlier))
        expected = session_unit(validate_capture(before, load_truth(before, source)), None, EARLIER)
    now = read_capture(CaptureReader(capture))
    found = validate_capture(now, load_truth(now, source), expected=expected)
    exchanged = tuple(f"{station}: {body}" for station, body in sorted(found.exchanged.items()))
    return CaptureOutcome(kind, seed, "", stored_checks(found.report.checks), exchanged=exchanged)


@pytest.mark.parametrize("kind", KINDS)
def test_three_captures_over_a_line(kind: str, tmp_path: Path) -> None:
    captures = _record(tmp_path, kind, SEEDS)
    earlier = _record(tmp_path, EARLIER, SEEDS) if kind == "scale" else [None] * len(SEEDS)
    for seed, capture, before in zip(SEEDS, captures, earlier, strict=True):
        outcome = _outcome(tmp_path, kind, seed, capture, before)
        assert outcome.exchanged == PLANTED_FAULTS[kind].exchanged
        named = {(check.key, check.station): check for check in outcome.named}
        if kind in NO_FAULTS:
            assert not named
        for number in planted_numbers(kind, seed):
            assert is_sized(number, named[number.key, number.station])
