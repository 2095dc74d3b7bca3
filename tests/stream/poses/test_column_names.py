"""Names of columns, as programs write them."""

import pytest

from harness.stream.poses.column_names import ColumnName, parse_column_name


@pytest.mark.parametrize(
    ("name", "meaning"),
    [
        ("#timestamp [ns]", ("time", "timestamp", "", "ns")),
        ("Time (Seconds)", ("time", "time", "", "s")),
        ("time_ms", ("time", "time", "", "ms")),
        ("field.header.stamp", ("time", "stamp", "", "")),
        ("Frame", ("frame", "", "", "")),
        ("child_frame_id", ("body", "", "", "")),
        ("station", ("body", "", "", "")),
        ("Sta", ("body", "", "", "")),
        ("geometry_id", ("body", "", "", "")),
        ("p_RS_R_x [m]", ("position", "x", "", "m")),
        ("x_mm", ("position", "x", "", "mm")),
        ("tx [in]", ("position", "x", "", "in")),
        ("TY", ("position", "y", "", "")),
        ("head.pos.z", ("position", "z", "head", "")),
        ("left_hand_x", ("position", "x", "left_hand", "")),
        ("hand2X", ("position", "x", "hand2", "")),
        ("pose/left/position/y", ("position", "y", "left", "")),
        ("q_RS_w []", ("quaternion", "w", "", "")),
        ("field.pose.pose.orientation.x", ("quaternion", "x", "", "")),
        ("left_hand_qw", ("quaternion", "w", "left_hand", "")),
        ("RotW", ("quaternion", "w", "", "")),
        ("roll", ("angle", "x", "", "")),
        ("Yaw (deg)", ("angle", "z", "", "deg")),
        ("hand.pitch_rad", ("angle", "y", "hand", "rad")),
        ("euler_y", ("angle", "y", "", "")),
        ("v_RS_R_x [m s^-1]", ("", "", "", "")),
        ("field.pose.covariance0", ("", "", "", "")),
        ("velocity.x", ("", "", "", "")),
        ("position_valid", ("valid", "", "", "")),
        ("left_is_valid", ("valid", "", "left", "")),
        ("isTracked", ("valid", "", "", "")),
        ("hand_TrackingState", ("valid", "", "hand", "")),
        ("Rot[5]", ("matrix", "5", "", "")),
        ("hand_r21", ("matrix", "21", "hand", "")),
        ("m_0_2", ("matrix", "02", "", "")),
        ("sensor12", ("", "", "", "")),
        ("date", ("time", "date", "", "")),
        ("Zeit [s]", ("time", "time", "", "s")),
        ("t (s)", ("time", "time", "", "s")),
        ("Timestamp (ms)", ("time", "timestamp", "", "ms")),
        ("time_ns", ("time", "time", "", "ns")),
        ("timestamp_millis", ("time", "timestamp", "", "ms")),
        ("elapsedSeconds", ("time", "time", "", "s")),
        ("stamp.nsecs", ("nanoseconds", "", "", "")),
        ("position_z_meters", ("position", "z", "", "m")),
        ("", ("", "", "", "")),
    ],
)
def test_a_name_has_a_meaning(name: str, meaning: tuple[str, str, str, str]) -> None:
    found = parse_column_name([name])
    assert (found.kind, found.axis, found.body, found.unit) == meaning


def test_numbers_of_components_are_a_convention() -> None:
    assert parse_column_name(["Q0"]) == ColumnName("quaternion", "w", numbered=True)
    assert not parse_column_name(["qx"]).numbered
    assert parse_column_name(["Rx"]).family == "r"  # not of the same quaternion as qx
    assert parse_column_name(["quat_real"]) == ColumnName("quaternion", "w")


def test_cells_above_tell_body_and_kind() -> None:
    assert parse_column_name(["Rigid Body", "left hand", "Rotation", "X"]) == ColumnName("quaternion", "x", "left hand")
    assert parse_column_name(["Head Rotation", "X"]).kind == "quaternion"
    assert parse_column_name(["Rigid Body", "hand", "Position", "X"]) == ColumnName("position", "x", "hand")
    assert parse_column_name(["Rigid Body Marker", "hand:Marker1", "Position", "X"]).kind == ""
