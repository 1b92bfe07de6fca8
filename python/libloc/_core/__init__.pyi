"""
libloc's C++ core. Use it through the package libloc.
"""
from __future__ import annotations
import collections.abc
import enum
import numpy
import numpy.typing
import os
import typing
from . import so3
__all__: list[str] = ['AbsoluteError', 'Alignment', 'Association', 'CameraCalibration', 'Consistency', 'DataError', 'DiscreteImuNoise', 'DistortionModel', 'ESTIMATE_CHANNEL', 'ErrorStatistics', 'Estimate', 'EstimateStatus', 'EstimateValid', 'GPS_CHANNEL', 'GpsArrays', 'GpsCalibration', 'GpsFixType', 'GpsMeasurement', 'IMAGE_CHANNEL', 'IMU_CHANNEL', 'ImageMeasurement', 'ImuArrays', 'ImuCalibration', 'ImuMeasurement', 'ImuNoise', 'LcmLogReader', 'MAGNETOMETER_CHANNEL', 'MadgwickFilter', 'MadgwickOptions', 'MadgwickResult', 'MagnetometerArrays', 'MagnetometerCalibration', 'MagnetometerMeasurement', 'MeasurementSource', 'OrientationError', 'Pose3', 'REFERENCE_CHANNEL', 'Random', 'Recording', 'ReferenceArrays', 'ReferenceMeasurement', 'RelativeError', 'Rig', 'SOURCE_STATUS_CHANNEL', 'STATISTICS_CHANNEL', 'Trajectory', 'TriadCalibration', 'absolute_error', 'align_points', 'associate', 'average_consistency', 'beta_from_gyro', 'chi_square_cdf', 'chi_square_quantile', 'discretise', 'error_statistics', 'format_seconds', 'message_fingerprints', 'message_type', 'normalised_error_squared', 'open_broad', 'open_csv', 'open_euroc', 'open_lcm_log', 'orientation_error', 'parse_seconds', 'quantile', 'read_any_rig', 'read_rig', 'read_tum', 'relative_error', 'root_mean_square', 'so3', 'write_rig', 'write_tum']
class DataError(ValueError):
    """
    What is wrong in a file or message: where (file, line or byte), which field, which value.
    """
