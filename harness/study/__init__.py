"""Studies: many runs and what they come to; the experiments of the papers, rerun.

A paper is a module of this folder, named in `paper.PAPERS`, with a `PAPER`:

    PAPER = Paper("kim2012", "Kim, Seol, Lee: ..., 2012", experiments={"combinations": combinations, ...})

    def combinations(study: Study) -> Experiment:
        rows = study.rows("combinations", behaviour="walking", method="kernel_cca")
        ...

Its runs are the files scenarios/papers/NAME/builtin_*.toml or cmu_*.toml; what follows the underscore names the run
and its folder in the study's. Once all have run, each experiment is asked in turn: it reads rows and cells back
(`Study.rows`, `Study.cells`), measures what no run does (`Study.kept`, so that it is measured once), and gives claims
(`claims`), tables and figures (`tables`). A run that is absent for this motion, or whose cells failed, has no rows:
claims then say "not run". `study.motion` is "builtin" or "cmu"; with `study.library` the folder of the latter.
"""
