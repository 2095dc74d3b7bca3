"""Eq. 1 of Kim et al. 2012 as printed: what its maps reach, and what they cannot."""

from dataclasses import replace

import numpy as np
import pytest

from harness.body import Body, Kinematics, build_body, locate_mount, tpose
from harness.calibrate.kim2012_calibration import SensorMaps, calibrate_kim2012
from harness.calibrate.poses import POSES, pose_configuration
from harness.core import rotations
from harness.core.arrays import Floats
from tests.calibrate.standing_model import Model, somebody
from tests.live.posing import frame


def character(body: Body, model: Model, qpos: Floats) -> tuple[Floats, Floats]:
    """Positions and orientations of the character's joints in a configuration."""
    kinematics = Kinematics(body)
    kinematics.set(qpos)
    placed = [locate_mount(body.skeleton, mount) for mount in model.mounts]
    bones = [body.skeleton.index(mount.bone) for mount in model.mounts]
    return kinematics.station_poses(bones, np.array([at for at, _ in placed]), np.array([turn for _, turn in placed]))


@pytest.mark.parametrize("straps", [True, False])
def test_in_tpose_each_sensor_reads_what_the_joint_reads(straps: bool) -> None:
    """Whatever the room, the straps and the places of the trackers."""
    model = Model(somebody(0), straps=straps, beside_m=0.02)
    body, frames = build_body(model.skeleton), model.held()[0]
    found = calibrate_kim2012(frames, body, model.mounts)
    place_m, turn = character(body, model, tpose(body.skeleton))
    mapped = found.maps.apply(frames[0])
    np.testing.assert_allclose(mapped.position_m, place_m, atol=1e-9)
    assert rotations.angle_between_rad(mapped.tracker_from_station, turn).max() < 1e-7
    assert found.calibration.kind == "kim2012"
    np.testing.assert_array_equal(found.calibration.world_from_tracker, rotations.IDENTITY)


def test_straps_in_nominal_orientation_stay_right_and_others_do_not() -> None:
    """T_q turns a reading in the room. In another pose that is right only without a turn on the strap."""
    for straps, most in ((False, 1e-3), (True, np.inf)):
        model = Model(somebody(0), straps=straps)
        body, held = build_body(model.skeleton), model.held()
        maps = calibrate_kim2012(held[0], body, model.mounts).maps
        place_m, turn = character(body, model, pose_configuration(POSES[3], body.skeleton))
        mapped = maps.apply(held[3][0])
        # The first pose differs from the T-pose by 0.006 deg. The performer has stepped aside: heading does not count.
        heading = rotations.multiply(mapped.tracker_from_station[4], rotations.inverse(turn[4]))
        off_rad = rotations.angle_between_rad(
            mapped.tracker_from_station, rotations.multiply(np.tile(heading, (6, 1)), turn)
        )
        assert off_rad.max() < most
        if straps:
            assert np.rad2deg(off_rad.max()) > 30.0
        else:
            between_m = [np.linalg.norm(x[0] - x[1]) for x in (mapped.position_m, place_m)]
            assert between_m[0] == pytest.approx(between_m[1], abs=1e-3)


def test_a_map_is_the_printed_one() -> None:
    """p_v = T_p p_w + b and q_v = T_q q_w, by hand for quarter turns; what is missing stays missing."""
    half = np.sqrt(0.5)
    maps = SensorMaps(
        np.array([half, 0.0, 0.0, half]),
        np.array([[1.0, 2.0, 3.0], [0.0, 0.0, 0.0]]),
        np.array([[0.0, 1.0, 0.0, 0.0]] * 2),
    )
    seen = frame(0.0)
    position_m = np.array([[1.0, 0.0, 0.0], [np.nan] * 3])
    mapped = maps.apply(replace(seen, position_m=position_m, position_valid=np.array([True, False])))
    np.testing.assert_allclose(mapped.position_m[0], [1.0, 3.0, 3.0], atol=1e-12)
    assert np.isnan(mapped.position_m[1]).all()
    np.testing.assert_allclose(mapped.tracker_from_station, [[0.0, 1.0, 0.0, 0.0]] * 2, atol=1e-12)
