"""Capture, calibration, reconstruction and outputs in real time."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.live.outputs import OutputOptions as OutputOptions
    from harness.live.outputs import open_outputs as open_outputs
    from harness.live.pose import SessionSetup as SessionSetup
    from harness.live.pose_sheet import draw_poses as draw_poses
    from harness.live.pose_terminal import PoseTerminal as PoseTerminal
    from harness.live.scheduling_jitter import JitterProbe as JitterProbe
    from harness.live.session import LiveOptions as LiveOptions
    from harness.live.session import LiveResult as LiveResult
    from harness.live.session import run_session as run_session
    from harness.live.session import warm_up as warm_up
    from harness.live.session_control import SessionControl as SessionControl
    from harness.live.stated_uncertainty import describe_uncertainty as describe_uncertainty
    from harness.live.viewer import ViewerOutput as ViewerOutput
    from harness.live.vmc import VmcOutput as VmcOutput
    from harness.live.vrpn_output import VrpnOutput as VrpnOutput
else:
    __getattr__, __dir__ = lazy_names(__name__)
