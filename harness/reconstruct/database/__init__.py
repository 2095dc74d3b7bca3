"""The database of poses that methods learn from, and windows of consecutive poses in it."""

from harness.reconstruct.database.frames import TakeSegment, Windows
from harness.reconstruct.database.motion_database import MotionDatabase

__all__ = ["MotionDatabase", "TakeSegment", "Windows"]
