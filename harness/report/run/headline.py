"""The sentence that the page opens on, and the facts that qualify it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.report.run.data import RunData
from harness.results.cell import varied_text
from harness.score.metrics import DEFINITIONS

PRIMARY_METRIC, SECONDARY_METRIC = "joint_angle_mean_deg", "mpjpe_mm"
SequenceKey = tuple[str, str, int]
"""Behaviour, clip and seed."""


@dataclass(frozen=True)
class Headline:
    """Plain text throughout; whoever prints it escapes it."""

    sentence: str
    best: str | None
    """The leading series; None when nothing was measured."""
    facts: Mapping[str, str]
    """Title -> text: motion, coverage, what was not measured."""


def build_headline(run: RunData) -> Headline:
    """Which method is best, by how much, on what, and what is missing."""
    facts = {
        "Motion": _motion(run),
        "Tracker": _tracker(run),
        "Learning": _learning(run),
        "Varied": _varied(run),
        "Coverage": _coverage(run),
        "Line": _link_loss(run),
        "Not measured": _unmeasured(run),
    }
    facts = {title: text for title, text in facts.items() if text}
    measured = {name: values for name in run.series if (values := _by_sequence(run, name, PRIMARY_METRIC))}
    if not measured:
        return Headline(f"Nothing was measured: {_progress(run)}.", None, facts)
    kinds: dict[str, dict[str, dict[SequenceKey, float]]] = {}
    for name, values in measured.items():
        kinds.setdefault(_performer(run, name), {})[name] = values
    said = [_ranking_sentence(run, kind, found) for kind, found in kinds.items()]
    return Headline(" ".join(sentence for sentence, _ in said), said[0][1], facts)


def _ranking_sentence(
    run: RunData, kind: str, measured: Mapping[str, Mapping[SequenceKey, float]]
) -> tuple[str, str | None]:
    """The sentence about methods that saw the same kind of performer, and which of them leads."""
    shared = sorted(set.intersection(*(set(values) for values in measured.values())))
    if not shared:
        return f"{', '.join(measured)} share no measured sequence: none is best.", None
    means = {name: float(np.mean([values[k] for k in shared])) for name, values in measured.items()}
    order = sorted(means, key=lambda name: means[name])
    sequences = _count_noun(len(shared), "sequence")
    if len(shared) < max(map(len, measured.values())):
        sequences = f"the {sequences} that all methods were measured on"
    best = f"{order[0]} is best" if len(order) > 1 else order[0]
    several = len({_performer(run, name) for name in run.series}) > 1
    whose = f" by {kind} performers" if several and kind else ""
    start = f"{best}: {means[order[0]]:.2f}° mean joint-angle error on {sequences} of {_source(run)}{whose}"
    lead = _lead_text(measured, order[0], order[1], shared) if len(order) > 1 else "; no other method was measured"
    at = f", with {run.varied_label}" if run.varied_label else ""
    return f"{start}{lead}{at}.{_positions(run, order, shared)}", order[0]


def _performer(run: RunData, series: str) -> str:
    """Whether the examples know the performers of a series, see `Cell.performer`."""
    return next(str(row["performer"]) for row in run.summary["methods"] if run.series_of(row) == series)


def _positions(run: RunData, order: Sequence[str], shared: Sequence[SequenceKey]) -> str:
    """Whether the joints' positions say the same; nothing where they were not measured."""
    found = {name: _by_sequence(run, name, SECONDARY_METRIC) for name in order}
    means = {name: np.mean([v[k] for k in shared]) for name, v in found.items() if set(shared) <= set(v)}
    if order[0] not in means:
        return ""
    first = min(means, key=lambda name: means[name])
    if first == order[0]:
        return f" Its joints are {means[first]:.0f} mm off" + (", the least too." if len(means) > 1 else ".")
    return f" In joint position {first} is better: {means[first]:.0f} mm off, {order[0]} {means[order[0]]:.0f} mm."


