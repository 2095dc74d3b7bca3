"""Runs of the verb `run` whose methods err by a known size: everything but the answers of the methods is the verb's."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
import tomli_w
from scipy.ndimage import gaussian_filter1d

from harness.core.arrays import Floats, Ints
from harness.core.humanoid24 import pack, standard_skeleton, unpack
from harness.core.seeds import generator
from harness.experiment import ClipEvaluation, Evaluation, ObservedTake, PlannedCell, cells
from harness.experiment.methods import MethodAnswers
from harness.reconstruct import MeanPose, Method, registry
from harness.results import Cell, select_cells
from tests.products import Make, run_verb

METHODS = {"ik": 1.5, "best_match": 3.0, "best_match+ik": 1.0, "mean_pose": 14.0}
"""Method -> size of its errors [deg]. A plan may have other names too."""
RATE_HZ = 40.0
FAILURE = "<b>no</b> pose & no plan"


@dataclass(frozen=True)
class Plan:
    """What the run contains."""

    behaviours: tuple[str, ...] = ("walking", "boxing")
    methods: Mapping[str, float] = field(default_factory=lambda: dict(METHODS))
    takes: int = 1
    """Performers of each behaviour, with one take each."""
    duration_s: float = 2.0
    inputs: Sequence[str] = ("pos+ori",)
    failing: tuple[str, ...] = ()
    """Methods whose cells fail."""
    covered: float = 1.0
    """Share of the frames that have an estimate."""
    silent: tuple[str, ...] = ()
    """Methods that never answer."""
    known: int | None = None
    """Number of performers that methods know from other takes; by default nobody knows of examples."""
    vary: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    """Key of the scenario -> values; errors of the n-th one are n times as large."""
    components: Mapping[str, Any] = field(default_factory=dict)
    """Changes to the noise."""
    straight_elbow_deg: Mapping[str, float] = field(default_factory=dict)
    """Method -> further error of its left elbow while that is bent by less than 30 degrees [deg]."""
    sigma_deg: Mapping[str, float] = field(default_factory=dict)
    """Method -> mean standard deviation that it states, half of it for the first hinge and changing over time [deg]."""
    lags: Mapping[str, int] = field(default_factory=dict)
    """Method -> its lag [frames]."""


def planted_run(out: Path, plan: Plan = Plan()) -> Path:
    """The folder of the run, without its page; the same plan gives the same errors."""
    out.parent.mkdir(parents=True, exist_ok=True)
    scenario = out.with_name(f"{out.name}.toml")
    scenario.write_text(tomli_w.dumps(_scenario(plan)), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        for name in {name.partition("+")[0] for name in plan.methods} - set(registry.list_methods()):
            patch.setitem(registry._BUILT_IN, name, MeanPose)
        patch.setattr(cells, "evaluate", lambda method, name, take: _answer(method, name, take, plan))
        measured = plan.covered >= 0.5 and set(plan.methods) > set(plan.silent)
        run_verb("run", scenario, "--out", out, "--no-report", code=4 if plan.failing else 0 if measured else 3)
    return out


def _scenario(plan: Plan) -> dict[str, Any]:
    takes = [f"{behaviour}_p{n}_01" for behaviour in plan.behaviours for n in range(1, plan.takes + 1)]
    known = takes[: plan.known or 0]
    behaviours = [behaviour for behaviour in plan.behaviours for _ in range(plan.takes)]
    return {
        "schema": 1,
        "methods": list(plan.methods),
        "stations": "liu2011",
        "inputs": list(plan.inputs),
        "motion": {
            "source": "builtin",
            "body": "common",
            "longest_s": plan.duration_s,
            "behaviours": behaviours,
            "test": takes,
            "examples": [name.replace("_01", "_02") for name in known],
        },
        **({"vary": dict(plan.vary)} if plan.vary else {}),
        "components": dict(plan.components),
    }


def _answer(method: Method, name: str, take: ObservedTake, plan: Plan) -> Evaluation:
    """The truth with smooth errors in every hinge and the root, four times as large where readings are missing."""
    if name in plan.failing:
        raise ValueError(FAILURE)
    rng = generator(1, "planted", str(take.clip.part), name, str(take.calibration.stations))
    (loop,), lag = take.loops, plan.lags.get(name, 0)
    kept = rng.random(len(loop.rows)) < (0.0 if name in plan.silent else plan.covered)
    loop = replace(loop, rows=loop.rows[kept], index=loop.index[kept])
    truth = np.zeros((len(take.frames) - lag, 55))
    truth[:, 3] = 1.0
    seen = take.truth_row[: len(truth)]
    truth[seen >= 0] = take.truth_qpos[seen[seen >= 0]]
    valid = np.array([frame.position_valid for frame in take.frames[: len(truth)]], dtype=float)
    worse = gaussian_filter1d(1.0 + 3.0 * (1.0 - valid).sum(axis=1), 4.0)[:, None]

    def smooth(width: int) -> Floats:
        noise: Floats = gaussian_filter1d(rng.normal(size=(len(truth), width)), 6.0, axis=0)
        unit: Floats = noise / noise.std()
        return unit

    error_deg = plan.methods[name] * _worse_by(take, plan)
    root_m, quaternion, angles_rad = unpack(truth)
    angles_rad = angles_rad + np.deg2rad(error_deg) * worse * smooth(angles_rad.shape[1])
    elbow = standard_skeleton().dof_names.index("lradius.rx")
    straight = np.abs(unpack(truth)[2][:, elbow]) < np.deg2rad(30.0)
    angles_rad[:, elbow] += np.deg2rad(plan.straight_elbow_deg.get(name, 0.0)) * straight
    qpos = pack(root_m + 0.003 * error_deg * worse * smooth(3), quaternion, angles_rad)
    sigma_rad = None
    if name in plan.sigma_deg:
        over_time = 1.0 + 0.1 * np.sin(np.arange(len(truth)) / 7.0)
        sigma_rad = np.deg2rad(plan.sigma_deg[name]) * over_time[:, None] * np.linspace(0.5, 1.5, 48)
    status: Ints = np.where((valid < 1.0).any(axis=1), 1, 0)
    step_ms = rng.gamma(4.0, 0.15, len(truth))
    nothing, zero = np.full(len(truth), np.nan), np.zeros(len(truth), dtype=np.int64)
    answers = MethodAnswers(qpos, status, zero, step_ms, nothing, nothing, zero, sigma_rad)
    return Evaluation(name, replace(take, loops=(loop,)), answers, lag)


def _worse_by(take: ObservedTake, plan: Plan) -> int:
    """How many times as large errors are: the place of the first varied value among its values, from 1."""
    for key, values in plan.vary.items():
        value: Any = take.clip.scenario
        for part in key.split("."):
            value = value[part] if isinstance(value, Mapping) else getattr(value, part)
        return 1 + list(values).index(value)
    return 1


@dataclass(frozen=True)
class MeansPlan:
    """What a run or a sweep contains whose errors are planted clip by clip."""

    behaviours: tuple[str, ...] = ("walking", "boxing")
    """Each of them a scenario of a sweep."""
    clips: int = 7
    """Performers of each behaviour, with one take each."""
    methods: Mapping[str, float] = field(default_factory=lambda: {"ik": 3.0, "local_pca": 1.6, "dynamic_map": 1.4})
    """Method -> its error [deg]."""
    vary: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    """Key -> values; the n-th makes errors larger by n tenths."""
    interaction: float = 0.0
    """Share by which the last values of all keys together make errors larger, beyond what each of them does."""
    seeds: Sequence[int] = (1,)
    """Of a sweep."""
    known: int = 0
    """Number of performers that methods know from other takes."""
    failing: tuple[str, ...] = ()
    """Methods whose cells fail."""
    unmeasured: tuple[str, ...] = ()
    """Methods whose metrics are None."""
    lags: Mapping[str, int] = field(default_factory=dict)
    """Method -> its lag [frames]."""

    @property
    def exit_code(self) -> int:
        """Of the verb that runs it."""
        return 4 if self.failing else 3 if set(self.methods) <= set(self.unmeasured) else 0

    def scenario(self, *behaviours: str) -> dict[str, Any]:
        """The scenario of these behaviours, without what is varied."""
        return _scenario(Plan(behaviours, self.methods, takes=self.clips, duration_s=1.5, known=self.known))


@cache
def measured_cell() -> Cell:
    """A cell of the verb `run`."""
    with TemporaryDirectory() as folder:
        plan = Plan(behaviours=("walking",), methods={"ik": 2.0}, duration_s=1.5)
        (cell,) = select_cells(planted_run(Path(folder) / "run", plan))
        return cell


def planted_sweep(out: Path, plan: MeansPlan = MeansPlan()) -> Path:
    """The folder of a sweep, without its page, by the verb `sweep`; only the errors of its cells are planted."""
    folder = out.with_name(f"{out.name}_scenarios")
    folder.mkdir(parents=True)
    for behaviour in plan.behaviours:
        (folder / f"{behaviour}.toml").write_text(tomli_w.dumps(plan.scenario(behaviour)), encoding="utf-8")
    content = {
        "schema": 1,
        "name": "planted",
        "scenarios": [f"./{behaviour}.toml" for behaviour in plan.behaviours],
        "methods": list(plan.methods),
        "seeds": list(plan.seeds),
        **({"vary": dict(plan.vary)} if plan.vary else {}),
    }
    (folder / "sweep.toml").write_text(tomli_w.dumps(content), encoding="utf-8")
    with planted_means(plan), pytest.MonkeyPatch.context() as patch:
        patch.setattr("harness.report.sweep.page.sweep_chart", lambda *lines: None)
        run_verb("sweep", folder / "sweep.toml", "--out", out, "--jobs", "1", code=plan.exit_code)
    return out


def planted_means_run(out: Path, plan: MeansPlan) -> Path:
    """The folder of a run, without its page, by the verb `run`; only the errors of its cells are planted."""
    out.parent.mkdir(parents=True, exist_ok=True)
    scenario, vary = out.with_name(f"{out.name}.toml"), {"vary": dict(plan.vary)} if plan.vary else {}
    scenario.write_text(tomli_w.dumps(plan.scenario(*plan.behaviours) | vary), encoding="utf-8")
    with planted_means(plan):
        run_verb("run", scenario, "--out", out, "--no-report", "--jobs", "1", code=plan.exit_code)
    return out


@contextmanager
def planted_means(plan: MeansPlan) -> Iterator[None]:
    """Cells are that of `measured_cell`, with the errors of the plan."""
    template = measured_cell()

    def judge(setting: ClipEvaluation, method: Method, planned: PlannedCell, key: str, command: str) -> Cell:
        name, clip, seed = planned.method, str(setting.part), planned.scenario.seed
        if name in plan.failing:
            raise ValueError(FAILURE)
        worse = 1.0 + 0.1 * sum(list(plan.vary[varied]).index(value) for varied, value in planned.varied.items())
        worse += plan.interaction * all(plan.vary[varied][-1] == value for varied, value in planned.varied.items())
        draw = generator(seed, "planted sweep", name, clip, str(planned.varied)).normal()
        error = plan.methods[name] * worse * float(np.exp(0.2 * draw))
        metrics = {**template.metrics, "joint_angle_mean_deg": error, "mpjpe_mm": 6.0 * error, "mpjre_deg": 1.7 * error}
        if name in plan.unmeasured:
            metrics = {metric: value if metric.startswith("frames_") else None for metric, value in metrics.items()}
        lag = {"lag": plan.lags[name]} if name in plan.lags else {}
        return replace(
            template,
            key=key,
            method=name,
            clip=clip,
            behaviour=setting.behaviour,
            inputs=planned.inputs,
            seed=seed,
            noise=planned.scenario.noise,
            varied=planned.varied,
            scenario=planned.scenario.name,
            performer=setting.subject.performer,
            defined_by=setting.conditions_of(method, planned.inputs) | lag,
            scores=replace(template.scores, metrics=metrics),
        )

    with pytest.MonkeyPatch.context() as patch:
        for name in set(plan.methods) - set(registry.list_methods()):
            patch.setitem(registry._BUILT_IN, name, MeanPose)
        patch.setattr(cells, "evaluate_cell", judge)
        yield


RANKED = {"expert_map": 1.0, "twin_map": 1.15, "ik": 2.0, "mean_pose": 8.0}
"""Method -> its error [deg]: `twin_map` is tied with `expert_map`, the others are worse."""


@pytest.fixture(scope="session")
def ranked(made_once: Make) -> Path:
    """A run of one condition in which methods are tied and worse, on one take of each of eight performers."""
    plan = MeansPlan(("jumping",), 8, RANKED)
    return made_once("ranked", lambda folder: planted_means_run(folder / "run", plan)) / "run"


@pytest.fixture(scope="session")
def conditions(made_once: Make) -> Path:
    """A run of two noise presets and eight performers, of whom six are known."""
    methods, vary = {"ik:previous": 2.0, "ik:previous[jump_m=1.0]": 1.0}, {"noise": ("clean", "default")}
    plan = MeansPlan(("jumping",), 8, methods, vary, known=6)
    return made_once("conditions", lambda folder: planted_means_run(folder / "run", plan)) / "run"


@pytest.fixture(scope="session")
def viewed(made_once: Make) -> Path:
    """A run of two clips whose methods are near, nearer and far from the truth, with frames that lack an estimate."""
    plan = Plan(methods={"ik": 2.0, "map": 1.0, "far": 30.0}, duration_s=2.0, covered=0.9)
    return made_once("viewed", lambda folder: planted_run(folder / "run", plan)) / "run"
