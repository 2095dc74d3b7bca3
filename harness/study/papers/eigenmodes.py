"""How few modes tell the bones of a person: Liu et al. 2011, Fig. 4 (docs/methods.md A2).

The lengths of P people's bones vary along principal directions, the modes. What the first few keep of the variance is
asked of bones measured by each person's left tibia, as the paper shows them, and of metres; what they are worth to a
calibration is asked of people who were left out.
"""

from collections.abc import Mapping

import numpy as np

from harness.core.arrays import Floats
from harness.core.humanoid24 import BONES
from harness.core.skeleton import Skeleton
from harness.errors import BadInput
from harness.results.findings import BarChart, Claim, FindingsTable, LineChart, PaperExperiment
from harness.study.papers.bone_lengths import (
    MODES,
    OTHER_SIDE,
    SUBSAMPLES,
    Eigenmodes,
    explained_variance_by_count,
    fit_eigenmodes,
    leave_one_out_errors_m,
    normalise_by_tibia,
    symmetrise,
)

PUBLISHED_VARIANCE = 0.99
"""What five modes keep of the variation, about."""
_ROUNDING = 0.005
"""What "about 99 %" may have been rounded from."""
_PLOTTED_MODES = 12
"""Modes on the curve."""
_SYNTHETIC_NOTE = (
    "Drawn bones are nobody's: left and right are alike, and beyond stature each part is drawn on its own."
)
_NOT_HANDS = np.array([name not in ("lhand", "rhand") for name in BONES])


def evaluate_bone_modes(people: Mapping[str, Skeleton], source: str, *, measured: bool, seed: int) -> PaperExperiment:
    """The experiment on these people, `measured` where their bones are real; BadInput when there are too few."""
    if len(people) <= MODES + 1:
        found = f"{MODES} modes tell the bones of {len(people)} people without a remainder, whatever they are."
        raise BadInput(found, "Name a library with ASF files of more people.")
    length_m = np.array([person.length_m for person in people.values()])
    shown = fit_eigenmodes(normalise_by_tibia(length_m))
    return PaperExperiment(
        name="eigenmodes",
        title="Five modes of bone lengths",
        question=(
            "How much of people's differences in bone lengths do a few principal modes keep? The paper draws five "
            "modes of the CMU skeletons, each bone normalised by the left tibia (Fig. 4), and keeps about 99 %."
        ),
        differences=(
            f"{len(people)} skeletons: {source}. The paper does not say how many it used, or which.",
            *(() if measured else (_SYNTHETIC_NOTE,)),
        ),
        claims=(_variance_claim(float(shown.kept[MODES - 1]), len(people), measured),),
        tables=(_variance_table(length_m), _leave_one_out_table(length_m)),
        figures=(
            _mode_bars(shown),
            _variance_lines(length_m),
            _variance_by_count_lines(length_m, seed),
            _bone_error_bars(length_m),
        ),
        notes=_notes(length_m),
    )


def _variance_claim(kept: float, people: int, measured: bool) -> Claim:
    near = abs(kept - PUBLISHED_VARIANCE) <= _ROUNDING
    why = (
        f"{_percent(1.0 - kept)} is lost, not 1 %. Five modes keep more of fewer people (see the curve), and "
        "nearly all if the mean is not taken away first: the paper tells neither."
    )
    return Claim(
        text=f"{MODES} modes keep about 99 % of the variance of bone lengths, normalised by the left tibia",
        published="99 %",
        ours=f"{_percent(kept)} of {people} skeletons",
        verdict=("reproduced" if near else "not reproduced") if measured else "not comparable",
        why=("" if near else why) if measured else f"Drawn bones, not measured ones. {why}",
        difference=100.0 * kept,
        unit="%",
    )


def _variance_table(length_m: Floats) -> FindingsTable:
    """The share that is kept, counted in every way that we could think of."""
    ways = {
        "normalised by the left tibia, as the paper shows them": normalise_by_tibia(length_m),
        "the same without hands": normalise_by_tibia(length_m)[:, _NOT_HANDS],
        "the same, left and right made alike": normalise_by_tibia(symmetrise(length_m)),
        "metres": length_m,
        "metres without hands": length_m[:, _NOT_HANDS],
        "metres, left and right made alike": symmetrise(length_m),
        "metres, each bone by its own spread": length_m / np.maximum(length_m.std(axis=0), 1e-9),
    }
    rows = [(name, fit_eigenmodes(numbers).kept) for name, numbers in ways.items()]
    whole = np.cumsum(np.linalg.svd(length_m, compute_uv=False) ** 2)
    rows.append(("metres, the mean not taken away first", whole / whole[-1]))
    return FindingsTable(
        "Share of the variance that is kept",
        ("bone lengths", *(f"{n} mode{'s' * (n > 1)}" for n in (1, 3, MODES, 8)), "modes for 99 %"),
        tuple(
            (name, *(_percent(kept[min(n, len(kept)) - 1]) for n in (1, 3, MODES, 8)), str(_modes_needed(kept)))
            for name, kept in rows
        ),
    )


