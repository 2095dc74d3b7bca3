"""Fabricates a run folder from built-in motion and errors of known size, through the real results API."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter1d

from harness.core.arrays import Bools, Floats
from harness.core.humanoid24 import BONES, pack, unpack
from harness.core.seeds import generator
from harness.mocap.synthetic import SOURCE, generate
from harness.results import manifest, storage
from harness.score.score import score_estimate
from tests.results.finish import finish_run, make_run

RATE_HZ = 40.0
STATIONS = ("left_hand", "right_hand", "left_ankle", "right_ankle", "torso", "head")
METHODS = {"ik": 1.5, "best_match": 3.0, "best_match+ik": 1.0, "mean_pose": 14.0}
"""Method -> size of its errors [deg]."""


@dataclass(frozen=True)
class Plan:
    """What the fabricated run contains."""

    behaviours: tuple[str, ...] = ("walking", "boxing")
    methods: Mapping[str, float] | None = None
    takes: int = 1
    duration_s: float = 5.0
    inputs: Sequence[str] = ("pos+ori",)
    clip_name: str = ""
    """Name given to every clip instead of its own."""
    failing: tuple[str, ...] = ()
    """Methods whose cells are planned and fail."""
    covered: float = 1.0
    """Share of the frames that have an estimate."""
    silent: tuple[str, ...] = ()
    """Methods that never answer."""
    performers: tuple[str, ...] = ("known",)
    """Behaviours of the takes, in turn."""
    varied: tuple[Mapping[str, Any], ...] = ({},)
    """The n-th entry has errors n times as large."""
    sigma_deg: Mapping[str, float] = field(default_factory=dict)
    """Method -> mean standard deviation that it states, half of it for the first hinge and changing over time [deg]."""
    lags: Mapping[str, int] = field(default_factory=dict)
    """Method -> its lag [frames]; the last frames have no answer."""


def fabricate(out: Path, plan: Plan | None = None) -> Path:
    """Write the run; the same plan gives the same bytes."""
    plan = plan or Plan()
    methods = METHODS if plan.methods is None else plan.methods
    scenario = {"name": "fabricated", "methods": list(methods), **asdict(replace(plan, methods=None))}
    command = "harness run fabricated.toml --out results/fabricated"
    make_run(out, manifest.describe_run(scenario, motion_source=SOURCE, command=command))
    keys, failures, planned = [], {}, 0
    takes = range(1, plan.takes + 1)
    for times, behaviour, take, inputs in itertools.product(
        range(len(plan.varied)), plan.behaviours, takes, plan.inputs
    ):
        for method, error_deg in methods.items():
            planned += 1
            if method in plan.failing:
                text = "Traceback (most recent call last):\n  somewhere\nValueError: <b>no</b> pose & no plan"
                failures[f"{method} on {behaviour}_{take}"] = text
                continue
            cell = make_cell(behaviour, take, method, (times + 1) * error_deg, inputs, plan, plan.varied[times])
            storage.write_cell(out, cell)
            keys.append(cell.key)
    finish_run(out, keys=keys, planned=planned, failures=failures)
    return out


def make_cell(
    behaviour: str, take: int, method: str, error_deg: float, inputs: str, plan: Plan, varied: Mapping[str, Any]
) -> storage.Cell:
    """The cell of one method on the take of one performer."""
    made = generate(behaviour, f"p{take}", 1, seed=1, duration_s=plan.duration_s, rate_hz=RATE_HZ)
    skeleton, dofs = made.skeleton.subset(BONES)
    truth = pack(made.root_m, made.world_from_root, made.angles_rad[:, dofs])
    clip = plan.clip_name or made.name
    valid, quality = _readings(clip, len(truth))
    rng = generator(1, clip, method, inputs)
    seen = np.flatnonzero(rng.random(len(truth)) < (0.0 if method in plan.silent else plan.covered))
    lag = plan.lags.get(method, 0)
    seen = seen[seen < len(truth) - lag]
    estimate = _wrong(truth, error_deg, valid, rng)[seen]
    sigma_rad = None
    if method in plan.sigma_deg:
        over_time = 1.0 + 0.1 * np.sin(seen / 7.0)
        sigma_rad = np.deg2rad(plan.sigma_deg[method]) * over_time[:, None] * np.linspace(0.5, 1.5, 48)
    status, step_ms = np.where(valid.all(axis=1), 0, 1)[seen], rng.gamma(4.0, 0.15, len(seen))
    defined_by: dict[str, Any] = {"clip": clip, "take": take, "inputs": inputs, "rate_hz": RATE_HZ, "varied": varied}
    defined_by |= {"lag": lag} if lag else {}
    scores = score_estimate(skeleton, RATE_HZ, truth, estimate, seen, status, step_ms, angle_sigma_rad=sigma_rad)
    return storage.Cell(
        key=storage.cell_key(defined_by, {"name": method}, "made up"),
        method=method,
        behaviour=behaviour,
        clip=clip,
        motion_source=SOURCE,
        stations=STATIONS,
        mount="tibia",
        rate_hz=RATE_HZ,
        inputs=inputs,
        split="none" if method == "ik" else "sequence",
        calibration="exact",
        noise="default",
        seed=1,
        defined_by=defined_by,
        scores=scores,
        health={"records": 6 * len(truth), "frames_dropped": 3, "out_of_order": 0, "clock_ppm": 12.5},
        bone_m=skeleton.bone_m,
        source_hash="0123456789abcdef",
        reproduce="harness run fabricated.toml --out results/fabricated",
        notes=("made up for a test",),
        time_s=seen / RATE_HZ,
        truth_qpos=truth[seen],
        estimate_qpos=estimate,
        frame_index=seen,
        status=status,
        origin=np.zeros_like(status),
        step_ms=step_ms,
        quality=quality[seen],
        position_valid=valid[seen],
        orientation_valid=valid[seen],
        suspect=np.zeros_like(valid)[seen],
        performer=plan.performers[(take - 1) % len(plan.performers)],
        scenario="fabricated",
        varied=varied,
        angle_sigma_rad=sigma_rad,
    )


def _readings(clip: str, frames: int) -> tuple[Bools, Floats]:
    """(F, S) validity and quality; each station is lost once for up to a second."""
    valid, quality = np.ones((frames, 6), dtype=bool), np.ones((frames, 6))
    for s, station in enumerate(STATIONS):
        rng = generator(1, clip, station)
        start, length = rng.integers(0, frames), rng.integers(5, 40)
        lost = slice(start, start + length)
        valid[lost, s] = False
        quality[lost, s] = np.linspace(0.6, 0.0, len(quality[lost, s]))
    return valid, quality


def _wrong(truth: Floats, error_deg: float, valid: Bools, rng: np.random.Generator) -> Floats:
    """The truth with smooth errors in every hinge and the root, four times as large where readings are missing."""
    root_m, quaternion, angles_rad = unpack(truth)
    worse = gaussian_filter1d(1.0 + 3.0 * (~valid).sum(axis=1), 4.0)[:, None]

    def smooth(width: int) -> Floats:
        noise: Floats = gaussian_filter1d(rng.normal(size=(len(truth), width)), 6.0, axis=0)
        unit: Floats = noise / noise.std()
        return unit

    angles_rad = angles_rad + np.deg2rad(error_deg) * worse * smooth(angles_rad.shape[1])
    return pack(root_m + 0.003 * error_deg * worse * smooth(3), quaternion, angles_rad)
