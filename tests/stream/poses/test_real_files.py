"""Every file of real trackers is read, or refused in words."""

from pathlib import Path

import numpy as np
import pytest

from harness.errors import BadFile
from harness.stream.poses.options import PoseFileOptions
from harness.stream.poses.pose_file import read_pose_log
from harness.stream.poses.pose_statistics import measure_sampling


def test_pairs_of_streams_are_read(real: Path) -> None:
    paths = sorted((real / "hand_eye").glob("*/*.csv"))
    assert len(paths) == 12
    for path in paths:
        log = read_pose_log(path)
        values = {one.subject: one for one in log.findings}
        assert (values["time unit"].value, values["length unit"].value) == ("s", "m")
        assert values["quaternion order"].value == "xyzw"
        assert (log.start_unix_s is None) == (path.parent.name == "arm_sim")
        coarse = {"falcon_3", "falcon_5", "tango_easy"} if path.name != "camera_color.csv" else set()
        assert ("time resolution" in values) == (path.parent.name in coarse)
        raw = np.loadtxt(path, delimiter=",")
        body = log.bodies[0]
        assert len(body.times_s) == len(np.unique(raw[:, 0]))
        row = np.argmin(raw[:, 0])
        np.testing.assert_allclose(body.positions_m[0], raw[row, 1:4])
        np.testing.assert_allclose(body.quaternions[0], raw[row, [7, 4, 5, 6]], atol=1e-9)


@pytest.mark.long
def test_matrices_of_a_fastrak_are_read(real: Path) -> None:
    paths = sorted((real / "polhemus").glob("*.traj"))
    assert len(paths) > 100
    repeated = []
    for path in paths:
        log = read_pose_log(path, PoseFileOptions(rate_hz=100.0))
        lines = [line for line in path.read_text().splitlines() if line.strip()]
        assert len(log.bodies[0].times_s) == len(lines) // 4
        np.testing.assert_allclose(log.bodies[0].positions_m[0], [float(line.split()[3]) for line in lines[:3]])
        repeated.append(measure_sampling(log.bodies[0]))
    share = sum(one.repeated_share * one.poses for one in repeated) / sum(one.poses for one in repeated)
    assert 0.1 < share < 0.2  # the page of the data set says 15 %


def test_labels_and_texts_are_refused(real: Path) -> None:
    others = [path for path in sorted(real.rglob("*")) if path.is_file() and path.suffix not in (".csv", ".traj")]
    assert others
    for path in others:
        with pytest.raises(BadFile, match="expected"):
            read_pose_log(path)
