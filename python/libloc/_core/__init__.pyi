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
__all__: list[str] = ['AbsoluteError', 'AccelerometerFit', 'AccelerometerOptions', 'Alignment', 'AllanFit', 'AllanOptions', 'AllanTerm', 'Association', 'CameraCalibration', 'ClockCalibration', 'ClockCalibrationResult', 'ClockChain', 'ClockLine', 'ClockModel', 'Consistency', 'CounterUnwrapper', 'DataError', 'DiscreteImuNoise', 'DistortionModel', 'ESTIMATE_CHANNEL', 'EllipsoidAdvice', 'EllipsoidCollector', 'EllipsoidFit', 'EllipsoidOptions', 'ErrorStatistics', 'Estimate', 'EstimateStatus', 'EstimateValid', 'GPS_CHANNEL', 'GpsArrays', 'GpsCalibration', 'GpsClock', 'GpsFixType', 'GpsMeasurement', 'GyroscopeFit', 'GyroscopeOptions', 'IMAGE_CHANNEL', 'IMU_CHANNEL', 'ImageMeasurement', 'ImuAllan', 'ImuArrays', 'ImuCalibration', 'ImuMeasurement', 'ImuNoise', 'ImuNoiseFit', 'LcmLogReader', 'MAGNETOMETER_CHANNEL', 'MadgwickFilter', 'MadgwickOptions', 'MadgwickResult', 'MagnetometerAlignment', 'MagnetometerAlignmentOptions', 'MagnetometerArrays', 'MagnetometerCalibration', 'MagnetometerMeasurement', 'MeasurementSource', 'NO_TIME', 'NmeaFixes', 'OrientationError', 'Pose3', 'Quality', 'REFERENCE_CHANNEL', 'Random', 'Recording', 'ReferenceArrays', 'ReferenceMeasurement', 'RelativeError', 'RestNoise', 'Rig', 'SOURCE_STATUS_CHANNEL', 'STATISTICS_CHANNEL', 'StillSegment', 'Stillness', 'StillnessDetector', 'StillnessOptions', 'TimeOffsetResult', 'Trajectory', 'TriadCalibration', 'TriadQuality', 'Verdict', 'absolute_error', 'align_magnetometer', 'align_points', 'aligned', 'allan_fit', 'analyse_imu_noise', 'associate', 'average_consistency', 'beta_from_gyro', 'calibrate_clock', 'chi_square_cdf', 'chi_square_quantile', 'discretise', 'error_statistics', 'estimate_time_offset', 'find_stillness', 'fit_accelerometer', 'fit_accelerometer_poses', 'fit_ellipsoid', 'fit_gyroscope', 'fit_gyroscope_bias', 'format_seconds', 'gps_from_unix', 'imu_noise_from', 'leap_seconds_known_until', 'local_positions', 'message_fingerprints', 'message_type', 'normalised_error_squared', 'open_broad', 'open_csv', 'open_euroc', 'open_lcm_log', 'open_nmea', 'orientation_error', 'parse_nmea', 'parse_seconds', 'quantile', 'read_any_rig', 'read_rig', 'read_tum', 'relative_error', 'root_mean_square', 'simulate_clock', 'simulate_gps_time', 'so3', 'unix_from_gps', 'update_rig', 'write_rig', 'write_tum']
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
class Verdict(enum.IntEnum):
    """
    What a calibration says about itself, from best to worst. REFUSED: not to be used unless the user insists.
    """
    FAIR: typing.ClassVar[Verdict]
    OK: typing.ClassVar[Verdict]
    REFUSED: typing.ClassVar[Verdict]
    WARN: typing.ClassVar[Verdict]
    @classmethod
    def __new__(cls, value):
        ...
    def __format__(self, format_spec):
        ...
class Quality:
    """
    Verdict of a calibration on itself, and why.
    """
    def __repr__(self) -> str:
        ...
    @property
    def reasons(self) -> list[str]:
        """
        complete sentences; empty when all is well
        """
    @property
    def usable(self) -> bool:
        """
        False when refused
        """
    @property
    def verdict(self) -> Verdict:
        ...
