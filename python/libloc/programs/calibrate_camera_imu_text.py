"""What loc-calibrate camera-imu says of its result: facts and tables, and the verdict in one sentence."""

from __future__ import annotations

import resource
from collections import Counter

import numpy as np

import libloc
from libloc import Verdict
from libloc.programs.calibrate_camera_imu_input import CameraImuInput
from libloc.programs.calibrate_report import Table, with_sigma

_INTRINSICS = ("fx [px]", "fy [px]", "cx [px]", "cy [px]")
_DISTORTION = {
    libloc.DistortionModel.RADTAN: ("k1", "k2", "p1", "p2"),
    libloc.DistortionModel.EQUIDISTANT: ("k1", "k2", "k3", "k4"),
    libloc.DistortionModel.NONE: (),
}


def _mounting_table(camera: libloc.CameraImuCamera) -> Table:
    T = camera.camera.T_body_camera
    quality = libloc.MountingQuality()
    quality.set_deviations(T, camera.covariance)
    rows = [
        [f"camera in IMU, {axis} [mm]", with_sigma(T.translation[i], quality.translation_sigma[i], 1e3)]
        for i, axis in enumerate("xyz")
    ]
    parts = (camera.sigma_by_noise, camera.sigma_by_blocks, camera.sigma_by_intrinsics)
    for row in rows:
        row += ["", "", ""]
    rows += [
        [
            f"IMU in camera, {axis} [mm]",
            with_sigma(camera.T_camera_imu.translation[i], camera.sigma[3 + i], 1e3),
            *(f"{1e3 * part[3 + i]:.2g}" for part in parts),
        ]
        for i, axis in enumerate("xyz")
    ]
    rows += [
        [
            f"rotation about the IMU's {axis} [deg]",
            f"± {np.rad2deg(camera.sigma[i]):.2g}",
            *(f"{np.rad2deg(part[i]):.2g}" for part in parts),
        ]
        for i, axis in enumerate("xyz")
    ]
    rows.append(
        [
            "clocks: t_imu - t_camera [ms]",
            with_sigma(camera.time_offset_s, camera.sigma[6], 1e3),
            *(f"{1e3 * part[6]:.2g}" for part in parts),
        ]
    )
    return Table(
        f"mounting of {camera.camera.name}",
        ["", "value ± deviation", "by noise", "by pieces", "by intrinsics"],
        rows,
    )


def _correlation_table(camera: libloc.CameraImuCamera) -> Table:
    """The covariance, with the deviations taken out: those stand above."""
    names = ["turn x", "turn y", "turn z", "t x", "t y", "t z", "offset"]
    correlation = camera.covariance / np.outer(camera.sigma, camera.sigma)
    return Table(
        f"correlations of the errors of {camera.camera.name} (turn about the IMU's axes, IMU in camera)",
        ["", *names],
        [[name, *(f"{x:.2f}" for x in row)] for name, row in zip(names, correlation, strict=True)],
    )


def _intrinsics_table(camera: libloc.CameraImuCamera, refined: bool) -> Table:
    values = [*camera.camera.intrinsics_px, *camera.camera.distortion]
    names = (*_INTRINSICS, *_DISTORTION[camera.camera.distortion_model])
    # A lens without distortion has no rows for it.
    rows = [
        [name, with_sigma(value, sigma if refined else None), f"{sigma:.2g}", f"{change:+.3g}"]
        for name, value, sigma, change in zip(
            names, values, camera.intrinsics_sigma, camera.intrinsics_change, strict=False
        )
    ]
    kind = "refined" if refined else "held"
    change = "changed by" if refined else "the recording would change it by"
    return Table(
        f"intrinsics of {camera.camera.name} ({kind})",
        ["", "value", "deviation" if refined else "deviation that was taken", change],
        rows,
    )


def _dropped_table(camera: libloc.CameraImuCamera) -> Table | None:
    reasons = Counter(view.reason for view in camera.views if not view.used)
    if not reasons:
        return None
    rows = [[reason, str(count)] for reason, count in reasons.most_common()]
    return Table(f"pictures of {camera.camera.name} that were not used", ["why", "pictures"], rows)


def _matrix_rows(name: str, matrix: libloc.CameraImuMatrixCheck) -> list[list[str]]:
    value, sigma = matrix.value, matrix.sigma
    return [
        [f"{name}, row {axis}", *(with_sigma(value[i, j], sigma[i, j] or None) for j in range(3))]
        for i, axis in enumerate("xyz")
    ]


def sentence_of(fit: libloc.CameraImuFit, verdict: Verdict) -> str:
    """The verdict for somebody who does this for the first time."""
    worst = max(fit.cameras, key=lambda c: float(np.linalg.norm(c.sigma[3:6])))
    turn = np.rad2deg(np.linalg.norm(worst.sigma[:3]))
    shift = 1e3 * np.linalg.norm(worst.sigma[3:6])
    known = (
        f"where {worst.camera.name} sits is known to {shift:.2g} mm and {turn:.2g} deg, "
        f"and the offset of the clocks to {1e3 * worst.sigma[6]:.2g} ms"
    )
    if verdict == Verdict.OK:
        return f"Good: {known}."
    if verdict == Verdict.FAIR:
        return f"Usable: {known}; see below what would make it better."
    if verdict == Verdict.WARN:
        return f"Doubtful: {known}, but something does not fit; see below before you use it."
    if fit.stopped:
        return "Do not use this result: it was stopped before its end; let it run to the end."
    return "Do not use this result: record once more as said below."


