"""Reproduction of Kim, Seol and Lee 2012: local models, and every experiment (docs/papers.md B).

The criteria of the claims were fixed before any run. The paper prints no errors as numbers. Its orders, and the sets
that it calls suitable, are tested by intervals over units.
"""

from functools import partial

from harness.results.benchmark_statement import BenchmarkStatement, Reading
from harness.results.findings import FindingsTable, PaperExperiment
from harness.study.papers.five_stations import (
    KERNEL_CCA,
    KERNEL_CCA_LITERAL,
    WORLD_METRICS,
    claim_in_run,
    differences,
    errors_by_method,
    five_stations,
    label_in,
    method_tables,
    performers,
)
from harness.study.papers.paper import Paper
from harness.study.papers.paper_study import PaperStudy
from harness.study.papers.published_speed import KIM2012, compare_speed
from harness.study.papers.sparse_database import extrapolation, sparse
from harness.study.papers.station_choice import one_station, rank_station_sets

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
