"""Playback of a scenario with the table [physics]: the first loop of the device has the bytes of the simulation."""

from pathlib import Path

import numpy as np
import pytest

from harness.errors import UnknownName
from harness.experiment.playback import Playback, prepare_playback
from harness.stream.polhemus.codec import DeviceSamples, RecordValues, WireFormat, encode_records

SCENARIO = """
methods = ["ik:previous"]
stations = "liu2011"
[motion]
source = "builtin"
behaviours = ["boxing"]
test = ["boxing_p1_01"]
longest_s = 2.0
[physics]
"""
SETTINGS = "fusion = { prediction_ms = { head = 50, torso = 20 }, enhancement = { left_hand = 1, torso = 2 } }\n"
LOST = '[components]\nlost = [{ station = "torso", from_s = 1.0, to_s = 1.5 }]\n'
TURNED = '[disturbance]\nkind = "all_turned"\nfrom_s = 1.0\nlasts_s = 0.5\n'
OFF = '[disturbance]\nkind = "one_off"\nstation = "head"\nfrom_s = 1.0\nlasts_s = 0.5\n'


def played(folder: Path, extra: str, **asked: object) -> Playback:
    path = folder / "mine.toml"
    path.write_text(SCENARIO + extra, encoding="utf-8")
    return prepare_playback(path, **asked)  # type: ignore[arg-type]


def first_loop(samples: DeviceSamples, wire_format: WireFormat) -> bytes:
    """The records of the first loop as a device with the samples' settings encodes them."""
    position_m, turn = samples.position_m, samples.tracker_from_station
    if samples.filter is not None:
        settings = samples.filter.prediction_ms, samples.filter.enhancement
        position_m, turn = samples.filter.report_poses(position_m, turn, *settings)
    shown = slice(0, samples.take_frames)
    characters = np.tile(np.frombuffer(wire_format.characters, np.uint8), samples.take_frames)
    values = RecordValues(
        samples.device_s[shown].ravel(),
        position_m[shown].reshape(-1, 3),
        turn[shown].reshape(-1, 4),
        samples.quality[shown].ravel(),
    )
    return encode_records(wire_format.items, characters, values, wire_format.settings).tobytes()


@pytest.mark.parametrize("noise", ["clean", "default"])
@pytest.mark.parametrize(
    "extra",
    ["", SETTINGS, SETTINGS + LOST, SETTINGS + TURNED, OFF],
    ids=["plain", "prediction and enhancement", "lost station", "all turned", "one off"],
)
def test_the_first_loop_has_the_bytes_of_the_simulation(extra: str, noise: str, tmp_path: Path) -> None:
    playback = played(tmp_path, extra, noise=noise)
    simulation = playback.simulation
    assert simulation.health["records_dropped"] == 0.0
    assert first_loop(playback.samples, simulation.wire_format) == simulation.wire.data
    assert playback.samples.filter is not None
    assert len(playback.samples.filter.emitters) == 9


def test_settings_and_faults_change_the_bytes(tmp_path: Path) -> None:
    """Else the test above would hold for a scenario whose settings are ignored."""
    wires = [played(tmp_path, extra).simulation.wire.data for extra in ("", SETTINGS, LOST, TURNED, OFF)]
    assert len(set(wires)) == len(wires)


def test_the_way_back_is_part_of_the_device_s_motion(tmp_path: Path) -> None:
    """The performer does not jump at the end of the take: neither do the reported positions."""
    samples = played(tmp_path, "", noise="clean").samples
    step_m = np.linalg.norm(np.diff(samples.position_m, axis=0, append=samples.position_m[:1]), axis=2)
    tracked = (samples.quality > 0.0) & (np.roll(samples.quality, -1, axis=0) > 0.0)
    assert tracked[samples.take_frames :].all()
    assert step_m[samples.take_frames - 1 :].max() <= step_m[tracked].max() < 0.5


def test_some_of_the_stations_may_be_played(tmp_path: Path) -> None:
    """Settings of stations that are not played have no effect; an unknown station is refused."""
    two = played(tmp_path, SETTINGS, stations=["left_hand", "head"]).samples
    assert two.filter is not None
    np.testing.assert_array_equal(two.filter.prediction_ms, [0, 50])
    np.testing.assert_array_equal(two.filter.enhancement, [1, 0])
    with pytest.raises(UnknownName, match="Did you mean 'torso'"):
        played(tmp_path, SETTINGS.replace("torso", "torsoo"))
