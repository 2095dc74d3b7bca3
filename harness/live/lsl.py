"""Live output as Lab Streaming Layer streams, to record poses together with EEG, eye trackers and event markers.

There are two streams: NAME-qpos with the configuration, and NAME-joints with the positions of the joints. A sample's
time stamp is the time of measurement on LSL's clock, which has a constant offset to `time.monotonic`.

liblsl announces streams to the network by default, and has no setting to serve them to this computer only. The
configuration here hides them from searches on the network (labstreaminglayer.readthedocs.io, "LSL configuration
files").
"""

import os
import time
from typing import Any

from harness.core.skeleton import Skeleton
from harness.errors import BadInput, MissingExtra
from harness.live.file_outputs import hinges_in_qpos_order
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
"""Announce streams on the loopback interface only, and log errors only."""
_CONFIG_VARIABLE = "LSLAPICFG"
"""Environment variable by which users name their own configuration."""


class LslOutput:
    """An `Output` to two LSL streams."""

    def __init__(self, name: str, skeleton: Skeleton, rate_hz: float, *, network: bool = False) -> None:
        """Open the streams; `network` keeps liblsl's default configuration, which announces them to the network.

        Raises BadInput for an empty name, MissingExtra without pylsl.
        """
        pylsl = import_pylsl()
        if not name.strip():
            raise BadInput("--lsl needs a name.", "Receivers find the streams by it.")
        self.name = f"--lsl {name}"
        where = f"configured by {_CONFIG_VARIABLE}"
        if network:
            where = "announced to the network"
        elif not os.environ.get(_CONFIG_VARIABLE):
            where = "announced on this computer only; liblsl's ports are open to the network"
            pylsl.set_config_content(_LOOPBACK_CONFIG)  # has effect only before the first stream of the process
        self.description = f"LSL: {name}-qpos and {name}-joints, {where}"
        self._clock_offset_s = pylsl.local_clock() - time.monotonic()
        root = [(f"root.{axis}", "metres") for axis in "xyz"]
        root += [(f"root.q{axis}", "unit quaternion") for axis in "wxyz"]
        hinges = [(skeleton.dof_names[d], "radians") for d in hinges_in_qpos_order(skeleton)]
        joints = [(f"{bone}.{axis}", "metres") for bone in ("root", *skeleton.names) for axis in "xyz"]
        self._qpos = _make_outlet(pylsl, f"{name}-qpos", [*root, *hinges], rate_hz)
        self._joints = _make_outlet(pylsl, f"{name}-joints", joints, rate_hz)

    def send(self, pose: LivePose) -> None:
        stamp_s = pose.measured_s + self._clock_offset_s
        self._qpos.push_sample(pose.estimate.qpos, stamp_s)
        self._joints.push_sample(pose.joints_m.ravel(), stamp_s)

    def close(self) -> None:
        self._qpos = self._joints = None  # liblsl closes streams without references


def import_pylsl() -> Any:
    """Import pylsl; MissingExtra if it or its C library is missing."""
    try:
        import pylsl
    except (ImportError, RuntimeError, OSError) as error:  # RuntimeError: the wheel has no liblsl for this computer
        raise MissingExtra("--lsl", "pylsl with liblsl", "lsl") from error
    return pylsl


def _make_outlet(pylsl: Any, name: str, channels: list[tuple[str, str]], rate_hz: float) -> Any:
    info = pylsl.StreamInfo(name, "MoCap", len(channels), rate_hz, "double64", f"tracker-harness-{name}")
    channel_list = info.desc().append_child("channels")
    for label, unit in channels:
        channel = channel_list.append_child("channel")
        channel.append_child_value("label", label)
        channel.append_child_value("unit", unit)
    setup = info.desc().append_child("setup")
    setup.append_child_value("axes", "world: x forward, y left, z up; quaternion w, x, y, z")
    setup.append_child_value("time", "of measurement: the device's stamps on the clock of the host that received them")
    return pylsl.StreamOutlet(info)
