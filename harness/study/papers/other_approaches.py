"""Liu et al. 2011: what the paper says of other approaches, and the neighbour graph that its search is built on."""

from harness.compare.claims import claim_lower_error, claim_noninferior
from harness.results.benchmark_statement import BenchmarkStatement
from harness.results.expected_orders import METRIC
from harness.results.findings import PaperExperiment
from harness.study.papers.database_size import OWN, whole_run
from harness.study.papers.leave_one_out import DYNAMIC_MAP_LITERAL, behaviour_label, differences
from harness.study.papers.paper_study import PaperStudy
from harness.study.papers.tables import RMS, errors_by_unit, mean_bars, mean_table

RUN = "other_approaches"
OTHERS = {"best_match+ik": "interpolation generalises better", "kernel_ridge+ik": "local models are better"}
"""Method of another approach -> what the paper says against it."""
GRAPH = f"{DYNAMIC_MAP_LITERAL}[index=graph]"
FULL_SET = BenchmarkStatement(
    text="the quality is comparable with that of a full set of sensors",
    target="comparable",
    measured="",
    verdict="not run",
    why="no clip was recorded with a full set of inertial sensors as well",
)


def other_approaches(study: PaperStudy) -> PaperExperiment:
    """The paper's method against playing the best match, against a global model, and with the neighbour graph."""
    behaviours = tuple(dict.fromkeys(study.runs[RUN].motion.behaviours))
    sides = tuple(
        {
            behaviour_label(behaviour): {
                method: errors_by_unit(
                    study.rows(run, behaviour=behaviour, method=method, inputs="pos+ori", performer="known"), metric
                )
                for run, methods in ((whole_run(study), tuple(OWN)), (RUN, (*OTHERS, GRAPH)))
                for method in methods
            }
            for behaviour in behaviours
        }
        for metric in (METRIC, RMS)
    )
    claims = [
        claim_lower_error(
            f"{label}: {method} errs less than {other}",
            *(errors[method], errors[other]),
            published=published,
            reading=reading,
        )
        for label, errors in sides[0].items()
        for other, published in OTHERS.items()
        for method, reading in OWN.items()
    ]
    graph = [
        claim_noninferior(
            f"{label}: {DYNAMIC_MAP_LITERAL} errs no more with the neighbour graph than with all neighbours",
            *(errors[GRAPH], errors[DYNAMIC_MAP_LITERAL]),
            kind="derived",
            reading="as printed",
        )
        for label, errors in sides[0].items()
    ]
    caption = "Mean joint-angle error over units, positions and orientations."
    return PaperExperiment(
        name="other_approaches",
        title="Best match, a global model, and the neighbour graph",
        question=(
            "The paper says of earlier systems that interpolation generalises better than playing the best match, and "
            "that local models are better than a global one. Does its method err less than each? The search for "
            "neighbours uses a precomputed graph, which finds the same neighbours or fewer. What does that cost?"
        ),
        differences=(
            "Both statements are about the systems of others. Here best_match plays the nearest example, and "
            "kernel_ridge is one smooth map that is learnt from at most 2,000 examples at once. Both end with inverse "
            "kinematics (+ik), so that they fit the trackers as the paper's method does.",
            "The paper compares its quality with that of a full set of inertial sensors, in words. No such recording "
            "is at hand, so the statement is listed and not tested.",
            *differences(study),
        ),
        claims=(*claims, *graph, FULL_SET),
        tables=(mean_table("Joint-angle error [deg]", "behaviour", *sides),),
        figures=(mean_bars("Other approaches", "deg", sides[0], caption=caption),),
        runs=(RUN, whole_run(study)),
    )
