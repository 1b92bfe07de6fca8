"""For the tests of loc-view: messages of a short ride, logs of them, a stream that keeps what is drawn."""

import io
from collections import Counter

import loc
import numpy as np
from libloc.lcm_log import LogWriter
from libloc.view import intake, logs, pictures
from libloc.view.plots import PlotDrawing
from libloc.view.recorder import Recorder
from libloc.view.scene import Scene
from libloc.view.space import SpaceDrawing
from PIL import Image
from scipy.spatial.transform import Rotation

import libloc

START = 1_700_000_000_000_000_000
OFFSET_NS = 5_000_000  # of the camera's clock
WIDTH, HEIGHT = 160, 120
NAN = float("nan")
ORIGIN = (np.deg2rad(48.0), np.deg2rad(11.0), 500.0)


# ---- messages
def stamped(kind, time_ns, sequence=0):
    m = kind()
    m.time_ns, m.host_time_ns, m.sequence = int(time_ns), int(time_ns), sequence
    return m


def jpeg(shade=128):
    file = io.BytesIO()
    pixels = np.full((HEIGHT, WIDTH), shade, dtype=np.uint8)
    pixels[::7] = 20
    Image.fromarray(pixels).save(file, "JPEG")
    return file.getvalue()


def image(time_ns, sequence, data=None, camera=0):
    m = stamped(loc.image_t, time_ns, sequence)
    m.camera, m.width, m.height = camera, WIDTH, HEIGHT
    m.pixelformat = loc.image_t.PIXEL_FORMAT_MJPEG
    m.data = jpeg() if data is None else data
    m.size = len(m.data)
    return m


def frame(time_ns, sequence, place=(0.0, 0.0, 0.0)):
    """Three features: used, expected and not used, new (without expectation)."""
    m = stamped(loc.slam_frame_t, time_ns, sequence)
    m.camera_position, m.q_world_camera_wxyz = list(place), [0.5, -0.5, 0.5, -0.5]
    m.size = 3
    m.feature_id, m.feature_converted = [1, 2, 3], [True, False, False]
    m.feature_state = [m.STATE_MEASURED, m.STATE_PREDICTED, m.STATE_NEW]
    m.u_px, m.v_px = [10.0, NAN, 50.0], [20.0, NAN, 60.0]
    m.predicted_u_px, m.predicted_v_px = [11.0, 30.0, NAN], [20.0, 40.0, NAN]
    m.estimated_u_px = m.estimated_v_px = [NAN] * 3
    m.innovation_cov = [[4.0, 0.0, 1.0], [9.0, 3.0, 4.0], [NAN] * 3]
    m.inverse_depth = m.sigma_inverse_depth = [0.1, 0.1, 0.1]
    m.map_size, m.visible, m.measured, m.rejected, m.added = 3, 2, 1, 0, 1
    m.reprojection_before_px, m.reprojection_after_px, m.nis, m.nis_dim = 1.5, 0.5, 3.0, 2
    m.time_spent_s = 0.002
    return m


def estimate(time_ns, sequence, position, status=0, method="inertial-slam"):
    m = stamped(loc.estimate_t, time_ns, sequence)
    m.publish_time_ns = m.host_time_ns + 4_000_000
    m.method, m.world = method, "ENU"
    m.valid = m.VALID_ORIENTATION | m.VALID_HEADING | m.VALID_POSITION | m.VALID_COVARIANCE
    m.status = status
    m.q_world_body_wxyz = [1.0, 0.0, 0.0, 0.0]
    m.position = list(position)
    m.covariance_dim = 9
    m.covariance = np.diag([1e-4, 1e-4, 4e-4, 0.01, 0.04, 0.09, 1, 1, 1]).tolist()
    return m


def where(s):
    return np.array([2.0 * s, np.sin(s), 1.0])


def elsewhere(position):
    """In the reference's own world."""
    return Rotation.from_euler("z", 1.0).apply(position) + np.array([5.0, 6.0, 7.0])


