"""Kim et al. 2012: local models against a global one."""

from harness.results.benchmark_statement import BenchmarkStatement, Reading
from harness.results.findings import FindingsTable, PaperExperiment
from harness.study.papers.five_stations import (
    KERNEL_CCA,
    KERNEL_CCA_LITERAL,
    WORLD_METRICS,
    claim_in_run,
    differences,
    errors_by_method,
    label_in,
    method_tables,
    performers,
)
from harness.study.papers.paper_study import PaperStudy

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
