"""SLAM from pictures of a EuRoC recording or a simulated room: the camera's way and the map as slam.png."""

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import libloc

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("input", type=Path, nargs="?", help="EuRoC recording with pictures (default: simulated)")
parser.add_argument("--output", type=Path, default=Path("slam.png"))
arguments = parser.parse_args()
if arguments.input is None:
    camera = libloc.Scenario("circle").rig().cameras[0]
    renderer = libloc.SceneRenderer(libloc.box_room(libloc.Random(1)), camera)
    way = [libloc.Pose3(translation=[np.sin(t) - 1, 1.5 * np.cos(t), 1.5]) for t in np.arange(0, 4, 0.05)]
    source = ((i * 50_000_000, renderer.render(T * camera.T_body_camera)) for i, T in enumerate(way))
else:
    camera = libloc.read_any_rig(arguments.input / "mav0/cam0/sensor.yaml").cameras[0]
    source = libloc.pictures(arguments.input)

slam = libloc.ImageSlam(libloc.slam_options_for_images(libloc.SlamOptions(camera=camera)))
path = []
for time_ns, picture in source:
    if slam.process_image(time_ns, picture):
        path.append(slam.frames()[0].camera_position)
map_, path = slam.map(), np.array(path)
print(f"{len(path)} pictures, {len(map_)} points in the map")
figure = Figure(figsize=(12, 5), layout="constrained")
left, right = figure.subplots(1, 2)
left.imshow(picture, cmap="gray")
left.scatter(*slam.features.pixel_px.T, s=12, color="tab:orange")
left.set_title("features of the last picture")
right.plot(*path[:, :2].T, label="way of the camera")
right.scatter(*map_.position[:, :2].T, s=4, color="tab:orange", label="map")
right.set(xlabel="x", ylabel="y", title="from above; lengths are in a unit of their own", aspect="equal")
right.legend()
figure.savefig(arguments.output)
