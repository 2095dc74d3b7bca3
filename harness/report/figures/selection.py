"""What a figure shows of its run: metric, methods, condition, clip and control."""

from dataclasses import dataclass

from harness.results.reported_metrics import PRIMARY_METRIC


@dataclass(frozen=True)
class FigureSelection:
    """What the user chose; the defaults leave the choice to the figure."""

    metric: str = PRIMARY_METRIC
    methods: tuple[str, ...] = ()
    """Methods to show, in this order where order matters; empty: all."""
    condition: str = ""
    """Name of a condition or some of its parts (see `RunCondition.name`); empty: all, or the last varied values."""
    clip: str = ""
    control: str = ""
    """The method that is highlighted next to the one with the lowest error."""