class TriadQuality:
    """
    How a triad's calibration was found, and how far it may be trusted. A deviation that was not estimated is NaN.
    """
    verdict: Verdict
    def __init__(self) -> None:
        ...
    @property
    def bias_sigma(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        deviation of the bias (3,), in its unit
        """
    @bias_sigma.setter
    def bias_sigma(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def matrix_sigma(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        deviation of each entry (3, 3)
        """
    @matrix_sigma.setter
    def matrix_sigma(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def method(self) -> str:
        """
        "robust", "still-poses", ...
        """
    @method.setter
    def method(self, arg0: str) -> None:
        ...
    @property
    def reasons(self) -> list[str]:
        """
        Copies of the sentences, one line each: assign a list to change them.
        """
    @reasons.setter
    def reasons(self, arg1: collections.abc.Sequence[str]) -> None:
        ...
    @property
    def residual_rms(self) -> float:
        """
        of the norm, relative to the field's norm
        """
    @residual_rms.setter
    def residual_rms(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def samples(self) -> int:
        """
        readings (of still poses: poses) that were used
        """
    @samples.setter
    def samples(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
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
    @property
    def quality(self) -> TriadQuality | None:
        """
        How it was found; None when nobody has said.
        """
    @quality.setter
    def quality(self, arg0: TriadQuality | None) -> None:
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
    def noise_measured(self) -> list[str]:
        """
        Copies of the names of the fields of noise that were measured; the others are guesses.
        """
    @noise_measured.setter
    def noise_measured(self, arg1: collections.abc.Sequence[str]) -> None:
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
    Where the antenna is, and how late its fixes are stamped.
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
    @property
    def time_offset_s(self) -> float:
        """
        t_imu = t_gps + time_offset_s
        """
    @time_offset_s.setter
    def time_offset_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def time_offset_sigma_s(self) -> float:
        """
        its deviation; NaN: not measured
        """
    @time_offset_sigma_s.setter
    def time_offset_sigma_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
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
class ClockCalibration:
    """
    What is known of the clock that stamps a stream. A figure that is not known is NaN.
    """
    def __init__(self, stream: str, reference: str = 'host') -> None:
        ...
    def check(self) -> None:
        """
        ValueError names the stream and the field.
        """
    @property
    def jitter_p99_s(self) -> float:
        """
        99 % of arrivals are at most that late [s]
        """
    @jitter_p99_s.setter
    def jitter_p99_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def jitter_rms_s(self) -> float:
        """
        of arrivals after the earliest possible (the lower envelope) [s]
        """
    @jitter_rms_s.setter
    def jitter_rms_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def offset_sigma_s(self) -> float:
        """
        deviation of a time that was put on the reference clock [s]
        """
    @offset_sigma_s.setter
    def offset_sigma_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def reference(self) -> str:
        """
        the clock it was compared with: "host", "gps"
        """
    @reference.setter
    def reference(self, arg0: str) -> None:
        ...
    @property
    def skew_ppm(self) -> float:
        """
        seconds of the reference per second of the stream's clock, less 1 [1e-6]
        """
    @skew_ppm.setter
    def skew_ppm(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def skew_sigma_ppm(self) -> float:
        ...
    @skew_sigma_ppm.setter
    def skew_sigma_ppm(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def stream(self) -> str:
        """
        "imu", "gps", a camera's name, ...
        """
    @stream.setter
    def stream(self, arg0: str) -> None:
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
    def doubts(self) -> list[tuple[str, Verdict, str]]:
        """
        (block, verdict, sentence) for each calibration that was refused and written all the same, or came with a warning.
        """
    @property
    def cameras(self) -> list[CameraCalibration]:
        """
        Copies of the cameras: assign a list to change them.
        """
    @cameras.setter
    def cameras(self, arg1: collections.abc.Sequence[CameraCalibration]) -> None:
        ...
    @property
    def clocks(self) -> list[ClockCalibration]:
        """
        Copies of the clocks: assign a list to change them.
        """
    @clocks.setter
    def clocks(self, arg1: collections.abc.Sequence[ClockCalibration]) -> None:
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
class EllipsoidOptions:
    """
    How an ellipsoid is fitted, and where the verdicts change.
    """
    def __init__(self, *, method: str = 'robust', reference_norm: typing.SupportsFloat | typing.SupportsIndex = 0.0, shape_prior_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.2, tukey_c: typing.SupportsFloat | typing.SupportsIndex = 4.685, outlier_share: typing.SupportsFloat | typing.SupportsIndex = 0.02, max_iterations: typing.SupportsInt | typing.SupportsIndex = 100, seed: typing.SupportsInt | typing.SupportsIndex = 1, ok_centre_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.003, fair_centre_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.01, warn_centre_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.02) -> None:
        """
        method: 'lsq', 'robust', 'als' or 'sphere'. ValueError names a field that is out of range.
        """
    @property
    def fair_centre_sigma(self) -> float:
        """
        … fair
        """
    @property
    def max_iterations(self) -> int:
        ...
    @property
    def method(self) -> str:
        ...
    @property
    def ok_centre_sigma(self) -> float:
        """
        largest predicted deviation of the centre over the radius that is ok
        """
    @property
    def outlier_share(self) -> float:
        """
        robust: above this share the start is the least median of squares
        """
    @property
    def reference_norm(self) -> float:
        """
        norm of corrected readings, in the unit wanted; 0: the readings' own mean radius
        """
    @property
    def seed(self) -> int:
        """
        of the subsets of the least median of squares
        """
    @property
    def shape_prior_sigma(self) -> float:
        """
        robust: deviation of the relative axis lengths from a sphere; 0: no prior
        """
    @property
    def tukey_c(self) -> float:
        """
        residuals beyond this many sigma do not count
        """
    @property
    def warn_centre_sigma(self) -> float:
        """
        … a warning; beyond: refused
        """
class EllipsoidFit:
    """
    corrected = matrix @ (raw - centre), of norm reference_norm. matrix is symmetric: a rotation is not observable from norms. Look at quality before using it.
    """
    def triad(self) -> TriadCalibration:
        """
        For the rig, with its quality. DataError with the reasons when there is none.
        """
    @property
    def axis_ratio(self) -> float:
        """
        longest over shortest axis
        """
    @property
    def cells_hit(self) -> int:
        ...
    @property
    def centre(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,), in the readings' unit
        """
    @property
    def centre_over_radius(self) -> float:
        """
        |centre| / radius
        """
    @property
    def centre_sigma(self) -> float:
        """
        largest deviation of the centre in any direction, over the radius
        """
    @property
    def converged(self) -> bool:
        ...
    @property
    def cov(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (9, 9) covariance of centre x, y, z and matrix xx, yy, zz, xy, xz, yz
        """
    @property
    def coverage(self) -> numpy.typing.NDArray[numpy.int32]:
        """
        (10, 10) int32: readings in cells of equal area; rows from -z up, columns from +x towards +y
        """
    @property
    def inliers(self) -> int:
        ...
    @property
    def is_ellipsoid(self) -> bool:
        """
        False: the readings determine none
        """
    @property
    def iterations(self) -> int:
        ...
    @property
    def matrix(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3, 3), symmetric
        """
    @property
    def method(self) -> str:
        ...
    @property
    def noise_sigma(self) -> float:
        """
        of a reading across the surface, in the readings' unit
        """
    @property
    def norm_variation_after(self) -> float:
        """
        of |corrected|, all readings
        """
    @property
    def norm_variation_before(self) -> float:
        """
        of |raw|: deviation over mean
        """
    @property
    def not_finite(self) -> int:
        """
        left out
        """
    @property
    def quality(self) -> Quality:
        ...
    @property
    def radius(self) -> float:
        """
        geometric mean of the half axes, in the readings' unit
        """
    @property
    def readings(self) -> int:
        """
        taken
        """
    @property
    def reference_norm(self) -> float:
        ...
    @property
    def residual_rms(self) -> float:
        """
        of the corrected norm over the inliers, relative
        """
class EllipsoidAdvice:
    """
    What to do next while readings are collected.
    """
    @property
    def enough(self) -> bool:
        ...
    @property
    def missing_direction(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) in the sensor's axes, of length 1: point it along the field; NaN when there is none
        """
    @property
    def text(self) -> str:
        """
        in words
        """
    @property
    def turn_axis(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) in the sensor's axes, of length 1: turn about it to get there
        """
class EllipsoidCollector:
    """
    Collects readings in bounded memory for a calibration that a person watches. Each direction keeps its latest readings.
    """
    def __init__(self, options: EllipsoidOptions = ..., readings_per_cell: typing.SupportsInt | typing.SupportsIndex = 20) -> None:
        ...
    def add(self, reading: numpy.typing.ArrayLike) -> bool:
        """
        False when it is not finite: counted and left out.
        """
    def advice(self, fit: EllipsoidFit) -> EllipsoidAdvice:
        ...
    def fit(self) -> EllipsoidFit:
        """
        Of what is kept now.
        """
    @property
    def kept(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3): the readings that fit() uses, in order of arrival
        """
    @property
    def received(self) -> int:
        ...
class ClockLine:
    """
    One clock in terms of another: output = output_ref + (input - input_ref) * (1 + skew).
    """
    def convert(self, input_ns: numpy.typing.NDArray[numpy.int64]) -> tuple[numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.float64]]:
        """
        (times_ns, sigma_ns) of int64 (N,); also outside the span, where sigma grows.
        """
    def inverse(self) -> ClockLine:
        """
        The line from output to input.
        """
    @property
    def input_ref_ns(self) -> int:
        ...
    @property
    def offset_ns(self) -> int:
        """
        output - input at the reference
        """
    @property
    def output_ref_ns(self) -> int:
        ...
    @property
    def sigma_ns(self) -> float:
        """
        standard deviation of the output at input_ref_ns
        """
    @property
    def sigma_skew(self) -> float:
        ...
    @property
    def skew(self) -> float:
        """
        relative frequency error; 1e-6 is 1 ppm
        """
    @property
    def skew_ppm(self) -> float:
        ...
    @property
    def valid_from_ns(self) -> int:
        """
        span of the input for which the line holds
        """
    @property
    def valid_to_ns(self) -> int:
        ...
class ClockModel:
    """
    Device clock to host clock, from stamps and arrivals: a line under a sliding window of samples that are only ever late. Gives true time + minimum delay. Survives resets, jumps, steps, gaps; times never step back.
    """
    def __init__(self, **kwargs) -> None:
        """
        Options as keywords: window_s=120, skew_sigma_ppm=100, initial_sigma_ns=10_000_000, skew_walk=1.5e-8, min_step_ns=200_000, step_samples=20, step_s=5, early_samples=5, reset_samples=3, reset_step_ns=1_000_000_000, max_extrapolation_s=60. ValueError names one that is out of range.
        """
    def convert(self, device_times_ns: numpy.typing.NDArray[numpy.int64]) -> tuple[numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.float64]]:
        """
        Returns (times_ns, sigma_ns): int64 (N,) and float64 (N,); INT64_MIN (libloc.NO_TIME) and NaN where there is no answer.
        """
    def process(self, device_times_ns: numpy.typing.NDArray[numpy.int64], host_times_ns: numpy.typing.NDArray[numpy.int64]) -> tuple[numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.float64]]:
        """
        As live: each sample is taken in, then converted with what is known by then. Returns (times_ns, sigma_ns) as convert().
        """
    def reset(self) -> None:
        """
        Forgets everything but the counts.
        """
    def update(self, device_times_ns: numpy.typing.NDArray[numpy.int64], host_times_ns: numpy.typing.NDArray[numpy.int64]) -> None:
        """
        Samples in the order of arrival, int64 (N,) each.
        """
    @property
    def counts(self) -> dict:
        """
        What it has survived: a dict.
        """
    @property
    def epoch(self) -> int:
        """
        Lines started so far.
        """
    @property
    def line(self) -> ClockLine:
        """
        What is known now, a copy.
        """
    @property
    def mean_jitter_ns(self) -> float:
        ...
    @property
    def ready(self) -> bool:
        ...
class CounterUnwrapper:
    """
    Counters of devices as nanoseconds that do not wrap around. A tick lasts tick_numerator_ns / tick_denominator.
    """
    def __init__(self, bits: typing.SupportsInt | typing.SupportsIndex = 32, tick_numerator_ns: typing.SupportsInt | typing.SupportsIndex = 1000, tick_denominator: typing.SupportsInt | typing.SupportsIndex = 1) -> None:
        ...
    def unwrap(self, counts: numpy.typing.NDArray[numpy.int64]) -> numpy.typing.NDArray[numpy.int64]:
        """
        int64 (N,) counts in, int64 (N,) nanoseconds out.
        """
    @property
    def wraps(self) -> int:
        ...
class ClockCalibrationResult:
    """
    What a recording tells about its clock.
    """
    @property
    def counts(self) -> dict:
        ...
    @property
    def duration_s(self) -> float:
        ...
    @property
    def epochs(self) -> int:
        ...
    @property
    def jitter_max_ns(self) -> float:
        ...
    @property
    def jitter_median_ns(self) -> float:
        ...
    @property
    def jitter_p90_ns(self) -> float:
        ...
    @property
    def jitter_p99_ns(self) -> float:
        ...
    @property
    def jitter_rms_ns(self) -> float:
        """
        lateness of arrivals
        """
    @property
    def offset_ns(self) -> int:
        """
        host - device at the last sample
        """
    @property
    def quality(self) -> Quality:
        ...
    @property
    def rate_hz(self) -> float:
        ...
    @property
    def sigma_ns(self) -> float:
        """
        of a time put on the host's clock
        """
    @property
    def skew_max_ppm(self) -> float:
        ...
    @property
    def skew_min_ppm(self) -> float:
        ...
    @property
    def skew_ppm(self) -> float:
        """
        mean; seconds of the host per second, less 1
        """
    @property
    def skew_sigma_ppm(self) -> float:
        """
        its wandering included
        """
class GpsClock:
    """
    Host clock to GPS time (without leap seconds), from pulses per second and labels. Without pulses sigma says tens of milliseconds.
    """
    def __init__(self, **kwargs) -> None:
        """
        Options as keywords: label='previous' or 'next', pulse_gate_ns=100_000_000, pulse_delay_ns=0, sigma_pulse_delay_ns=2000, pairing_delay_ns=400_000_000, label_delay_ns=350_000_000, sigma_label_delay_ns=200_000_000, max_pulse_extrapolation_s=600, max_label_extrapolation_s=60.
        """
    def convert(self, host_times_ns: numpy.typing.NDArray[numpy.int64]) -> tuple[numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.float64]]:
        """
        Returns (times_ns, sigma_ns): int64 (N,) and float64 (N,); INT64_MIN (libloc.NO_TIME) and NaN where there is no answer.
        """
    def update(self, is_pulse: numpy.typing.NDArray[numpy.bool], host_times_ns: numpy.typing.NDArray[numpy.int64], gps_times_ns: numpy.typing.NDArray[numpy.int64]) -> None:
        """
        Events in the order of arrival: bool (N,); int64 (N,) edge of the pulse or arrival of the label; int64 (N,) GPS time of the label, NO_TIME of a pulse unless its source has paired it.
        """
    @property
    def basis(self) -> str:
        """
        'none', 'labels' or 'pulses'
        """
    @property
    def counts(self) -> dict:
        ...
    @property
    def epoch(self) -> int:
        ...
    @property
    def line(self) -> ClockLine | None:
        """
        Host to GPS as it is known now; None when it is not.
        """
class ClockChain:
    """
    Device clock to host clock to GPS time, sigma of both steps.
    """
    def __init__(self) -> None:
        ...
    def convert(self, device_times_ns: numpy.typing.NDArray[numpy.int64]) -> tuple[numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.float64]]:
        """
        Returns (times_ns, sigma_ns): int64 (N,) and float64 (N,); INT64_MIN (libloc.NO_TIME) and NaN where there is no answer.
        """
    def update(self, device_times_ns: numpy.typing.NDArray[numpy.int64], host_times_ns: numpy.typing.NDArray[numpy.int64]) -> None:
        ...
    def update_gps(self, is_pulse: numpy.typing.NDArray[numpy.bool], host_times_ns: numpy.typing.NDArray[numpy.int64], gps_times_ns: numpy.typing.NDArray[numpy.int64]) -> None:
        """
        Events in the order of arrival: bool (N,); int64 (N,) edge of the pulse or arrival of the label; int64 (N,) GPS time of the label, NO_TIME of a pulse unless its source has paired it.
        """
    @property
    def device_counts(self) -> dict:
        ...
    @property
    def gps_counts(self) -> dict:
        ...
class TimeOffsetResult:
    """
    t_reference = t_stream + offset_s
    """
    @property
    def bias(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        stream - reference [m]
        """
    @property
    def converged(self) -> bool:
        ...
    @property
    def down_weighted(self) -> int:
        ...
    @property
    def lever_arm(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def not_finite(self) -> int:
        ...
    @property
    def offset_s(self) -> float:
        ...
    @property
    def outside(self) -> int:
        ...
    @property
    def quality(self) -> Quality:
        ...
    @property
    def rms_after_m(self) -> float:
        ...
    @property
    def rms_before_m(self) -> float:
        ...
    @property
    def sigma_s(self) -> float:
        ...
    @property
    def speed_deviation(self) -> float:
        ...
    @property
    def speed_rms(self) -> float:
        ...
    @property
    def used(self) -> int:
        ...
    @property
    def velocity_deviation(self) -> float:
        ...
class StillnessOptions:
    """
    What counts as still. No threshold has a unit.
    """
    def __init__(self, *, min_duration_s: typing.SupportsFloat | typing.SupportsIndex = 1.0, window_s: typing.SupportsFloat | typing.SupportsIndex = 0.5, enter_ratio: typing.SupportsFloat | typing.SupportsIndex = 3.0, leave_ratio: typing.SupportsFloat | typing.SupportsIndex = 6.0, min_whiteness: typing.SupportsFloat | typing.SupportsIndex = 0.1, turning_sigmas: typing.SupportsFloat | typing.SupportsIndex = 10.0, max_wander: typing.SupportsFloat | typing.SupportsIndex = 4.0, gap_periods: typing.SupportsFloat | typing.SupportsIndex = 5.0) -> None:
        """
        ValueError names a field that is out of range.
        """
    @property
    def enter_ratio(self) -> float:
        """
        variance over the noise's: stillness begins below
        """
    @property
    def gap_periods(self) -> float:
        """
        a longer pause ends a segment
        """
    @property
    def leave_ratio(self) -> float:
        """
        and ends above
        """
    @property
    def max_wander(self) -> float:
        """
        mean square step from window to window over what the noise makes; 0: off
        """
    @property
    def min_duration_s(self) -> float:
        """
        shorter segments are left out
        """
    @property
    def min_whiteness(self) -> float:
        """
        of the quietest windows; 0: not judged
        """
    @property
    def turning_sigmas(self) -> float:
        """
        mean rate off the median of all segments, in deviations of a sample; 0: off
        """
    @property
    def window_s(self) -> float:
        """
        over which the variance is taken
        """
class RestNoise:
    """
    Noise of one sensor at rest, that stillness is measured against.
    """
    @property
    def known(self) -> bool:
        ...
    @property
    def quantum(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) smallest step of the readings
        """
    @property
    def variance(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) of a sample; NaN: axis without information
        """
    @property
    def whiteness(self) -> float:
        """
        of the quietest windows: 1 for white noise
        """
class StillSegment:
    """
    One still part of a recording. An absent sensor's figures are NaN.
    """
    @property
    def accelerometer_cov(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3, 3), of a sample
        """
    @property
    def accelerometer_mean(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,)
        """
    @property
    def begin(self) -> int:
        """
        first row
        """
    @property
    def duration_s(self) -> float:
        ...
    @property
    def end(self) -> int:
        """
        one past the last row
        """
    @property
    def end_ns(self) -> int:
        """
        of the last row in it
        """
    @property
    def gyroscope_cov(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3, 3), of a sample
        """
    @property
    def gyroscope_mean(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,)
        """
    @property
    def samples(self) -> int:
        """
        taken
        """
    @property
    def start_ns(self) -> int:
        ...
class Stillness:
    """
    Still segments of a recording, and the noise they were found by.
    """
    @property
    def accelerometer(self) -> RestNoise:
        ...
    @property
    def gaps(self) -> int:
        ...
    @property
    def gyroscope(self) -> RestNoise:
        ...
    @property
    def not_finite(self) -> int:
        """
        rows left out
        """
    @property
    def out_of_order(self) -> int:
        """
        rows left out: not later than the one before
        """
    @property
    def quality(self) -> Quality:
        ...
    @property
    def rate_hz(self) -> float:
        """
        one over the median period
        """
    @property
    def samples(self) -> int:
        """
        taken
        """
    @property
    def segments(self) -> list[StillSegment]:
        """
        in order of time
        """
    @property
    def still_share(self) -> float:
        """
        of the samples taken
        """
    @property
    def turning_segments(self) -> int:
        """
        left out: turning evenly
        """
    @property
    def wandering_segments(self) -> int:
        """
        cut or left out: vibrating, but moving
        """
    @property
    def window_samples(self) -> int:
        ...
class StillnessDetector:
    """
    The same rule sample by sample, half a window late.
    """
    def __init__(self, gyroscope: RestNoise, accelerometer: RestNoise, rate_hz: typing.SupportsFloat | typing.SupportsIndex, window_samples: typing.SupportsInt | typing.SupportsIndex, options: StillnessOptions = ..., gyroscope_bias: numpy.typing.ArrayLike | None = None) -> None:
        ...
    def update(self, time_ns: typing.SupportsInt | typing.SupportsIndex, gyroscope: numpy.typing.ArrayLike, accelerometer: numpy.typing.ArrayLike) -> bool:
        """
        True while the device is still.
        """
    @property
    def rejected(self) -> int:
        ...
    @property
    def still(self) -> bool:
        ...
    @property
    def still_since_ns(self) -> int | None:
        """
        None in motion
        """
class AccelerometerOptions:
    """
    Gravity, and where the verdicts change.
    """
    def __init__(self, *, gravity: typing.SupportsFloat | typing.SupportsIndex = 9.80665, distinct_angle: typing.SupportsFloat | typing.SupportsIndex = 0.17453292519943295, least_poses: typing.SupportsInt | typing.SupportsIndex = 9, good_poses: typing.SupportsInt | typing.SupportsIndex = 15, outlier_sigmas: typing.SupportsFloat | typing.SupportsIndex = 4.685, ok_error: typing.SupportsFloat | typing.SupportsIndex = 0.001, fair_error: typing.SupportsFloat | typing.SupportsIndex = 0.003, warn_error: typing.SupportsFloat | typing.SupportsIndex = 0.01) -> None:
        """
        ValueError names a field that is out of range.
        """
    @property
    def distinct_angle(self) -> float:
        """
        [rad]; closer poses count once
        """
    @property
    def fair_error(self) -> float:
        """
        … fair
        """
    @property
    def good_poses(self) -> int:
        """
        distinct ones; below: advice
        """
    @property
    def gravity(self) -> float:
        """
        [m/s^2]
        """
    @property
    def least_poses(self) -> int:
        """
        distinct ones; below: refused
        """
    @property
    def ok_error(self) -> float:
        """
        predicted error over gravity that is ok
        """
    @property
    def outlier_sigmas(self) -> float:
        """
        a pose further off is left out
        """
    @property
    def warn_error(self) -> float:
        """
        … a warning; beyond: refused
        """
class AccelerometerFit:
    """
    corrected = triad.matrix @ (raw - triad.bias), of the length of gravity at rest. The matrix is symmetric: a rotation is not observable.
    """
    @property
    def converged(self) -> bool:
        ...
    @property
    def cov(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (9, 9) of bias x, y, z and matrix xx, yy, zz, xy, xz, yz
        """
    @property
    def distinct(self) -> numpy.typing.NDArray[numpy.bool]:
        """
        (P,) bool: first of its direction
        """
    @property
    def distinct_poses(self) -> int:
        ...
    @property
    def inlier(self) -> numpy.typing.NDArray[numpy.bool]:
        """
        (P,) bool: poses used
        """
    @property
    def inliers(self) -> int:
        ...
    @property
    def leave_one_out_rms(self) -> float:
        """
        each predicted by the others [m/s^2]
        """
    @property
    def left_out(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (P,) the same from a fit without the pose
        """
    @property
    def pose_sigma(self) -> float:
        """
        from pose to pose, beyond the samples' noise [m/s^2]
        """
    @property
    def predicted_error(self) -> float:
        """
        of a corrected reading, over gravity
        """
    @property
    def quality(self) -> Quality:
        ...
    @property
    def residual_rms(self) -> float:
        """
        [m/s^2]
        """
    @property
    def residuals(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (P,) length less gravity [m/s^2]
        """
    @property
    def solved(self) -> bool:
        ...
    @property
    def triad(self) -> TriadCalibration:
        """
        raw to [m/s^2]
        """
class GyroscopeOptions:
    """
    Where the verdicts change.
    """
    def __init__(self, *, gap_periods: typing.SupportsFloat | typing.SupportsIndex = 5.0, outlier_chi2: typing.SupportsFloat | typing.SupportsIndex = 18.4, ok_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.002, fair_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.005, warn_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.02) -> None:
        """
        ValueError names a field that is out of range.
        """
    @property
    def fair_sigma(self) -> float:
        """
        … fair
        """
    @property
    def gap_periods(self) -> float:
        """
        a longer pause makes a turn unusable
        """
    @property
    def ok_sigma(self) -> float:
        """
        predicted relative deviation of the matrix that is ok
        """
    @property
    def outlier_chi2(self) -> float:
        """
        of a turn; beyond, it is left out
        """
    @property
    def warn_sigma(self) -> float:
        """
        … a warning; beyond: bias only
        """
class GyroscopeFit:
    """
    angular velocity = triad.matrix @ (raw - triad.bias), in the accelerometer's axes.
    """
    @property
    def bias_cov(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3, 3), raw units
        """
    @property
    def bias_known(self) -> bool:
        ...
    @property
    def bias_range(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) largest less smallest, raw units
        """
    @property
    def bias_slope(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) raw units per second
        """
    @property
    def bias_spread(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) deviation over the segments, raw units
        """
    @property
    def chi2_ratio(self) -> float:
        """
        over the degrees of freedom
        """
    @property
    def converged(self) -> bool:
        ...
    @property
    def cov(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (9, 9) of the matrix row by row
        """
    @property
    def inliers(self) -> int:
        """
        turns used
        """
    @property
    def left_handed(self) -> bool:
        ...
    @property
    def matrix_known(self) -> bool:
        """
        False: bias only, the matrix is the identity
        """
    @property
    def quality(self) -> Quality:
        ...
    @property
    def relative_sigma(self) -> float:
        """
        largest deviation of the matrix in any direction, over its mean scale
        """
    @property
    def residual_rms(self) -> float:
        """
        [rad]
        """
    @property
    def rotation_angle(self) -> float:
        """
        [rad] to the accelerometer's axes
        """
    @property
    def segments(self) -> int:
        """
        still ones, that the bias is from
        """
    @property
    def triad(self) -> TriadCalibration:
        """
        raw to [rad/s]
        """
    @property
    def turn_gravity_angle(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (T,) [rad] by which gravity turned
        """
    @property
    def turn_inlier(self) -> numpy.typing.NDArray[numpy.bool]:
        """
        (T,) bool
        """
    @property
    def turn_residuals(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (T,) [rad]; NaN where the turn was not usable
        """
class AllanOptions:
    """
    At which averaging times the Allan deviation is taken.
    """
    def __init__(self, *, points_per_octave: typing.SupportsInt | typing.SupportsIndex = 4, longest_share: typing.SupportsFloat | typing.SupportsIndex = 0.125) -> None:
        """
        ValueError names a field that is out of range.
        """
    @property
    def longest_share(self) -> float:
        """
        longest averaging time over the recording
        """
    @property
    def points_per_octave(self) -> int:
        ...
class AllanTerm:
    """
    One term of the noise; value and sigma are NaN unless it was identified.
    """
    @property
    def identified(self) -> bool:
        ...
    @property
    def share(self) -> float:
        """
        of the fitted variance, there
        """
    @property
    def sigma(self) -> float:
        ...
    @property
    def tau_s(self) -> float:
        """
        where its share is largest
        """
    @property
    def upper_bound(self) -> float:
        ...
    @property
    def value(self) -> float:
        ...
class AllanFit:
    """
    Overlapping Allan deviation of one axis and its terms.
    """
    @property
    def bias_instability(self) -> AllanTerm:
        """
        B [unit]
        """
    @property
    def deviation(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (K,)
        """
    @property
    def duration_s(self) -> float:
        ...
    @property
    def fitted_from_tau_s(self) -> float:
        """
        shorter ones: the sensor's own filter
        """
    @property
    def freedom(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (K,) equivalent degrees of freedom
        """
    @property
    def minimum_deviation(self) -> float:
        ...
    @property
    def minimum_tau_s(self) -> float:
        ...
    @property
    def misfit(self) -> float:
        """
        rms of the residuals in their own deviations
        """
    @property
    def noise_density(self) -> AllanTerm:
        """
        N [unit/sqrt(Hz)]
        """
    @property
    def quality(self) -> Quality:
        ...
    @property
    def random_walk(self) -> AllanTerm:
        """
        K [unit/s/sqrt(Hz)]
        """
    @property
    def rate_hz(self) -> float:
        ...
    @property
    def sigma(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (K,) deviation of the deviation
        """
    @property
    def tau_s(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (K,) averaging times
        """
class ImuAllan:
    """
    Allan deviation of all axes, from the longest part without motion and gaps.
    """
    @property
    def accelerometer(self) -> list[AllanFit]:
        """
        three fits, or none
        """
    @property
    def begin(self) -> int:
        """
        rows used
        """
    @property
    def bridged(self) -> int:
        """
        samples that were lost or not finite, and interpolated
        """
    @property
    def duration_s(self) -> float:
        ...
    @property
    def end(self) -> int:
        ...
    @property
    def gyroscope(self) -> list[AllanFit]:
        """
        three fits, or none
        """
    @property
    def quality(self) -> Quality:
        ...
    @property
    def used_share(self) -> float:
        ...
class ImuNoiseFit:
    """
    Noise for the estimators, and where each field is from.
    """
    @property
    def measured(self) -> list[str]:
        """
        names of the fields that the recording determines
        """
    @property
    def noise(self) -> ImuNoise:
        ...
    @property
    def quality(self) -> Quality:
        ...
class MagnetometerAlignmentOptions:
    """
    How the magnetometer is aligned, and where verdicts change.
    """
    def __init__(self, *, interval_s: typing.SupportsFloat | typing.SupportsIndex = 0.25, expected_dip: typing.SupportsFloat | typing.SupportsIndex = ..., norm_tolerance: typing.SupportsFloat | typing.SupportsIndex = 0.2, force_tolerance: typing.SupportsFloat | typing.SupportsIndex = 0.03, gap_periods: typing.SupportsFloat | typing.SupportsIndex = 5.0, gyroscope_matrix_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.01, field_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.005, least_second_axis: typing.SupportsFloat | typing.SupportsIndex = 0.1, ok_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.008726646259971648, fair_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.017453292519943295, warn_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.05235987755982988) -> None:
        """
        ValueError names a field that is out of range.
        """
    @property
    def expected_dip(self) -> float:
        """
        [rad] positive down; NaN: mirroring is not checked
        """
    @property
    def fair_sigma(self) -> float:
        """
        … fair
        """
    @property
    def field_sigma(self) -> float:
        """
        of each entry of what is left of the magnetometer's matrix and, over the field, of its centre
        """
    @property
    def force_tolerance(self) -> float:
        """
        of the specific force taken as gravity, relative
        """
    @property
    def gap_periods(self) -> float:
        """
        a longer pause ends an interval
        """
    @property
    def gyroscope_matrix_sigma(self) -> float:
        """
        of each entry of what is left of the gyroscope's scale and misalignment
        """
    @property
    def interval_s(self) -> float:
        """
        over which the gyroscope carries the field
        """
    @property
    def least_second_axis(self) -> float:
        """
        turning about a second axis over the first
        """
    @property
    def norm_tolerance(self) -> float:
        """
        of the field's length, relative
        """
    @property
    def ok_sigma(self) -> float:
        """
        [rad] predicted deviation that is ok
        """
    @property
    def warn_sigma(self) -> float:
        """
        … a warning; beyond: refused
        """
class MagnetometerAlignment:
    """
    field in body axes = matrix @ magnetometer
    """
    @property
    def angle(self) -> float:
        """
        [rad] of the rotation
        """
    @property
    def axes(self) -> str:
        """
        magnetometer axis nearest to each body axis
        """
    @property
    def cov(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3, 3) [rad^2] of a rotation on the right
        """
    @property
    def delay_s(self) -> float:
        """
        readings are of so much before their time stamp
        """
    @property
    def delay_sigma_s(self) -> float:
        ...
    @property
    def dip(self) -> float:
        """
        [rad] positive down; NaN without gravity
        """
    @property
    def dip_scatter(self) -> float:
        """
        [rad] of single readings
        """
    @property
    def dip_sigma(self) -> float:
        """
        [rad]
        """
    @property
    def disturbed(self) -> int:
        ...
    @property
    def gravity_readings(self) -> int:
        ...
    @property
    def gyroscope_bias(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) [rad/s] still in the readings
        """
    @property
    def inliers(self) -> int:
        ...
    @property
    def intervals(self) -> int:
        ...
    @property
    def matrix(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3, 3), orthonormal; determinant -1 when mirrored
        """
    @property
    def mirror_checked(self) -> bool:
        ...
    @property
    def mirrored(self) -> bool:
        ...
    @property
    def not_finite(self) -> int:
        ...
    @property
    def permuted(self) -> bool:
        ...
    @property
    def quality(self) -> Quality:
        ...
    @property
    def repeated(self) -> int:
        ...
    @property
    def residual_rms(self) -> float:
        """
        [rad]
        """
    @property
    def second_axis_share(self) -> float:
        ...
    @property
    def sigma(self) -> float:
        """
        [rad] largest deviation of the rotation
        """
    @property
    def solved(self) -> bool:
        ...
    @property
    def too_fast(self) -> int:
        ...
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
    @property
    def origin(self) -> tuple[float, float, float] | None:
        """
        Latitude, longitude [rad] and altitude [m] of the world's origin of a reference that is given in degrees (ASPN-23); None before its first position, and for other recordings.
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
class NmeaFixes:
    """
    One row for each epoch. What the receiver did not say is NaN.
    """
    @property
    def counts(self) -> dict[str, int]:
        """
        Sentences by type, refused ones by reason, epochs without fix.
        """
    @property
    def fix(self) -> numpy.typing.NDArray[numpy.int8]:
        """
        (N,) int8, GpsFixType; 0 rows have no position
        """
    @property
    def gps_times_ns(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (N,) int64, since 1980-01-06 without leap seconds; NO_TIME when unknown
        """
    @property
    def latitude_longitude_altitude(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [rad, rad, m above the ellipsoid]
        """
    @property
    def position_cov(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3, 3) [m^2], east, north, up
        """
    @property
    def satellites(self) -> numpy.typing.NDArray[numpy.int32]:
        """
        (N,) int32, -1 when unknown
        """
    @property
    def velocity_enu(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [m/s], up is NaN
        """
def absolute_error(estimate: Trajectory, reference: Trajectory, alignment: str = 'se3') -> AbsoluteError:
    """
    Of paired trajectories (see associate). alignment: "se3", "sim3", "yaw" or "none". DataError when the poses do not determine it.
    """
def align_magnetometer(times_ns: numpy.typing.NDArray[numpy.int64], gyroscope: numpy.typing.NDArray[numpy.float64], accelerometer: numpy.typing.NDArray[numpy.float64] | None, magnetometer: numpy.typing.NDArray[numpy.float64], options: MagnetometerAlignmentOptions = ...) -> MagnetometerAlignment:
    """
    Rotation from a calibrated magnetometer (any unit) to the IMU: int64 (N,), float64 (N, 3) [rad/s], [m/s^2] or None. A slower magnetometer repeats its reading or is NaN in between. Bad data do not raise: see quality.
    """
def align_points(estimate: numpy.typing.NDArray[numpy.float64], reference: numpy.typing.NDArray[numpy.float64], alignment: str = 'se3') -> Alignment:
    """
    Least-squares transform between points (N, 3) [m] that belong together (Umeyama): "se3", "sim3" (with scale), "yaw" (turn about z and translation) or "none".
    """
def aligned(magnetometer: TriadCalibration, alignment: MagnetometerAlignment) -> TriadCalibration:
    """
    The magnetometer's TriadCalibration followed by the alignment, for the rig.
    """
def allan_fit(values: numpy.typing.NDArray[numpy.float64], rate_hz: typing.SupportsFloat | typing.SupportsIndex, options: AllanOptions = ...) -> AllanFit:
    """
    float64 (N,) at a constant rate, the sensor at rest. DataError names a value that is not finite.
    """
def analyse_imu_noise(times_ns: numpy.typing.NDArray[numpy.int64], gyroscope: numpy.typing.NDArray[numpy.float64] | None, accelerometer: numpy.typing.NDArray[numpy.float64] | None, options: AllanOptions = ..., stillness: StillnessOptions = ...) -> ImuAllan:
    """
    int64 (N,); float64 (N, 3) [rad/s] and [m/s^2], one may be None. Bad data do not raise: see quality.
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
def calibrate_clock(times_ns: numpy.typing.NDArray[numpy.int64], host_times_ns: numpy.typing.NDArray[numpy.int64], **kwargs) -> ClockCalibrationResult:
    """
    Stamps and arrivals of one stream, int64 (N,) in the order of arrival; options as of ClockModel.
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
def estimate_time_offset(times_ns: numpy.typing.NDArray[numpy.int64], positions: numpy.typing.NDArray[numpy.float64], reference_times_ns: numpy.typing.NDArray[numpy.int64], reference_positions: numpy.typing.NDArray[numpy.float64], *, reference_velocities: typing.Any = None, reference_q_world_body_wxyz: typing.Any = None, max_offset_s: typing.SupportsFloat | typing.SupportsIndex = 1.0, horizontal: bool = True, max_reference_gap_s: typing.SupportsFloat | typing.SupportsIndex = 1.0, estimate_bias: bool = False, estimate_lever_arm: bool = False, lever_arm: numpy.typing.ArrayLike = (0.0, 0.0, 0.0), correlation_s: typing.SupportsFloat | typing.SupportsIndex = 120.0, bias_sigma_m: typing.SupportsFloat | typing.SupportsIndex = 1.5) -> TimeOffsetResult:
    """
    By how much the stamps of a position stream are off against a reference trajectory in the same world (z up): t_reference = t_stream + offset_s. int64 (N,), float64 (N, 3) [m]; NaN rows are skipped. DataError names the index where times do not increase.
    """
def find_stillness(times_ns: numpy.typing.NDArray[numpy.int64], gyroscope: numpy.typing.NDArray[numpy.float64] | None, accelerometer: numpy.typing.NDArray[numpy.float64] | None, options: StillnessOptions = ...) -> Stillness:
    """
    Still segments of a recording of any unit: int64 (N,) times, float64 (N, 3) readings; one sensor may be None. Bad data do not raise: see Stillness.quality.
    """
def fit_accelerometer(segments: collections.abc.Sequence[StillSegment], options: AccelerometerOptions = ...) -> AccelerometerFit:
    """
    Nine parameters from the accelerometer's means in still segments. Bad data do not raise: see quality.
    """
def fit_accelerometer_poses(means: numpy.typing.NDArray[numpy.float64], sigmas: numpy.typing.NDArray[numpy.float64] | None = None, options: AccelerometerOptions = ...) -> AccelerometerFit:
    """
    The same from float64 (P, 3) means of still poses; sigmas (P,): deviation of each mean, raw units.
    """
def fit_ellipsoid(readings: numpy.typing.NDArray[numpy.float64], options: EllipsoidOptions = ..., weights: numpy.typing.NDArray[numpy.float64] | None = None) -> EllipsoidFit:
    """
    Fits an ellipsoid to float64 (N, 3) readings of any unit; weights (N,): information of a reading relative to the others. Bad data do not raise: see EllipsoidFit.quality.
    """
def fit_gyroscope(times_ns: numpy.typing.NDArray[numpy.int64], gyroscope: numpy.typing.NDArray[numpy.float64], segments: collections.abc.Sequence[StillSegment], accelerometer: AccelerometerFit, options: GyroscopeOptions = ...) -> GyroscopeFit:
    """
    Bias, scale and misalignment from the turns between the still segments of the same recording.
    """
def fit_gyroscope_bias(segments: collections.abc.Sequence[StillSegment]) -> GyroscopeFit:
    """
    Bias alone.
    """
def format_seconds(time_ns: typing.SupportsInt | typing.SupportsIndex) -> str:
    """
    Nanoseconds as seconds with nine decimals.
    """
def gps_from_unix(unix_time_ns: typing.SupportsInt | typing.SupportsIndex, *, leap_seconds: typing.SupportsInt | typing.SupportsIndex | None = None) -> int | None:
    """
    Nanoseconds since 1970 (UTC) to GPS time: since 1980-01-06, leap seconds counted. None before 1980 and after 2260. leap_seconds: GPS minus UTC, where the library's table is not to be used.
    """
def imu_noise_from(allan: ImuAllan, fallback: ImuNoise = ...) -> ImuNoiseFit:
    """
    What was not identified keeps the fallback's value, or the upper bound where that is lower.
    """
def leap_seconds_known_until() -> str:
    """
    First day, as YYYY-MM-DD, of which the library's table of leap seconds does not know.
    """
def local_positions(latitude_longitude_altitude: numpy.typing.NDArray[numpy.float64], origin: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
    """
    East, north, up (N, 3) [m] of positions on the WGS 84 ellipsoid, [rad, rad, m], in the plane that touches it at the origin. NaN stays NaN.
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
def open_nmea(path: os.PathLike | str | bytes, *, reference_date: typing.Any | None = None, leap_seconds: typing.SupportsInt | typing.SupportsIndex | None = None, geoid_separation: typing.SupportsFloat | typing.SupportsIndex | None = None, sigma_per_dop: typing.SupportsFloat | typing.SupportsIndex = 0.0, accept_not_measured: bool = False) -> MeasurementSource:
    """
    The fixes of an NMEA log as a recording, on GPS time. Options as parse_nmea.
    """
def orientation_error(estimate_wxyz: numpy.typing.NDArray[numpy.float64], reference_wxyz: numpy.typing.NDArray[numpy.float64], mask: numpy.typing.NDArray[numpy.bool] | None = None, *, align_heading: bool = False) -> OrientationError:
    """
    float64 (N, 4) of the same times, NaN where unknown; mask: bool (N,), where to score. align_heading removes the turn about z that they have in common: for a heading that is relative to the start. DataError when nothing is left to score.
    """
def parse_nmea(data: bytes, *, reference_date: typing.Any | None = None, leap_seconds: typing.SupportsInt | typing.SupportsIndex | None = None, geoid_separation: typing.SupportsFloat | typing.SupportsIndex | None = None, sigma_per_dop: typing.SupportsFloat | typing.SupportsIndex = 0.0, accept_not_measured: bool = False) -> NmeaFixes:
    """
    Fixes in the bytes of a receiver; anything may stand between the sentences. reference_date: a datetime.date at or after the data by less than 19 years, which resolves two-digit years and mends the dates of receivers that are past their 1024 weeks. leap_seconds: GPS minus UTC instead of the library's table. geoid_separation [m]: where the receiver does not say it. sigma_per_dop [m]: covariance for fixes without GST; 0: NaN. accept_not_measured: dead-reckoned, manual and simulator positions count as fixes.
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
def simulate_clock(scenario: str, duration_s: typing.SupportsFloat | typing.SupportsIndex, random: Random) -> tuple[numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.int64]]:
    """
    'usb_imu' (200 Hz), 'pps' or 'nmea_only': (device_times_ns, host_times_ns, truth_ns), int64 (N,) each; the truth is true host time + minimum delay.
    """
def simulate_gps_time(duration_s: typing.SupportsFloat | typing.SupportsIndex, random: Random, with_pulses: bool = True, label_next: bool = False) -> tuple[numpy.typing.NDArray[numpy.bool], numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.int64]]:
    """
    (is_pulse, host_times_ns, gps_times_ns) as GpsClock.update takes them, then the truth second by second: host times and GPS times, int64 (M,).
    """
def unix_from_gps(gps_time_ns: typing.SupportsInt | typing.SupportsIndex, *, leap_seconds: typing.SupportsInt | typing.SupportsIndex | None = None) -> int:
    """
    GPS time to nanoseconds since 1970 (UTC); a leap second has the number of the second after it.
    """
def update_rig(path: os.PathLike | str | bytes, change: collections.abc.Callable[[typing.Any], None]) -> Rig:
    """
    Reads rig.yaml (an empty rig when there is none), calls change(rig), which alters it, and writes it. What is not changed stays as it was to the last bit, but comments are lost. When anything raises, the file stays as it was.
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
NO_TIME: int = -9223372036854775808
REFERENCE_CHANNEL: str = 'LOC_REFERENCE'
SOURCE_STATUS_CHANNEL: str = 'LOC_SOURCE_STATUS'
STATISTICS_CHANNEL: str = 'LOC_STATISTICS'