class Random:
    """
    Seeded random numbers: the same seed gives the same numbers on every machine, and in C++.
    """
    def __init__(self, seed: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def direction(self, count: typing.SupportsInt | typing.SupportsIndex | None = None) -> numpy.typing.NDArray[numpy.float64]:
        """
        Unit vectors, uniform on the sphere: shape (3,), or (count, 3).
        """
    def fork(self, stream: typing.SupportsInt | typing.SupportsIndex) -> Random:
        """
        A generator for an independent part of a simulation.
        """
    def normal(self) -> float:
        """
        One standard normal number.
        """
    def normal3(self, count: typing.SupportsInt | typing.SupportsIndex | None = None) -> numpy.typing.NDArray[numpy.float64]:
        """
        Standard normal vectors: shape (3,), or (count, 3).
        """
    def rotation(self, count: typing.SupportsInt | typing.SupportsIndex | None = None) -> numpy.typing.NDArray[numpy.float64]:
        """
        Quaternions wxyz, uniform on SO(3): shape (4,), or (count, 4).
        """
    def uniform(self, low: typing.SupportsFloat | typing.SupportsIndex = 0.0, high: typing.SupportsFloat | typing.SupportsIndex = 1.0) -> float:
        """
        One number, uniform in [low, high).
        """
class Pose3:
    """
    A rigid transform, SE(3). T_a_b takes coordinates of b to coordinates of a: p_a = T_a_b * p_b. Tangent vectors are xi = (rho, theta) [m, rad].
    """
    @staticmethod
    def exp(xi: numpy.typing.ArrayLike) -> Pose3:
        """
        The group's exponential.
        """
    @staticmethod
    def from_matrix(matrix: numpy.typing.ArrayLike) -> Pose3:
        """
        From a homogeneous matrix (4, 4). ValueError unless it is rigid to 1e-3.
        """
    def __getstate__(self) -> tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]:
        ...
    def __init__(self, rotation_wxyz: numpy.typing.ArrayLike = (1.0, 0.0, 0.0, 0.0), translation: numpy.typing.ArrayLike = (0.0, 0.0, 0.0)) -> None:
        ...
    def __mul__(self, arg0: Pose3) -> Pose3:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: tuple) -> None:
        ...
    def adjoint(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (6, 6) matrix with self * Exp(xi) = Exp(adjoint @ xi) * self.
        """
    def boxminus(self, other: Pose3) -> numpy.typing.NDArray[numpy.float64]:
        """
        xi (6,) with other.boxplus(xi) = self.
        """
    def boxplus(self, xi: numpy.typing.ArrayLike) -> Pose3:
        """
        self * Exp(xi).
        """
    def inverse(self) -> Pose3:
        ...
    def log(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Inverse of exp: (6,).
        """
    def matrix(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Homogeneous matrix (4, 4).
        """
    def transform(self, points: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
        """
        p_a = T_a_b * p_b for points (3,) or (N, 3) [m].
        """
    @property
    def rotation_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Unit quaternion (4,), a copy.
        """
    @rotation_wxyz.setter
    def rotation_wxyz(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def translation(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) [m], a copy.
        """
    @translation.setter
    def translation(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
class ImuNoise:
    """
    Noise of an IMU as continuous densities.
    """
    def __init__(self, *, gyroscope_noise_density: typing.SupportsFloat | typing.SupportsIndex = 0.00017, gyroscope_random_walk: typing.SupportsFloat | typing.SupportsIndex = 2e-05, accelerometer_noise_density: typing.SupportsFloat | typing.SupportsIndex = 0.002, accelerometer_random_walk: typing.SupportsFloat | typing.SupportsIndex = 0.003, gyroscope_bias_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.01, accelerometer_bias_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.2) -> None:
        """
        ValueError names a field that is negative or not finite.
        """
    def check(self) -> None:
        """
        ValueError names a field that is out of range.
        """
    @property
    def accelerometer_bias_sigma(self) -> float:
        """
        [m/s^2], turn-on
        """
    @accelerometer_bias_sigma.setter
    def accelerometer_bias_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def accelerometer_noise_density(self) -> float:
        """
        [m/s^2/sqrt(Hz)], white
        """
    @accelerometer_noise_density.setter
    def accelerometer_noise_density(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def accelerometer_random_walk(self) -> float:
        """
        [m/s^3/sqrt(Hz)], of the bias
        """
    @accelerometer_random_walk.setter
    def accelerometer_random_walk(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gyroscope_bias_sigma(self) -> float:
        """
        [rad/s], turn-on
        """
    @gyroscope_bias_sigma.setter
    def gyroscope_bias_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gyroscope_noise_density(self) -> float:
        """
        [rad/s/sqrt(Hz)], white
        """
    @gyroscope_noise_density.setter
    def gyroscope_noise_density(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gyroscope_random_walk(self) -> float:
        """
        [rad/s^2/sqrt(Hz)], of the bias
        """
    @gyroscope_random_walk.setter
    def gyroscope_random_walk(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class DiscreteImuNoise:
    """
    Deviations of discrete samples.
    """
    @property
    def sigma_accelerometer_bias_step(self) -> float:
        """
        [m/s^2]
        """
    @property
    def sigma_angular_velocity(self) -> float:
        """
        [rad/s]
        """
    @property
    def sigma_gyroscope_bias_step(self) -> float:
        """
        [rad/s]
        """
    @property
    def sigma_specific_force(self) -> float:
        """
        [m/s^2]
        """
class ImuMeasurement:
    """
    One IMU sample, in the body frame.
    """
    def __init__(self, time_ns: typing.SupportsInt | typing.SupportsIndex, angular_velocity: numpy.typing.ArrayLike, specific_force: numpy.typing.ArrayLike) -> None:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def angular_velocity(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) [rad/s]
        """
    @angular_velocity.setter
    def angular_velocity(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def host_time_ns(self) -> int | None:
        """
        Arrival at the host [ns]; None when unknown.
        """
    @host_time_ns.setter
    def host_time_ns(self, arg1: typing.SupportsInt | typing.SupportsIndex | None) -> None:
        ...
    @property
    def sequence(self) -> int:
        """
        Counts the samples of one stream from 0; -1 when unknown.
        """
    @sequence.setter
    def sequence(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def specific_force(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) [m/s^2], at rest +9.81 upwards
        """
    @specific_force.setter
    def specific_force(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def time_ns(self) -> int:
        """
        Time of measurement [ns].
        """
    @time_ns.setter
    def time_ns(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
class MagnetometerMeasurement:
    """
    One magnetometer sample, in the body frame.
    """
    def __init__(self, time_ns: typing.SupportsInt | typing.SupportsIndex, magnetic_field: numpy.typing.ArrayLike) -> None:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def host_time_ns(self) -> int | None:
        """
        Arrival at the host [ns]; None when unknown.
        """
    @host_time_ns.setter
    def host_time_ns(self, arg1: typing.SupportsInt | typing.SupportsIndex | None) -> None:
        ...
    @property
    def magnetic_field(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) [T]
        """
    @magnetic_field.setter
    def magnetic_field(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def sequence(self) -> int:
        """
        Counts the samples of one stream from 0; -1 when unknown.
        """
    @sequence.setter
    def sequence(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def time_ns(self) -> int:
        """
        Time of measurement [ns].
        """
    @time_ns.setter
    def time_ns(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
class ReferenceMeasurement:
    """
    Pose by a reference system, for evaluation. What it does not know is NaN.
    """
    def __init__(self, time_ns: typing.SupportsInt | typing.SupportsIndex, q_world_body_wxyz: numpy.typing.ArrayLike, position: numpy.typing.ArrayLike, velocity: numpy.typing.ArrayLike, score: bool = True) -> None:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def host_time_ns(self) -> int | None:
        """
        Arrival at the host [ns]; None when unknown.
        """
    @host_time_ns.setter
    def host_time_ns(self, arg1: typing.SupportsInt | typing.SupportsIndex | None) -> None:
        ...
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        of body in world (3,) [m]
        """
    @position.setter
    def position(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def q_world_body_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def score(self) -> bool:
        """
        False where the recording says: do not score here.
        """
    @score.setter
    def score(self, arg0: bool) -> None:
        ...
    @property
    def sequence(self) -> int:
        """
        Counts the samples of one stream from 0; -1 when unknown.
        """
    @sequence.setter
    def sequence(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def time_ns(self) -> int:
        """
        Time of measurement [ns].
        """
    @time_ns.setter
    def time_ns(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def velocity(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        in world (3,) [m/s]
        """
    @velocity.setter
    def velocity(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
class GpsFixType(enum.IntEnum):
    """
    Kind of a GPS fix.
    """
    DIFFERENTIAL: typing.ClassVar[GpsFixType]
    FIXED: typing.ClassVar[GpsFixType]
    FIX_2D: typing.ClassVar[GpsFixType]
    FIX_3D: typing.ClassVar[GpsFixType]
    FLOAT: typing.ClassVar[GpsFixType]
    NONE: typing.ClassVar[GpsFixType]
    TIME: typing.ClassVar[GpsFixType]
    @classmethod
    def __new__(cls, value):
        ...
    def __format__(self, format_spec):
        ...
class GpsMeasurement:
    """
    One GPS fix. What the receiver did not say is NaN.
    """
    def __repr__(self) -> str:
        ...
    @property
    def altitude(self) -> float:
        """
        [m] above the ellipsoid
        """
    @property
    def fix(self) -> GpsFixType:
        ...
    @property
    def gps_time_ns(self) -> int | None:
        """
        since 1980-01-06 without leap seconds; None when unknown
        """
    @property
    def host_time_ns(self) -> int | None:
        """
        Arrival at the host [ns]; None when unknown.
        """
    @host_time_ns.setter
    def host_time_ns(self, arg1: typing.SupportsInt | typing.SupportsIndex | None) -> None:
        ...
    @property
    def latitude(self) -> float:
        """
        [rad], WGS 84
        """
    @property
    def longitude(self) -> float:
        """
        [rad]
        """
    @property
    def position_cov(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3, 3) [m^2], east, north, up
        """
    @property
    def satellites(self) -> int:
        """
        used; -1 when unknown
        """
    @property
    def sequence(self) -> int:
        """
        Counts the samples of one stream from 0; -1 when unknown.
        """
    @sequence.setter
    def sequence(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def time_ns(self) -> int:
        """
        Time of measurement [ns].
        """
    @time_ns.setter
    def time_ns(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def velocity_cov(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3, 3) [m^2/s^2]
        """
    @property
    def velocity_enu(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) [m/s]
        """
class ImageMeasurement:
    """
    One picture, raw or JPEG.
    """
    def __repr__(self) -> str:
        ...
    @property
    def camera(self) -> int:
        """
        index of the camera in the rig
        """
    @property
    def data(self) -> bytes:
        """
        bytes of the picture
        """
    @property
    def exposure_ns(self) -> int:
        """
        length of the exposure [ns]; 0 when unknown
        """
    @property
    def fourcc(self) -> str:
        """
        "GREY", "BGR3", "RGB3" or "MJPG"
        """
    @property
    def height_px(self) -> int:
        ...
    @property
    def host_time_ns(self) -> int | None:
        """
        Arrival at the host [ns]; None when unknown.
        """
    @host_time_ns.setter
    def host_time_ns(self, arg1: typing.SupportsInt | typing.SupportsIndex | None) -> None:
        ...
    @property
    def row_stride_bytes(self) -> int:
        """
        0 for JPEG
        """
    @property
    def sequence(self) -> int:
        """
        Counts the samples of one stream from 0; -1 when unknown.
        """
    @sequence.setter
    def sequence(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def time_ns(self) -> int:
        """
        Time of measurement [ns].
        """
    @time_ns.setter
    def time_ns(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def width_px(self) -> int:
        ...
class TriadCalibration:
    """
    corrected = matrix @ (raw - bias)
    """
    def __init__(self) -> None:
        ...
    @property
    def bias(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,), in the sensor's unit
        """
    @bias.setter
    def bias(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def matrix(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3, 3): scale, misalignment, soft iron, rotation
        """
    @matrix.setter
    def matrix(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
class ImuCalibration:
    """
    Rate, noise, and how raw samples are corrected.
    """
    noise: ImuNoise
    def __init__(self) -> None:
        ...
    @property
    def accelerometer(self) -> TriadCalibration:
        """
        [m/s^2]
        """
    @accelerometer.setter
    def accelerometer(self, arg0: TriadCalibration) -> None:
        ...
    @property
    def gyroscope(self) -> TriadCalibration:
        """
        [rad/s]
        """
    @gyroscope.setter
    def gyroscope(self, arg0: TriadCalibration) -> None:
        ...
    @property
    def rate_hz(self) -> float:
        """
        nominal; 0 when unknown
        """
    @rate_hz.setter
    def rate_hz(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class MagnetometerCalibration:
    """
    How raw samples are corrected: hard and soft iron.
    """
    def __init__(self) -> None:
        ...
    @property
    def triad(self) -> TriadCalibration:
        """
        [T], result in body axes
        """
    @triad.setter
    def triad(self, arg0: TriadCalibration) -> None:
        ...
class GpsCalibration:
    """
    Where the antenna is.
    """
    def __init__(self) -> None:
        ...
    @property
    def antenna_in_body(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        lever arm (3,) [m]
        """
    @antenna_in_body.setter
    def antenna_in_body(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
class DistortionModel(enum.Enum):
    """
    What a lens does.
    """
    EQUIDISTANT: typing.ClassVar[DistortionModel]
    NONE: typing.ClassVar[DistortionModel]
    RADTAN: typing.ClassVar[DistortionModel]
    @classmethod
    def __new__(cls, value):
        ...
class CameraCalibration:
    """
    Projection, pose and time offset of one camera.
    """
    T_body_camera: Pose3
    distortion_model: DistortionModel
    name: str
    def __init__(self) -> None:
        ...
    @property
    def distortion(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (4,): k1 k2 p1 p2 (radtan) or k1..k4 (equidistant)
        """
    @distortion.setter
    def distortion(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def height_px(self) -> int:
        ...
    @height_px.setter
    def height_px(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def intrinsics_px(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (4,): fx, fy, cx, cy
        """
    @intrinsics_px.setter
    def intrinsics_px(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def rate_hz(self) -> float:
        """
        nominal; 0 when unknown
        """
    @rate_hz.setter
    def rate_hz(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def time_offset_s(self) -> float:
        """
        t_imu = t_camera + time_offset_s
        """
    @time_offset_s.setter
    def time_offset_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def width_px(self) -> int:
        ...
    @width_px.setter
    def width_px(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
class Rig:
    """
    The sensors of one device; the body frame is the IMU's. A sensor that is absent is None.
    """
    gps: GpsCalibration | None
    imu: ImuCalibration | None
    magnetometer: MagnetometerCalibration | None
    def __init__(self) -> None:
        ...
    def calibrated(self, measurement: ImuMeasurement | MagnetometerMeasurement | ImageMeasurement | GpsMeasurement | ReferenceMeasurement) -> ImuMeasurement | MagnetometerMeasurement | ImageMeasurement | GpsMeasurement | ReferenceMeasurement:
        """
        The measurement as the calibration corrects it.
        """
    def check(self) -> None:
        """
        ValueError names a field that is out of range.
        """
    @property
    def cameras(self) -> list[CameraCalibration]:
        """
        Copies of the cameras: assign a list to change them.
        """
    @cameras.setter
    def cameras(self, arg1: collections.abc.Sequence[CameraCalibration]) -> None:
        ...
class MadgwickOptions:
    """
    Options of MadgwickFilter; every field is a keyword of the constructor: MadgwickOptions(beta=0.041, rest_bias=True), MadgwickOptions.robust(world="NED").
    """
    @staticmethod
    def preset(name: str, **kwargs) -> MadgwickOptions:
        """
        "report" or "robust". ValueError for another name.
        """
    @staticmethod
    def report(**kwargs) -> MadgwickOptions:
        """
        The form of Madgwick's report, beta = 0.1, nothing else.
        """
    @staticmethod
    def robust(**kwargs) -> MadgwickOptions:
        """
        Everything on: for real sensors.
        """
    def __init__(self, **kwargs) -> None:
        """
        The form of the report, with the fields that are named. TypeError for an unknown field, ValueError for a value out of range.
        """
    def __repr__(self) -> str:
        ...
    def check(self) -> None:
        """
        ValueError names a field that is out of range.
        """
    @property
    def accelerometer_time_constant_s(self) -> float:
        """
        Low-pass of the specific force in world axes; 0: none. [s]
        """
    @accelerometer_time_constant_s.setter
    def accelerometer_time_constant_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def alpha(self) -> float:
        """
        Step factor of the report, > 1; infinity is its final form.
        """
    @alpha.setter
    def alpha(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def beta(self) -> float:
        """
        Gain: the rate at which the gradient turns the quaternion. [rad/s]
        """
    @beta.setter
    def beta(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gradient_phase(self) -> float:
        """
        Where in the step force and field are compared with the attitude: 0 start (the report), 1 end.
        """
    @gradient_phase.setter
    def gradient_phase(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def magnetic_dip_tolerance(self) -> float:
        """
        [rad]
        """
    @magnetic_dip_tolerance.setter
    def magnetic_dip_tolerance(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def magnetic_max_rejection_s(self) -> float:
        """
        After this long the field is taken for the new normal. [s]
        """
    @magnetic_max_rejection_s.setter
    def magnetic_max_rejection_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def magnetic_norm_tolerance(self) -> float:
        """
        Relative to the reference.
        """
    @magnetic_norm_tolerance.setter
    def magnetic_norm_tolerance(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def magnetic_reference_time_s(self) -> float:
        """
        Time constant with which the reference follows. [s]
        """
    @magnetic_reference_time_s.setter
    def magnetic_reference_time_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def magnetic_rejection(self) -> bool:
        """
        Reject the magnetometer where norm or dip differ from the learnt reference.
        """
    @magnetic_rejection.setter
    def magnetic_rejection(self, arg0: bool) -> None:
        ...
    @property
    def magnetometer_heading_only(self) -> bool:
        """
        The magnetometer turns the estimate about the vertical only.
        """
    @magnetometer_heading_only.setter
    def magnetometer_heading_only(self, arg0: bool) -> None:
        ...
    @property
    def magnetometer_weight(self) -> float:
        """
        Weight of the magnetometer's gradient against the accelerometer's.
        """
    @magnetometer_weight.setter
    def magnetometer_weight(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_angular_velocity(self) -> float:
        """
        A sample with more is skipped. [rad/s]
        """
    @max_angular_velocity.setter
    def max_angular_velocity(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_gap_s(self) -> float:
        """
        A longer time between IMU samples starts the filter anew. [s]
        """
    @max_gap_s.setter
    def max_gap_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_gyroscope_bias(self) -> float:
        """
        A larger low-passed rate is a slow turn, not a bias. [rad/s]
        """
    @max_gyroscope_bias.setter
    def max_gyroscope_bias(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_heading_age_s(self) -> float:
        """
        So long after the last use of the field the heading still counts as valid. [s]
        """
    @max_heading_age_s.setter
    def max_heading_age_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_magnetometer_age_s(self) -> float:
        """
        Until then a magnetometer sample is used on. [s]
        """
    @max_magnetometer_age_s.setter
    def max_magnetometer_age_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_specific_force(self) -> float:
        """
        With more the step goes without the accelerometer. [m/s^2]
        """
    @max_specific_force.setter
    def max_specific_force(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def motion_bias(self) -> bool:
        """
        Estimate the bias in motion as well, from what the accelerometer keeps correcting.
        """
    @motion_bias.setter
    def motion_bias(self, arg0: bool) -> None:
        ...
    @property
    def motion_bias_noise(self) -> float:
        """
        White noise of the rate of the tilt correction. [rad/s*sqrt(s)]
        """
    @motion_bias_noise.setter
    def motion_bias_noise(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def motion_bias_start_sigma(self) -> float:
        """
        Deviation of the bias at the start. [rad/s]
        """
    @motion_bias_start_sigma.setter
    def motion_bias_start_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def motion_bias_walk(self) -> float:
        """
        By which it walks. [rad/s/sqrt(s)]
        """
    @motion_bias_walk.setter
    def motion_bias_walk(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def rest_bias(self) -> bool:
        """
        Estimate the gyroscope's bias while at rest.
        """
    @rest_bias.setter
    def rest_bias(self, arg0: bool) -> None:
        ...
    @property
    def rest_bias_cutoff_hz(self) -> float:
        """
        Low-pass of the rate that becomes the bias. [Hz]
        """
    @rest_bias_cutoff_hz.setter
    def rest_bias_cutoff_hz(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def rest_bias_sigma(self) -> float:
        """
        Deviation of the bias after a rest. [rad/s]
        """
    @rest_bias_sigma.setter
    def rest_bias_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def rest_low_pass_s(self) -> float:
        """
        Time constant of these low-passes. [s]
        """
    @rest_low_pass_s.setter
    def rest_low_pass_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def rest_max_angular_velocity(self) -> float:
        """
        At rest the rate stays this close to its low-pass. [rad/s]
        """
    @rest_max_angular_velocity.setter
    def rest_max_angular_velocity(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def rest_max_force_change(self) -> float:
        """
        At rest the force stays this close to its low-pass. [m/s^2]
        """
    @rest_max_force_change.setter
    def rest_max_force_change(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def rest_min_duration_s(self) -> float:
        """
        Calm for this long is rest. [s]
        """
    @rest_min_duration_s.setter
    def rest_min_duration_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def soft_gradient(self) -> float:
        """
        Error below which the correction is proportional to the error; 0 is the report. [rad]
        """
    @soft_gradient.setter
    def soft_gradient(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def start_time_s(self) -> float:
        """
        For this long after the start the gain is at least 1/elapsed; 0: none (the report). [s]
        """
    @start_time_s.setter
    def start_time_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def world(self) -> str:
        """
        Axes of world: "ENU", "NWU" or "NED".
        """
    @world.setter
    def world(self, arg1: str) -> None:
        ...
class EstimateValid(enum.IntFlag):
    """
    Which parts of an estimate hold something; the others are NaN.
    """
    ACCELEROMETER_BIAS: typing.ClassVar[EstimateValid]
    COVARIANCE: typing.ClassVar[EstimateValid]
    GYROSCOPE_BIAS: typing.ClassVar[EstimateValid]
    HEADING: typing.ClassVar[EstimateValid]
    ORIENTATION: typing.ClassVar[EstimateValid]
    POSITION: typing.ClassVar[EstimateValid]
    VELOCITY: typing.ClassVar[EstimateValid]
    @classmethod
    def __new__(cls, value):
        ...
    def __and__(self, other):
        ...
    def __format__(self, format_spec):
        ...
    def __invert__(self):
        ...
    def __or__(self, other):
        ...
    def __rand__(self, other):
        ...
    def __ror__(self, other):
        ...
    def __rxor__(self, other):
        ...
    def __xor__(self, other):
        ...
class EstimateStatus(enum.IntFlag):
    """
    What an estimator did with the input since its last estimate, and why; 0 is normal.
    """
    ACCELEROMETER_IGNORED: typing.ClassVar[EstimateStatus]
    AT_REST: typing.ClassVar[EstimateStatus]
    GAP: typing.ClassVar[EstimateStatus]
    INITIALISING: typing.ClassVar[EstimateStatus]
    MAGNETOMETER_DISTURBED: typing.ClassVar[EstimateStatus]
    MAGNETOMETER_IGNORED: typing.ClassVar[EstimateStatus]
    MAGNETOMETER_MISSING: typing.ClassVar[EstimateStatus]
    NOT_FINITE: typing.ClassVar[EstimateStatus]
    OUT_OF_RANGE: typing.ClassVar[EstimateStatus]
    REINITIALISED: typing.ClassVar[EstimateStatus]
    TIME_NOT_INCREASING: typing.ClassVar[EstimateStatus]
    @classmethod
    def __new__(cls, value):
        ...
    def __and__(self, other):
        ...
    def __format__(self, format_spec):
        ...
    def __invert__(self):
        ...
    def __or__(self, other):
        ...
    def __rand__(self, other):
        ...
    def __ror__(self, other):
        ...
    def __rxor__(self, other):
        ...
    def __xor__(self, other):
        ...
class Estimate:
    """
    What an estimator says after one measurement.
    """
    @property
    def accelerometer_bias(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) [m/s^2]
        """
    @property
    def angular_velocity(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) [rad/s], in body axes, bias removed
        """
    @property
    def covariance(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (d, d), of the error (theta [rad, body axes], p, v, bg, ba); d = 0: none
        """
    @property
    def gyroscope_bias(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) [rad/s]
        """
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) [m]
        """
    @property
    def q_world_body_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def sequence(self) -> int:
        ...
    @property
    def status(self) -> EstimateStatus:
        ...
    @property
    def time_ns(self) -> int | None:
        ...
    @property
    def valid(self) -> EstimateValid:
        ...
    @property
    def velocity(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) [m/s]
        """
class MadgwickResult:
    """
    What MadgwickFilter.run gives; row i is the state after sample i.
    """
    @property
    def gyroscope_bias(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [rad/s]; NaN before the filter has started.
        """
    @property
    def magnetometer_used(self) -> int:
        """
        Magnetometer rows up to the last IMU sample's time; give the others to the next call.
        """
    @property
    def q_world_body_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 4), takes body to world; NaN before the filter has started.
        """
    @property
    def status(self) -> numpy.typing.NDArray[numpy.uint32]:
        """
        (N,) uint32, bits of EstimateStatus.
        """
class MadgwickFilter:
    """
    Orientation q_world_body from gyroscope and accelerometer, with or without magnetometer: Madgwick's filter with rest-bias estimation, magnetic rejection and a low-passed accelerometer. Not observable: heading without magnetometer (then relative to the start).
    """
    def __init__(self, options: MadgwickOptions | None = None) -> None:
        """
        options: MadgwickOptions, by default the report's form.
        """
    def counts(self) -> dict[str, int]:
        """
        What was used and what was skipped, and why: {name: number}.
        """
    def estimate(self) -> Estimate:
        ...
    def reset(self) -> None:
        """
        Forgets the past, not the options or the counts.
        """
    def run(self, times_ns: numpy.typing.NDArray[numpy.int64], gyro: numpy.typing.NDArray[numpy.float64], force: numpy.typing.NDArray[numpy.float64], magnetometer: numpy.typing.NDArray[numpy.float64] | None = None, magnetometer_times_ns: numpy.typing.NDArray[numpy.int64] | None = None) -> MadgwickResult:
        """
        All steps of a recording in one call, without the GIL and without copies of the input; the same numbers as step by step, and the next call goes on from here.
        
        times_ns: int64 (N,) [ns]. gyro: float64 (N, 3) [rad/s]. force: float64 (N, 3) specific force [m/s^2], at rest +9.81 upwards.
        magnetometer: float64 [T]. Either (N, 3), one row per IMU sample, rows of NaN where there is none; or (M, 3) with magnetometer_times_ns, int64 (M,), increasing.
        Arrays must be C-contiguous. TypeError or ValueError names the argument, its dtype or shape. KeyboardInterrupt leaves the filter where it was then.
        """
    def update(self, time_ns: typing.SupportsInt | typing.SupportsIndex, gyro: numpy.typing.ArrayLike, force: numpy.typing.ArrayLike) -> EstimateStatus:
        """
        One sample: gyro (3,) [rad/s], force (3,) [m/s^2], at rest +9.81 upwards. Gives the status of this step; input that is skipped (see the status) leaves the state as it was.
        """
    def update_magnetometer(self, time_ns: typing.SupportsInt | typing.SupportsIndex, field: numpy.typing.ArrayLike) -> EstimateStatus:
        """
        One magnetometer sample (3,) [T], before the IMU sample of the same time.
        """
    @property
    def gyroscope_bias(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) [rad/s]; NaN before the filter has started.
        """
    @property
    def initialised(self) -> bool:
        ...
    @property
    def options(self) -> MadgwickOptions:
        ...
    @property
    def q_world_body_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (4,); NaN before the filter has started.
        """
    @property
    def status(self) -> EstimateStatus:
        """
        of the last IMU step
        """
class Trajectory:
    """
    Poses T_world_body over time.
    """
    def __init__(self, times_ns: numpy.typing.NDArray[numpy.int64], q_world_body_wxyz: numpy.typing.NDArray[numpy.float64], position: numpy.typing.NDArray[numpy.float64]) -> None:
        """
        int64 (N,), increasing; float64 (N, 4), unit; float64 (N, 3) [m]. DataError names the index and the value when times do not increase or a pose is not one.
        """
    def __len__(self) -> int:
        ...
    def pose_at(self, time_ns: typing.SupportsInt | typing.SupportsIndex) -> Pose3 | None:
        """
        Interpolated pose; None outside the trajectory.
        """
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [m], a copy
        """
    @property
    def q_world_body_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 4), a copy
        """
    @property
    def times_ns(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (N,) int64, a copy
        """
class Alignment:
    """
    reference = T_reference_estimate * (scale * estimate)
    """
    @property
    def T_reference_estimate(self) -> Pose3:
        ...
    @property
    def extent(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) [m] deviations of the reference points along their principal axes, the largest first
        """
    @property
    def failure(self) -> str:
        """
        Why the points do not determine a transform; empty when they do.
        """
    @property
    def ok(self) -> bool:
        ...
    @property
    def rms_residual(self) -> float:
        """
        [m] after the alignment
        """
    @property
    def scale(self) -> float:
        ...
class ErrorStatistics:
    """
    In the unit of the errors (sse: its square).
    """
    @property
    def count(self) -> int:
        ...
    @property
    def max(self) -> float:
        ...
    @property
    def mean(self) -> float:
        ...
    @property
    def median(self) -> float:
        ...
    @property
    def min(self) -> float:
        ...
    @property
    def rmse(self) -> float:
        ...
    @property
    def sse(self) -> float:
        """
        sum of squares
        """
    @property
    def std(self) -> float:
        """
        of the population
        """
class Association:
    """
    Pairs of poses by time; both trajectories have the same length.
    """
    @property
    def estimate(self) -> Trajectory:
        ...
    @property
    def estimate_index(self) -> numpy.typing.NDArray[numpy.int64]:
        ...
    @property
    def reference(self) -> Trajectory:
        ...
    @property
    def reference_index(self) -> numpy.typing.NDArray[numpy.int64]:
        ...
    @property
    def shared_partner(self) -> int:
        """
        left out: the partner had a nearer one
        """
    @property
    def without_partner(self) -> int:
        """
        samples left out: nothing near in time
        """
class AbsoluteError:
    """
    Absolute trajectory error, after the alignment.
    """
    @property
    def alignment(self) -> Alignment:
        ...
    @property
    def rotation(self) -> ErrorStatistics:
        """
        [rad]
        """
    @property
    def rotation_rad(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N,) [rad]
        """
    @property
    def times_ns(self) -> numpy.typing.NDArray[numpy.int64]:
        ...
    @property
    def translation(self) -> ErrorStatistics:
        """
        [m]; its rmse is the ATE
        """
    @property
    def translation_m(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N,) [m]
        """
class RelativeError:
    """
    Relative pose error: drift over pieces of the trajectory.
    """
    @property
    def first(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        index of the pose where a piece begins
        """
    @property
    def last(self) -> numpy.typing.NDArray[numpy.int64]:
        ...
    @property
    def rotation(self) -> ErrorStatistics:
        """
        [rad]
        """
    @property
    def rotation_rad(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N,) [rad]
        """
    @property
    def translation(self) -> ErrorStatistics:
        """
        [m]
        """
    @property
    def translation_m(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N,) [m]
        """
class OrientationError:
    """
    Error of orientations as the BROAD data set defines it; NaN where one is not finite.
    """
    @property
    def estimate_not_finite(self) -> int:
        """
        left out
        """
    @property
    def heading(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N,) [rad], about world's z
        """
    @property
    def heading_offset(self) -> float:
        """
        [rad] that align_heading removed from the estimate
        """
    @property
    def heading_rmse(self) -> float:
        """
        [rad]
        """
    @property
    def inclination(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N,) [rad]
        """
    @property
    def inclination_rmse(self) -> float:
        """
        [rad]
        """
    @property
    def masked(self) -> int:
        """
        left out: outside the mask
        """
    @property
    def reference_not_finite(self) -> int:
        """
        left out
        """
    @property
    def scored(self) -> int:
        """
        samples in the RMSE
        """
    @property
    def total(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N,) [rad]
        """
    @property
    def total_rmse(self) -> float:
        """
        [rad], of the scored samples
        """
class Consistency:
    """
    Average of NEES or NIS against its bounds.
    """
    @property
    def average(self) -> float:
        """
        its expectation is dof
        """
    @property
    def consistent(self) -> bool:
        ...
    @property
    def dof(self) -> int:
        ...
    @property
    def lower(self) -> float:
        ...
    @property
    def optimistic(self) -> bool:
        """
        the covariance is too small
        """
    @property
    def pessimistic(self) -> bool:
        """
        the covariance is too large
        """
    @property
    def samples(self) -> int:
        ...
    @property
    def upper(self) -> float:
        ...
class ImuArrays:
    """
    IMU samples of a recording; empty when there are none.
    """
    @property
    def angular_velocity(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [rad/s]
        """
    @property
    def specific_force(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [m/s^2], at rest +9.81 upwards
        """
    @property
    def times_ns(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (N,) int64
        """
class MagnetometerArrays:
    """
    Magnetometer samples, empty when there are none.
    """
    @property
    def magnetic_field(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [T]
        """
    @property
    def times_ns(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (N,) int64
        """
class ReferenceArrays:
    """
    Truth, empty when there is none; NaN where it does not know.
    """
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [m], of body in world
        """
    @property
    def q_world_body_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 4)
        """
    @property
    def score(self) -> numpy.typing.NDArray[numpy.bool]:
        """
        (N,) bool; False: do not score here
        """
    @property
    def times_ns(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (N,) int64
        """
    @property
    def velocity(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [m/s], in world
        """
class GpsArrays:
    """
    GPS fixes, empty when there are none; NaN where the receiver did not say.
    """
    @property
    def fix(self) -> numpy.typing.NDArray[numpy.int8]:
        """
        (N,) int8, GpsFixType
        """
    @property
    def latitude_longitude_altitude(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [rad, rad, m]
        """
    @property
    def times_ns(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (N,) int64
        """
    @property
    def velocity_enu(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [m/s]
        """
class Recording:
    """
    A whole recording as arrays.
    """
    @property
    def counts(self) -> dict[str, int]:
        """
        What was read and what was skipped, and why.
        """
    @property
    def gps(self) -> GpsArrays:
        ...
    @property
    def images(self) -> int:
        """
        How many pictures there were; iterate over a source to get them.
        """
    @property
    def imu(self) -> ImuArrays:
        ...
    @property
    def magnetometer(self) -> MagnetometerArrays:
        ...
    @property
    def reference(self) -> ReferenceArrays:
        ...
class MeasurementSource:
    """
    Iterates over the measurements of a recording in time order, in constant memory. DataError names file, line or byte, field and value when it cannot be read on.
    """
    def __iter__(self) -> typing.Any:
        ...
    def __next__(self) -> ImuMeasurement | MagnetometerMeasurement | ImageMeasurement | GpsMeasurement | ReferenceMeasurement:
        ...
    def counts(self) -> dict[str, int]:
        """
        What was read and what was skipped, and why: {name: number}.
        """
    def read_all(self) -> Recording:
        """
        The rest of the recording as arrays.
        """
class LcmLogReader:
    """
    Iterates over the events of an LCM log: (event number, log time [us since 1970], channel, data). Damage is skipped to the next event and reported by damage().
    """
    def __init__(self, path: os.PathLike | str | bytes) -> None:
        """
        DataError when the file is missing, not a regular file, or empty.
        """
    def __iter__(self) -> typing.Any:
        ...
    def __next__(self) -> tuple[int, int, str, bytes]:
        ...
    def damage(self) -> dict[str, int]:
        """
        What was not readable so far; empty when all was.
        """
def absolute_error(estimate: Trajectory, reference: Trajectory, alignment: str = 'se3') -> AbsoluteError:
    """
    Of paired trajectories (see associate). alignment: "se3", "sim3", "yaw" or "none". DataError when the poses do not determine it.
    """
def align_points(estimate: numpy.typing.NDArray[numpy.float64], reference: numpy.typing.NDArray[numpy.float64], alignment: str = 'se3') -> Alignment:
    """
    Least-squares transform between points (N, 3) [m] that belong together (Umeyama): "se3", "sim3" (with scale), "yaw" (turn about z and translation) or "none".
    """
def associate(estimate: Trajectory, reference: Trajectory, *, max_difference_ns: typing.SupportsInt | typing.SupportsIndex = 10000000, estimate_time_offset_ns: typing.SupportsInt | typing.SupportsIndex = 0, interpolate_reference: bool = False, one_to_one: bool = True) -> Association:
    """
    Pairs each pose of the shorter trajectory with the nearest in time of the other. DataError when nothing pairs.
    """
def average_consistency(values: numpy.typing.NDArray[numpy.float64], dof: typing.SupportsInt | typing.SupportsIndex, probability: typing.SupportsFloat | typing.SupportsIndex = 0.95) -> Consistency:
    """
    Average of independent values (N,) of NEES or NIS against the bounds of a consistent estimator.
    """
def beta_from_gyro(noise: ImuNoise, bias_residual: typing.SupportsFloat | typing.SupportsIndex, scale_error: typing.SupportsFloat | typing.SupportsIndex, max_rate: typing.SupportsFloat | typing.SupportsIndex, dt_s: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    beta [rad/s] that covers the rates by which the gyroscope can be wrong: bias_residual [rad/s], scale_error (relative) at max_rate [rad/s], and noise at samples dt_s [s] apart.
    """
def chi_square_cdf(x: typing.SupportsFloat | typing.SupportsIndex, dof: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    P(X <= x) of the chi-square distribution. ValueError unless dof > 0.
    """
def chi_square_quantile(probability: typing.SupportsFloat | typing.SupportsIndex, dof: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    x with P(X <= x) = probability. ValueError unless 0 <= probability < 1 and dof > 0.
    """
def discretise(noise: ImuNoise, dt_s: typing.SupportsFloat | typing.SupportsIndex) -> DiscreteImuNoise:
    """
    Deviations of samples dt_s [s] apart.
    """
def error_statistics(errors: numpy.typing.NDArray[numpy.float64]) -> ErrorStatistics:
    """
    Of float64 errors (N,). ValueError when empty or not finite.
    """
def format_seconds(time_ns: typing.SupportsInt | typing.SupportsIndex) -> str:
    """
    Nanoseconds as seconds with nine decimals.
    """
def message_fingerprints() -> dict[str, int]:
    """
    Fingerprint of each LCM type of package loc, as the C++ library has it.
    """
def message_type(data: bytes) -> str | None:
    """
    Name of the type of package loc whose encoded message this is, "imu_t"; None for other types. DataError when the bytes are not exactly one message of that type.
    """
def normalised_error_squared(error: numpy.typing.ArrayLike, covariance: numpy.typing.ArrayLike) -> float:
    """
    e^T P^-1 e (NEES, NIS) of error (d,) and covariance (d, d). ValueError unless P is symmetric and positive definite.
    """
def open_broad(path: os.PathLike | str | bytes, *, reference: bool = True) -> MeasurementSource:
    """
    A trial of the BROAD data set (.mat).
    """
def open_csv(path: os.PathLike | str | bytes, *, time_unit: str = '', angular_velocity_unit: str = '', specific_force_unit: str = '', magnetic_field_unit: str = '', tesla_per_unit: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> MeasurementSource:
    """
    A CSV file whose first line names columns and units: time_ns or "t [s]", wx wy wz, ax ay az, mx my mz, qw qx qy qz, px py pz ... The units given here are for headings that have none.
    """
def open_euroc(folder: os.PathLike | str | bytes, *, reference: bool = True, magnetometer: bool = True) -> MeasurementSource:
    """
    A EuRoC / ASL recording: the folder that holds mav0.
    """
def open_lcm_log(path: os.PathLike | str | bytes) -> MeasurementSource:
    """
    The measurements in an LCM log, in the order of the log: package loc's types and ASPN-23's. What cannot be decoded is counted.
    """
def orientation_error(estimate_wxyz: numpy.typing.NDArray[numpy.float64], reference_wxyz: numpy.typing.NDArray[numpy.float64], mask: numpy.typing.NDArray[numpy.bool] | None = None, *, align_heading: bool = False) -> OrientationError:
    """
    float64 (N, 4) of the same times, NaN where unknown; mask: bool (N,), where to score. align_heading removes the turn about z that they have in common: for a heading that is relative to the start. DataError when nothing is left to score.
    """
def parse_seconds(text: str) -> int:
    """
    Decimal seconds to int nanoseconds, exactly. ValueError for any other text.
    """
def quantile(values: numpy.typing.NDArray[numpy.float64], probability: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    Quantile of float64 values (N,), interpolated linearly. ValueError when empty or probability is not in [0, 1].
    """
def read_any_rig(path: os.PathLike | str | bytes) -> Rig:
    """
    rig.yaml, Kalibr's camchain or imu.yaml, EuRoC's sensor.yaml: whichever it is.
    """
def read_rig(path: os.PathLike | str | bytes) -> Rig:
    """
    rig.yaml. DataError names file, line, key and value.
    """
def read_tum(path: os.PathLike | str | bytes) -> tuple[Trajectory, dict[str, int]]:
    """
    A trajectory in TUM's format, and what was read and skipped. DataError names file, line and value.
    """
def relative_error(estimate: Trajectory, reference: Trajectory, *, delta: typing.SupportsFloat | typing.SupportsIndex = 1.0, unit: str = 'frames', all_pairs: bool = False, relative_tolerance: typing.SupportsFloat | typing.SupportsIndex = 0.1, pairs_from_reference: bool = False) -> RelativeError:
    """
    Of paired trajectories, over pieces of length delta: "frames", "seconds" or "metres".
    """
def root_mean_square(values: numpy.typing.NDArray[numpy.float64]) -> float:
    """
    Root mean square of float64 values (N,). ValueError when empty.
    """
def write_rig(path: os.PathLike | str | bytes, rig: Rig) -> None:
    """
    Writes rig.yaml; read_rig gives the same numbers back.
    """
def write_tum(path: os.PathLike | str | bytes, trajectory: Trajectory) -> None:
    """
    Writes a trajectory in TUM's format.
    """
ESTIMATE_CHANNEL: str = 'LOC_ESTIMATE'
GPS_CHANNEL: str = 'LOC_GPS'
IMAGE_CHANNEL: str = 'LOC_IMAGE'
IMU_CHANNEL: str = 'LOC_IMU'
MAGNETOMETER_CHANNEL: str = 'LOC_MAGNETOMETER'
REFERENCE_CHANNEL: str = 'LOC_REFERENCE'
SOURCE_STATUS_CHANNEL: str = 'LOC_SOURCE_STATUS'
STATISTICS_CHANNEL: str = 'LOC_STATISTICS'
