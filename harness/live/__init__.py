"""Capture, calibration, reconstruction and outputs in real time."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.live.outputs import OutputOptions, open_outputs
    from harness.live.pose import SessionSetup
    from harness.live.pose_sheet import draw_poses
    from harness.live.pose_terminal import PoseTerminal
    from harness.live.scheduling_jitter import JitterProbe
    from harness.live.session import LiveOptions, LiveResult, run_session, warm_up
    from harness.live.session_control import SessionControl
    from harness.live.stated_uncertainty import describe_uncertainty
    from harness.live.viewer import ViewerOutput
    from harness.live.vmc import VmcOutput
    from harness.live.vrpn_output import VrpnOutput
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "JitterProbe",
    "LiveOptions",
    "LiveResult",
    "OutputOptions",
    "PoseTerminal",
    "SessionControl",
    "SessionSetup",
    "ViewerOutput",
    "VmcOutput",
    "VrpnOutput",
    "describe_uncertainty",
    "draw_poses",
    "open_outputs",
    "run_session",
    "warm_up",
]
