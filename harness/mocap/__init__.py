"""Motion capture: files, libraries and sources of clips."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.mocap.clip_file import CLIP_FORMATS as CLIP_FORMATS
    from harness.mocap.clip_file import read_clip as read_clip
    from harness.mocap.fetch import fetch_cmu as fetch_cmu
    from harness.mocap.file_inspection import inspect_file as inspect_file
    from harness.mocap.library import LibraryFolders as LibraryFolders
    from harness.mocap.library import MotionLibrary as MotionLibrary
    from harness.mocap.library import absolute_folders as absolute_folders
    from harness.mocap.library import ignored_paths_note as ignored_paths_note
    from harness.mocap.read.amc import read_amc as read_amc
    from harness.mocap.read.c3d import MarkerClip as MarkerClip
    from harness.mocap.read.c3d import read_c3d as read_c3d
    from harness.mocap.shared_motion import SharedMotion as SharedMotion
    from harness.mocap.shared_motion import find_shared_motion as find_shared_motion
    from harness.mocap.sources import MOCAP_VARIABLE as MOCAP_VARIABLE
    from harness.mocap.sources import POPULATION_SIZE as POPULATION_SIZE
    from harness.mocap.sources import MotionSource as MotionSource
    from harness.mocap.sources import SyntheticSource as SyntheticSource
    from harness.mocap.sources import find_library_folders as find_library_folders
    from harness.mocap.sources import folders_of_environment as folders_of_environment
    from harness.mocap.sources import open_motion_source as open_motion_source
    from harness.mocap.sources import read_skeletons as read_skeletons
else:
    __getattr__, __dir__ = lazy_names(__name__)
