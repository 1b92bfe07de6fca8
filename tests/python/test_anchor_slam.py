"""GPS ties the map of SLAM to the Earth: anchor_slam and loc-slam, on a simulated drive."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest
from libloc.programs import slam as program
from support import built_program

import libloc

ORIGIN = (0.761, 0.0251, 150.0)  # of the simulated world


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A car that goes round a block, 20 s: IMU, tracks, GPS and truth as an LCM log, and its rig."""
    folder = tmp_path_factory.mktemp("drive")
    log, rig = folder / "drive.log", folder / "rig.yaml"
    streams = "imu,gps,features,reference"
    command = [built_program("loc-simulate"), "--scenario", "street-car", "--seed", "7", "--duration", "20s"]
    command += ["--streams", streams, "--out", log, "--write-rig", rig]
    subprocess.run(command, check=True, capture_output=True)
    return log, rig


def horizontal_error(run: libloc.AnchoredRun, truth: libloc.ReferenceArrays) -> np.ndarray:
    times = truth.times_ns.astype(float)
    true = np.stack([np.interp(run.time_ns, times, truth.position[:, i]) for i in range(2)], axis=1)
    return np.linalg.norm(run.position[:, :2] - true, axis=1)


@pytest.mark.parametrize("inertial", [True, False])
def test_the_map_comes_to_where_gps_is(drive: tuple[Path, Path], inertial: bool) -> None:
    recording, rig = libloc.read_recording(drive[0]), libloc.read_rig(drive[1])
    motion = libloc.SlamMotion.INERTIAL if inertial else libloc.SlamMotion.CONSTANT_VELOCITY
    options = libloc.SlamOptions(camera=rig.cameras[0], motion=motion)
    run = libloc.run_slam(recording, options, rig=rig)
    anchor = libloc.MapAnchorOptions(inertial, origin=ORIGIN)
    world = libloc.anchor_slam(run, recording.gps, anchor, inertial=inertial, rig=rig)
    assert world.origin == pytest.approx(ORIGIN)
    assert world.georeferenced.all()  # also what came before the start
    assert np.array_equal(world.time_ns, run.time_ns)
    # Fixes share an error of 1.5 m that lasts for minutes.
    error = horizontal_error(world, recording.reference)
    assert np.sqrt(np.mean(error**2)) < (2.5 if inertial else 4)
    sigma = np.sqrt(world.covariance[:, 3, 3] + world.covariance[:, 4, 4])
    assert np.mean(error < 3 * sigma) > 0.95
    assert not np.any(world.status & libloc.EstimateStatus.SCALE_UNKNOWN)
    assert world.counts["anchor.started"] == 1
    if not inertial:
        assert world.scale != pytest.approx(1, abs=0.05)


def test_without_a_way_there_is_no_heading(drive: tuple[Path, Path]) -> None:
    recording, rig = libloc.read_recording(drive[0]), libloc.read_rig(drive[1])
    options = libloc.SlamOptions(camera=rig.cameras[0], motion=libloc.SlamMotion.INERTIAL)
    run = libloc.run_slam(recording, options, rig=rig)
    gps = recording.gps
    none = libloc.anchor_run(
        run, gps.times_ns[:0], gps.latitude_longitude_altitude[:0], libloc.MapAnchorOptions()
    )
    assert none.origin is None
    assert not none.georeferenced.any()
    assert np.array_equal(none.position, run.position)
    with pytest.raises(ValueError, match="position_cov must have"):
        libloc.anchor_run(
            run,
            gps.times_ns,
            gps.latitude_longitude_altitude,
            libloc.MapAnchorOptions(),
            position_cov=np.eye(3),
        )
    with pytest.raises(TypeError, match="no field nonsense"):
        libloc.MapAnchorOptions(nonsense=1)
    with pytest.raises(ValueError, match="gate_probability"):
        libloc.MapAnchorOptions(gate_probability=2)


def test_loc_slam_writes_the_path_on_the_earth(
    drive: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = [str(drive[0]), "--config", str(drive[1]), "--method", "inertial-slam"]
    assert program.main([*arguments, "--output", str(tmp_path), "--no-plots"]) == 0
    assert "world          by GPS: origin 43.602" in capsys.readouterr().out
    assert '<trkpt lat="43.60' in (tmp_path / "world.gpx").read_text()
    world, _ = libloc.read_tum(tmp_path / "world.tum")
    assert len(world) > 300
