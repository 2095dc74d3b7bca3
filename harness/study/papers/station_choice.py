"""Kim et al. 2012, Fig. 3: comparison of sets of stations, and reconstruction from a single station."""

from collections.abc import Iterable, Sequence

from harness.compare.claims import Errors, claim_lower_error
from harness.results.cell import Cell
from harness.results.findings import FindingsTable, PaperExperiment
from harness.study.papers.five_stations import claim_in_run, differences
from harness.study.papers.paper_study import PaperStudy
from harness.study.papers.station_sets import (
    STATION_ABBREVIATIONS,
    ErrorsBySet,
    claim_best_of_size,
    claim_better_than_average,
    claim_error_decreases,
    claim_harder,
    errors_by_set,
    format_station_set,
    ranked_bars,
    set_table,
    station_count_lines,
)
from harness.study.papers.tables import HINGE_GROUPS, errors_by_joint_group, mean_table

ALL_STATIONS, RIGHT_HAND = format_station_set(STATION_ABBREVIATIONS), "RH"
PUBLISHED_SETS = {"walking": "RA+LA+PEL", "boxing": "RH+LH+PEL"}
"""Behaviour -> the three stations that the paper calls suitable."""
_DISAGREEMENT_REASONS = {
    "walking": (
        "the mean weights arms and legs equally: these stations determine the legs and leave the arms to the examples"
    ),
    "boxing": "the mean weights arms and legs equally: these stations leave the legs to the examples",
}
"""Behaviour -> explanation of a claim that is not reproduced; see the tables of errors by body part."""
_WALKING_NOTE = (
    "the examples are other walks of the same people, which resemble each other; errors of new people are larger"
)


def rank_station_sets(study: PaperStudy) -> PaperExperiment:
    """Fig. 3: all sets of the five stations, ranked."""
    rows = {behaviour: study.rows(f"sensors_{behaviour}") for behaviour in PUBLISHED_SETS}
    angles: dict[str, ErrorsBySet] = {behaviour: errors_by_set(selected) for behaviour, selected in rows.items()}
    positions = {behaviour: errors_by_set(selected, "mpjpe_mm") for behaviour, selected in rows.items()}
    claims = []
    for behaviour, other in (("walking", "boxing"), ("boxing", "walking")):
        sets, suitable, other_suitable = angles[behaviour], PUBLISHED_SETS[behaviour], PUBLISHED_SETS[other]
        claims += [
            claim_best_of_size(behaviour, suitable, sets, _DISAGREEMENT_REASONS[behaviour]),
            claim_better_than_average(behaviour, suitable, sets, _DISAGREEMENT_REASONS[behaviour]),
            claim_lower_error(
                f"{behaviour}: {suitable}, suitable for it, errs less than {other_suitable}, suitable for {other}",
                sets.get(suitable, {}),
                sets.get(other_suitable, {}),
                why=_DISAGREEMENT_REASONS[behaviour],
            ),
            claim_error_decreases(behaviour, sets),
        ]
    walks, bouts = (angles[behaviour].get(ALL_STATIONS, {}) for behaviour in ("walking", "boxing"))
    easy = _WALKING_NOTE if study.motion == "cmu" else ""
    claims.append(
        claim_harder("with all five stations, walking is harder than boxing (which has more data)", walks, bouts, easy)
    )
    return PaperExperiment(
        name="sensors",
        title="Comparison of sets of stations",
        question=(
            "Which stations are needed, of right and left hand (RH, LH), right and left ankle (RA, LA) and pelvis "
            "(PEL)? The paper shows 15 sets as bars (Fig. 3). It finds RA+LA+PEL suitable for walking and RH+LH+PEL "
            "for boxing. More stations on the limbs look more natural. Walking, with less data, is harder."
        ),
        differences=(
            "All 31 sets are compared, since the paper does not list its 15.",
            "The error is the mean error of hinge angles; the paper's axis has no unit.",
            "'Suitable' is tested in three ways: no other set of the same size errs less; the others err more on "
            "average; the set that suits the other behaviour errs more.",
            "Without a station on the pelvis, readings are relative to an ankle or else to a hand. In the paper they "
            "are relative to the room in which the database was recorded.",
            *differences(study),
        ),
        claims=tuple(claims),
        tables=tuple(
            table
            for b in PUBLISHED_SETS
            for table in (
                _body_part_table(b, study, f"sensors_{b}", (*PUBLISHED_SETS.values(), ALL_STATIONS)),
                set_table(f"{b}: all sets, mean ± sd over clips (clips)", angles[b], positions[b], ALL_STATIONS),
            )
        ),
        figures=(
            *(
                ranked_bars(
                    f"{b}: mean joint-angle error of kernel_cca, by set of stations",
                    angles[b],
                    f"The paper calls {PUBLISHED_SETS[b]} suitable. The intervals are those of the mean over clips.",
                )
                for b in PUBLISHED_SETS
            ),
            station_count_lines(
                "Error against the number of stations",
                angles,
                "Averaged over clips and over all sets of the same size.",
            ),
        ),
        runs=tuple(f"sensors_{b}" for b in PUBLISHED_SETS),
    )


def one_station(study: PaperStudy) -> PaperExperiment:
    """One station on the right hand compared with five."""
    claims, tables, names = [], [], []
    for behaviour, run in (
        ("table tennis", "one_table_tennis"),
        ("boxing", "sensors_boxing"),
        ("walking", "sensors_walking"),
    ):
        sets = errors_by_set(study.rows(run))
        text = f"{behaviour}: five stations err less than the one on the right hand"
        claims.append(
            claim_in_run(study, run, text, sets.get(ALL_STATIONS, {}), sets.get(RIGHT_HAND, {}), published="pictures")
        )
        if sets:
            names.append(run)
            tables.append(_body_part_table(behaviour, study, run, (RIGHT_HAND, ALL_STATIONS)))
    return PaperExperiment(
        name="one_tracker",
        title="One station on the right hand, or five",
        question=(
            "How well does a single station on the right hand determine the body? The paper compares it with five, in "
            "pictures without numbers. The root then follows the hand, and the feet get no inverse kinematics."
        ),
        differences=(
            "With one station the method is the same: the hand is fitted to it, and the feet are not fitted.",
            "The root is placed relative to the hand as in the neighbours; the paper does not print its rule.",
            "Cells of boxing and walking are those of the sets of stations above.",
            *differences(study),
        ),
        claims=tuple(claims),
        tables=tuple(tables),
        runs=tuple(names),
    )


def _body_part_table(behaviour: str, study: PaperStudy, run: str, sets: Sequence[str]) -> FindingsTable:
    """Errors of every group of hinges and of the root, for some sets of stations."""
    groups: dict[str, dict[str, Errors]] = {}
    stations = {format_station_set(row["stations"]): row["stations"] for row in study.rows(run)}
    for name in sets:
        cells = list(study.cells(run, stations=stations.get(name, [])))
        for group, errors in errors_by_joint_group(cells, HINGE_GROUPS).items():
            groups.setdefault(f"{group} [deg]", {})[name] = errors
        for metric, title in (("root_heading_deg", "root's heading [deg]"), ("root_position_mm", "root [mm]")):
            groups.setdefault(title, {})[name] = _metric_by_clip(cells, metric)
    return mean_table(f"{behaviour}: error by body part", "body part", groups)


def _metric_by_clip(cells: Iterable[Cell], metric: str) -> dict[str, float]:
    return {cell.clip: value for cell in cells if (value := cell.metrics[metric]) is not None}
