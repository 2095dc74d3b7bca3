"""How much performers differ: those of the motion generator beside the performers of CMU's clips.

Takes are laid onto the common body and cut into blocks of two seconds, at most six of each performer. For every hinge
the mean angle, the range (5 to 95 %), and in walking the phase of its motion at the rate of strides are computed. The
variance of each between and within performers is that of a one-way analysis of variance. A value is the square root
of its mean over the hinges of a part of the body. Intervals are 95 % jackknife intervals over performers.

The error for a new performer, relative to that for a known one, is measured with `METHOD`: the same part of a take is
reconstructed once from examples of the other performers, and once also from the rest of the performer's own takes.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Literal

import numpy as np
from scipy import special

from harness.bench.limits import hold_to_limit
from harness.body import retarget_to_common_body
from harness.core.arrays import Floats
from harness.core.humanoid24 import standard_skeleton, unpack
from harness.core.motion import Clip
from harness.core.split import ClipPart
from harness.errors import BadInput
from harness.experiment import ClipEvaluation, ClipTask, evaluate_cell
from harness.experiment.scenarios import ScenarioMotion
from harness.mocap import (
    MOCAP_VARIABLE,
    MotionSource,
    SyntheticSource,
    folders_of_environment,
    open_motion_source,
    synthetic,
)
from harness.reconstruct import make_method
from harness.results.findings import BenchmarkStatement
from harness.study.speed.benchmark_clips import load_clean_scenario

METHOD = "local_pca"
BLOCK_S, MOST_BLOCKS, MOST_TAKES = 2.0, 6, 3
TAKE_S = 5.0
"""Length of a take of the motion generator, near that of CMU's walks [s]."""
STYLED = tuple(who for who in synthetic.performer_names() if who not in synthetic.REFERENCE_PERFORMERS)[::2]
"""Every second performer with a style of his own."""
BEHAVIOURS = ("walking", "jumping", "boxing")
OTHER_CLIPS = ("03_01", "03_03", "09_12", "16_33", "16_34", "16_01", "16_15", "16_23", "16_28", "08_07")
"""CMU's clips that are left out: uneven ground, backward steps, stops, and joints that jump in one frame."""
PARTS = {
    "legs": ("femur", "tibia", "foot"),
    "trunk": ("back", "thorax", "neck", "head"),
    "arms": ("clavicle", "humerus", "radius", "wrist", "hand"),
}
STRIDE_HZ = np.arange(0.6, 1.3, 0.01)
STRONG_RAD = np.deg2rad(2.0)
"""A hinge has a phase where its motion at the rate of strides has this mean amplitude."""
TESTED = "@0.60-1.00"
"""The part of a performer's first take that is reconstructed."""


class NoLibrary(BadInput):
    """No library of real motion was named."""


class _ShortTakes(SyntheticSource):
    """Takes of the motion generator that last `TAKE_S`."""

    def load(self, name: str) -> Clip:
        if name not in self._clips:
            behaviour, performer, take = name.rsplit("_", 2)
            self._clips[name] = synthetic.generate(
                behaviour, performer, int(take), seed=self._seed, duration_s=TAKE_S, rate_hz=60.0
            )
        return self._clips[name]


@dataclass(frozen=True)
class Spread:
    """Logarithms of two standard deviations, of which the first has a standard error over `count` performers."""

    between: float
    error: float
    within: float
    count: int

    @property
    def is_lost(self) -> bool:
        """Whether the spread between performers vanishes beside the one within."""
        return self.between < self.within + float(np.log(0.1))

    def text(self) -> str:
        """Such as "4.7 (3.5 to 6.4) between, 2.3 within" [deg]."""
        width = float(special.stdtrit(self.count - 1, 0.975)) * self.error
        low, middle, high = np.exp([self.between - width, self.between, self.between + width])
        return f"{middle:.1f} ({low:.1f} to {high:.1f}) between, {np.exp(self.within):.1f} within"


