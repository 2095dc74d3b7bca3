"""Ranges of motion of the limbs in a run's database: which joints are the most movable (Kim et al. 2012, Fig. 3)."""

from collections.abc import Mapping

import numpy as np

from harness.core.split import ClipPart, allowed_frames
from harness.experiment.cells import open_scenario_motion
from harness.study.papers.paper_study import PaperStudy

LIMBS: Mapping[str, tuple[str, ...]] = {
    "right_hand": ("rhumerus", "rradius", "rwrist", "rhand"),
    "left_hand": ("lhumerus", "lradius", "lwrist", "lhand"),
    "right_ankle": ("rfemur", "rtibia"),
    "left_ankle": ("lfemur", "ltibia"),
    "pelvis": (),
}
"""Station -> bones from shoulder or hip to the one that carries it; the pelvis is the root and has no hinge."""
_QUANTILES = (0.025, 0.975)


def measure_ranges(study: PaperStudy, run: str) -> dict[str, float]:
    """Station -> range of motion of its limb in the run's examples [deg].

    The range of a limb is that of its most movable hinge: the width of the central 95 % of its angles over all frames
    that may be learnt from, so those of tested blocks do not count. A station without hinges has 0.
    """
    motion = study.runs[run].motion
    source = open_scenario_motion(motion, study.library, study.seed)
    withheld = [ClipPart.parse(text) for text in (*motion.withheld, *motion.test)]
    angles: dict[str, list[np.ndarray]] = {}
    for name in motion.examples:
        clip = source.load(name)
        runs = allowed_frames(withheld, name, len(clip), clip.rate_hz)
        for column, hinge in enumerate(clip.skeleton.dof_names):
            angles.setdefault(hinge, []).extend(clip.angles_rad[run.start : run.stop, column] for run in runs)
    widths_deg = {
        hinge: float(np.rad2deg(np.ptp(np.quantile(np.concatenate(values), _QUANTILES))))
        for hinge, values in angles.items()
    }
    return {
        station: max((width for hinge, width in widths_deg.items() if hinge.partition(".")[0] in bones), default=0.0)
        for station, bones in LIMBS.items()
    }
