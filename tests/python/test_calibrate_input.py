"""What loc-calibrate reads: recordings, and tables that are none."""

from pathlib import Path

import numpy as np
import pytest
from libloc.programs.calibrate_input import InputOptions, merged, read_readings, read_stamps_table
from support import data_folder, turning_body, write_csv

from libloc import DataError


def read(path, sensor="magnetometer", **options):
    return read_readings(Path(path), sensor, InputOptions(**options))


def write(path, text):
    path.write_text(text)
    return path


def test_a_recording_is_what_libloc_reads(tmp_path):
    r = turning_body(50)
    write_csv(tmp_path / "own.csv", r)
    got = read(tmp_path / "own.csv")
    assert np.array_equal(got.gyroscope.rows, r.gyro)
    assert np.array_equal(got.accelerometer.rows, r.force)
    assert np.allclose(got.magnetometer.rows, r.field, rtol=1e-14)
    assert np.array_equal(got.magnetometer.times_ns, r.times_ns)
    assert got.magnetometer.unit == "T"
    assert got.counts["imu.read"] == 50


def test_a_table_without_heading(tmp_path):
    path = write(tmp_path / "raw.csv", "1,2,3\n4,5,6\n\n7,8,9\n")
    got = read(path, columns="mx,my,mz", magnetometer_unit="counts")
    assert got.magnetometer.rows.tolist() == [[1, 2, 3], [4, 5, 6], [7, 8, 9]]
    assert (got.magnetometer.unit, got.magnetometer.times_ns) == ("counts", None)
    got = read(path, columns="mz,mx,my", magnetometer_unit="uT")
    assert got.magnetometer.rows[0].tolist() == pytest.approx([2e-6, 3e-6, 1e-6])
    timed = read(path, columns="mx,my,mz", magnetometer_unit="uT", rate_hz=50)
    assert timed.magnetometer.times_ns.tolist() == [0, 20_000_000, 40_000_000]


def test_units_and_times_in_the_heading(tmp_path):
    """Half an IMU beside a magnetometer is no recording of libloc, but readings all the same."""
    path = write(
        tmp_path / "half.csv",
        "# t [ms], acc_x_mg, acc_y_mg, acc_z_mg, mx [gauss], my [gauss], mz [gauss]\n"
        "1700000000000.000001,0,0,1000,0.1,0.2,0.3\n"
        "1700000000010,0,0,1000,,,\n"
        "1700000000020,0,0,1000,0.4,0.5,0.6\n"
        "1700000000030,0,0,10",
    )
    got = read(path)
    assert got.accelerometer.rows[0].tolist() == pytest.approx([0, 0, 9.80665])
    assert got.accelerometer.times_ns[0] == 1_700_000_000_000_000_001
    assert np.allclose(got.magnetometer.rows, [[1e-5, 2e-5, 3e-5], [4e-5, 5e-5, 6e-5]])
    assert got.magnetometer.times_ns[1] == 1_700_000_000_020_000_000
    assert got.gyroscope is None
    assert got.counts["rows.skipped.no_line_end"] == 1


@pytest.mark.parametrize("before", ["\n", "\ufeff", "\ufeff\n \n", "\r\n"])
def test_what_stands_before_the_heading(tmp_path, before):
    path = tmp_path / "x.csv"
    text = before + "mx [uT],my [uT],mz [uT]\n1,2,3\n2,3,4\n"
    path.write_bytes(text.encode())
    got = read(path)
    assert np.allclose(got.magnetometer.rows, [[1e-6, 2e-6, 3e-6], [2e-6, 3e-6, 4e-6]])
    path.write_bytes((before + "1,2,3\n2,3,4\n").encode())
    got = read(path, columns="mx,my,mz", magnetometer_unit="uT")
    assert len(got.magnetometer) == 2
    path.write_bytes((before + "device_ns,host_ns\n1,2\n3,4\n").encode())
    device, host, _ = read_stamps_table(path, InputOptions())
    assert (device.tolist(), host.tolist()) == ([1, 3], [2, 4])


def test_comments_before_the_heading_where_columns_are_named(tmp_path):
    path = write(tmp_path / "x.csv", "# my recording\n# 3 axes\nX,Y,Z\n1,2,3\n")
    got = read(path, columns="mx,my,mz", magnetometer_unit="uT")
    assert got.magnetometer.rows.tolist() == [pytest.approx([1e-6, 2e-6, 3e-6])]


