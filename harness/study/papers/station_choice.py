"""Kim et al. 2012, Fig. 3: which trackers to wear, and what a single one tells."""

from collections.abc import Iterable, Sequence

from harness.results.cell import Cell
from harness.results.findings import Experiment, Table
from harness.study.papers.claims import Errors, errs_less
from harness.study.papers.five_stations import differences, held
from harness.study.papers.paper_study import Study
from harness.study.papers.station_sets import (
    SHORT,
    Sets,
    best_of_its_size,
    better_than_average,
    by_set,
    count_lines,
    falls_with_each,
    harder,
    named,
    ranked_bars,
    set_table,
)
from harness.study.papers.tables import GROUPS, joint_groups, mean_table

ALL_FIVE, HAND = named(SHORT), "RH"
SUITED = {"walking": "RA+LA+PEL", "boxing": "RH+LH+PEL"}
"""The three trackers that the paper calls suitable."""
_WHY_NOT = {
    "walking": "the mean counts arms as much as legs: these trackers determine the legs and leave the arms to examples",
    "boxing": "the mean counts legs as much as arms: these trackers leave the legs to examples",
}
"""See the tables of where sets err."""
_EASY_WALKS = "the walks are of people whose other walks are learnt from, one much like another; new people's err more"


def sensors(study: Study) -> Experiment:
    """Fig. 3."""
    rows = {behaviour: study.rows(f"sensors_{behaviour}") for behaviour in SUITED}
    angles: dict[str, Sets] = {behaviour: by_set(found) for behaviour, found in rows.items()}
    positions = {behaviour: by_set(found, "mpjpe_mm") for behaviour, found in rows.items()}
    claims = []
    for behaviour, other in (("walking", "boxing"), ("boxing", "walking")):
        sets, suited, theirs = angles[behaviour], SUITED[behaviour], SUITED[other]
        claims += [
            best_of_its_size(behaviour, suited, sets, _WHY_NOT[behaviour]),
            better_than_average(behaviour, suited, sets, _WHY_NOT[behaviour]),
            errs_less(
                f"{behaviour}: {suited}, called suitable for it, errs less than {theirs}, called so for {other}",
                sets.get(suited, {}),
                sets.get(theirs, {}),
                why=_WHY_NOT[behaviour],
            ),
            falls_with_each(behaviour, sets),
        ]
    walks, bouts = (angles[behaviour].get(ALL_FIVE, {}) for behaviour in ("walking", "boxing"))
    easy = _EASY_WALKS if study.motion == "cmu" else ""
    claims.append(harder("with all five, walking is harder than boxing (which has more data)", walks, bouts, easy))
    return Experiment(
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
            for b in SUITED
            for table in (
                _where_it_errs(b, study, f"sensors_{b}", (*SUITED.values(), ALL_FIVE)),
                set_table(f"{b}: all sets, mean ± sd over clips (clips)", angles[b], positions[b], ALL_FIVE),
            )
        ),
        figures=(
            *(
                ranked_bars(
                    f"{b}: mean joint-angle error of kernel_cca, by the trackers worn",
                    angles[b],
                    f"The paper calls {SUITED[b]} suitable. Intervals are of the mean over clips.",
                )
                for b in SUITED
            ),
            count_lines(
                "Error against the number of trackers", angles, "Averaged over clips and over all sets of as many."
            ),
        ),
        runs=tuple(f"sensors_{b}" for b in SUITED),
    )


def one_tracker(study: Study) -> Experiment:
    """The right hand's alone."""
    claims, tables, names = [], [], []
    for behaviour, run in (
        ("table tennis", "one_table_tennis"),
        ("boxing", "sensors_boxing"),
        ("walking", "sensors_walking"),
    ):
        sets = by_set(study.rows(run))
        text = f"{behaviour}: five trackers err less than the one on the right hand"
        claims.append(held(study, run, text, sets.get(ALL_FIVE, {}), sets.get(HAND, {}), published="pictures"))
        if sets:
            names.append(run)
            tables.append(_where_it_errs(behaviour, study, run, (HAND, ALL_FIVE)))
    return Experiment(
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


def _where_it_errs(behaviour: str, study: Study, run: str, sets: Sequence[str]) -> Table:
    """Every group of hinges, and the root, with some sets of trackers."""
    groups: dict[str, dict[str, Errors]] = {}
    worn = {named(row["stations"]): row["stations"] for row in study.rows(run)}
    for name in sets:
        cells = list(study.cells(run, stations=worn.get(name, [])))
        for group, errors in joint_groups(cells, GROUPS).items():
            groups.setdefault(f"{group} [deg]", {})[name] = errors
        for metric, title in (("root_heading_deg", "root's heading [deg]"), ("root_position_mm", "root [mm]")):
            groups.setdefault(title, {})[name] = _measured(cells, metric)
    return mean_table(f"{behaviour}: where it errs", "what", groups)


def _measured(cells: Iterable[Cell], metric: str) -> dict[str, float]:
    return {cell.clip: value for cell in cells if (value := cell.metrics[metric]) is not None}
