"""Shows a drive: what is true, what the odometry said, what the filter made of it. Pictures, videos, rerun.

    run = driving.run_of_filter(imu.times_ns, filter.run(...), truth, odometry)
    driving.save_summary(run, "summary.png")
    driving.animate(run, driving.scene_along(run.truth.position), "drive.mp4")

World has z up (ENU); body x forward, y left, z up. Nothing here needs a screen.
"""

from libloc.driving.animation import AnimationOptions as AnimationOptions
from libloc.driving.animation import DrivingAnimation as DrivingAnimation
from libloc.driving.animation import animate as animate
from libloc.driving.log import run_of_log as run_of_log
from libloc.driving.run import DrivingRun as DrivingRun
from libloc.driving.run import Estimate as Estimate
from libloc.driving.run import Odometry as Odometry
from libloc.driving.run import Truth as Truth
from libloc.driving.run import run_of_filter as run_of_filter
from libloc.driving.scene import Building as Building
from libloc.driving.scene import DrivingScene as DrivingScene
from libloc.driving.scene import SceneOptions as SceneOptions
from libloc.driving.scene import scene_along as scene_along
from libloc.driving.summary import plot_summary as plot_summary
from libloc.driving.summary import save_summary as save_summary
from libloc.driving.video import MissingPackageError as MissingPackageError
from libloc.driving.viewer import save_rerun as save_rerun
from libloc.driving.viewer import view_rerun as view_rerun
