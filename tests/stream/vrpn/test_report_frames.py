"""Frames from reports: what closes one, whose times they carry, and what belongs to none."""

import numpy as np

from harness.stream.frame import TrackerFrame
from harness.stream.vrpn.messages import PoseReport
from harness.stream.vrpn.report_frames import ReportFrames

RATE_HZ, START_US = 100.0, 1_700_000_000_123_456
PLACE, TURN = (0.1, 0.2, 0.3), (1.0, 0.0, 0.0, 0.0)


def report(sensor: int, at_s: float, place: tuple[float, float, float] = PLACE) -> PoseReport:
    return PoseReport(sensor, START_US + round(1e6 * at_s), place, TURN)


def frames_of(reader: ReportFrames, *reports: PoseReport, now_s: float = 5.0) -> list[TrackerFrame]:
    return [frame for one in reports for frame in reader.add(one, now_s)]


def present(frame: TrackerFrame) -> list[bool]:
    return [bool(at_s == at_s) for at_s in frame.measured_s]


def test_a_round_of_all_sensors_is_a_frame() -> None:
    reader = ReportFrames([3, 7], RATE_HZ)
    (frame,) = frames_of(reader, report(7, 0.0), report(3, 0.001, (1.0, 2.0, 3.0)))
    assert frame.measured_s.tolist() == [0.001, 0.0]
    assert frame.position_m.tolist() == [[1.0, 2.0, 3.0], list(PLACE)]
    assert frame.tracker_from_station.tolist() == [list(TURN)] * 2
    assert (frame.position_valid & frame.orientation_valid & (frame.quality == 1.0) & ~frame.suspect).all()
    assert (frame.received_s, reader.start_us) == (5.0, START_US)


def test_a_sensor_that_reports_again_closes_the_frame() -> None:
    reader = ReportFrames([0, 1], RATE_HZ)
    (frame,) = frames_of(reader, report(0, 0.0), report(0, 0.01))
    assert present(frame) == [True, False]
    assert np.isnan(frame.position_m[1]).all()
    assert frame.quality.tolist() == [1.0, 0.0]


def test_a_frame_spans_one_and_a_half_periods_at_most() -> None:
    reader = ReportFrames([0, 1], RATE_HZ)
    assert present(*frames_of(reader, report(0, 0.0), report(1, 0.016))) == [True, False]
    reader = ReportFrames([0, 1], RATE_HZ)
    assert present(*frames_of(reader, report(0, 0.0), report(1, 0.014))) == [True, True]


def test_an_overdue_frame_is_closed_by_the_hosts_clock() -> None:
    reader = ReportFrames([0, 1], RATE_HZ)
    assert not frames_of(reader, report(0, 0.0))
    assert not reader.expire(5.014)
    (frame,) = reader.expire(5.016)
    assert present(frame) == [True, False]
    assert not reader.expire(6.0)


def test_frames_of_one_moment_have_increasing_times_of_reception() -> None:
    first, second = frames_of(ReportFrames([0], RATE_HZ), report(0, 0.0), report(0, 0.01))
    assert first.received_s == 5.0 < second.received_s < 5.000001


def test_a_redundant_copy_belongs_to_no_frame() -> None:
    reader = ReportFrames([0], RATE_HZ)
    assert len(frames_of(reader, report(0, 0.0), report(0, 0.0), report(0, 0.01))) == 2
    assert (reader.counts["records"], reader.counts["copies"]) == (3, 1)


def test_a_report_that_is_not_later_is_suspect() -> None:
    frames = frames_of(ReportFrames([0], RATE_HZ), report(0, 0.01), report(0, 0.01, (9.0, 9.0, 9.0)), report(0, 0.005))
    assert [bool(frame.suspect[0]) for frame in frames] == [False, True, True]


def test_a_clock_that_was_set_back_goes_on_by_the_hosts_clock() -> None:
    reader = ReportFrames([0], RATE_HZ)
    frames = [*reader.add(report(0, 0.0), 5.0), *reader.add(report(0, 0.5), 5.5)]
    frames += [*reader.add(report(0, -3600.0), 5.75), *reader.add(report(0, -3599.9), 5.85)]
    np.testing.assert_allclose([frame.measured_s[0] for frame in frames], [0.0, 0.5, 0.75, 0.85], atol=1e-6)
    assert not any(frame.suspect.any() for frame in frames)
    assert reader.counts["clock_resets"] == 1


def test_a_step_back_below_a_second_is_no_reset() -> None:
    reader = ReportFrames([0], RATE_HZ)
    *_, last = frames_of(reader, report(0, 2.0), report(0, 1.1))
    assert (reader.counts["clock_resets"], bool(last.suspect[0])) == (0, True)


def test_a_pose_that_is_no_pose_is_not_valid() -> None:
    nan = float("nan")
    bad = [
        PoseReport(0, START_US, (nan, 0.0, 0.0), TURN),
        PoseReport(0, START_US + 1, PLACE, (0.0, 0.0, 0.0, 0.0)),
        PoseReport(0, START_US + 2, PLACE, (nan, 0.0, 0.0, 1.0)),
        PoseReport(0, START_US + 3, PLACE, (3.0, 0.0, 0.0, 0.0)),
    ]
    frames = frames_of(ReportFrames([0], RATE_HZ), *bad)
    assert [bool(frame.position_valid[0]) for frame in frames] == [False, True, True, True]
    assert [bool(frame.orientation_valid[0]) for frame in frames] == [True, False, False, False]
    assert np.isnan(frames[3].tracker_from_station).all()


def test_quaternions_keep_their_digits_unless_they_are_no_unit_quaternions() -> None:
    near, far = (0.6, 0.8 + 1e-10, 0.0, 0.0), (0.9, 1.2, 0.0, 0.0)
    reports = [PoseReport(0, START_US, PLACE, near), PoseReport(0, START_US + 10_000, PLACE, far)]
    kept, divided = frames_of(ReportFrames([0], RATE_HZ), *reports)
    assert kept.tracker_from_station[0].tolist() == list(near)
    np.testing.assert_allclose(divided.tracker_from_station[0], [0.6, 0.8, 0.0, 0.0], atol=1e-15)


def test_another_sensor_is_counted_alone() -> None:
    reader = ReportFrames([1], RATE_HZ)
    assert not frames_of(reader, report(0, 0.0))
    assert (reader.counts["other_sensors"], reader.counts["records"]) == (1, 0)