def _check_text(check: libloc.CameraImuCheck, scale: float, unit: str) -> str:
    text = f"{with_sigma(check.value, check.sigma, scale)} {unit}"
    return text if check.estimated else f"held; one step from there says {text}"


def _suggested_noise(noise: libloc.ImuNoise, fit: libloc.CameraImuFit) -> str:
    """Densities with which the residuals are as large as they should be."""
    gyro, accel = fit.gyroscope_noise_scale, fit.accelerometer_noise_scale
    return (
        f"gyroscope {noise.gyroscope_noise_density * gyro:.3g} rad/s/√Hz ({gyro:.2f} times what was given), "
        f"accelerometer {noise.accelerometer_noise_density * accel:.3g} m/s²/√Hz ({accel:.2f} times)"
    )


def facts_of(data: CameraImuInput, fit: libloc.CameraImuFit, verdict: Verdict) -> list[tuple[str, str]]:
    facts = [("in one sentence", sentence_of(fit, verdict))]
    for camera in fit.cameras:
        name, T = camera.camera.name, camera.camera.T_body_camera
        q = " ".join(f"{x:.8f}" for x in T.rotation_wxyz)
        facts.append(
            (f"{name} in IMU", f"q_wxyz {q}, translation [m] {np.array2string(T.translation, precision=6)}")
        )
        used = sum(view.used for view in camera.views)
        start = camera.start
        facts += [
            (
                f"{name}: pictures",
                f"{used} of {len(camera.views)} used, {len(camera.corner_id)} corners, residuals "
                f"{np.sqrt(np.nanmean(np.sum(camera.corner_residual_px**2, axis=1))):.3f} px rms, "
                f"{camera.corner_chi:.2f} of their deviation",
            ),
            (
                f"{name}: start",
                f"offset {1e3 * start.time_offset_s:.3f} ms at a correlation of {start.correlation:.3f} "
                f"(next best {start.second_correlation:.2f}); turn rates along the main axes "
                + ", ".join(f"{x:.2f}" for x in start.excitation)
                + " rad/s",
            ),
            (f"{name}: drift of the clocks", _check_text(camera.offset_drift, 1e6, "us/s")),
        ]
        if np.isfinite(camera.line_delay_s.value):
            facts.append((f"{name}: line delay", _check_text(camera.line_delay_s, 1e6, "us a row")))
    if np.isfinite(fit.target_scale.value):
        facts.append(
            ("target's size by the accelerometer", _check_text(fit.target_scale, 1, "of what was said"))
        )
    gravity = ", ".join(f"{x:.4f}" for x in fit.gravity_target)
    bias = np.mean(fit.biases, axis=0)
    facts += [
        (
            "gravity in target",
            f"({gravity}) m/s², direction ± {np.rad2deg(fit.gravity_direction_sigma):.2g} deg; size "
            + _check_text(fit.gravity_size, 1, "m/s²"),
        ),
        ("bias of the gyroscope", " ".join(f"{x:.5f}" for x in bias[:3]) + " rad/s (mean)"),
        ("bias of the accelerometer", " ".join(f"{x:.4f}" for x in bias[3:]) + " m/s² (mean)"),
        (
            "IMU residuals",
            f"{fit.gyroscope_chi:.2f} (gyroscope) and {fit.accelerometer_chi:.2f} (accelerometer) of their "
            "deviation; 1 is right",
        ),
        ("suggested noise", _suggested_noise(data.noise, fit)),
        ("knots", f"{1e3 * fit.knot_spacing_s:.2f} ms apart; {fit.knot_reason}"),
        (
            "CPU time",
            (f"reading and search {data.detect_cpu_s:.1f} s, " if data.detect_cpu_s else "")
            + f"start {fit.start_cpu_s:.2f} s, "
            f"solution {fit.solve_cpu_s:.2f} s ({fit.iterations} steps); memory at most "
            f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB",
        ),
    ]
    return facts


def tables_of(fit: libloc.CameraImuFit, refined: bool, imu_matrices: bool) -> list[Table]:
    """refined, imu_matrices: whether these were estimated."""
    tables: list[Table] = []
    for camera in fit.cameras:
        tables += [_mounting_table(camera), _correlation_table(camera), _intrinsics_table(camera, refined)]
        dropped = _dropped_table(camera)
        if dropped is not None:
            tables.append(dropped)
    # Not determined beside everything else that was estimated: no table.
    if np.isfinite(fit.gyroscope_matrix.value).all():
        kind = "estimated" if imu_matrices else "held; one step from there says"
        tables.append(
            Table(
                f"IMU: reading = matrix * what the sensor feels + bias ({kind})",
                ["", "x", "y", "z"],
                _matrix_rows("gyroscope", fit.gyroscope_matrix)
                + _matrix_rows("accelerometer", fit.accelerometer_matrix),
            )
        )
    return tables
