"""Paths on the Earth: files that other people's parsers read, with the values that went in."""

import json
import xml.etree.ElementTree as ET

import numpy as np
import pytest

import libloc

GPX = "{http://www.topografix.com/GPX/1/1}"
KML = "{http://www.opengis.net/kml/2.2}"
GX = "{http://www.google.com/kml/ext/2.2}"
LOC = "{urn:libloc:geo:1}"
NAME = "a <b> & \"c\" 'd' ü 東 \U0001f697 ]]>"


@pytest.fixture
def path():
    rng = np.random.default_rng(1)
    n = 50
    places = np.column_stack(
        [np.deg2rad(47 + 1e-3 * rng.random(n)), np.deg2rad(8 + 1e-3 * rng.random(n)), 400 + rng.random(n)]
    )
    times = 1_790_000_000_000_000_000 + np.arange(n, dtype=np.int64) * 100_000_000
    return places, times, rng.random(n), rng.random(n)


def test_gpx(tmp_path, path):
    places, times, horizontal, vertical = path
    libloc.write_gpx(
        tmp_path / "x.gpx",
        places,
        utc_ns=times,
        sigma_horizontal=horizontal,
        sigma_vertical=vertical,
        segments=[20],
        name=NAME,
        description="d",
    )
    root = ET.parse(tmp_path / "x.gpx").getroot()
    assert root.tag == GPX + "gpx"
    assert root.attrib["version"] == "1.1" and root.attrib["creator"]
    track = root.find(GPX + "trk")
    # The order that the schema asks for.
    assert [child.tag for child in track] == [GPX + "name", GPX + "desc", GPX + "trkseg", GPX + "trkseg"]
    assert track.find(GPX + "name").text == NAME
    assert [len(s) for s in track.findall(GPX + "trkseg")] == [20, 30]
    points = list(track.iter(GPX + "trkpt"))
    assert [child.tag for child in points[0]] == [GPX + "ele", GPX + "time", GPX + "extensions"]
    read = np.array(
        [[float(p.attrib["lat"]), float(p.attrib["lon"]), float(p.find(GPX + "ele").text)] for p in points]
    )
    np.testing.assert_allclose(np.deg2rad(read[:, :2]), places[:, :2], atol=1e-11)
    np.testing.assert_allclose(read[:, 2], places[:, 2], atol=6e-4)
    stamps = np.array([np.datetime64(p.find(GPX + "time").text.rstrip("Z"), "ns") for p in points])
    np.testing.assert_array_equal(stamps.astype(np.int64), times)
    sigma = [float(p.find(f"{GPX}extensions/{LOC}sigma_horizontal").text) for p in points]
    np.testing.assert_allclose(sigma, horizontal, atol=6e-4)


def test_kml(tmp_path, path):
    places, times, _, _ = path
    libloc.write_kml(tmp_path / "x.kml", places, utc_ns=times, segments=[1], name=NAME, geoid_height=48.0)
    root = ET.parse(tmp_path / "x.kml").getroot()
    assert root.tag == KML + "kml"
    placemark = root.find(f"{KML}Document/{KML}Placemark")
    assert placemark.find(KML + "name").text == NAME
    tracks = placemark.find(GX + "MultiTrack").findall(GX + "Track")
    assert [len(t.findall(KML + "when")) for t in tracks] == [1, 49]
    read = np.array([[float(v) for v in c.text.split()] for t in tracks for c in t.findall(GX + "coord")])
    np.testing.assert_allclose(np.deg2rad(read[:, 1]), places[:, 0], atol=1e-11)
    np.testing.assert_allclose(read[:, 2], places[:, 2] - 48, atol=6e-4)

    libloc.write_kml(tmp_path / "y.kml", places)
    line = ET.parse(tmp_path / "y.kml").find(f".//{KML}LineString/{KML}coordinates").text.split()
    assert len(line) == 50
    assert all(len(c.split(",")) == 3 for c in line)


def test_geojson(tmp_path, path):
    places, times, horizontal, _ = path
    places[:, 1] = np.deg2rad(179.9) + np.arange(50) * np.deg2rad(0.01)  # over the antimeridian
    libloc.write_geojson(tmp_path / "x.geojson", places, utc_ns=times, sigma_horizontal=horizontal, name=NAME)
    collection = json.loads((tmp_path / "x.geojson").read_text(encoding="utf-8"))
    assert collection["type"] == "FeatureCollection"
    (feature,) = collection["features"]
    assert feature["properties"]["name"] == NAME
    geometry = feature["geometry"]
    assert geometry["type"] == "MultiLineString"
    first, second = (np.array(line) for line in geometry["coordinates"])
    assert len(first) + len(second) in (51, 52)  # the point at 180 degrees may be one of the path
    assert first[-1][0] == 180 and second[0][0] == -180
    assert np.all(np.abs(np.diff(first[:, 0])) < 1) and np.all(np.abs(np.diff(second[:, 0])) < 1)
    properties = feature["properties"]
    for key in ("coordTimes", "sigma_horizontal_m", "sigma_vertical_m"):
        assert [len(part) for part in properties[key]] == [len(first), len(second)]
    assert properties["sigma_vertical_m"][0][0] is None


def test_wrong_input(tmp_path, path):
    places, times, _, _ = path
    file = tmp_path / "x.gpx"
    with pytest.raises(ValueError, match="utc_ns"):
        libloc.write_gpx(file, places, utc_ns=times[:-1])
    with pytest.raises(ValueError, match="segments"):
        libloc.write_gpx(file, places, segments=[50])
    with pytest.raises(ValueError, match=r"points\[3\]"):
        places[3, 0] = np.nan
        libloc.write_gpx(file, places)
    with pytest.raises(ValueError, match="none"):
        libloc.write_gpx(file, np.zeros((0, 3)))
    assert not file.exists()
