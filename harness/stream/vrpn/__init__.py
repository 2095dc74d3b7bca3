"""VRPN: a client of the trackers of a server, and a server of poses."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.stream.vrpn.client import VrpnConfig, VrpnTracker
    from harness.stream.vrpn.messages import PoseReport
    from harness.stream.vrpn.relay import RelayedStream, describe_sensors
    from harness.stream.vrpn.server import open_server
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = ["PoseReport", "RelayedStream", "VrpnConfig", "VrpnTracker", "describe_sensors", "open_server"]