def messages(seconds=1.0):
    """(channel, message) in the order of time: a second has 10 pictures with frames, 200 estimates."""
    out = []
    for i in range(round(10 * seconds)):
        t = START + i * 100_000_000
        out.append((t, "LOC_IMAGE", image(t - OFFSET_NS, i)))
        out.append((t + 2, "LOC_SLAM_FRAME", frame(t, i, where(0.1 * i))))
    for i in range(round(200 * seconds)):
        t = START + i * 5_000_000
        status = loc.estimate_t.STATUS_FEW_FEATURES if 40 <= i < 80 and i % 2 == 0 else 0
        out.append((t + 1, "LOC_ESTIMATE", estimate(t, i, where(0.005 * i), status)))
        truth = stamped(loc.reference_t, t, i)
        truth.position = elsewhere(where(0.005 * i)).tolist()
        truth.velocity, truth.q_world_body_wxyz = [NAN] * 3, [1.0, 0.0, 0.0, 0.0]
        out.append((t, "LOC_REFERENCE", truth))
    points = stamped(loc.map_points_t, START + 500_000_000)
    points.size, points.point_id = 2, [1, 2]
    points.position = [[5.0, 0.0, 1.0], [0.0, 50.0, 1.0]]
    points.position_cov = [
        np.diag([0.06, 0.03, 0.14]).ravel().tolist(),
        np.diag([900.0] * 3).ravel().tolist(),
    ]
    out.append((points.time_ns, "LOC_MAP", points))
    status = loc.estimator_status_t()
    status.measurement_time_ns, status.method = START + 300_000_000, "inertial-slam"
    status.size, status.condition, status.since_s = 1, ["no GPS"], [0.3]
    out.append((status.measurement_time_ns, "LOC_ESTIMATOR_STATUS", status))
    frame_ = libloc.LocalFrame(*ORIGIN)
    for i in range(round(5 * seconds)):
        t = START + i * 200_000_000
        fix = stamped(loc.gps_fix_t, t, i)
        fix.fix_type = fix.FIX_3D
        fix.latitude, fix.longitude, fix.altitude = frame_.to_geodetic(where(0.2 * i)).tolist()
        fix.position_cov = np.diag([1.0, 1.0, 4.0]).tolist()
        out.append((t, "LOC_GPS", fix))
    return [(channel, m) for _, channel, m in sorted(out, key=lambda one: one[0])]


def fusion(time_ns):
    m = stamped(loc.fusion_t, time_ns)
    m.origin_latitude, m.origin_longitude, m.origin_altitude = ORIGIN
    return m


def write(path, events):
    with LogWriter(path) as log:
        for channel, m in events:
            log.write(channel, m, log_time_us=START // 1000)
    return path


def ride_log(folder):
    return write(folder / "ride.log", messages())


def camera_rig(folder):
    camera = libloc.CameraCalibration()
    camera.name = "cam0"
    camera.width_px, camera.height_px, camera.intrinsics_px = WIDTH, HEIGHT, [100, 100, 79.5, 59.5]
    camera.time_offset_s = 1e-9 * OFFSET_NS
    rig = libloc.Rig()
    rig.cameras = [camera]
    libloc.write_rig(folder / "rig.yaml", rig)
    return folder / "rig.yaml"


# ---- a stream that keeps what it gets
class Stream:
    def __init__(self):
        self.logged = []  # entity, time of measurement or None, archetypes
        self.rows = {}
        self._stamp = None

    def set_log_time_enabled(self, on):
        assert not on

    set_log_tick_enabled = set_log_time_enabled

    def set_time(self, name, duration=None, sequence=None):
        if sequence is not None:
            self._stamp = sequence
        else:
            assert name == "time"
            self.since_start_ns = int(duration / np.timedelta64(1, "ns"))

    def log(self, entity, *what, static=False):
        self.logged.append((entity, None if static else self._stamp, what))

    def send_columns(self, entity, indexes, columns):
        times = indexes[1].times.to_pylist()
        values = next(iter(columns)).as_arrow_array().to_pylist()
        self.rows.setdefault(entity, []).extend(zip(times, values, strict=True))

    def of(self, entity):
        """Without what holds at all times."""
        return [
            (time_ns, what[0])
            for name, time_ns, what in self.logged
            if name == entity and time_ns is not None
        ]


def values(batch):
    return np.array(batch.as_arrow_array().to_pylist(), dtype=float)


def drawn(*paths, align="auto", **options):
    """Stream, counts of logs that were drawn into it."""
    import rerun as rr

    stream, channels, window = Stream(), intake.channels_of([]), logs.Window(**options)
    found = logs.survey(paths, intake.Intake(channels), 0, window, counts := Counter())
    out = Recorder(rr, stream, found.start_ns)
    scene = Scene(
        out,
        SpaceDrawing(out, None, 0.1),
        PlotDrawing(out),
        pictures.PictureDrawing(out, 0, OFFSET_NS, None, 85),
        30.0,
    )
    scene.space.align, _ = logs.alignment(found, align)
    taken = intake.Intake(channels)
    logs.draw(paths, taken, found, window, scene)
    return stream, scene.counts + taken.counts + counts
