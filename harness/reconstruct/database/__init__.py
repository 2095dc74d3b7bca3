"""The database of poses that methods learn from, and windows of consecutive poses in it."""

from harness.reconstruct.database.frames import TakeSegment
from harness.reconstruct.database.motion_database import MotionDatabase
from harness.reconstruct.database.windows import Windows

__all__ = ["MotionDatabase", "TakeSegment", "Windows"]
