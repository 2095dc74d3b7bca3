"""Run a scenario and read its results: python examples/run_and_read.py [FOLDER]"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import harness


def main(out: Path) -> None:
    scenario = harness.load_scenario("demo")  # a TOML file, or a name that `harness list` prints
    short = replace(
        scenario.motion, test=("walking_p1_01", "boxing_p1_01"), behaviours=("walking", "boxing"), longest_s=3.0
    )
    scenario = replace(scenario, motion=short, methods=("ik", "local_pca"), name="short demo")
    outcome = harness.run(scenario, out)  # resumes if `out` holds an unfinished run of this scenario
    print(f"outcome: {outcome.word}")

    run = harness.load(out)
    for record in run.records:  # one record per cell: clip x method x seed x condition
        print(f"{record.clip:15} {record.method:10} {record.metrics['joint_angle_mean_deg']:5.1f} deg")
    for cell in run.cells(method="ik"):  # the arrays of each frame are read on request
        error_deg = cell.errors["joint_angle_mean_deg"]
        worst = np.nanargmax(np.where(cell.scores.scored, error_deg, np.nan))
        print(f"ik is worst on {cell.clip} after {cell.time_s[worst]:.2f} s: {error_deg[worst]:.1f} deg")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "results/run_and_read"))
