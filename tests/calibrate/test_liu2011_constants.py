"""The constants of the printed equation: the figures of docs/notes/calibration.md, on the people who chose them."""

import numpy as np
import pytest

from harness.bench.calibration_accuracy import simulate_pose_holds
from harness.body import build_body
from harness.calibrate.liu2011_calibration import Liu2011Constants, PrintedObjective
from harness.calibrate.pose_calibration import measure_poses, pose_bundle
from harness.calibrate.skeleton_prior import fit_skeleton_prior
from harness.experiment import TrackerSession
from harness.experiment.scenarios import load_scenario
from harness.mocap.synthetic import sample_skeletons
from harness.simulate import TrackerConfig, noise_preset, perturb_mounts

SEED, PRIOR_SIZE, PERFORMERS = 11, 100, 8


@pytest.mark.slow
def test_the_chosen_constants_have_the_figures_of_the_notes() -> None:
    people = sample_skeletons(PRIOR_SIZE + PERFORMERS, seed=SEED)
    space, mounts = fit_skeleton_prior(people[:PRIOR_SIZE]), load_scenario("calibration").nominal_mounts
    errors: dict[str, list[tuple[float, float]]] = {}
    for number, skeleton in enumerate(people[PRIOR_SIZE:]):
        name = f"choice {number}"
        worn = perturb_mounts(mounts, beside_m=0.015, turned_rad=np.pi, seed=SEED, session=name)
        session = TrackerSession(
            name, SEED, build_body(skeleton), mounts, worn, TrackerConfig(), noise_preset("default")
        )
        holds = measure_poses(simulate_pose_holds(session, np.deg2rad(2.5)), mounts)
        for label, constants in (
            ("used", Liu2011Constants()),
            ("smaller damping", Liu2011Constants(alpha_2=1.0, damping=1e-3)),
            ("later stop", Liu2011Constants(alpha_1=0.01, damping=0.01, tolerance=1e-3)),
        ):
            objective = PrintedObjective(pose_bundle(holds, space, mounts), constants)
            at, _ = objective.minimise()
            off_m = np.linalg.norm(at.mount_m - session.true_calibration.mount_m, axis=1)
            length_m = objective.signed_length_m(at) - skeleton.length_m
            errors.setdefault(label, []).append((_rms_mm(off_m), _rms_mm(length_m)))
    mounts_mm, lengths_mm = np.mean(errors["used"], axis=0)
    assert mounts_mm == pytest.approx(20.7, abs=0.5)
    assert lengths_mm == pytest.approx(9.4, abs=0.5)
    assert np.mean(errors["smaller damping"], axis=0) == pytest.approx([52.5, 40.1], abs=1.0)
    assert np.mean(errors["later stop"], axis=0).min() > 300.0


def _rms_mm(values_m: np.ndarray) -> float:
    return float(1e3 * np.sqrt(np.mean(values_m**2)))
