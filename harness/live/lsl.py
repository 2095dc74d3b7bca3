"""Poses as streams of the Lab Streaming Layer, beside EEG, eye trackers and markers of the same experiment.

Two streams: NAME-qpos, the configuration, and NAME-joints, the joints' places. Samples are stamped with the moment of
the measurement by LSL's clock, which is the one of `time.monotonic` or runs beside it.

liblsl announces streams to the network by default, and it has no setting to serve them to this computer alone: what
can be set here is that nobody on the network finds them (labstreaminglayer.readthedocs.io, "LSL configuration files").
"""

import os
import time
from typing import Any

from harness.core.skeleton import Skeleton
from harness.errors import BadInput, MissingExtra
from harness.live.pose import LivePose

_LOOPBACK_CONFIG = """
[multicast]
ResolveScope = machine
ListenAddress = 127.0.0.1
[ports]
IPv6 = disable
[log]
level = -2
"""
"""Announced on the loopback interface only; only errors are logged."""
_CONFIG_VARIABLE = "LSLAPICFG"
"""The variable with which users name a configuration of their own."""


class LslOutput:
    """An `Output`."""

    def __init__(self, name: str, own: Skeleton, rate_hz: float, *, network: bool = False) -> None:
        """BadInput, MissingExtra. `network` leaves liblsl its own configuration."""
        pylsl = import_pylsl()
        if not name.strip():
            raise BadInput("--lsl without a name.", "Receivers find the streams by it.")
        self.name = f"--lsl {name}"
        where = f"as {_CONFIG_VARIABLE} says"
        if network:
            where = "announced to the network"
        elif not os.environ.get(_CONFIG_VARIABLE):
            where = "found on this computer alone, though liblsl's ports are open to the network"
            pylsl.set_config_content(
                _LOOPBACK_CONFIG
            )  # counts until the first stream is made, and for the whole program
        self.description = f"LSL: {name}-qpos and {name}-joints, {where}"
        self._clock_offset_s = pylsl.local_clock() - time.monotonic()
        root = [(f"root.{axis}", "metres") for axis in "xyz"] + [
            (f"root.q{axis}", "unit quaternion") for axis in "wxyz"
        ]
        hinges = [
            (own.dof_names[d], "radians") for run in own.dof_of_bone for d in reversed(range(run.start, run.stop))
        ]
        joints = [(f"{bone}.{axis}", "metres") for bone in ("root", *own.names) for axis in "xyz"]
        self._qpos = _make_outlet(pylsl, f"{name}-qpos", [*root, *hinges], rate_hz)
        self._joints = _make_outlet(pylsl, f"{name}-joints", joints, rate_hz)

    def send(self, pose: LivePose) -> None:
        stamp_s = pose.measured_s + self._clock_offset_s
        self._qpos.push_sample(pose.estimate.qpos, stamp_s)
        self._joints.push_sample(pose.joints_m.ravel(), stamp_s)

    def close(self) -> None:
        self._qpos = self._joints = None  # liblsl closes what nobody holds


def import_pylsl() -> Any:
    """The module pylsl; MissingExtra when it or its C library is not there."""
    try:
        import pylsl
    except (ImportError, RuntimeError, OSError) as error:  # RuntimeError: the wheel has no liblsl for this computer
        raise MissingExtra("--lsl", "pylsl with liblsl", "lsl") from error
    return pylsl


def _make_outlet(pylsl: Any, name: str, channels: list[tuple[str, str]], rate_hz: float) -> Any:
    info = pylsl.StreamInfo(name, "MoCap", len(channels), rate_hz, "double64", f"tracker-harness-{name}")
    listed = info.desc().append_child("channels")
    for label, unit in channels:
        channel = listed.append_child("channel")
        channel.append_child_value("label", label)
        channel.append_child_value("unit", unit)
    setup = info.desc().append_child("setup")
    setup.append_child_value("axes", "world: x forward, y left, z up; quaternion w, x, y, z")
    setup.append_child_value("time", "of measurement: the device's stamps on the clock of the host that received them")
    return pylsl.StreamOutlet(info)