def test_each_column_has_its_own_unit(tmp_path):
    path = write(tmp_path / "x.csv", "ax [g],ay [m/s^2],az [mg]\n1,2,3000\n")
    got = read(path, "accelerometer").accelerometer
    assert got.rows[0].tolist() == pytest.approx([9.80665, 2, 3 * 9.80665])
    path = write(tmp_path / "y.csv", "ax [g],ay [raw],az [g]\n1,2,3\n")
    with pytest.raises(DataError, match="x in g, y in counts, z in g: all three in counts, or none"):
        read(path, "accelerometer")
    path = write(tmp_path / "z.csv", "ax [g],ay [g],az\n1,2,3\n")
    with pytest.raises(DataError, match="accelerometer, column of z: no unit"):
        read(path, "accelerometer")


def test_real_tables():
    folder = data_folder("magnetometer")
    got = read(folder / "ckexplorer_acc_mag.csv", accelerometer_unit="g", magnetometer_unit="gauss")
    assert len(got.magnetometer) == len(got.accelerometer) == 12_000
    assert np.linalg.norm(got.accelerometer.rows, axis=1).mean() == pytest.approx(9.8, rel=0.05)
    got = read(folder / "jremington_mag3_raw.csv", columns="mx,my,mz", magnetometer_unit="counts")
    assert got.magnetometer.rows[0].tolist() == [9996, -9059, 5700]


def test_text_tables_of_imu_tk_are_merged():
    folder = data_folder("imu-tk-xsens")
    got = merged(
        read(folder / "xsens_acc.mat", "accelerometer", accelerometer_unit="counts"),
        read(folder / "xsens_gyro.mat", "gyroscope", gyroscope_unit="counts"),
    )
    assert len(got.accelerometer) == len(got.gyroscope) == 51_175
    assert got.accelerometer.rows[0].tolist() == [33108, 33329, 36429]
    assert got.gyroscope.times_ns[1] == 39_857_000
    with pytest.raises(DataError, match=r"accelerometer is in .* already"):
        merged(got, read(folder / "xsens_acc.mat", "accelerometer", accelerometer_unit="counts"))


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        ("# my recording\nmx_ut,my_ut,mz_ut\n1,2,3\n", {}, r"x\.csv:1: a comment, not a heading"),
        ("\n# a, b\n1,2,3\n", {}, r"x\.csv:2: a comment, not a heading"),
        ("1,2,3\n", {}, r"x\.csv:1: the first line is numbers.*--columns mx,my,mz"),
        ("1,2,3\n", {"columns": "mx,my"}, "2 of the 3 columns"),
        ("1,2,3\n", {"columns": "mx,my,mx"}, "comes twice"),
        ("1,2,3\n", {"columns": "mx,my,foo"}, "'foo' is not known"),
        ("1,2,3\n", {"columns": "-,-,-"}, "no column holds readings"),
        ("1,2,3\n", {"columns": "mx,my,mz"}, "no unit: give --magnetometer-unit"),
        ("1,2,3\n", {"columns": "mx_ut,my_ut,mz_ut", "magnetometer_unit": "gauss"}, "contradicts"),
        ("1,2,3\n", {"columns": "mx_km,my_km,mz_km"}, "unit 'km' is not known"),
        ("1,2,3\n4,5\n", {"columns": "mx_ut,my_ut,mz_ut"}, r"x\.csv:2: 2 cells, not 3"),
        ("1,2,3\n4,x,6\n", {"columns": "mx_ut,my_ut,mz_ut"}, r"x\.csv:2: magnetometer: '4, x, 6'"),
        ("1,2,3\n4,,6\n", {"columns": "mx_ut,my_ut,mz_ut"}, r"x\.csv:2"),
        ("1,2,3,4\n", {"columns": "t,mx_ut,my_ut,mz_ut"}, "--time-unit"),
        ("1,2,3,4\nx,2,3,4\n", {"columns": "t_s,mx_ut,my_ut,mz_ut"}, r"x\.csv:2: 'x' is no time"),
        ("1,2,3,4\n1e99,2,3,4\n", {"columns": "t_s,mx_ut,my_ut,mz_ut"}, r"x\.csv:2: '1e99' is no time"),
        ("mx,my,mz\n1,2,3\n", {}, "no unit: give --magnetometer-unit"),
        ("mx_ut,my_ut,mz_ut\n", {}, "no readings in it"),
        ("time_ns,weight\n1,2\n", {}, "weight"),
    ],
)
def test_what_cannot_be_read_is_named(tmp_path, text, options, message):
    with pytest.raises(DataError, match=message):
        read(write(tmp_path / "x.csv", text), **options)


def test_absent_sensors_are_named(tmp_path):
    got = read(write(tmp_path / "x.csv", "1,2,3\n"), columns="mx_ut,my_ut,mz_ut")
    with pytest.raises(DataError, match=r"no gyroscope in it; it holds magnetometer \(1\)"):
        got.need("gyroscope")
    with pytest.raises(DataError, match=r"no time in it.*--rate"):
        got.need_times("magnetometer")
    with pytest.raises(DataError, match="no such file"):
        read(tmp_path / "absent.csv")
