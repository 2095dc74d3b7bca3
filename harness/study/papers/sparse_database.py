"""Kim et al. 2012, Figs. 4 and 5: hardly any examples, and poses that none of them shows."""

from harness.results.findings import Claim, FindingsTable, LineChart, PaperExperiment
from harness.study.papers.five_stations import (
    KERNEL_CCA,
    METHODS,
    WEIGHTED_BLEND,
    WORLD_METRICS,
    claim_in_run,
    differences,
    errors_by_method,
    method_tables,
    performers,
)
from harness.study.papers.paper_study import PaperStudy
from harness.study.papers.tables import error_lines, errors_by_clip, errors_by_joint_group, mean_bars, mean_table

DATABASE_FRAMES = {"table_tennis": 31, "walking": 43}
ARM_AND_SPINE = {
    "right arm": ("rclavicle", "rhumerus", "rradius", "rwrist", "rhand"),
    "spine": ("lowerback", "upperback", "thorax"),
    "left arm": ("lclavicle", "lhumerus", "lradius", "lwrist", "lhand"),
    "head and neck": ("lowerneck", "upperneck", "head"),
    "legs": ("lfemur", "ltibia", "lfoot", "rfemur", "rtibia", "rfoot"),
}
"""Bones whose hinges are taken together where the paper's pictures show the right arm and the spine."""


def sparse(study: PaperStudy) -> PaperExperiment:
    """Fig. 4."""
    claims: list[Claim] = []
    figures: list[LineChart] = []
    tables: list[FindingsTable] = []
    for behaviour, count in DATABASE_FRAMES.items():
        run, shown = f"sparse_{behaviour}", behaviour.replace("_", " ")
        rows = study.rows(run)
        for who in performers(rows) or ("known",):
            errors = errors_by_method(row for row in rows if row["performer"] == who)
            told = f"{shown}, {count} frames, {who} performers" if who == "new" else f"{shown}, {count} frames"
            for less, more in (
                (KERNEL_CCA, WEIGHTED_BLEND),
                (KERNEL_CCA, "ik"),
                (KERNEL_CCA, "ik:previous"),
                (f"{KERNEL_CCA}[solve=limbs]", f"{WEIGHTED_BLEND}[solve=limbs]"),
                (f"{KERNEL_CCA}[final_ik=false]", f"{WEIGHTED_BLEND}[final_ik=false]"),
            ):
                text = f"{told}: {less} errs less than {more}"
                claims.append(claim_in_run(study, run, text, errors.get(less, {}), errors.get(more, {})))
        if rows:
            tables += method_tables(f"{shown}, {count} frames", rows, WORLD_METRICS)
            known = [row for row in rows if row["performer"] == performers(rows)[0]]
            longest = max(known, key=lambda row: int(row["frames_matched"]))["clip"]
            cells = study.cells(run, clip=longest)
            curves = {cell.method: cell for cell in cells if cell.method in METHODS}
            title = f"{shown}, {count} frames: error over time in {longest}, the longest take"
            figures.append(error_lines(title, curves, caption="Mean error of the 48 hinges in every frame."))
    return PaperExperiment(
        name="sparse",
        title="Extremely sparse databases, frame by frame",
        question=(
            "With 31 frames of table tennis or 43 of walking to learn from, and other motion put in, does kernel CCA "
            "err less than a weighted blend of neighbours and than inverse kinematics? The paper shows the error of "
            "every frame (Fig. 4), lowest for kernel CCA."
        ),
        differences=(
            "Frames are evenly spaced over the whole database; the paper does not say how it chose them.",
            "The paper's inverse kinematics is unknown: `ik` is the strongest that was found, `ik:previous` the "
            "plainest.",
            "kernel_cca and weighted_blend end in a solve for the whole body, with [solve=limbs] limb by limb, in "
            "closed form as in the paper, with [final_ik=false] in neither.",
            *differences(study),
        ),
        claims=tuple(claims),
        tables=tuple(tables),
        figures=tuple(figures),
        runs=tuple(run for run in ("sparse_table_tennis", "sparse_walking") if run in study.runs),
    )


def extrapolation(study: PaperStudy) -> PaperExperiment:
    """Fig. 5."""
    run, ends = "extrapolation", "[final_ik=false]"
    errors = {
        m: errors_by_joint_group(study.cells(run, method=m + ends), ARM_AND_SPINE) for m in (KERNEL_CCA, WEIGHTED_BLEND)
    }
    for method in errors:
        errors[method]["whole body"] = errors_by_clip(study.rows(run, method=method + ends))
    claims = [
        claim_in_run(
            *(study, run, f"{group}: kernel_cca errs less than weighted_blend"),
            *(errors[KERNEL_CCA][group], errors[WEIGHTED_BLEND][group]),
        )
        for group in ("right arm", "spine", "whole body")
    ]
    groups = {group: {method: errors[method][group] for method in errors} for group in errors[KERNEL_CCA]}
    title = "Three trackers, 31 frames of table tennis, no final inverse kinematics"
    caption = "Mean error of the hinges of each group."
    return PaperExperiment(
        name="extrapolation",
        title="Beyond the examples: right arm and spine",
        question=(
            "From 31 frames of table tennis, three trackers (RH, LH, PEL) and no final inverse kinematics, does kernel "
            "CCA reach poses that no example shows? The paper's pictures (Fig. 5) have it better than the blend at the "
            "right arm and the spine."
        ),
        differences=(
            "Judged by errors of joint groups over eight takes; the paper shows single frames.",
            "Two of the eight performers (p3, p6) are left-handed: their bat is not in the right hand.",
            *differences(study),
        ),
        claims=tuple(claims),
        tables=(mean_table(f"{title} [deg]", "hinges of", groups),) if run in study.runs else (),
        figures=(mean_bars(title, "deg", groups, caption=caption),) if run in study.runs else (),
        runs=(run,) if run in study.runs else (),
    )
