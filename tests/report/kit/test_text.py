"""Names and labels of metrics on a page."""

from harness.report.kit.text import metric_label, metric_name
from harness.score import DEFINITIONS


def test_every_label_ends_with_the_unit_and_no_two_metrics_share_one() -> None:
    labels = {name: metric_label(name) for name in DEFINITIONS}
    assert all(label.endswith(f" [{DEFINITIONS[name].unit}]") for name, label in labels.items())
    assert len(set(labels.values())) == len(labels)
    assert not any("_" in label for label in labels.values())
    assert metric_label("joint_angle_mean_deg") == "joint angle error [deg]"
    assert metric_name("frames_held") == "frames held"
