"""Pictures of the camera-IMU calibration: each is drawn, whatever the result holds."""

from types import SimpleNamespace

import numpy as np
import pytest
from libloc.programs.calibrate_plots_camera_imu import pictures
from PIL import Image


def made_up_camera(name: str, corners: int = 3000, views: int = 100) -> SimpleNamespace:
    random = np.random.default_rng(len(name))
    offsets = np.linspace(-10, 10, 2001)
    dropped = {3: "no corners", 40: "no corners", 41: "clock outside of the IMU's"}
    return SimpleNamespace(
        camera=SimpleNamespace(
            name=name, width_px=752, height_px=480, intrinsics_px=np.array([458, 457, 367, 248.0])
        ),
        time_offset_s=0.0123,
        sigma=np.full(7, 1e-3),
        sigma_by_noise=np.full(7, 5e-4),
        sigma_by_blocks=np.full(7, 8e-4),
        sigma_by_intrinsics=np.zeros(7),
        start=SimpleNamespace(
            time_offset_s=0.0121,
            correlation=0.99,
            second_correlation=0.6,
            curve_offset_s=offsets,
            curve_correlation=np.exp(-(offsets**2)),
            excitation=np.array([0.9, 0.5, 0.3]),
        ),
        views=[
            SimpleNamespace(
                used=i not in dropped,
                reason=dropped.get(i, ""),
                rms_px=np.nan if i in dropped else 0.4,
                sigma_px=np.nan if i in dropped else 0.3,
            )
            for i in range(views)
        ],
        corner_view=random.integers(50, views, corners),
        corner_pixel_px=random.uniform((0, 0), (752, 480), (corners, 2)),
        corner_residual_px=0.3 * random.normal(size=(corners, 2)),
    )


def made_up_fit(cameras: int = 1, samples: int = 4000) -> SimpleNamespace:
    random = np.random.default_rng(1)
    angle = 0.3 * np.sin(np.arange(samples) * 0.01)
    return SimpleNamespace(
        cameras=[made_up_camera(f"cam{i}") for i in range(cameras)],
        imu_time_ns=np.arange(samples) * 5_000_000,
        imu_residuals=random.normal(size=(samples, 6)),
        gyroscope_chi=1.0,
        accelerometer_chi=1.0,
        bias_time_ns=np.arange(21) * 1_000_000_000,
        biases=0.01 * random.normal(size=(21, 6)),
        target_imu_q_wxyz=np.stack([np.cos(angle / 2), np.sin(angle / 2), 0 * angle, 0 * angle], axis=1),
        knot_spacing_s=0.02,
        bandwidth_hz=8.0,
        knot_reason="Knots every 20 ms.",
    )


def draw(fit, folder, **more) -> set[str]:
    names = set()
    for picture in pictures(fit, **more):
        assert picture.caption
        picture.draw().savefig(folder / f"{picture.name}.png")
        with Image.open(folder / f"{picture.name}.png") as image:
            assert len(np.unique(np.asarray(image.convert("L")))) > 20  # something is drawn
        names.add(picture.name)
    return names


ALWAYS = {"imu_residuals", "biases", "correlation", "deviations", "motion"}


@pytest.mark.parametrize("cameras", [1, 2])
def test_every_picture_is_drawn(tmp_path, cameras):
    fit = made_up_fit(cameras)
    recordings = [
        SimpleNamespace(views=[SimpleNamespace(time_ns=50_000_000 * i) for i in range(100)])
        for _ in range(cameras)
    ]
    readings = np.random.default_rng(2).normal(size=(4000, 6))
    imu = (fit.imu_time_ns, readings[:, :3], readings[:, 3:])
    own = {f"{what}_cam{i}" for i in range(cameras) for what in ("reprojection", "pictures")}
    assert draw(fit, tmp_path, recordings=recordings, imu=imu) == ALWAYS | {"spectrum"} | own


def test_what_is_not_known_or_absent_is_left_out(tmp_path):
    fit = made_up_fit()
    fit.imu_residuals[100:200] = np.nan
    fit.imu_residuals[:, 4] = np.nan
    camera = fit.cameras[0]
    camera.corner_residual_px[:50] = np.nan
    camera.sigma_by_intrinsics[:] = np.nan
    camera.start.curve_correlation[500:] = np.nan
    draw(fit, tmp_path)
    for name in ("corner_view", "corner_pixel_px", "corner_residual_px"):
        setattr(camera, name, getattr(camera, name)[:0])
    for view in camera.views:
        view.used, view.reason = False, "no corners"
    draw(fit, tmp_path)


def test_residuals_and_reasons_are_those_of_the_fit():
    figures = {picture.name: picture.draw() for picture in pictures(made_up_fit())}
    lower = figures["pictures_cam0"].axes[1]
    assert [label.get_text() for label in lower.get_yticklabels()] == [
        "used (97)",
        "clock outside of the IMU's (1)",
        "no corners (2)",
    ]
    # The attitude turns about x only, by 0.3 sin(2 t).
    rates = [line.get_ydata() for line in figures["motion"].axes[0].lines]
    assert np.abs(rates[0]).max() == pytest.approx(np.degrees(0.6), rel=1e-3)
    assert max(np.abs(rates[1]).max(), np.abs(rates[2]).max()) < 1e-9
