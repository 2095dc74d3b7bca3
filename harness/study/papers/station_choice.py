"""Kim et al. 2012, Fig. 3: which trackers to wear, and what a single one tells."""

from collections.abc import Iterable, Sequence

from harness.results.cell import Cell
from harness.results.findings import FindingsTable, PaperExperiment
from harness.study.papers.claims import Errors, claim_lower_error
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
"""The three trackers that the paper calls suitable."""
_DISAGREEMENT_REASONS = {
    "walking": "the mean counts arms as much as legs: these trackers determine the legs and leave the arms to examples",
    "boxing": "the mean counts legs as much as arms: these trackers leave the legs to examples",
}
"""See the tables of where sets err."""
_WALKING_NOTE = (
    "the walks are of people whose other walks are learnt from, one much like another; new people's err more"
)


def rank_station_sets(study: PaperStudy) -> PaperExperiment:
    """Fig. 3."""
    rows = {behaviour: study.rows(f"sensors_{behaviour}") for behaviour in PUBLISHED_SETS}
    angles: dict[str, ErrorsBySet] = {behaviour: errors_by_set(found) for behaviour, found in rows.items()}
    positions = {behaviour: errors_by_set(found, "mpjpe_mm") for behaviour, found in rows.items()}
    claims = []
    for behaviour, other in (("walking", "boxing"), ("boxing", "walking")):
        sets, suited, theirs = angles[behaviour], PUBLISHED_SETS[behaviour], PUBLISHED_SETS[other]
        claims += [
            claim_best_of_size(behaviour, suited, sets, _DISAGREEMENT_REASONS[behaviour]),
            claim_better_than_average(behaviour, suited, sets, _DISAGREEMENT_REASONS[behaviour]),
            claim_lower_error(
                f"{behaviour}: {suited}, called suitable for it, errs less than {theirs}, called so for {other}",
                sets.get(suited, {}),
                sets.get(theirs, {}),
                why=_DISAGREEMENT_REASONS[behaviour],
            ),
            claim_error_decreases(behaviour, sets),
        ]
    walks, bouts = (angles[behaviour].get(ALL_STATIONS, {}) for behaviour in ("walking", "boxing"))
    easy = _WALKING_NOTE if study.motion == "cmu" else ""
    claims.append(
        claim_harder("with all five, walking is harder than boxing (which has more data)", walks, bouts, easy)
    )
    return PaperExperiment(
        name="sensors",
        title="Which trackers to wear",
        question=(
            "Of trackers on right and left hand (RH, LH), right and left ankle (RA, LA) and pelvis (PEL), which are "
            "needed? The paper shows 15 sets as bars (Fig. 3), finds RA+LA+PEL suitable for walking and RH+LH+PEL for "
            "boxing, more trackers on the limbs more natural, and walking harder, of which it has less data."
        ),
        differences=(
            "All 31 sets, for the paper does not list its 15.",
            "The error is the mean of the hinge angles' errors; the paper's axis has no unit.",
            "Suitable is read in three ways: no other set of as many trackers errs less; the others err more on "
            "average; so does the one called suitable for the other behaviour.",
            "Without a tracker on the pelvis the others are seen from an ankle, or else from a hand; the paper sees "
            "all from the room in which its database was recorded.",
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
                    f"{b}: mean joint-angle error of kernel_cca, by the trackers worn",
                    angles[b],
                    f"The paper calls {PUBLISHED_SETS[b]} suitable. Intervals are of the mean over clips.",
                )
                for b in PUBLISHED_SETS
            ),
            station_count_lines(
                "Error against the number of trackers", angles, "Averaged over clips and over all sets of as many."
            ),
        ),
        runs=tuple(f"sensors_{b}" for b in PUBLISHED_SETS),
    )


def one_station(study: PaperStudy) -> PaperExperiment:
    """The right hand's alone."""
    claims, tables, names = [], [], []
    for behaviour, run in (
        ("table tennis", "one_table_tennis"),
        ("boxing", "sensors_boxing"),
        ("walking", "sensors_walking"),
    ):
        sets = errors_by_set(study.rows(run))
        text = f"{behaviour}: five trackers err less than the one on the right hand"
        claims.append(
            claim_in_run(study, run, text, sets.get(ALL_STATIONS, {}), sets.get(RIGHT_HAND, {}), published="pictures")
        )
        if sets:
            names.append(run)
            tables.append(_body_part_table(behaviour, study, run, (RIGHT_HAND, ALL_STATIONS)))
    return PaperExperiment(
        name="one_tracker",
        title="One tracker on the right hand, or five",
        question=(
            "What does a single tracker on the right hand tell of the body? The paper shows it beside five (pictures, "
            "no figures): the root then follows the hand, and no inverse kinematics is applied to the feet."
        ),
        differences=(
            "One tracker is the same method with one station: the hand is fitted to it and the feet to nothing.",
            "The root stands where the neighbours' hand was seen from it; the paper's rule for it is not printed.",
            "Boxing and walking are cells of the sets of trackers above.",
            *differences(study),
        ),
        claims=tuple(claims),
        tables=tuple(tables),
        runs=tuple(names),
    )


def _body_part_table(behaviour: str, study: PaperStudy, run: str, sets: Sequence[str]) -> FindingsTable:
    """Every group of hinges, and the root, with some sets of trackers."""
    groups: dict[str, dict[str, Errors]] = {}
    worn = {format_station_set(row["stations"]): row["stations"] for row in study.rows(run)}
    for name in sets:
        cells = list(study.cells(run, stations=worn.get(name, [])))
        for group, errors in errors_by_joint_group(cells, HINGE_GROUPS).items():
            groups.setdefault(f"{group} [deg]", {})[name] = errors
        for metric, title in (("root_heading_deg", "root's heading [deg]"), ("root_position_mm", "root [mm]")):
            groups.setdefault(title, {})[name] = _metric_by_clip(cells, metric)
    return mean_table(f"{behaviour}: where it errs", "what", groups)


def _metric_by_clip(cells: Iterable[Cell], metric: str) -> dict[str, float]:
    return {cell.clip: value for cell in cells if (value := cell.metrics[metric]) is not None}
