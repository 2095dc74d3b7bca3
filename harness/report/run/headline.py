"""The sentences that open the page of a run, and the facts below them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.core.number_format import count_noun, format_share
from harness.report.kit.text import describe_motion_source
from harness.report.run.data import RunData
from harness.results.cell import varied_text
from harness.results.reported_metrics import PRIMARY_METRIC, SECONDARY_METRIC
from harness.score.metrics import DEFINITIONS

SequenceKey = tuple[str, str, int]
"""Behaviour, clip and seed."""
_Errors = Mapping[str, Mapping[SequenceKey, float]]
"""Series -> sequence -> error."""
_MOST_UNMEASURED = 8
"""Metrics without a value that are listed one by one."""


@dataclass(frozen=True)
class Headline:
    """What a run found, as plain text; the page escapes it."""

    sentence: str
    best: str | None
    """The series with the lowest error; None when no series leads."""
    facts: Mapping[str, str]
    """Title -> text: motion, coverage, what was not measured."""


def build_headline(run: RunData) -> Headline:
    """Which method is best, by how much and on what motion, and what is missing."""
    facts = {
        "Motion": _motion(run),
        "Tracker": _tracker(run),
        "Learning": _learning(run),
        "Varied": _varied(run),
        "Coverage": _coverage(run),
        "Link": _link_loss(run),
        "Not measured": _unmeasured(run),
    }
    facts = {title: text for title, text in facts.items() if text}
    measured = {name: errors for name in run.series if (errors := _by_sequence(run, name, PRIMARY_METRIC))}
    if not measured:
        return Headline(f"Nothing was measured: {_progress(run)}.", None, facts)
    by_performer: dict[str, dict[str, dict[SequenceKey, float]]] = {}
    for name, errors in measured.items():
        by_performer.setdefault(_performer(run, name), {})[name] = errors
    rankings = [_ranking(run, performer, errors) for performer, errors in by_performer.items()]
    return Headline(" ".join(sentence for sentence, _ in rankings), rankings[0][1], facts)


def _ranking(run: RunData, performer: str, measured: _Errors) -> tuple[str, str | None]:
    """The sentences about series with the same kind of performer, and which of them is best."""
    shared = sorted(set.intersection(*(set(errors) for errors in measured.values())))
    if not shared:
        return f"{', '.join(measured)} share no measured sequence, so they are not ranked.", None
    means = {name: float(np.mean([errors[k] for k in shared])) for name, errors in measured.items()}
    order = sorted(means, key=lambda name: means[name])
    best = order[0]
    sequences = count_noun(len(shared), "sequence")
    if len(shared) < max(map(len, measured.values())):
        sequences = f"the {sequences} that all methods were measured on"
    several = len({_performer(run, name) for name in run.series}) > 1
    motion = _source(run) + (f" by {performer} performers" if several and performer else "")
    setting = f", with {run.varied_label}" if run.varied_label else ""
    start = f"{best} is best" if len(order) > 1 else best
    sentences = [f"{start}: {means[best]:.2f}° mean joint-angle error on {sequences} of {motion}{setting}."]
    sentences.append(_lead(measured, best, order[1], shared) if len(order) > 1 else "No other method was measured.")
    return " ".join([*sentences, *_positions(run, order, shared)]), best


def _performer(run: RunData, series: str) -> str:
    """Whether the examples know the performers of a series, see `Cell.performer`."""
    return next(str(row["performer"]) for row in run.summary["methods"] if run.series_of(row) == series)


def _lead(measured: _Errors, best: str, second: str, shared: Sequence[SequenceKey]) -> str:
    """The sentence on how much lower the best error is than the second."""
    lowest, next_lowest = (np.array([measured[name][k] for k in shared]) for name in (best, second))
    difference, wins = float(np.mean(next_lowest - lowest)), int(np.sum(lowest < next_lowest))
    if difference < 0.005:
        return f"{second}, the next, has the same error."
    how_often = "" if len(shared) == 1 else f", and lower on {wins} of {len(shared)} sequences"
    share = format_share(difference / next_lowest.mean())
    return f"That is {difference:.2f}° ({share}) less than {second}, the next{how_often}."


def _positions(run: RunData, order: Sequence[str], shared: Sequence[SequenceKey]) -> list[str]:
    """The sentence on joint positions; none where they were not measured."""
    errors = {name: _by_sequence(run, name, SECONDARY_METRIC) for name in order}
    means = {name: np.mean([e[k] for k in shared]) for name, e in errors.items() if set(shared) <= set(e)}
    best = order[0]
    if best not in means:
        return []
    lowest = min(means, key=lambda name: means[name])
    if lowest == best:
        also = ", also the lowest" if len(means) > 1 else ""
        return [f"Its mean joint position error is {means[best]:.0f} mm{also}."]
    return [f"{lowest} has the lowest joint position error: {means[lowest]:.0f} mm ({best}: {means[best]:.0f} mm)."]


def _by_sequence(run: RunData, series: str, metric: str) -> dict[SequenceKey, float]:
    """The metric of every sequence on which it was measured."""
    return {
        (str(row["behaviour"]), str(row["clip"]), int(row["seed"])): float(row[metric])
        for row in run.cells
        if run.series_of(row) == series and row[metric] is not None
    }


def _source(run: RunData) -> str:
    source = str(run.manifest.inputs.get("motion_source", "unknown source"))
    return "built-in motion" if "built-in" in source else f"motion from {source}"


def _motion(run: RunData) -> str:
    source = describe_motion_source(str(run.manifest.inputs.get("motion_source", "unknown")))
    clips = {str(row["clip"]) for row in run.cells}
    behaviours = ", ".join(name.replace("_", " ") for name in run.behaviours)
    return f"{source}; {behaviours}; {count_noun(len(clips), 'clip')}"


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
    """The split that limits what each method may learn from."""
    by_split: dict[str, dict[str, None]] = {}
    for row in run.summary["methods"]:
        by_split.setdefault(str(row["split"]), {})[str(row["method"])] = None
    without = by_split.pop("none", {})
    parts = [f"split {split}: {', '.join(names)}" for split, names in by_split.items()]
    return "; ".join([*parts, *([f"no examples: {', '.join(without)}"] if without else [])])


def _varied(run: RunData) -> str:
    """The combinations of varied values that were run, and which of them the page shows."""
    if not run.varied_label:
        return ""
    texts = list(dict.fromkeys(varied_text(row["varied"]) for row in run.full_summary["cells"]))
    return f"{'; '.join(texts)}. All sections from Results on show {run.varied_label}"


def _progress(run: RunData) -> str:
    return f"{run.summary['cells_finished']} of {run.summary['cells_planned']} cells finished"


def _coverage(run: RunData) -> str:
    matched = sum(int(row["frames_matched"]) for row in run.cells)
    expected = sum(int(row["frames_expected"]) for row in run.cells)
    share = f" ({format_share(matched / expected, 1)})" if expected else ""
    return f"{matched:,} of {expected:,} frames matched{share}; {_progress(run)}"


def _link_loss(run: RunData) -> str:
    """The share of records that the link between tracker and host could not carry."""
    sent, dropped = (
        sum(float(row["health"].get(name, 0.0)) for row in run.cells) for name in ("records_sent", "records_dropped")
    )
    return f"too slow: {format_share(dropped / (sent + dropped))} of the records were dropped" if dropped else ""


def _unmeasured(run: RunData) -> str:
    """Metrics without a value, and how many cells lack them."""
    lacking = {name: sum(row[name] is None for row in run.cells) for name in DEFINITIONS}
    parts = [f"{name} in {count_noun(count, 'cell')} of {len(run.cells)}" for name, count in lacking.items() if count]
    if len(parts) > _MOST_UNMEASURED:
        start = f"{len(parts)} of {len(DEFINITIONS)} metrics in some cells"
        parts = [start, *parts[:3], "and others (see all metrics)"]
    return ", ".join(parts)