def bench_performers(seed: int = 1, performers: Sequence[str] = STYLED) -> list[BenchmarkStatement]:
    """Spreads of built-in performers relative to CMU's; NoLibrary without a library of real motion."""
    if not folders_of_environment():
        raise NoLibrary(
            "performers compares the motion generator with real performers, and no library was named.",
            f"Set {MOCAP_VARIABLE} to a folder with CMU clips; `harness mocap fetch cmu` downloads some.",
        )
    library, built_in = open_motion_source("cmu", None, seed=seed, rate_hz=120.0), _ShortTakes(seed)
    rows = []
    for behaviour in BEHAVIOURS:
        real = _takes_of(library, behaviour)
        styled = {who: _synthetic_takes(behaviour, who) for who in performers}
        neutral = {who: _synthetic_takes(behaviour, who) for who in synthetic.REFERENCE_PERFORMERS}
        sides = [spreads(*side, behaviour) for side in ((built_in, styled), (library, real), (built_in, neutral))]
        for name, own in sides[0].items():
            cmu, reference = sides[1][name], sides[2][name]
            if alike := [side for side, found in (("built-in", own), ("CMU's", cmu)) if found.is_lost]:
                within = f"{np.exp(own.within):.1f} and {np.exp(cmu.within):.1f} deg within"
                text = f"{' and '.join(alike)} performers differ by less than their own blocks show; {within}"
                rows.append(hold_to_limit(f"{behaviour}, {name}, built-in / CMU", np.nan, reference=text))
                continue
            width = float(special.stdtrit(cmu.count - 1, 0.975)) * np.hypot(own.error, cmu.error)
            ratio, low, high = np.exp(own.between - cmu.between + np.array([0.0, -width, width]))
            found = (
                f"{low:.2f} to {high:.2f}; {own.count} performers: {own.text()}; {cmu.count} of CMU: {cmu.text()}; "
                f"p1 to p8: {np.exp(reference.between):.1f} between"
            )
            rows.append(hold_to_limit(f"{behaviour}, {name}, built-in / CMU", float(ratio), reference=found))
        groups = [list(styled)[at : at + len(real)] for at in range(0, len(styled) - len(real) + 1, len(real))]
        ours = [_new_to_known(built_in, {who: styled[who] for who in group}, behaviour, seed) for group in groups[:2]]
        for title, logs in (("built-in", np.concatenate(ours)), ("CMU", _new_to_known(library, real, behaviour, seed))):
            width = float(special.stdtrit(len(logs) - 1, 0.975)) * float(np.std(logs, ddof=1)) / np.sqrt(len(logs))
            middle, low, high = np.exp(logs.mean() + np.array([0.0, -width, width]))
            found = f"{low:.2f} to {high:.2f}, {len(logs)} performers, {METHOD}"
            rows.append(hold_to_limit(f"{behaviour}, error if new / if known, {title}", float(middle), reference=found))
    return rows


def _takes_of(library: MotionSource, behaviour: str) -> dict[str, list[str]]:
    """The first clips of each performer of the library."""
    takes: dict[str, list[str]] = {}
    for name in library.names():
        if library.behaviour(name) == behaviour and name not in OTHER_CLIPS:
            takes.setdefault(library.performer(name), []).append(name)
    return {who: names[:MOST_TAKES] for who, names in takes.items()}


def _synthetic_takes(behaviour: str, performer: str) -> list[str]:
    return list(synthetic.take_names(behaviour, [performer]))[:MOST_TAKES]


def spreads(source: MotionSource, takes: dict[str, list[str]], behaviour: str) -> dict[str, Spread]:
    """Spread of the mean angle, the range and (in walking) the phase [deg], by quantity and part of the body."""
    described = [[_describe(*block) for block in _blocks(source, names)] for names in takes.values()]
    mean, extent, stride = ([np.array([block[k] for block in blocks]) for blocks in described] for k in range(3))
    quantities = {"mean angle": mean, "range": extent}
    strong = np.ones(len(_hinges()), bool)
    if behaviour == "walking":
        usual = np.mean([blocks.mean(axis=0) for blocks in stride], axis=0)
        strong = np.abs(usual) > STRONG_RAD
        quantities["phase"] = [np.angle(blocks * np.exp(-1j * np.angle(usual))) for blocks in stride]
    out = {}
    for quantity, groups in quantities.items():
        for part, bones in PARTS.items():
            chosen = np.array([any(bone in hinge for bone in bones) for hinge in _hinges()])
            if quantity == "phase":
                chosen &= strong
            out[f"{quantity} of the {part}"] = _spread([np.rad2deg(group[:, chosen]) for group in groups])
    return out


@cache
def _hinges() -> tuple[str, ...]:
    return standard_skeleton().dof_names


