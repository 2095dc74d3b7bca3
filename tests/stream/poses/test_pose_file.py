"""Files of other programs: the motion is found in each, and what was concluded is said with its reason."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from harness.core import rotations
from harness.core.arrays import Ints
from harness.errors import BadFile, BadInput
from harness.stream.poses.options import PoseFileOptions
from harness.stream.poses.pose_conversion import UNTIMED as UNTIMED_CLOCK
from harness.stream.poses.pose_conversion import UnknownRate
from harness.stream.poses.pose_file import read_pose_log
from harness.stream.poses.pose_log import BodyPoses, FileFinding, PoseLog
from tests.stream.poses.pose_files import (
    COUNT,
    POSITIONS_M,
    QUATERNIONS,
    RATE_HZ,
    SAMPLES,
    START_S,
    TIMES_S,
    UNTIMED,
    XYZW,
    angles,
    dtrack,
    euroc,
    motive,
    numbers,
    pose,
    qualisys,
    rows,
    tum,
    vicon_tracker,
    write,
)

HEADER = "t,x,y,z,qw,qx,qy,qz"


def line(n: int) -> str:
    return f"{TIMES_S[n]:.4f},{pose(n)}"


def finding(log: PoseLog, subject: str) -> FileFinding:
    (found,) = [one for one in log.findings if one.subject == subject]
    return found


def assert_motion(body: BodyPoses, kept: slice | Ints = slice(None)) -> None:
    np.testing.assert_allclose(body.times_s, TIMES_S[kept] - TIMES_S[kept][0], atol=1e-6)
    np.testing.assert_allclose(body.positions_m, POSITIONS_M[kept], atol=1e-6)
    assert rotations.angle_between_rad(body.quaternions, QUATERNIONS[kept]).max() < 1e-6


@pytest.mark.parametrize("name", SAMPLES)
def test_the_motion_is_read(name: str, tmp_path: Path) -> None:
    log = read_pose_log(write(tmp_path / "rig.csv", SAMPLES[name]))
    assert log.names in (("rig",), ("hand",))
    assert_motion(log.bodies[0])
    assert all(one.reason for one in log.findings)
    assert [one.subject for one in log.findings if one.assumed] == ["up", "handedness"]


@pytest.mark.parametrize("name", UNTIMED)
def test_a_file_without_times_needs_a_rate(name: str, tmp_path: Path) -> None:
    path = write(tmp_path / "rig.traj", UNTIMED[name])
    with pytest.raises(UnknownRate, match=rf"rig.traj has no times.* \({COUNT} samples\)\. .*--rate HZ"):
        read_pose_log(path)
    log = read_pose_log(path, PoseFileOptions(rate_hz=RATE_HZ))
    assert_motion(log.bodies[0])
    assert log.clock == "samples counted at 50 Hz"
    untimed = read_pose_log(path, PoseFileOptions(untimed=True))
    assert untimed.clock == UNTIMED_CLOCK
    assert untimed.duration_s == COUNT - 1.0


def test_comments_between_rows_are_counted(tmp_path: Path) -> None:
    log = read_pose_log(write(tmp_path / "a.csv", SAMPLES["comments"]))
    assert finding(log, "left out").value == "3 comment lines"


def test_times_as_text_are_named(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", rows(lambda n: f"12h30m{n}s,{pose(n)}", [HEADER]))
    with pytest.raises(UnknownRate, match=r"a.csv has no times, but text in the column 't'"):
        read_pose_log(path)
    assert_motion(read_pose_log(path, PoseFileOptions(rate_hz=RATE_HZ)).bodies[0])


def test_unix_times_are_kept(tmp_path: Path) -> None:
    for content, unit in ((tum(), "s"), (euroc(), "ns")):
        log = read_pose_log(write(tmp_path / "a", content))
        assert log.clock == "Unix time"
        assert log.start_unix_s == pytest.approx(START_S, abs=1e-6)
        assert finding(log, "time unit").value == unit
    assert read_pose_log(write(tmp_path / "b", SAMPLES["own names"])).start_unix_s is None


def test_the_program_of_optitrack_is_known(tmp_path: Path) -> None:
    log = read_pose_log(write(tmp_path / "take.csv", motive(range(5))))
    assert log.names == ("head", "hand")
    assert (finding(log, "length unit").value, finding(log, "quaternion order").value) == ("mm", "xyzw")
    assert finding(log, "up") == FileFinding("up", "y, turned to z", "the default of OptiTrack's program", assumed=True)
    assert finding(log, "gaps of head").value == f"5 of {COUNT} rows hold no pose"
    x, y, z = POSITIONS_M[5:].T
    np.testing.assert_allclose(log.bodies[0].positions_m, np.stack([x, -z, y], axis=1), atol=1e-6)
    np.testing.assert_allclose(log.bodies[0].times_s, TIMES_S[5:], atol=1e-6)
    backwards = read_pose_log(tmp_path / "take.csv", PoseFileOptions(up="z")).body("hand")
    np.testing.assert_allclose(backwards.positions_m, POSITIONS_M[::-1], atol=1e-6)
    assert rotations.angle_between_rad(backwards.quaternions, QUATERNIONS[::-1]).max() < 1e-6


def test_a_take_of_many_bodies_whose_header_lines_have_no_labels(tmp_path: Path) -> None:
    names = ("head", "hand", "foot", "hip")
    above = ("Rigid Body",) * 4, names, ("6B29FC40CA471067", "11", "12", "13")
    kinds = ",Rotation" * 4 + ",Position" * 3 + ",Mean Marker Error"
    header = ["Format Version,1.22,Rotation Type,Quaternion,Length Units,Millimeters", ""]
    header += ["," + "".join(f",{cell}" * 8 for cell in line) for line in above]
    header += ["," + kinds * 4, "Frame,Time" + ",X,Y,Z,W,X,Y,Z," * 4]
    path = tmp_path / "take.csv"
    log = read_pose_log(
        write(
            path,
            rows(
                lambda n: (
                    f"{n},{TIMES_S[n]:.4f}" + f",{numbers([*QUATERNIONS[n, XYZW], *(1e3 * POSITIONS_M[n])])},0.1" * 4
                ),
                header,
            ),
        )
    )
    assert log.names == names


def test_accelerations_beside_a_quaternion_are_no_positions(tmp_path: Path) -> None:
    header = [
        "// Update Rate: 50.0Hz",
        "PacketCounter,SampleTimeFine,Quat_q0,Quat_q1,Quat_q2,Quat_q3,Acc_X,Acc_Y,Acc_Z",
    ]
    text = rows(lambda n: f"{n},{200 * n},{numbers(QUATERNIONS[n])},0.1,0.2,9.8", header)
    with pytest.raises(BadFile, match="no position among the columns PacketCounter"):
        read_pose_log(write(tmp_path / "imu.txt", text))


def test_serial_numbers_tell_bodies(tmp_path: Path) -> None:
    text = rows(
        lambda n: "\n".join(f"{TIMES_S[n]},LHR-{one},{pose(n)}" for one in "AB"), ["t,device_serial,x,y,z,qw,qx,qy,qz"]
    )
    log = read_pose_log(write(tmp_path / "rig.csv", text))
    assert log.names == ("LHR-A", "LHR-B")
    assert_motion(log.bodies[1])


def test_angles_of_optitrack_are_read_with_their_axes(tmp_path: Path) -> None:
    values = angles("xyz", np.pi / 180.0)
    header = [
        "Format Version,1.23,Take Name,T,Export Frame Rate,50,Rotation Type,XYZ,Length Units,Meters",
        *(",," + ",".join([cell] * 7) for cell in ("Rigid Body", "target", '"7E3"')),
        ",,Rotation,Rotation,Rotation,Position,Position,Position,Mean Marker Error",
        "Frame,Time (Seconds),X,Y,Z,X,Y,Z,",
    ]
    content = rows(lambda n: f"{n},{TIMES_S[n]:.4f},{numbers(values[n])},{numbers(POSITIONS_M[n])},0.001", header)
    path = write(tmp_path / "take.csv", content)
    with pytest.raises(BadFile, match=r"rotations of the type XYZ; expected quaternions. .* or give --euler xyz"):
        read_pose_log(path)
    log = read_pose_log(path, PoseFileOptions(euler="xyz", up="z"))
    assert log.names == ("target",)
    assert_motion(log.bodies[0])


def test_the_program_of_vicon_is_known(tmp_path: Path) -> None:
    log = read_pose_log(write(tmp_path / "capture.csv", vicon_tracker()))
    assert (log.names, log.clock) == (("a", "b"), "samples counted at 50 Hz")
    assert_motion(log.bodies[1])
    assert read_pose_log(tmp_path / "capture.csv", PoseFileOptions(rate_hz=25.0)).duration_s == 2 * log.duration_s


@pytest.mark.parametrize("up", ["x", "y", "z", "-x", "-y", "-z"])
def test_the_axis_that_points_up_becomes_z(up: str, tmp_path: Path) -> None:
    sign, axis = -1.0 if up.startswith("-") else 1.0, "xyz".index(up[-1])
    body = read_pose_log(write(tmp_path / "a", SAMPLES["own names"]), PoseFileOptions(up=up)).bodies[0]
    np.testing.assert_allclose(body.positions_m[:, 2], sign * POSITIONS_M[:, axis], atol=1e-6)
    np.testing.assert_allclose(
        np.linalg.norm(np.diff(body.positions_m, axis=0), axis=1),
        np.linalg.norm(np.diff(POSITIONS_M, axis=0), axis=1),
        atol=1e-6,
    )
    turned = rotations.rotate(body.quaternions, np.array([0.3, 0.1, 0.05]))  # the lever arm turns with the world
    assert np.ptp(body.positions_m - turned, axis=0).max() < 1e-6


def test_options_replace_the_evidence(tmp_path: Path) -> None:
    content = rows(lambda n: f"{TIMES_S[n]:.4f},9,{pose(n, XYZW, unit_m=0.0254)}")
    options = PoseFileOptions(("time_ms", "-", "x", "y", "z", "qx", "qy", "qz", "qw"), 0.0254, time_unit="s")
    log = read_pose_log(write(tmp_path / "a.csv", content), options)
    assert_motion(log.bodies[0])
    assert finding(log, "columns").reason == "given by --columns"
    assert finding(log, "length unit") == FileFinding("length unit", "0.0254 m", "given by --unit")
    assert finding(log, "time unit").reason == "given by --time-unit"
    wrong = read_pose_log(write(tmp_path / "b.csv", SAMPLES["no names"]), PoseFileOptions(quaternion="wxyz"))
    np.testing.assert_allclose(wrong.bodies[0].quaternions, QUATERNIONS[:, XYZW], atol=1e-6)
    assert finding(wrong, "quaternion order").reason == "given by --quaternion"


@pytest.mark.parametrize(
    "values", [{"quaternion": "zyxw"}, {"up": "w"}, {"time_unit": "h"}, {"rate_hz": 0.0}, {"unit_m": np.nan}]
)
def test_options_that_cannot_be_are_refused(values: dict[str, float]) -> None:
    with pytest.raises(BadInput):
        PoseFileOptions(**values)  # type: ignore[arg-type]


def test_rows_are_sorted_and_doubles_left_out(tmp_path: Path, rng: np.random.Generator) -> None:
    order = [*rng.permutation(COUNT).tolist(), 7, 8, 8]
    lines = [f"{TIMES_S[n]:.4f},{name},{pose(n)}" for n in order for name in ("head", "'=hand")]
    lines.append(f"{TIMES_S[20]:.4f},head,9,9,9,1,0,0,0")  # another pose at a time that was there
    path = write(tmp_path / "a.csv", "\n".join(["time_s,station,x,y,z,qw,qx,qy,qz", *lines]) + "\n")
    log = read_pose_log(path)
    assert log.names == ("head", "=hand")
    for body in log.bodies:
        assert_motion(body)
    back = np.mean(np.append(np.diff([*order, 20]) < 0, False))
    assert finding(log, "order of head").value == f"{100 * back:.1f} % of the rows are out of order"
    doubles = [one.value for one in log.findings if one.subject == "doubled rows of head"]
    assert doubles == [
        f"{100 * count / (COUNT + 4):.1f} % of the rows {what}"
        for count, what in ((3, "repeat time and pose of another"), (1, "have the time of another"))
    ]


def test_numbers_name_bodies(tmp_path: Path) -> None:
    lines = rows(lambda n: "\n".join(f"{TIMES_S[n]:.4f} {sensor} {pose(n, XYZW, separator=' ')}" for sensor in (1, 2)))
    log = read_pose_log(write(tmp_path / "a.txt", lines))
    assert log.names == ("1", "2")
    assert_motion(log.bodies[1])
    named = rows(lambda n: f"{TIMES_S[n]:.4f},3.0,{pose(n)}", ["t,sensor,px,py,pz,qw,qx,qy,qz"])
    assert read_pose_log(write(tmp_path / "b.csv", named)).names == ("3",)


def test_bodies_stand_beside_each_other(tmp_path: Path) -> None:
    content = rows(lambda n: f"{TIMES_S[n]:.4f},{pose(n)},{pose(COUNT - 1 - n)}")
    log = read_pose_log(write(tmp_path / "a.csv", content))
    assert log.names == ("body1", "body2")
    np.testing.assert_allclose(log.bodies[1].positions_m, POSITIONS_M[::-1], atol=1e-6)
    names = ",".join(f"{body}.{axis}" for body in ("head", "hand") for axis in ("x", "y", "z", "qw", "qx", "qy", "qz"))
    assert read_pose_log(write(tmp_path / "b.csv", f"time,{names}\n{content}")).names == ("head", "hand")


def test_rows_without_a_pose_are_gaps(tmp_path: Path) -> None:
    def with_gaps(n: int) -> str:
        if n % 10 == 3:
            return f"{TIMES_S[n]:.4f},nan,NaN,null,,,,"
        return f"{TIMES_S[n]:.4f},0,0,0,1,0,0,0" if n % 10 == 7 else line(n)

    log = read_pose_log(write(tmp_path / "a.csv", rows(with_gaps, [HEADER])))
    kept = np.flatnonzero((np.arange(COUNT) % 10 != 3) & (np.arange(COUNT) % 10 != 7))
    assert_motion(log.bodies[0], kept)
    assert finding(log, "gaps of a").value == f"60 of {COUNT} rows hold no pose"


def test_a_path_that_begins_at_the_origin_keeps_its_first_pose(tmp_path: Path) -> None:
    content = rows(lambda n: f"{TIMES_S[n]:.4f},{numbers([*(POSITIONS_M[n] - POSITIONS_M[0]), *QUATERNIONS[n]])}")
    log = read_pose_log(write(tmp_path / "a.csv", content))
    assert len(log.bodies[0].times_s) == COUNT


def test_a_row_that_was_cut_off_is_left_out(tmp_path: Path) -> None:
    whole = rows(line, [HEADER])
    for cut in (5, 40):  # within the last number, and within the row
        log = read_pose_log(write(tmp_path / "a.csv", whole[:-cut]))
        assert_motion(log.bodies[0], slice(0, COUNT - 1))
    assert_motion(read_pose_log(write(tmp_path / "b.csv", whole[:-1])).bodies[0])  # only the line end is missing


def test_several_files_are_bodies_of_one_log(tmp_path: Path) -> None:
    late = rows(lambda n: f"{START_S + 2.0 + TIMES_S[n]:.4f} {pose(n, XYZW, separator=' ')}")
    paths = [write(tmp_path / "head.tum", tum()), write(tmp_path / "hand.tum", late)]
    log = read_pose_log(paths)
    assert (log.names, log.source) == (("head", "hand"), "head.tum, hand.tum")
    assert log.start_unix_s == pytest.approx(START_S)
    np.testing.assert_allclose(log.bodies[1].times_s, 2.0 + TIMES_S, atol=1e-5)
    assert finding(log, "hand: quaternion order").value == "xyzw"
    assert finding(log, "common clock").assumed
    counted = write(tmp_path / "foot.csv", SAMPLES["own names"])
    with pytest.raises(BadInput, match="Files with Unix times, and others without"):
        read_pose_log([*paths, counted])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("1.08 0.66 1.57\n", "rows of 3 numbers, where a pose has 7"),
        ("0.6 0.8 0 0\n" * 9, "rows of 4 numbers, where a pose has 7"),
        ("words alone\nand more of them\n", "no rows of numbers"),
        ("", "an empty file"),
        ("a,b\0c\n", "binary data"),
        (rows(line, [HEADER]).replace("0.1000", "hello"), "line 7: a word among the numbers"),
        (rows(line, [HEADER]).replace("\n0.1000,", "\n"), "line 7: a line of 7 cells; expected a row of 8 columns"),
        (rows(lambda n: f"{n},1,2,3,0.1,0.2,0.3", ["t,x,y,z,roll,pitch,yaw"]), "angles .roll, pitch, yaw. of a conv"),
        (
            rows(lambda n: f"{n},1,2,3,0.1,0.2,0.3", ["t,TX,TY,TZ,RX,RY,RZ"]),
            "angles .RX, RY, RZ. .* --euler zyx is yaw",
        ),
        (rows(lambda n: f"{n},1,2,3,1.1,0,0,0"), "where a quaternion may stand, .* columns 5 to 8 have the norm 1.1;"),
        ('{"t": 0.5, "p": [1, 2, 3], "q": [1, 0, 0, 0]}\n' * 9, "JSON, no rows of numbers; .* Write its poses as CSV"),
        ('[\n {"t": 0.5}\n]\n', "JSON, no rows of numbers"),
        ("<log>\n<pose>1 2 3</pose>\n</log>\n", "XML, no rows of numbers"),
        (qualisys().replace("\t0.1", "\t0.9"), "matrix .* whose axes are not of length 1"),
        (rows(lambda n: f"{n},1,2,3,4,5,6", ["t,x,y,z,a,b,c"]), "no four columns of norm 1"),
        (rows(lambda n: f"{n},1,2,3,4,5,6", ["time_s,x_m,y_m,z_m,px_m,py_m,pz_m"]), "no quaternion among the columns"),
        (rows(lambda n: f"{TIMES_S[n]},1,2,3,1.2,0,0,0", [HEADER]), "a quaternion of norm 1.2 in row 1"),
        ("0 0 1 5\n1 0 0 6\n0 1 0 7\n0 0 0 1\n0 0 2 5\n1 0 0 6\n0 1 0 7\n0 0 0 1\n", "matrix 2 whose axes"),
        (HEADER + "\n" + ",,,,,,,1\n" * 9, "no rows of numbers"),
        ("[motion]\nsource = 'cmu'\nmotion = 'cmu'\n", "a scenario; expected timed poses"),
    ],
)
def test_other_files_are_refused_in_words(content: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(BadFile, match=message):
        read_pose_log(write(tmp_path / "a.csv", content), PoseFileOptions(untimed=True))


def test_a_rate_or_time_unit_that_does_not_fit_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", SAMPLES["own names"])
    with pytest.raises(BadInput, match="has times of its own"):
        read_pose_log(path, PoseFileOptions(rate_hz=3.0))
    with pytest.raises(BadInput, match=r"--time-unit, but b.csv has no times"):
        read_pose_log(write(tmp_path / "b.csv", UNTIMED["kitti"]), PoseFileOptions(time_unit="ms"))
    with pytest.raises(BadFile, match="8 columns, where --columns names 9"):
        read_pose_log(path, PoseFileOptions(columns=tuple("abcdefghi")))


def test_header_lines_with_numbers_name_no_bodies(tmp_path: Path) -> None:
    content = rows(line, ["rate,50,by,hand,room,2,on,Monday", HEADER])
    assert read_pose_log(write(tmp_path / "a.csv", content)).names == ("a",)
    named = rows(line, [",head,head,head,head,head,head,head", HEADER])
    assert read_pose_log(write(tmp_path / "b.csv", named)).names == ("head",)


def test_matrices_without_translation_stay_row_by_row(tmp_path: Path) -> None:
    def turned(n: int) -> str:
        flat = np.eye(4)
        flat[:3, :3] = rotations.to_matrix(QUATERNIONS[n])
        return f"{TIMES_S[n]:.4f},{numbers(flat.ravel())}"

    body = read_pose_log(write(tmp_path / "a.csv", rows(turned))).bodies[0]
    assert rotations.angle_between_rad(body.quaternions, QUATERNIONS).max() < 1e-6


def test_a_name_that_is_written_in_two_ways_is_one_body(tmp_path: Path) -> None:
    content = rows(lambda n: f"{TIMES_S[n]:.4f},{('head', ' head')[n % 2]},{pose(n)}", [f"t,name,{HEADER[2:]}"])
    log = read_pose_log(write(tmp_path / "a.csv", content))
    assert log.names == ("head",)
    assert_motion(log.bodies[0])


def test_numbers_of_bodies_keep_all_digits(tmp_path: Path) -> None:
    def content(first: str) -> str:
        ids = (first, "8700340.00")
        return rows(lambda n: f"{TIMES_S[n]:.4f},{ids[n % 2]},{pose(n)}", [f"t,tool,{HEADER[2:]}"])

    assert read_pose_log(write(tmp_path / "a.csv", content("8700339"))).names == ("8700339", "8700340")
    assert read_pose_log(write(tmp_path / "b.csv", content("0.500"))).names == ("0.500", "8700340")


def test_positions_of_markers_are_no_bodies(tmp_path: Path) -> None:
    """NDI's program writes those of each tool's markers behind its pose, under the same names."""
    pose_names = "Q0,Qx,Qy,Qz,Tx,Ty,Tz"

    def tool(row: int, markers: int) -> str:
        place = 1e3 * POSITIONS_M[row]
        return f"{numbers([*QUATERNIONS[row], *place])}" + f",OK,{numbers(place + 50.0)}" * markers

    apart = ",".join(f"Port {tool},Frame,State,{pose_names}" + ",State,Tx,Ty,Tz" * 3 for tool in (1, 2))
    close = f"Frame,{pose_names},{pose_names},State,Tx,Ty,Tz"
    for content in (
        rows(lambda n: ",".join(f"449A,{n},OK,{tool(row, 3)}" for row in (n, COUNT - 1 - n)), [apart]),
        rows(lambda n: f"{n},{tool(n, 0)},{tool(COUNT - 1 - n, 1)}", [close]),
    ):
        log = read_pose_log(write(tmp_path / "a.csv", content), PoseFileOptions(rate_hz=RATE_HZ))
        assert log.names == ("body1", "body2")
        assert_motion(log.bodies[0])
        assert_motion(BodyPoses("2", TIMES_S, log.bodies[1].positions_m[::-1], log.bodies[1].quaternions[::-1]))


def test_a_column_of_ever_new_words_names_no_bodies(tmp_path: Path) -> None:
    content = rows(lambda n: f"{TIMES_S[n % COUNT]:.4f},word{n},{pose(n % COUNT)}", [f"t,name,{HEADER[2:]}"], 1001)
    with pytest.raises(BadFile, match="more than 1000 different words in the column of names"):
        read_pose_log(write(tmp_path / "a.csv", content))
    fewer = content.replace("word1000", "word1")
    assert len(read_pose_log(write(tmp_path / "b.csv", fewer)).bodies) == 1000


def test_the_usual_order_is_that_of_euroc_for_nanoseconds(tmp_path: Path, rng: np.random.Generator) -> None:
    """A path without a lever arm shows no order."""
    path = np.cumsum(rng.normal(size=(COUNT, 3)), axis=0) * 0.01

    def content(scale: float) -> str:
        return rows(lambda n: f"{round(scale * TIMES_S[n])},{numbers([*path[n], *QUATERNIONS[n]])}")

    for scale, usual in ((1e9, "wxyz"), (1e6, "xyzw")):
        found = finding(read_pose_log(write(tmp_path / "a.csv", content(scale))), "quaternion order")
        assert (found.value, found.assumed) == (usual, True)


def test_qualisys_is_known(tmp_path: Path) -> None:
    log = read_pose_log(write(tmp_path / "a.tsv", qualisys(range(5)).replace("\n", "\r\n")))
    assert log.names == ("marker rig", "hand")
    assert_motion(log.select(["marker rig"]).bodies[0], slice(5, None))
    assert rotations.angle_between_rad(log.bodies[1].quaternions, QUATERNIONS[::-1]).max() < 1e-6
    assert finding(log, "length unit") == FileFinding("length unit", "mm", "Qualisys writes mm")
    assert finding(log, "gaps of marker rig").value == f"5 of {COUNT} rows hold no pose"
    assert finding(log, "rotation").value == "matrix, column by column"
    assert finding(log, "not read").value.startswith(
        "marker rig/Roll, marker rig/Pitch, marker rig/Yaw, marker rig/Res"
    )
    listed = qualisys().replace("marker rig X", "X").replace("hand X", "X")
    assert read_pose_log(write(tmp_path / "c.tsv", listed)).names == ("marker rig", "hand")
    untimed = qualisys().replace("Frame\tTime\t", "Frame\tCounter\t")
    assert read_pose_log(write(tmp_path / "b.tsv", untimed)).clock == "samples counted at 50 Hz"


def test_a_log_of_dtrack_is_known(tmp_path: Path) -> None:
    log = read_pose_log(write(tmp_path / "a.txt", dtrack()))
    assert log.names == ("body0", "body1", "flystick0")
    assert_motion(log.bodies[0])
    assert_motion(log.bodies[1], slice(0, None, 2))
    assert_motion(log.bodies[2], np.flatnonzero(np.arange(COUNT) % 5 != 3))
    assert finding(log, "length unit") == FileFinding("length unit", "mm", "DTrack writes mm")
    assert finding(log, "untracked rows of flystick0").value == f"60 of {COUNT} left out"
    damaged = dtrack().replace("[0 1.000][", "[0 1.000]", 3)
    found = read_pose_log(write(tmp_path / "b.txt", damaged))
    assert (len(found.body("body0").times_s), finding(found, "left out").value) == (COUNT - 3, "3 comment lines")
    untimed = write(tmp_path / "c.txt", dtrack(timed=False))
    with pytest.raises(UnknownRate, match=r"c.txt has no times, but numbers of samples"):
        read_pose_log(untimed)
    assert_motion(read_pose_log(untimed, PoseFileOptions(rate_hz=RATE_HZ)).bodies[0])


def test_a_long_log_of_dtrack_is_read_in_pieces(tmp_path: Path) -> None:
    log = read_pose_log(write(tmp_path / "a.txt", dtrack() * 40))
    assert finding(log, "doubled rows of body0").value == "97.5 % of the rows repeat time and pose of another"
    assert_motion(log.bodies[0])


@pytest.mark.parametrize("state", ["is_valid", "Tracked", "TrackingState"])
@pytest.mark.parametrize(
    ("seen", "lost"), [("True", "False"), ("1", "0"), ("2", "0.0"), ("true", '"false"'), ("WAHR", "FALSCH")]
)
def test_rows_that_are_not_valid_are_left_out(state: str, seen: str, lost: str, tmp_path: Path) -> None:
    def with_state(n: int) -> str:
        return f"{line(n)},0.1,{lost if n % 10 == 3 else seen}"

    log = read_pose_log(write(tmp_path / "a.csv", rows(with_state, [f"{HEADER},error,{state}"])))
    assert_motion(log.bodies[0], np.flatnonzero(np.arange(COUNT) % 10 != 3))
    assert finding(log, "untracked rows of a").value == f"30 of {COUNT} left out"
    assert finding(log, "not read") == FileFinding("not read", "error", "not needed for times and poses")


def test_states_that_say_nothing_or_no(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", rows(lambda n: f"{line(n)},no", [f"{HEADER},valid"]))
    with pytest.raises(BadFile, match="no row that its column of validity calls tracked"):
        read_pose_log(path)
    log = read_pose_log(write(tmp_path / "b.csv", rows(lambda n: f"{line(n)},limited", [f"{HEADER},trackingState"])))
    assert_motion(log.bodies[0])
    assert finding(log, "not read").reason.endswith("words of unknown meaning")


def test_a_first_row_without_a_pose_is_a_gap(tmp_path: Path) -> None:
    content = rows(lambda n: line(n) if n else "0.0000,nan,nan,nan,nan,nan,nan,nan", [HEADER])
    log = read_pose_log(write(tmp_path / "a.csv", content))
    assert finding(log, "gaps of a").value == f"1 of {COUNT} rows hold no pose"
    assert_motion(log.bodies[0], slice(1, None))


def test_a_state_counts_for_its_body(tmp_path: Path) -> None:
    names = [f"{body}_{axis}" for body in ("head", "hand") for axis in ("x", "y", "z", "qw", "qx", "qy", "qz", "valid")]
    content = rows(lambda n: f"{line(n)},{int(n > 9)},{pose(n)},1", [",".join(["t", *names])])
    log = read_pose_log(write(tmp_path / "a.csv", content))
    assert_motion(log.select(["head"]).bodies[0], slice(10, None))
    assert_motion(log.body("hand"))
    shared = read_pose_log(write(tmp_path / "b.csv", content.replace("head_valid", "valid")))
    assert_motion(shared.body("hand"), slice(10, None))


def test_many_columns_that_are_not_read_are_counted(tmp_path: Path) -> None:
    content = rows(lambda n: f"{line(n)}{',7' * 11}", [HEADER + "".join(f",other{n}" for n in range(11))])
    found = finding(read_pose_log(write(tmp_path / "a.csv", content)), "not read")
    assert found.value == ", ".join(f"other{n}" for n in range(8)) + " and 3 others"


@pytest.mark.parametrize("order", ["xyz", "xzy", "yxz", "yzx", "zxy", "zyx"])
@pytest.mark.parametrize("unit", ["deg", "rad"])
def test_angles_are_read_with_their_axes(order: str, unit: str, tmp_path: Path) -> None:
    values = angles(order, {"deg": np.pi / 180.0, "rad": 1.0}[unit])[:, ::-1]
    content = rows(
        lambda n: f"{TIMES_S[n]:.4f},{numbers(POSITIONS_M[n])},{numbers(values[n])}", ["t,x,y,z,yaw,pitch,roll"]
    )
    log = read_pose_log(write(tmp_path / "a.csv", content), PoseFileOptions(euler=order))
    assert_motion(log.bodies[0])
    found = finding(log, "unit of angles")
    assert (found.value, found.assumed) == (unit, unit == "rad")
    named = content.replace("yaw,pitch,roll", f"rz [{unit}],ry [{unit}],rx [{unit}]")
    log = read_pose_log(write(tmp_path / "b.csv", named), PoseFileOptions(euler=order))
    assert not finding(log, "unit of angles").assumed


def test_the_option_of_angles(tmp_path: Path) -> None:
    values = angles("zyx", np.pi / 180.0) / 100.0
    content = rows(lambda n: f"{TIMES_S[n]:.4f},{numbers(POSITIONS_M[n])},{numbers(values[n])}")
    path = write(tmp_path / "a.csv", content)
    columns = ("time", "x", "y", "z", "roll", "pitch", "yaw")
    log = read_pose_log(path, PoseFileOptions(columns=columns, euler="zyx:deg"))
    expected = Rotation.from_euler("ZYX", values[:, ::-1], degrees=True).as_quat(scalar_first=True)
    assert rotations.angle_between_rad(log.bodies[0].quaternions, expected).max() < 1e-6
    assert finding(log, "unit of angles").reason == "given by --euler"
    for name in ("own names", "matrices in lines"):
        with pytest.raises(BadInput, match=r"--euler, but b.csv has no angles alone"):
            read_pose_log(write(tmp_path / "b.csv", SAMPLES[name]), PoseFileOptions(euler="zyx"))


def test_dates_are_unix_times(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", SAMPLES["dates"])
    log = read_pose_log(path)
    assert (log.clock, log.start_unix_s) == ("Unix time", 1714557600.0)
    numbered = rows(lambda n: f"20240501,{line(n)}", [f"date,{HEADER}"])
    assert_motion(read_pose_log(write(tmp_path / "c.csv", numbered)).bodies[0])
    nanoseconds = read_pose_log(write(tmp_path / "b.csv", SAMPLES["nanoseconds alone"]))
    assert finding(nanoseconds, "time unit").reason == "the column's name"
    with pytest.raises(BadInput, match=r"a.csv has times of day"):
        read_pose_log(path, PoseFileOptions(time_unit="ms"))


@pytest.mark.parametrize("identifier", ["7E3", "123", "44"])
@pytest.mark.parametrize("labels", [True, False])
def test_identifiers_of_optitrack_are_no_numbers(identifier: str, labels: bool, tmp_path: Path) -> None:
    content = motive().replace('"6B29FC40"', f'"{identifier}"').replace('"A1"', '"12"')
    if not labels:
        content = content.replace(",Type", ",").replace(",Name", ",").replace(",ID,", ",,")
    log = read_pose_log(write(tmp_path / "a.csv", content), PoseFileOptions(up="z"))
    assert log.names == ("head", "hand")
    assert_motion(log.body("head"))


def test_a_damaged_first_row_is_no_header(tmp_path: Path) -> None:
    content = rows(line, [HEADER]).replace(line(1), "hello")
    with pytest.raises(BadFile, match="line 3: a line of 1 cells"):
        read_pose_log(write(tmp_path / "a.csv", content))


def test_matrices_of_zeros_are_gaps(tmp_path: Path) -> None:
    lines = UNTIMED["kitti"].splitlines()
    lines[7] = " ".join(["0"] * 12)
    log = read_pose_log(write(tmp_path / "a.txt", "\n".join(lines) + "\n"), PoseFileOptions(rate_hz=RATE_HZ))
    assert_motion(log.bodies[0], np.flatnonzero(np.arange(COUNT) != 7))
    assert finding(log, "gaps of a").value == f"1 of {COUNT} rows hold no pose"


def test_angles_that_are_no_numbers_are_gaps(tmp_path: Path) -> None:
    values = angles("zyx")[:, ::-1]
    content = rows(
        lambda n: f"{TIMES_S[n]:.4f},{numbers(POSITIONS_M[n])},{numbers(values[n]) if n != 7 else '1e999,nan,nan'}",
        ["t,x,y,z,yaw,pitch,roll"],
    )
    log = read_pose_log(write(tmp_path / "a.csv", content), PoseFileOptions(euler="zyx:rad"))
    assert_motion(log.bodies[0], np.flatnonzero(np.arange(COUNT) != 7))