def _lead_text(
    measured: Mapping[str, Mapping[SequenceKey, float]], best: str, second: str, shared: Sequence[SequenceKey]
) -> str:
    """How far the next one is behind."""
    ours, others = (np.array([measured[name][k] for k in shared]) for name in (best, second))
    less, ahead = float(np.mean(others - ours)), int(np.sum(ours < others))
    if less < 0.005:
        return f", as much as {second}, the next"
    share = f" ({100.0 * less / others.mean():.0f} %)"
    how_often = "" if len(shared) == 1 else f", and better on {ahead} of {len(shared)}"
    return f", {less:.2f}°{share} less than {second}, the next{how_often}"


def _by_sequence(run: RunData, series: str, metric: str) -> dict[SequenceKey, float]:
    """The metric of every sequence where it was measured."""
    return {
        (str(row["behaviour"]), str(row["clip"]), int(row["seed"])): float(row[metric])
        for row in run.cells
        if run.series_of(row) == series and row[metric] is not None
    }


def _source(run: RunData) -> str:
    source = str(run.manifest.inputs.get("motion_source", "unknown source"))
    return "built-in motion" if "built-in" in source else f"motion from {source}"


def _motion(run: RunData) -> str:
    source = str(run.manifest.inputs.get("motion_source", "unknown"))
    made_up = " (generated by a procedure, not recorded from a person)" if "built-in" in source else ""
    clips = {str(row["clip"]) for row in run.cells}
    shown = ", ".join(name.replace("_", " ") for name in run.behaviours)
    return f"{source}{made_up}; {shown}; {_count_noun(len(clips), 'clip')}"


def _tracker(run: RunData) -> str:
    if not run.cells:
        return ""
    row = run.cells[0]
    inputs = ", ".join(sorted({str(row["inputs"]) for row in run.cells}))
    stations = [str(name).replace("_", " ") for name in row["stations"]]
    return (
        f"simulated; {len(stations)} stations ({', '.join(stations)}; mount {row['mount']}) at {row['rate_hz']:g} Hz, "
        f"inputs {inputs}, noise {row['noise']}, calibration {row['calibration']}, seed {row['seed']}"
    )


def _learning(run: RunData) -> str:
    """What methods that learn were allowed to see."""
    learners: dict[str, dict[str, None]] = {}
    for row in run.summary["methods"]:
        learners.setdefault(str(row["split"]), {})[str(row["method"])] = None
    without = learners.pop("none", {})
    parts = [f"{', '.join(names)} from other motion (split {split})" for split, names in learners.items()]
    return "; ".join([*parts, *([f"{', '.join(without)} from none"] if without else [])])


def _varied(run: RunData) -> str:
    """The combinations that were run, and which of them is shown."""
    texts = list(dict.fromkeys(varied_text(row["varied"]) for row in run.full_summary["cells"]))
    return f"{'; '.join(texts)}. From the results on everything is about {run.varied_label}" if run.varied_label else ""


def _progress(run: RunData) -> str:
    return f"{run.summary['cells_finished']} of {run.summary['cells_planned']} cells finished"


def _coverage(run: RunData) -> str:
    matched = sum(int(row["frames_matched"]) for row in run.cells)
    expected = sum(int(row["frames_expected"]) for row in run.cells)
    share = f" ({100.0 * matched / expected:.1f} %)" if expected else ""
    return f"{matched:,} of {expected:,} frames matched{share}; {_progress(run)}"


def _link_loss(run: RunData) -> str:
    """What the line between tracker and host could not carry."""
    totals = [
        [float(row["health"].get(name, 0.0)) for row in run.cells] for name in ("records_sent", "records_dropped")
    ]
    sent, lost = map(sum, totals)
    return f"too slow: {100.0 * lost / (sent + lost):.0f} % of the records were dropped" if lost else ""


def _unmeasured(run: RunData) -> str:
    """Metrics without a value, by how many of the cells lack them."""
    lacking = {name: sum(row[name] is None for row in run.cells) for name in DEFINITIONS}
    parts = [f"{name} in {_count_noun(count, 'cell')} of {len(run.cells)}" for name, count in lacking.items() if count]
    if len(parts) > 8:
        parts = [f"{len(parts)} of {len(DEFINITIONS)} metrics in some cells", *parts[:3], "and so on (see all metrics)"]
    return ", ".join(parts)


def _count_noun(count: int, what: str) -> str:
    return f"{count} {what}" + ("" if count == 1 else "s")