def _blocks(source: MotionSource, names: Sequence[str]) -> list[tuple[Floats, float]]:
    """Angles (T, 48) [rad] and rate of at most `MOST_BLOCKS` blocks of some takes, first one of each take."""
    by_take = []
    for name in names:
        motion, _ = retarget_to_common_body(source.load(name), standard_skeleton())
        size = int(BLOCK_S * motion.rate_hz)
        angles = np.unwrap(unpack(motion.qpos)[2], axis=0)
        by_take.append([(angles[at : at + size], motion.rate_hz) for at in range(0, len(angles) - size + 1, size)])
    turns = max(map(len, by_take))
    return [blocks[turn] for turn in range(turns) for blocks in by_take if turn < len(blocks)][:MOST_BLOCKS]


def _describe(angles: Floats, rate_hz: float) -> tuple[Floats, Floats, Floats]:
    """Mean, range and motion at the rate of strides (complex, relative to the thighs') of each hinge (48,) [rad]."""
    mean = (angles.mean(axis=0) + np.pi) % (2.0 * np.pi) - np.pi
    extent = np.quantile(angles, 0.95, axis=0) - np.quantile(angles, 0.05, axis=0)
    thighs = angles[:, _hinges().index("lfemur.rx")] - angles[:, _hinges().index("rfemur.rx")]
    time_s = np.arange(len(angles)) / rate_hz
    waves = [np.exp(-2j * np.pi * rate * time_s) for rate in STRIDE_HZ]
    wave = max(waves, key=lambda each: abs(np.sum(each * (thighs - thighs.mean()))))
    base = np.stack([np.ones(len(wave)), wave.real, wave.imag], axis=-1)
    fitted = np.linalg.lstsq(base, np.column_stack([thighs, angles]), rcond=None)[0]
    stride = fitted[1] + 1j * fitted[2]
    return mean, extent, stride[1:] * np.exp(-1j * np.angle(stride[0]))


def _spread(groups: list[Floats]) -> Spread:
    """Spread of blocks (B, H) of each performer, over the H hinges together."""
    count = len(groups)
    whole = _log_deviations(groups)
    without = np.array([_log_deviations(groups[:k] + groups[k + 1 :])[0] for k in range(count)])
    error = float(np.sqrt((count - 1) / count * np.sum((without - without.mean()) ** 2)))
    return Spread(whole[0], error, whole[1], count)


def _log_deviations(groups: list[Floats]) -> tuple[float, float]:
    """Logarithm of the standard deviations between and within groups, whose variances are means over hinges."""
    means, sizes = np.array([group.mean(axis=0) for group in groups]), np.array([len(group) for group in groups])
    squares = sum(np.sum((group - mean) ** 2) for group, mean in zip(groups, means, strict=True))
    within = float(squares / (sizes.sum() - len(groups)) / means.shape[1])
    between = float(means.var(axis=0, ddof=1).mean()) - within * float(np.mean(1.0 / sizes))
    return 0.5 * float(np.log(max(between, 1e-6))), 0.5 * float(np.log(max(within, 1e-6)))


def _new_to_known(source: MotionSource, takes: dict[str, list[str]], behaviour: str, seed: int) -> Floats:
    """Logarithms of the error for each performer if he is new, relative to that if he is known."""
    examples = tuple(name for names in takes.values() for name in names)
    splits: tuple[Literal["subject", "block"], ...] = ("subject", "block")
    logs = []
    for names in takes.values():
        errors = []
        for split in splits:
            motion = ScenarioMotion(
                source="builtin" if source.title == synthetic.SOURCE else "cmu",
                test=(names[0] + TESTED,),
                behaviours=(behaviour,),
                examples=examples,
                split=split,
                body="common",
                rate_hz=120.0,
            )
            scenario = replace(load_clean_scenario(), motion=motion, methods=(METHOD,), seed=seed, vary={})
            (cell,) = ClipTask(scenario, ClipPart.parse(motion.test[0]), behaviour, None, "").cells()
            evaluation = ClipEvaluation(scenario, source, cell.part, behaviour)
            found = evaluate_cell(evaluation, make_method(METHOD), cell, "", "")
            errors.append(float(found.scores.metrics["joint_angle_mean_deg"] or np.nan))
        logs.append(np.log(errors[0] / errors[1]))
    return np.array(logs)
