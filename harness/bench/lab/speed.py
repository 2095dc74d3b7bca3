"""Speed and memory of a lab's verbs: long captures characterised, a minute validated, a trust study and its methods."""

import time
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from harness.bench.cpu_time import hold_cpu_to_limit, overbooked
from harness.bench.lab.captures import FIVE_MINUTES, SCENARIO, planted_capture, simulation_note
from harness.bench.lab.verb_cost import BOXING_KIND, measure_verb
from harness.bench.limits import hold_to_limit
from harness.body import retarget_to_own_body
from harness.experiment import prepare_playback
from harness.experiment.scenarios import Scenario, load_scenario
from harness.mocap.synthetic import generate_rig
from harness.results.findings import BenchmarkStatement
from harness.simulate import Trajectory, sampling_times_s, simulate_readings, transmit_readings
from harness.stream.polhemus.codec import ByteCapture, WireFormat
from harness.stream.recording import RecordingWriter, record_capture
from harness.study.trust.trust_study import run_trust_study

RATE_HZ, BAUD = 120.0, 460_800
"""Rate of each station, and a line that carries six of them."""
PART_S = 300.0
"""Length of the parts in which long captures are simulated [s]."""
MAX_CHARACTERIZE_UNITS, MAX_VALIDATE_UNITS = 400.0, 140.0
"""Most CPU time of the verbs (see `cpu_time`)."""
MAX_MEMORY_RATIO, MAX_TRUST_RATIO = 2.0, 1.3
TRUST_CLIPS = ("walking_p1_01", "boxing_p1_01", "jumping_p1_01", "golf_p1_01")
TRUST_PLAN = """\
kind = "trust plan"
scenario = "demo"
methods = ["ik", "local_pca", "dynamic_map", "expert_map"]
seeds = [1, 2, 3]
[margins]
joint_angle_mean_deg = 1.0
mpjpe_mm = 10.0
"""


def bench_lab(seed: int) -> list[BenchmarkStatement]:
    """The rows of `harness bench lab`."""
    with TemporaryDirectory(prefix="harness-lab-") as temporary:
        folder = Path(temporary)
        short = planted_capture("clock", seed, folder)
        measure_verb("characterize", short)  # compiles what no run has compiled yet
        _, short_bytes = measure_verb("characterize", short)
        return [*_characterize_rows(seed, folder, short_bytes), _validate_row(seed, folder), _trust_row(seed, folder)]


def long_capture(path: Path, seed: int, minutes: float) -> None:
    """Record six stations at rest at 120 Hz, in parts of `PART_S` with errors of their own, in one session.

    The host reads a frame at a time.
    """
    lab = load_scenario(SCENARIO)
    scenario = replace(lab, seed=seed, tracker=replace(lab.tracker, rate_hz=RATE_HZ, baud=BAUD))
    wire_format = WireFormat(tuple(scenario.stations), RATE_HZ, scenario.tracker.items)
    with RecordingWriter(path, simulation_note(scenario, FIVE_MINUTES)) as writer:
        for part in _parts(scenario, wire_format, round(60.0 * minutes / PART_S)):
            times_s, size = part.received_s.tolist(), len(part.data) // len(part.ends)
            stations = len(scenario.stations)
            if not writer.counts["conf"]:
                writer.on_configured(wire_format, times_s[0], times_s[0])
            for first in range(0, len(times_s), stations):
                end = first + stations
                writer.on_received(part.data[size * first : size * end], times_s[end - 1], times_s[end - 1])


def _parts(scenario: Scenario, wire_format: WireFormat, count: int) -> Iterator[ByteCapture]:
    body, motion = retarget_to_own_body(generate_rig(FIVE_MINUTES))
    mounts, tracker = scenario.nominal_mounts, scenario.tracker
    time_s = sampling_times_s(PART_S, tracker, len(mounts))[: round(PART_S * RATE_HZ)]
    simulate = partial(simulate_readings, Trajectory(body, motion), mounts, tracker, scenario.noise_model, time_s)
    for number in range(count):
        part: dict[str, Any] = {"take": f"part {number}", "begins_s": PART_S * number, "session": "long"}
        yield transmit_readings(simulate(seed=scenario.seed, **part), wire_format, tracker)[1]


def _characterize_rows(seed: int, folder: Path, short_bytes: int) -> list[BenchmarkStatement]:
    """CPU time, and memory relative to that for a capture of two minutes."""
    rows = []
    for minutes, most in ((30, MAX_CHARACTERIZE_UNITS), (180, None)):
        capture = folder / f"{minutes}.rec"
        long_capture(capture, seed, minutes)
        cpu_s, peak_bytes = measure_verb("characterize", capture)
        megabytes, name = capture.stat().st_size / 1e6, f"characterize, {minutes} min of six stations at 120 Hz"
        capture.unlink()
        memory, ratio = f"{peak_bytes / 1e6:.0f} and {short_bytes / 1e6:.0f} MB", peak_bytes / short_bytes
        title = f"{name}, peak memory / that for 2 min"
        rows += [
            hold_cpu_to_limit(name, cpu_s, most, f"a file of {megabytes:.0f} MB"),
            hold_to_limit(title, ratio, "x", most=MAX_MEMORY_RATIO, reference=memory),
        ]
    return rows


def _validate_row(seed: int, folder: Path) -> BenchmarkStatement:
    capture = planted_capture(BOXING_KIND, seed, folder)
    measure_verb("validate", capture, seed)
    cpu_s, _ = measure_verb("validate", capture, seed)
    return hold_cpu_to_limit("validate, 60 s of six stations", cpu_s, MAX_VALIDATE_UNITS)


def _trust_row(seed: int, folder: Path) -> BenchmarkStatement:
    plan, captures = folder / "plan.toml", []
    plan.write_text(TRUST_PLAN, encoding="utf-8")
    for clip in TRUST_CLIPS:
        playback = prepare_playback("demo", clip=clip, seed=seed)
        captures.append(folder / f"{clip}.rec")
        simulation, note = playback.simulation, simulation_note(playback.scenario, clip)
        record_capture(captures[-1], simulation.wire_format, simulation.wire, note)
    start_s = time.perf_counter()
    study = run_trust_study(plan, captures, folder / "study", exploratory=True)
    total_s = time.perf_counter() - start_s
    return trust_row(total_s, study.methods_s, overbooked())


def trust_row(total_s: float, methods_s: float, doubt: str) -> BenchmarkStatement:
    """The row of a study's wall time over that of its methods [s], which an overbooked machine leaves in doubt."""
    methods, name = f"training and methods: {methods_s:.0f} s", "trust, time over that of its methods"
    return hold_to_limit(name, total_s / methods_s, "x", most=MAX_TRUST_RATIO, reference=methods, doubt=doubt)
