"""One motion of a rigid body, and its files as other programs write them."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from harness.core import rotations
from harness.core.arrays import Floats

COUNT, RATE_HZ, START_S = 300, 50.0, 1403636579.75
TIMES_S = np.arange(COUNT) / RATE_HZ
QUATERNIONS = rotations.exp(np.sin(TIMES_S[:, None] * [1.3, 0.9, 0.7]) * [1.2, 0.8, 1.5])
"""World from body, w x y z."""
POSITIONS_M = rotations.rotate(QUATERNIONS, np.array([0.3, 0.1, 0.05])) + np.array([0.5, -0.2, 1.3])
XYZW, WXYZ = (1, 2, 3, 0), (0, 1, 2, 3)


def numbers(values: Sequence[float] | Floats, separator: str = ",") -> str:
    return separator.join(f"{value:.9f}" for value in values)


def pose(row: int, order: Sequence[int] = WXYZ, unit_m: float = 1.0, separator: str = ",") -> str:
    """Position and quaternion of a row."""
    return numbers([*(POSITIONS_M[row] / unit_m), *QUATERNIONS[row, order]], separator)


def rows(line: Callable[[int], str], header: Sequence[str] = (), count: int = COUNT) -> str:
    return "\n".join([*header, *map(line, range(count))]) + "\n"


def matrix(row: int) -> Floats:
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = rotations.to_matrix(QUATERNIONS[row]), POSITIONS_M[row]
    return out


def tum(header: bool = True) -> str:
    head = ["# timestamp tx ty tz qx qy qz qw"] if header else []
    return rows(lambda n: f"{START_S + TIMES_S[n]:.4f} {pose(n, XYZW, separator=' ')}", head)


def euroc() -> str:
    names = "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []"
    more = ", v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], b_w_RS_S_x [rad s^-1]"
    return rows(lambda n: f"{round(1e9 * START_S) + round(1e9 * TIMES_S[n])},{pose(n)},7,8,9,0.1", [names + more])


def motive(lost: range = range(0)) -> str:
    """Two rigid bodies in mm with y up: `head`, which is not seen in the rows `lost`, and `hand`, backwards."""
    header = [
        "Format Version,1.23,Take Name,Take 1,Take Notes,,Capture Frame Rate,50.000000,Export Frame Rate,50.000000,"
        "Rotation Type,Quaternion,Length Units,Millimeters,Coordinate Space,Global",
        "",
        ",Type" + ",Rigid Body" * 8 + ",Rigid Body Marker" * 4 + ",Rigid Body" * 8,
        ",Name" + ",head" * 8 + ",head:Marker1" * 4 + ",hand" * 8,
        ",ID" + ',"6B29FC40"' * 8 + ',"A1"' * 4 + ',"11"' * 8,
        ","
        + (",Rotation" * 4 + ",Position" * 3 + ",Mean Marker Error" + ",Position" * 3 + ",Marker Quality")
        + (",Rotation" * 4 + ",Position" * 3 + ",Mean Marker Error"),
        "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,,X,Y,Z,,X,Y,Z,W,X,Y,Z,",
    ]

    def body(row: int) -> str:
        return numbers([*QUATERNIONS[row, XYZW], *(1e3 * POSITIONS_M[row])]) + ",0.001"

    def line(n: int) -> str:
        head = "," * 11 if n in lost else f"{body(n)},{numbers(1e3 * POSITIONS_M[n])},1.0"
        return f"{n},{TIMES_S[n]:.6f},{head},{body(COUNT - 1 - n)}"

    return rows(line, header)


def vicon_tracker() -> str:
    """Frames without times, two objects in mm; the rate stands in the header."""
    header = [
        *("Objects", "50", ",,a:a,,,,,,,b:b,,,,,,"),
        "Frame,Sub Frame,RX,RY,RZ,RW,TX,TY,TZ,RX,RY,RZ,RW,TX,TY,TZ",
        ",,,,,,mm,mm,mm,,,,,mm,mm,mm",
    ]

    def body(row: int) -> str:
        return numbers([*QUATERNIONS[row, XYZW], *(1e3 * POSITIONS_M[row])])

    return rows(lambda n: f"{n + 1},0,{body(n)},{body(n)}", header)


def qualisys(lost: range = range(0)) -> str:
    """Two bodies in mm with matrices column by column; `marker rig` is not seen in the rows `lost`."""
    columns = ["X", "Y", "Z", "Roll", "Pitch", "Yaw", "Residual", *(f"Rot[{n}]" for n in range(9))]
    header = [
        *("NO_OF_FRAMES\t300", "NO_OF_BODIES\t2", "FREQUENCY\t50", "DESCRIPTION\t--"),
        *("TIME_STAMP\t2020-01-22, 17:47:17\t22107.99179716", "DATA_INCLUDED\t6D", "BODY_NAMES\tmarker rig\thand"),
        "\t".join(
            ["Frame", "Time", *(cell for name in ("marker rig", "hand") for cell in (f"{name} X", *columns[1:]))]
        ),
    ]

    def body(row: int, seen: bool = True) -> str:
        numbers_of = [*(1e3 * POSITIONS_M[row]), 1.0, 2.0, 3.0, 0.4, *matrix(row)[:3, :3].T.ravel()]
        return numbers(numbers_of if seen else np.zeros(16), "\t")

    return rows(lambda n: f"{n + 1}\t{TIMES_S[n]:.5f}\t{body(n, n not in lost)}\t{body(COUNT - 1 - n)}\t", header)


def dtrack(timed: bool = True) -> str:
    """Two bodies, the second one seen in every second frame, and a flystick that is not tracked in every fifth one."""

    def pose_of(row: int) -> str:
        return f"{numbers(1e3 * POSITIONS_M[row], ' ')}{{}}][{numbers(matrix(row)[:3, :3].T.ravel(), ' ')}]"

    def frame(n: int) -> str:
        bodies = " ".join(f"[{body} 1.000][{pose_of(n).format(' 1 2 3')}" for body in range(2 - n % 2))
        flystick = f"6df2 1 1 [0 {-1.0 if n % 5 == 3 else 1.0:.3f} 4 2][{pose_of(n).format('')}[0 0.00 0.00]"
        clock = f"ts {36000.0 + TIMES_S[n]:.6f}\n" if timed else ""
        return f"fr {n + 1}\n{clock}6dcal 3\n6d {2 - n % 2} {bodies}\n{flystick}"

    return rows(frame)


def angles(order: str = "zyx", unit_rad: float = 1.0) -> Floats:
    """(N, 3) the angles about x, y, z whose turns about the moving axes in this order give the motion."""
    found = Rotation.from_matrix(rotations.to_matrix(QUATERNIONS)).as_euler(order.upper())  # type: ignore[call-overload]
    return np.asarray(found[:, [order.index(axis) for axis in "xyz"]] / unit_rad)


def matrix_lines(per_matrix: int = 4) -> str:
    """A row a line, a blank line after each matrix."""
    texts = ["\n".join(numbers(line, " ") for line in matrix(n)[:per_matrix]) for n in range(COUNT)]
    return "\n\n".join(texts) + "\n\n"


SAMPLES: dict[str, str | bytes] = {
    "tum": tum(),
    "tum without header": tum(header=False),
    "euroc": euroc(),
    "own names": rows(lambda n: f"{TIMES_S[n]:.4f},{pose(n)}", ["time_s,x_m,y_m,z_m,qw,qx,qy,qz"]),
    "no names": rows(lambda n: f"{TIMES_S[n]:.4f}, {pose(n, XYZW, separator=', ')}"),
    "no names, wxyz": rows(lambda n: f"{TIMES_S[n]:.4f},{pose(n)}"),
    "no names, quaternion first": rows(
        lambda n: f"{TIMES_S[n]:.4f},{numbers([*QUATERNIONS[n, XYZW], *POSITIONS_M[n]])}"
    ),
    "microseconds": rows(lambda n: f"{round(1e6 * TIMES_S[n])},{pose(n)}"),
    "semicolons and decimal commas": rows(
        lambda n: f"{TIMES_S[n]:.4f};{pose(n, separator=';')}".replace(".", ","), ["t;x;y;z;qw;qx;qy;qz"]
    ),
    "tabs": rows(lambda n: f"{TIMES_S[n]:.4f}\t{pose(n, separator=chr(9))}", ["t\tx\ty\tz\tqw\tqx\tqy\tqz"]),
    "carriage returns and a mark": b"\xef\xbb\xbf" + tum().replace("\n", "\r\n").encode(),
    "utf-16": rows(lambda n: f"{TIMES_S[n]:.4f};{pose(n, separator=';')}", ["t;x;y;z;qw;qx;qy;qz"]).encode("utf-16"),
    "comments": rows(
        lambda n: f"{TIMES_S[n]:.4f} {pose(n, XYZW, separator=' ')}" + ("\n# lost" if n % 90 == 50 else ""), ["# by x"]
    ),
    "quotes": rows(lambda n: f'"{TIMES_S[n]:.4f}",{pose(n)},"a, b"', ['"time","x","y","z","qw","qx","qy","qz","note"']),
    "rostopic": rows(
        lambda n: (
            f"{round(1e9 * (START_S + TIMES_S[n])) + 3_000_000},{n},"
            f"{round(1e9 * START_S) + round(1e9 * TIMES_S[n])},map,{pose(n, XYZW)}"
        ),
        [
            "%time,field.header.seq,field.header.stamp,field.header.frame_id,"
            + ",".join(f"field.pose.position.{axis}" for axis in "xyz")
            + ","
            + ",".join(f"field.pose.orientation.{axis}" for axis in "xyzw")
        ],
    ),
    "seconds and nanoseconds": rows(
        lambda n: f"1403636579,{round(1e9 * (0.25 + TIMES_S[n]))},{pose(n)}",
        ["header.stamp.secs,header.stamp.nsecs,position.x,position.y,position.z,quat.w,quat.x,quat.y,quat.z"],
    ),
    "imaginary units and a title": rows(
        lambda n: f"{TIMES_S[n]:.4f};{pose(n, XYZW, separator=';')};",
        ["sep=;", "Subject;7;of;the;hall;on;a;Monday;", "elapsed time (s);x;y;z;quat_i;quat_j;quat_k;quat_real"],
    ),
    "matrices with names": rows(
        lambda n: f"{TIMES_S[n]:.4f},{numbers(matrix(n)[:3].ravel())}",
        ["time," + ",".join(f"m{row}{column}" for row in range(3) for column in range(4))],
    ),
    "matrices whose elements are named": rows(
        lambda n: f"{TIMES_S[n]:.4f},{numbers(POSITIONS_M[n])},{numbers(matrix(n)[:3, :3].ravel())},0.9,7",
        ["time,x,y,z," + ",".join(f"r{row}{column}" for row in (1, 2, 3) for column in (1, 2, 3)) + ",quality,n"],
    ),
    "whole matrices whose elements are named": rows(
        lambda n: f"{TIMES_S[n]:.4f},{numbers(matrix(n).ravel())},normal",
        ["time," + ",".join(f"m{row}{column}" for row in range(4) for column in range(4)) + ",state"],
    ),
    "whole matrices that count from 1": rows(
        lambda n: f"{TIMES_S[n]:.4f},{numbers(matrix(n)[:3].ravel())},7",
        ["time," + ",".join(f"hand.m{row}{column}" for row in range(1, 4) for column in range(1, 5)) + ",quality"],
    ),
    "dates": rows(lambda n: f"2024-05-01T10:00:{TIMES_S[n]:06.3f}Z,{pose(n)}", ["timestamp,x,y,z,qw,qx,qy,qz"]),
    "dates without a header": rows(lambda n: f"2024-05-01 10:00:{TIMES_S[n]:06.3f},{pose(n)}"),
    "times of day over midnight": rows(
        lambda n: (
            (f"23:59:{57 + TIMES_S[n]:.3f}" if TIMES_S[n] < 3 else f"0:00:{TIMES_S[n] - 3:06.3f}") + f",{pose(n)}"
        ),
        ["Uhrzeit,x,y,z,qw,qx,qy,qz"],
    ),
    "nanoseconds alone": rows(lambda n: f"{round(1e9 * TIMES_S[n])},{pose(n)}", ["stamp_nsec,x,y,z,qw,qx,qy,qz"]),
    "millimetres": rows(lambda n: f"{TIMES_S[n]:.4f},{pose(n, unit_m=0.001)}", ["t,x,y,z,q0,q1,q2,q3"]),
    "matrices in lines": rows(lambda n: f"{TIMES_S[n]:.4f} {numbers(matrix(n)[:3].ravel(), ' ')}"),
    "matrices column by column": rows(lambda n: f"{TIMES_S[n]:.4f},{numbers(matrix(n).T.ravel())}"),
}
"""Files with times that hold the motion as one body; z is up."""
UNTIMED = {
    "matrices": matrix_lines(),
    "matrices of three lines": matrix_lines(3),
    "kitti": rows(lambda n: numbers(matrix(n)[:3].ravel(), " ")),
    "numbers of samples": rows(lambda n: f"{n},{pose(n)}", ["frame,x,y,z,qw,qx,qy,qz"]),
    "numbers without a name": rows(lambda n: f"{n},{pose(n)}"),
    "poses alone": rows(lambda n: pose(n, XYZW)),
}
"""The same without times."""


def write(path: Path, content: str | bytes) -> Path:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path
