"""Reproduction of Kim, Seol and Lee 2012: local models, and every experiment (docs/papers.md B).

The criteria of the claims were fixed before any run. The paper prints no errors as numbers. Its orders, and the sets
that it calls suitable, are tested by intervals over units.
"""

from collections.abc import Iterator
from functools import partial

from harness.results.findings import (
    BenchmarkStatement,
    FindingsTable,
    LineChart,
    PaperExperiment,
    Reading,
    StatementKind,
)
from harness.study.papers.five_stations import (
    KERNEL_CCA,
    KERNEL_CCA_LITERAL,
    METHODS,
    WEIGHTED_BLEND,
    WEIGHTED_BLEND_LITERAL,
    WORLD_METRICS,
    claim_in_run,
    differences,
    errors_by_method,
    five_stations,
    label_in,
    method_tables,
    performers,
)
from harness.study.papers.leave_one_out import Order
from harness.study.papers.paper import Paper
from harness.study.papers.paper_study import PaperStudy
from harness.study.papers.published_speed import KIM2012, compare_speed
from harness.study.papers.station_choice import one_station, rank_station_sets
from harness.study.papers.tables import error_lines, errors_by_joint_group, errors_by_unit, mean_bars, mean_table

DATABASE_FRAMES = {"table_tennis": 31, "walking": 43}
ONE_DATABASE_FRAMES = sum(DATABASE_FRAMES.values())
"""The paper adds the two: 74 frames. It does not say whether they were one database."""
_ORDERS: tuple[Order, ...] = (
    Order(KERNEL_CCA_LITERAL, WEIGHTED_BLEND_LITERAL, "printed", "as printed"),
    Order(KERNEL_CCA_LITERAL, "ik", "printed", "as printed"),
    Order(KERNEL_CCA, WEIGHTED_BLEND, "printed", "ours"),
    Order(KERNEL_CCA, "ik", "printed", "ours"),
    Order(KERNEL_CCA, "ik:previous", "repeated", "ours"),
    Order(f"{KERNEL_CCA}[solve=limbs]", f"{WEIGHTED_BLEND}[solve=limbs]", "repeated", "ours"),
    Order(f"{KERNEL_CCA}[final_ik=false]", f"{WEIGHTED_BLEND}[final_ik=false]", "repeated", "ours"),
)
"""Orders that are tested on each database."""
_PRINTED_ORDERS = tuple(order for order in _ORDERS if order.kind == "printed")
ARM_AND_SPINE = {
    "right arm": ("rclavicle", "rhumerus", "rradius", "rwrist", "rhand"),
    "spine": ("lowerback", "upperback", "thorax"),
    "left arm": ("lclavicle", "lhumerus", "lradius", "lwrist", "lhand"),
    "head and neck": ("lowerneck", "upperneck", "head"),
    "legs": ("lfemur", "ltibia", "lfoot", "rfemur", "rtibia", "rfoot"),
}
"""Group -> bones, for the body parts that the paper's pictures show."""


def sparse(study: PaperStudy) -> PaperExperiment:
    """Fig. 4: methods compared with very small databases."""
    claims: list[BenchmarkStatement] = []
    figures: list[LineChart] = []
    tables: list[FindingsTable] = []
    for run, behaviour, size in _databases():
        shown = f"{label_in(study, behaviour)}, {size}"
        rows, apart = study.rows(run), run.startswith("sparse")
        for performer in performers(rows) or ("known",):
            errors = errors_by_method(row for row in rows if row["performer"] == performer)
            title = shown + (", new performers" if performer == "new" else "")
            for lower, higher, kind, reading in _ORDERS if apart else _PRINTED_ORDERS:
                text, sides = (
                    f"{title}: {lower} errs less than {higher}",
                    (errors.get(lower, {}), errors.get(higher, {})),
                )
                stated: StatementKind = kind if apart else "repeated"
                claims.append(claim_in_run(study, run, text, *sides, kind=stated, reading=reading))
        if rows:
            tables += method_tables(shown, rows, WORLD_METRICS)
            known = [row for row in rows if row["performer"] == performers(rows)[0]]
            longest = max(known, key=lambda row: int(row["frames_matched"]))["clip"]
            cells = study.cells(run, clip=longest)
            curves = {cell.method: cell for _, cell in cells if cell.method in METHODS}
            title = f"{shown}: error over time in {longest}, the longest take"
            figures.append(error_lines(title, curves, caption="Mean error of the 48 hinges in every frame."))
    return PaperExperiment(
        name="sparse",
        title="Extremely sparse databases, frame by frame",
        question=(
            "With 31 frames of table tennis or 43 of walking as examples, does kernel CCA err less on other motion "
            "than a weighted blend of neighbours and than inverse kinematics? The paper shows the error of every frame "
            "(Fig. 4); it is lowest for kernel CCA. It also speaks of 74 frames in all, so the orders are repeated "
            "with one database of both."
        ),
        differences=(
            "The frames are evenly spaced over the full database. The paper does not say how it chose them.",
            "The paper's inverse kinematics is unknown: `ik` is the most accurate variant here, `ik:previous` the "
            "simplest.",
            "kernel_cca and weighted_blend end with inverse kinematics of the whole body. With [solve=limbs] it is "
            "solved limb by limb in closed form, as in the paper; [final_ik=false] leaves it out.",
            *differences(study),
        ),
        claims=tuple(claims),
        tables=tuple(tables),
        figures=tuple(figures),
        runs=tuple(run for run, _, _ in _databases() if run in study.runs),
    )


