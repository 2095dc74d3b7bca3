"""The experiments of the papers, rerun.

A paper is a module of this folder. It is named in `paper.PAPERS` and has a `PAPER`:

    PAPER = Paper("kim2012", "Kim, Seol, Lee: ..., 2012", experiments={"combinations": combinations, ...})

    def combinations(study: PaperStudy) -> PaperExperiment:
        rows = study.rows("combinations", behaviour="walking", method="kernel_cca")
        ...

Its runs are the files scenarios/papers/NAME/builtin_*.toml or cmu_*.toml. The part after the underscore names the run
and its folder in the study's folder. When all runs are finished, each experiment is evaluated in turn. It

- reads rows and cells of the runs (`PaperStudy.rows`, `PaperStudy.cells`);
- measures what no run measures (`PaperStudy.cached_measurement`, which caches the result);
- returns claims (`claims`), tables and figures (`tables`).

A run that does not exist for this motion, or whose cells failed, has no rows; claims are then "not run". `study.motion`
is "builtin" or "cmu"; for "cmu", `study.library` is the folder of the motion library.
"""
