"""Judges systems that turn a few body-worn 6-DOF trackers into full-body motion."""

__version__ = "0.1.0"
