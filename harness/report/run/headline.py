"""The sentences that open the page of a run, and the facts below them."""

import numpy as np

from harness.compare import Sampling, count_clips
from harness.core.number_format import count_noun, format_share
from harness.core.stream_health import describe_line_loss
from harness.report.kit.text import describe_motion_source, name_motion
from harness.report.run.data import RunData
from harness.report.run.ranking import describe_rankings
from harness.results import SECONDARY_METRIC, setting_text
from harness.score import DEFINITIONS

SequenceKey = tuple[str, str, int]
"""Behaviour, clip and seed."""
_MOST_UNMEASURED = 8
"""Metrics without a value that are listed one by one."""


def run_verdict(run: RunData) -> tuple[str, str | None]:
    """Which method is best, by how much and on what motion, in sentences, and the series with the lowest error.

    None when no series leads.
    """
    source = str(run.manifest.inputs.get("motion_source", "unknown source"))
    rankings = describe_rankings(run.full_summary, name_motion(source))
    if not rankings:
        return f"Nothing was measured: {_progress(run)}.", None
    sentences = [text for ranking, lowest in rankings for text in (ranking, *_positions(run, lowest))]
    return " ".join(sentences), rankings[0][1]


def run_facts(run: RunData) -> dict[str, str]:
    """Title -> text: motion, coverage, what was not measured; without what does not apply."""
    facts = {
        "Motion": _motion(run),
        "Tracker": _tracker(run),
        "Learning": _learning(run),
        "Varied": _varied(run),
        "Coverage": _coverage(run),
        "Link": describe_line_loss(run.cells).removeprefix("THE LINK IS "),
        "Not measured": _unmeasured(run),
    }
    return {title: text for title, text in facts.items() if text}


def _positions(run: RunData, series: str | None) -> list[str]:
    """The sentence on joint positions, of the series that have the same sequences; none where not measured."""
    names = [name for name in run.series if run.lags[name] == run.lags.get(series or "", 0)]
    errors = {name: _by_sequence(run, name, SECONDARY_METRIC) for name in names}
    shared = set(errors.get(series or "", {}))
    means = {name: np.mean([e[k] for k in shared]) for name, e in errors.items() if shared and shared <= set(e)}
    if series not in means:
        return []
    lowest = min(means, key=lambda name: means[name])
    if lowest == series:
        also = ", also the lowest" if len(means) > 1 else ""
        return [f"Its mean joint position error is {means[series]:.0f} mm{also}."]
    return [f"{lowest} has the lowest joint position error: {means[lowest]:.0f} mm ({series}: {means[series]:.0f} mm)."]


def _by_sequence(run: RunData, series: str, metric: str) -> dict[SequenceKey, float]:
    """The metric of every sequence on which it was measured."""
    return {
        (str(row["behaviour"]), str(row["clip"]), int(row["seed"])): float(row[metric])
        for row in run.cells
        if run.series_of(row) == series and row[metric] is not None
    }


def _motion(run: RunData) -> str:
    source = describe_motion_source(str(run.manifest.inputs.get("motion_source", "unknown")))
    clips = {str(row["clip"]) for row in run.cells}
    behaviours = ", ".join(name.replace("_", " ") for name in run.behaviours)
    return f"{source}; {behaviours}; {count_clips(clips, Sampling.of_summary(run.full_summary))}"


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
    """The settings that were run, and which of them the page shows."""
    if not run.varied_label:
        return ""
    texts = list(dict.fromkeys(setting_text(row) for row in run.full_summary["cells"]))
    return f"{'; '.join(texts)}. All sections from Results on show {run.varied_label}"


def _progress(run: RunData) -> str:
    return f"{run.summary['cells_finished']} of {run.summary['cells_planned']} cells finished"


def _coverage(run: RunData) -> str:
    matched = sum(int(row["frames_matched"]) for row in run.cells)
    expected = sum(int(row["frames_expected"]) for row in run.cells)
    share = f" ({format_share(matched / expected, 1)})" if expected else ""
    return f"{matched:,} of {expected:,} frames matched{share}; {_progress(run)}"


def _unmeasured(run: RunData) -> str:
    """Metrics without a value, and how many cells lack them."""
    lacking = {name: sum(row[name] is None for row in run.cells) for name in DEFINITIONS}
    parts = [f"{name} in {count_noun(count, 'cell')} of {len(run.cells)}" for name, count in lacking.items() if count]
    if len(parts) > _MOST_UNMEASURED:
        start = f"{len(parts)} of {len(DEFINITIONS)} metrics in some cells"
        parts = [start, *parts[:3], "and others (see all metrics)"]
    return ", ".join(parts)
