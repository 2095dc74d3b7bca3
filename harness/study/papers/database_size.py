"""Liu et al. 2011: the error against the size of the database, one database of all behaviours, other approaches."""

from collections.abc import Mapping

from harness.results.findings import BarChart, BenchmarkStatement, FindingsTable, PaperExperiment, Reading
from harness.study.papers.claims import claim_decreasing, claim_lower_error, claim_noninferior
from harness.study.papers.leave_one_out import (
    DYNAMIC_MAP,
    DYNAMIC_MAP_LITERAL,
    INPUTS,
    LOCAL_PCA,
    behaviour_label,
    differences,
)
from harness.study.papers.paper_study import PaperStudy
from harness.study.papers.tables import UnitErrors, errors_by_unit, mean_bars, mean_table

SIZE_RUN, ALL_RUN, KEY = "database_size", "one_database", "motion.example_share"
METHODS = (DYNAMIC_MAP_LITERAL, DYNAMIC_MAP, LOCAL_PCA, "ik")
OWN: Mapping[str, Reading] = {DYNAMIC_MAP_LITERAL: "as printed", DYNAMIC_MAP: "ours"}
"""The methods that stand for the paper's own."""
_WORDING = (
    "The paper says that its method scales up well to the size and heterogeneity of motion databases, and prints no "
    "figure. That is tested so: one database of all behaviours costs nothing, within the margin of `harness compare`. "
    "That more examples reduce the error, and that a database of one behaviour gives a smaller error than one of all, "
    "are our interpretations and listed as derived."
)
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


def database_size(study: PaperStudy) -> PaperExperiment:
    """Error against the share of the database, in nested subsets."""
    claims: list[BenchmarkStatement] = []
    tables: list[FindingsTable] = []
    figures: list[BarChart] = []
    for inputs in study.runs[SIZE_RUN].inputs:
        errors = {method: _errors_by_share(study, method, inputs) for method in METHODS}
        for method, reading in OWN.items():
            series, start = errors[method], f"boxing, {INPUTS[inputs]}: {method} errs less"
            least, whole = next(iter(series)), list(series)[-1]
            text = f"{start} with the whole database than with {least} % of it"
            claims.append(claim_lower_error(text, series[whole], series[least], kind="derived", reading=reading))
            text = f"{start} with each larger share of the database"
            claims.append(claim_decreasing(text, series, "%", kind="derived", reading=reading))
        shares = list(errors[DYNAMIC_MAP])
        groups = {f"{share} %": {method: errors[method][share] for method in METHODS} for share in shares}
        title = f"Boxing, {INPUTS[inputs]}"
        tables.append(mean_table(f"{title} [deg]", "share of the database", groups))
        caption = "Mean joint-angle error over units. Every smaller share is a part of every larger one."
        figures.append(mean_bars(f"{title}: error against the share of the database", "deg", groups, caption=caption))
    return PaperExperiment(
        name="database_size",
        title="Error against the size of the database",
        question=(
            "How much does the error fall when there are more examples? The same takes of boxing are reconstructed "
            "from 1, 3, 10, 30 and 100 % of the database. The paper's database of boxing has 31,358 frames."
        ),
        differences=(
            _WORDING,
            "Shares are drawn in pieces of 0.5 s, since the methods learn from consecutive frames. Each smaller share "
            "is a part of every larger one. ik takes only the mean posture and the spread of each hinge from the "
            "examples.",
            *differences(study),
        ),
        claims=tuple(claims),
        tables=tuple(tables),
        figures=tuple(figures),
        runs=(SIZE_RUN, whole_run(study)),
    )


def one_database(study: PaperStudy) -> PaperExperiment:
    """One database for each behaviour compared with one of all behaviours."""
    claims: list[BenchmarkStatement] = []
    groups: dict[str, dict[str, UnitErrors]] = {}
    for behaviour in dict.fromkeys(study.runs[ALL_RUN].motion.behaviours):
        label, where = behaviour_label(behaviour), {"behaviour": behaviour, "inputs": "pos+ori", "performer": "known"}
        own, everything = (
            {method: errors_by_unit(study.rows(run, method=method, **where)) for method in METHODS}
            for run in (whole_run(study), ALL_RUN)
        )
        groups |= {f"{label}, database of the behaviour": own, f"{label}, database of all behaviours": everything}
        for method, reading in OWN.items():
            sides_of = own[method], everything[method]
            text = f"{label}: {method} errs no more with one database of all behaviours than with one of the behaviour"
            claims.append(claim_noninferior(text, *reversed(sides_of), published="scales up well", reading=reading))
            text = f"{label}: {method} errs less with a database of the behaviour than with one of all behaviours"
            claims.append(claim_lower_error(text, *sides_of, kind="derived", reading=reading))
    caption = "Mean joint-angle error over units, positions and orientations."
    return PaperExperiment(
        name="one_database",
        title="One database for each behaviour, or one of all behaviours",
        question=(
            "The paper has one database for each behaviour. Does a method err more when one database has all "
            "behaviours, so that it must find the right one by itself?"
        ),
        differences=(_WORDING, *differences(study)),
        claims=tuple(claims),
        tables=(mean_table("Joint-angle error [deg]", "behaviour", groups),),
        figures=(mean_bars("One database or several", "deg", groups, caption=caption),),
        runs=(ALL_RUN, whole_run(study)),
    )


def whole_run(study: PaperStudy) -> str:
    """Name of the run with the whole database of each behaviour, on the clips of the other runs."""
    return "blocks" if study.motion == "cmu" else "leave_one_out"


def _errors_by_share(study: PaperStudy, method: str, inputs: str) -> dict[str, UnitErrors]:
    """Share in percent -> unit -> error, the whole database last."""
    where = {"method": method, "inputs": inputs, "behaviour": "boxing", "performer": "known"}
    errors = {
        f"{100.0 * share:g}": errors_by_unit(study.rows(SIZE_RUN, varied={KEY: share}, **where))
        for share in study.runs[SIZE_RUN].vary[KEY]
    }
    return {**errors, "100": errors_by_unit(study.rows(whole_run(study), **where))}


def other_approaches(study: PaperStudy) -> PaperExperiment:
    """The paper's method against playing the best match, against a global model, and with the neighbour graph."""
    behaviours = tuple(dict.fromkeys(study.runs[RUN].motion.behaviours))
    groups = {
        behaviour_label(behaviour): {
            method: errors_by_unit(
                study.rows(run, behaviour=behaviour, method=method, inputs="pos+ori", performer="known")
            )
            for run, methods in ((whole_run(study), tuple(OWN)), (RUN, (*OTHERS, GRAPH)))
            for method in methods
        }
        for behaviour in behaviours
    }
    claims = [
        claim_lower_error(
            f"{label}: {method} errs less than {other}",
            *(errors[method], errors[other]),
            published=published,
            reading=reading,
        )
        for label, errors in groups.items()
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
        for label, errors in groups.items()
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
        tables=(mean_table("Joint-angle error [deg]", "behaviour", groups),),
        figures=(mean_bars("Other approaches", "deg", groups, caption=caption),),
        runs=(RUN, whole_run(study)),
    )