def _leave_one_out_table(length_m: Floats) -> FindingsTable:
    rows = []
    for modes in (0, 1, 2, 3, MODES, 8, 12):
        error_mm = 1e3 * np.abs(leave_one_out_errors_m(length_m, modes))
        rms_mm = float(np.sqrt(np.mean(error_mm**2)))
        figures = float(error_mm.mean()), rms_mm, float(error_mm.max())
        rows.append((str(modes) if modes else "0, the mean", *(f"{mm:.1f}" for mm in figures)))
    return FindingsTable(
        "A person left out, told by modes of the others in metres",
        ("modes", "mean error [mm]", "RMS [mm]", "largest [mm]"),
        tuple(rows),
    )


def _mode_bars(shown: Eigenmodes) -> BarChart:
    scaled = 100.0 * shown.spread[:, None] * shown.modes
    return BarChart(
        title="The five modes",
        unit="% of the left tibia",
        groups=BONES,
        series={f"mode {n + 1}": tuple(float(x) for x in mode) for n, mode in enumerate(scaled[:MODES])},
        caption="Each at one standard deviation of the people along it; the left tibia is 1 by definition.",
    )


def _variance_lines(length_m: Floats) -> LineChart:
    ways = {"normalised by the left tibia": normalise_by_tibia(length_m), "metres": length_m}
    kept = {name: fit_eigenmodes(numbers).kept[:_PLOTTED_MODES] for name, numbers in ways.items()}
    count = min(map(len, kept.values()))
    return LineChart(
        title="Variance kept by the first modes",
        x_label="modes",
        y_label="share kept [%]",
        x=tuple(float(n) for n in range(1, count + 1)),
        series={name: tuple(100.0 * float(share) for share in shares[:count]) for name, shares in kept.items()},
        caption=f"The paper keeps {MODES} modes and says about 99 %.",
    )


def _variance_by_count_lines(length_m: Floats, seed: int) -> LineChart:
    counts = range(MODES + 1, len(length_m) + 1)
    found = 100.0 * explained_variance_by_count(normalise_by_tibia(length_m), counts, seed)
    return LineChart(
        title="Variance kept by five modes, by the number of skeletons",
        x_label="skeletons",
        y_label="share kept [%]",
        x=tuple(float(n) for n in counts),
        series={name: tuple(map(float, found[:, i])) for i, name in enumerate(("lowest", "median", "highest"))},
        caption=f"Of {SUBSAMPLES} draws of so many of the people, lengths by the left tibia: few people, few directions.",
    )


def _bone_error_bars(length_m: Floats) -> BarChart:
    return BarChart(
        title="Error of a person left out, bone by bone",
        unit="mm RMS",
        groups=BONES,
        series={name: tuple(map(float, rms_mm)) for name, rms_mm in _bone_rms_mm(length_m).items()},
        horizontal=True,
        caption="What the mean of the others says of each bone, and what five of their modes can say at best.",
    )


def _bone_rms_mm(length_m: Floats) -> dict[str, Floats]:
    """RMS (24,) over people left out, by their mean and by five modes [mm]."""
    ways = {"the mean skeleton": 0, f"{MODES} modes": MODES}
    return {
        name: 1e3 * np.sqrt(np.mean(leave_one_out_errors_m(length_m, modes) ** 2, axis=0))
        for name, modes in ways.items()
    }


def _notes(length_m: Floats) -> tuple[str, ...]:
    kept = fit_eigenmodes(normalise_by_tibia(length_m)).kept
    of_mean, of_modes = (1e3 * float(np.abs(leave_one_out_errors_m(length_m, n)).mean()) for n in (0, MODES))
    by_mean_mm, by_modes_mm = _bone_rms_mm(length_m).values()
    worse = [name for name, mean, modes in zip(BONES, by_mean_mm, by_modes_mm, strict=True) if modes > mean]
    return (
        f"To keep 99 % it takes {_modes_needed(kept)} modes; five lose {_percent(1.0 - kept[MODES - 1])}.",
        *_asymmetry_notes(length_m),
        f"Five modes of the others miss the bones of a person left out by {of_modes:.1f} mm on average, their mean by "
        f"{of_mean:.1f} mm; and this is with all of that person's bones known, so no calibration does better by such a "
        "prior alone.",
        f"Bones that five modes tell worse than the mean does: {', '.join(worse) or 'none'}.",
    )


def _asymmetry_notes(length_m: Floats) -> tuple[str, ...]:
    """How left and right differ, if they do."""
    uneven = 100.0 * np.abs(length_m - length_m[:, OTHER_SIDE]) / symmetrise(length_m)
    hands, others = float(uneven[:, ~_NOT_HANDS].max()), float(uneven[:, _NOT_HANDS].max())
    if max(hands, others) < 0.5:
        return ()
    return (
        f"Left and right hands differ by up to {hands:.0f} %, other pairs by up to {others:.0f} % of their mean. Hands "
        "are short: without them the share is hardly another. Left and right made alike, five modes keep more.",
    )


def _modes_needed(kept: Floats) -> int:
    """Modes that keep 99 %."""
    return int(np.sum(kept < PUBLISHED_VARIANCE)) + 1


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f} %"
