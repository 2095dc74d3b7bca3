"""The motion generator: procedural, seeded full-body motion of 64 performers, which needs no download."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.mocap.synthetic.performers import REFERENCE_PERFORMERS as REFERENCE_PERFORMERS
    from harness.mocap.synthetic.performers import UNLISTED_PERFORMERS as UNLISTED_PERFORMERS
    from harness.mocap.synthetic.performers import performer_names as performer_names
    from harness.mocap.synthetic.performers import performer_skeleton as performer_skeleton
    from harness.mocap.synthetic.performers import sample_skeletons as sample_skeletons
    from harness.mocap.synthetic.takes import BEHAVIOURS as BEHAVIOURS
    from harness.mocap.synthetic.takes import RIG_TAKES as RIG_TAKES
    from harness.mocap.synthetic.takes import SOURCE as SOURCE
    from harness.mocap.synthetic.takes import generate as generate
    from harness.mocap.synthetic.takes import generate_rig as generate_rig
    from harness.mocap.synthetic.takes import stretch_marks as stretch_marks
    from harness.mocap.synthetic.takes import take_names as take_names
else:
    __getattr__, __dir__ = lazy_names(__name__)
