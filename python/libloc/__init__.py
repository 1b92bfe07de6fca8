"""Tells where a moving camera is: sensors in, orientation and trajectory out.

SI units and radians; quaternions are Hamilton, wxyz, body to world; times are int64 nanoseconds. Frames:
world has z up (unless NED is chosen), body is the IMU; T_a_b takes coordinates of b to coordinates of a.
"""

from libloc._core import *  # noqa: F403
from libloc._core import so3 as so3
from libloc.images import ImageSlamRun as ImageSlamRun
from libloc.images import open_pictures as open_pictures
from libloc.images import picture_format as picture_format
from libloc.images import pictures as pictures
from libloc.images import run_image_slam as run_image_slam
from libloc.recordings import file_format as file_format
from libloc.recordings import open_recording as open_recording
from libloc.recordings import read_recording as read_recording
from libloc.slam import FrameFeatures as FrameFeatures
from libloc.slam import anchor_slam as anchor_slam
from libloc.slam import features_of_frames as features_of_frames
from libloc.slam import features_of_tracks as features_of_tracks
from libloc.slam import run_slam as run_slam

__version__ = "0.5.0"
