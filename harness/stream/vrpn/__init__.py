"""VRPN: a client of the trackers of a server, and a server of poses."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.stream.vrpn.client import VrpnConfig as VrpnConfig
    from harness.stream.vrpn.client import VrpnTracker as VrpnTracker
    from harness.stream.vrpn.messages import PoseReport as PoseReport
    from harness.stream.vrpn.relay import RelayedStream as RelayedStream
    from harness.stream.vrpn.relay import describe_sensors as describe_sensors
    from harness.stream.vrpn.server import open_server as open_server
else:
    __getattr__, __dir__ = lazy_names(__name__)
