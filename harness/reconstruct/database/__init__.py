"""Poses to learn from: without place and heading, in windows, or as trackers would have read them."""

from harness.reconstruct.database.motion_database import MotionDatabase, TakeSegment
from harness.reconstruct.database.windows import Windows

__all__ = ["MotionDatabase", "TakeSegment", "Windows"]