def _databases() -> Iterator[tuple[str, str, str]]:
    """Run, behaviour and words for its database: one for each behaviour, then one of both."""
    for behaviour, count in DATABASE_FRAMES.items():
        yield f"sparse_{behaviour}", behaviour, f"{count} frames"
    for behaviour in DATABASE_FRAMES:
        yield f"one_sparse_{behaviour}", behaviour, f"one database of {ONE_DATABASE_FRAMES} frames"


def extrapolation(study: PaperStudy) -> PaperExperiment:
    """Fig. 5: poses outside the examples, by body part."""
    run, option = "extrapolation", "[final_ik=false]"
    pairs: dict[Reading, tuple[str, str]] = {
        "as printed": (KERNEL_CCA_LITERAL, WEIGHTED_BLEND_LITERAL),
        "ours": (KERNEL_CCA, WEIGHTED_BLEND),
    }
    errors = {
        m: {
            **errors_by_joint_group(study.cells(run, method=m + option), ARM_AND_SPINE),
            "whole body": errors_by_unit(study.rows(run, method=m + option)),
        }
        for pair in pairs.values()
        for m in pair
    }
    claims = [
        claim_in_run(
            *(study, run, f"{label_in(study, 'table_tennis')}, {group}: {lower} errs less than {higher}"),
            *(errors[lower][group], errors[higher][group]),
            kind="derived" if group == "whole body" else "printed",
            reading=reading,
        )
        for reading, (lower, higher) in pairs.items()
        for group in ("right arm", "spine", "whole body")
    ]
    groups = {group: {method: errors[method][group] for method in errors} for group in errors[KERNEL_CCA]}
    label = label_in(study, "table_tennis")
    title = f"Three stations, 31 frames of {label}, no final inverse kinematics"
    caption = "Mean error of the hinges of each group."
    return PaperExperiment(
        name="extrapolation",
        title="Beyond the examples: right arm and spine",
        question=(
            "With 31 frames of table tennis, three stations (RH, LH, PEL) and no final inverse kinematics, does kernel "
            "CCA reach poses that no example shows? In the paper's pictures (Fig. 5) it is better than the blend at "
            "the right arm and the spine."
        ),
        differences=(
            "Errors of joint groups over twelve takes or blocks are compared; the paper shows single frames.",
            *(
                ("Two of the twelve performers (p3, p6) are left-handed and hold the bat in the left hand.",)
                if study.motion == "builtin"
                else ()
            ),
            *differences(study),
        ),
        claims=tuple(claims),
        tables=(mean_table(f"{title} [deg]", "hinges of", groups),) if run in study.runs else (),
        figures=(mean_bars(title, "deg", groups, caption=caption),) if run in study.runs else (),
        runs=(run,) if run in study.runs else (),
    )


BEHAVIOURS = ("table_tennis", "walking")
GLOBAL = "kernel_ridge+ik"
"""One smooth map from readings to posture, learnt from all examples at once, with the final inverse kinematics."""
_LOCAL: dict[str, Reading] = {KERNEL_CCA_LITERAL: "as printed", KERNEL_CCA: "ours"}


def local_models(study: PaperStudy) -> PaperExperiment:
    """The error of kernel CCA on nearest neighbours against that of one model of all examples."""
    claims: list[BenchmarkStatement] = []
    tables: list[FindingsTable] = []
    for behaviour in BEHAVIOURS:
        run, label = f"global_{behaviour}", label_in(study, behaviour)
        rows = study.rows(run)
        for performer in performers(rows) or ("known",):
            errors = errors_by_method(row for row in rows if row["performer"] == performer)
            title = label + (", new performers" if performer == "new" else "")
            for method, reading in _LOCAL.items():
                text = f"{title}: {method} errs less than a global model ({GLOBAL})"
                sides = errors.get(method, {}), errors.get(GLOBAL, {})
                claims.append(claim_in_run(study, run, text, *sides, reading=reading))
        tables += method_tables(label, rows, WORLD_METRICS) if rows else ()
    return PaperExperiment(
        name="local_models",
        title="Local models or a global one",
        question=(
            "The paper builds a model of the nearest examples for every frame, and says that local modelling is better "
            "than global modelling. Does kernel CCA err less than one model of the whole database?"
        ),
        differences=(
            "The paper does not name the global model that it means. Here it is kernel ridge regression on all "
            "examples (2,000 at most), followed by the inverse kinematics that the other methods end with.",
            *differences(study),
        ),
        claims=tuple(claims),
        tables=tuple(tables),
        runs=tuple(f"global_{b}" for b in BEHAVIOURS if f"global_{b}" in study.runs),
    )


PAPER = Paper(
    "kim2012",
    "Kim, Seol, Lee: Realtime performance animation using sparse 3D motion sensors, 2012",
    experiments={
        "sensors": rank_station_sets,
        "sparse": sparse,
        "extrapolation": extrapolation,
        "local_models": local_models,
        "one_tracker": one_station,
        "five_trackers": five_stations,
        "speed": partial(compare_speed, published=KIM2012),
    },
    runs_of={
        "sensors": ("sensors_walking", "sensors_boxing"),
        "sparse": ("sparse_table_tennis", "sparse_walking", "one_sparse_table_tennis", "one_sparse_walking"),
        "extrapolation": ("extrapolation",),
        "local_models": ("global_table_tennis", "global_walking"),
        "one_tracker": ("one_table_tennis", "sensors_boxing", "sensors_walking"),
        "five_trackers": ("five_boxing", "five_table_tennis", "five_walking"),
        "speed": (),
    },
)
