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
__all__: list[str] = ['AbsoluteError', 'AccelerometerFit', 'AccelerometerOptions', 'Alignment', 'AllanFit', 'AllanOptions', 'AllanTerm', 'AnchoredRun', 'Association', 'CalibrationTarget', 'Camera', 'CameraCalibration', 'CameraFit', 'CameraFitOptions', 'CameraFitView', 'CameraImuCamera', 'CameraImuCheck', 'CameraImuFinding', 'CameraImuFit', 'CameraImuMatrixCheck', 'CameraImuOptions', 'CameraImuProgress', 'CameraImuStart', 'CameraImuView', 'CameraModel', 'CameraRecording', 'CameraRun', 'CarMotion', 'CircleMotion', 'ClockCalibration', 'ClockCalibrationResult', 'ClockChain', 'ClockLine', 'ClockModel', 'Consistency', 'CounterUnwrapper', 'DataError', 'DiscreteImuNoise', 'DistortionModel', 'ESTIMATE_CHANNEL', 'EllipsoidAdvice', 'EllipsoidCollector', 'EllipsoidFit', 'EllipsoidOptions', 'EqvioSource', 'ErrorStateFilter', 'ErrorStateOptions', 'ErrorStateRun', 'ErrorStatistics', 'Estimate', 'EstimateStatus', 'EstimateValid', 'EulerTrajectory', 'EulerTrajectoryFit', 'FUSION_CHANNEL', 'FeatureTracker', 'FeatureTrackerOptions', 'FeatureTrackerTimes', 'FeatureVideo', 'FeaturesArrays', 'FeaturesMeasurement', 'FigureEightMotion', 'FusionOutcome', 'FusionPreset', 'FusionPresetSensors', 'FusionResult', 'FusionStartOptions', 'GPS_CHANNEL', 'GpsArrays', 'GpsCalibration', 'GpsClock', 'GpsFixType', 'GpsMeasurement', 'GpsModel', 'GyroscopeFit', 'GyroscopeOptions', 'HAS_VISION', 'HandHeldMotion', 'IMAGE_CHANNEL', 'IMU_CHANNEL', 'ImageMeasurement', 'ImageSlam', 'ImuAllan', 'ImuArrays', 'ImuCalibration', 'ImuIntegration', 'ImuMeasurement', 'ImuModel', 'ImuNoise', 'ImuNoiseFit', 'ImuSampleModel', 'ImuSampling', 'InertialSlam', 'InertialTriadModel', 'IntrinsicsQuality', 'InverseDepthPoint', 'KnownLandmark', 'LcmLogReader', 'LocalFrame', 'LookAtMotion', 'MAGNETOMETER_CHANNEL', 'MadgwickFilter', 'MadgwickOptions', 'MadgwickResult', 'MagnetometerAlignment', 'MagnetometerAlignmentOptions', 'MagnetometerArrays', 'MagnetometerCalibration', 'MagnetometerMeasurement', 'MagnetometerModel', 'MapAnchorOptions', 'MeasurementSource', 'MonoSlam', 'Motion', 'MotionArrays', 'MountedMotion', 'MountingQuality', 'NO_TIME', 'NmeaFixes', 'ODOMETRY_CHANNEL', 'OdometryArrays', 'OdometryMeasurement', 'OrientationError', 'PedestrianMotion', 'Pose3', 'PoseSpline', 'PoseSplineFit', 'PoseStates', 'PredictOutcome', 'Quality', 'REFERENCE_CHANNEL', 'Random', 'Recording', 'ReferenceArrays', 'ReferenceMeasurement', 'RelativeError', 'RestFirstMotion', 'RestMotion', 'RestNoise', 'Rig', 'RotationForm', 'RotationSpline', 'RotationStates', 'SOURCE_STATUS_CHANNEL', 'STATISTICS_CHANNEL', 'Scenario', 'ScenarioStreams', 'Scene', 'SceneRenderer', 'SimulatedRun', 'Simulation', 'SlamAssociationOptions', 'SlamConsistency', 'SlamCounts', 'SlamFeatureArrays', 'SlamFeatureState', 'SlamFile', 'SlamFrame', 'SlamLandmarkArrays', 'SlamMapArrays', 'SlamMapOptions', 'SlamMotion', 'SlamOptions', 'SlamPrecision', 'SlamPredictionArrays', 'SlamRun', 'SlamSnapshot', 'SlamStartOptions', 'SplineGrid', 'StandStillOptions', 'StillSegment', 'Stillness', 'StillnessDetector', 'StillnessOptions', 'StreamClockModel', 'StreetModel', 'TRACKS_CHANNEL', 'TargetDetection', 'TargetDetector', 'TargetView', 'TimeOffsetResult', 'TrackArrays', 'TrackOrigin', 'Trajectory', 'TriadCalibration', 'TriadQuality', 'TruthArrays', 'VectorSpline', 'VectorSplineFit', 'Verdict', 'VisualOdometryModel', 'WaypointMotion', 'absolute_error', 'align_magnetometer', 'align_points', 'aligned', 'allan_fit', 'analyse_imu_noise', 'anchor_run', 'april_grid', 'associate', 'average_consistency', 'beta_from_gyro', 'box_room', 'calibrate_camera', 'calibrate_camera_imu', 'calibrate_clock', 'checkerboard', 'chi_square_cdf', 'chi_square_quantile', 'choose_views', 'decode_image', 'discretise', 'error_statistics', 'estimate_time_offset', 'euroc_cameras', 'example_drive', 'find_stillness', 'finds_april_grids', 'fit_accelerometer', 'fit_accelerometer_poses', 'fit_ellipsoid', 'fit_euler_trajectory', 'fit_gyroscope', 'fit_gyroscope_bias', 'fit_pose_spline', 'fit_vector_spline', 'format_seconds', 'gps_from_unix', 'image_array', 'image_measurement', 'imu_noise_from', 'is_eqvio', 'leap_seconds_known_until', 'lint_camera_imu', 'load_slam', 'local_positions', 'message_fingerprints', 'message_type', 'normalised_error_squared', 'open_broad', 'open_csv', 'open_eqvio', 'open_euroc', 'open_euroc_images', 'open_image_folder', 'open_lcm_log', 'open_nmea', 'open_video', 'orientation_error', 'parse_nmea', 'parse_seconds', 'quantile', 'read_any_rig', 'read_points', 'read_rig', 'read_slam_options', 'read_tracks', 'read_tum', 'relative_error', 'root_mean_square', 'sampled_path', 'save_slam', 'scenario_names', 'simulate', 'simulate_camera', 'simulate_clock', 'simulate_gps_time', 'slam_options_for_images', 'slam_options_text', 'so3', 'street', 'unix_from_gps', 'update_rig', 'write_geojson', 'write_gpx', 'write_kalibr_camchain', 'write_kalibr_imu', 'write_kml', 'write_ply', 'write_points', 'write_rig', 'write_slam_options', 'write_tracks', 'write_tum']
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
class LocalFrame:
    """
    East, north, up of an origin on WGS 84 [m]: a plane that touches the ellipsoid, valid at any distance.
    """
    def __init__(self, latitude: typing.SupportsFloat | typing.SupportsIndex, longitude: typing.SupportsFloat | typing.SupportsIndex, altitude: typing.SupportsFloat | typing.SupportsIndex) -> None:
        """
        [rad], [rad], [m] above the ellipsoid.
        """
    def __repr__(self) -> str:
        ...
    def to_geodetic(self, position: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) or (N, 3), east, north, up [m] to latitude, longitude [rad] and altitude [m].
        """
    def to_local(self, latitude_longitude_altitude: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) or (N, 3) [rad, rad, m] to east, north, up [m].
        """
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
class OdometryMeasurement:
    """
    Pose by an odometry that knows no metre, in its own unit: length = scale * metres. What is not known is NaN.
    """
    def __init__(self, time_ns: typing.SupportsInt | typing.SupportsIndex, position: numpy.typing.ArrayLike, q_wxyz: numpy.typing.ArrayLike, *, start_time_ns: typing.SupportsInt | typing.SupportsIndex | None = None, position_cov: numpy.typing.ArrayLike | None = None, orientation_cov: numpy.typing.ArrayLike | None = None) -> None:
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
    def orientation_cov(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3, 3) [rad^2], axes of body at time_ns
        """
    @orientation_cov.setter
    def orientation_cov(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) [odometry's unit]
        """
    @position.setter
    def position(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def position_cov(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3, 3) [unit^2], axes of position
        """
    @position_cov.setter
    def position_cov(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def q_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
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
    def start_time_ns(self) -> int | None:
        """
        None: absolute, pose of body in world. Otherwise pose of body in the axes of body at this time.
        """
    @property
    def time_ns(self) -> int:
        """
        Time of measurement [ns].
        """
    @time_ns.setter
    def time_ns(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
class FeaturesMeasurement:
    """
    The features of one frame with their identities.
    """
    def __init__(self, time_ns: typing.SupportsInt | typing.SupportsIndex, id: numpy.typing.NDArray[numpy.int64], pixel_px: numpy.typing.NDArray[numpy.float64], *, camera: typing.SupportsInt | typing.SupportsIndex = 0, sigma_px: typing.SupportsFloat | typing.SupportsIndex = ..., sequence: typing.SupportsInt | typing.SupportsIndex = -1) -> None:
        """
        id int64 (M,), pixel_px (M, 2); sigma_px: deviation of one coordinate, NaN when unknown.
        """
    def __repr__(self) -> str:
        ...
    @property
    def camera(self) -> int:
        """
        index of the camera in the rig
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
    def id(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (M,) int64, the same for the same point of the scene
        """
    @property
    def pixel_px(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (M, 2), u and v in the distorted image
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
    def sigma_px(self) -> float:
        """
        deviation of one coordinate; NaN when unknown
        """
    @property
    def time_ns(self) -> int:
        """
        Time of measurement [ns].
        """
    @time_ns.setter
    def time_ns(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
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
class IntrinsicsQuality:
    """
    How a camera's intrinsics were found, and how far they may be trusted. A deviation that is not known is NaN.
    """
    verdict: Verdict
    def __init__(self) -> None:
        ...
    @property
    def distortion_sigma(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (4,): of the distortion; 0 where the model has no such term
        """
    @distortion_sigma.setter
    def distortion_sigma(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def intrinsics_sigma_px(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (4,): deviations of fx, fy, cx, cy
        """
    @intrinsics_sigma_px.setter
    def intrinsics_sigma_px(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def method(self) -> str:
        """
        "target"
        """
    @method.setter
    def method(self, arg0: str) -> None:
        ...
    @property
    def pictures(self) -> int:
        """
        that were used
        """
    @pictures.setter
    def pictures(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
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
    def reprojection_rms_px(self) -> float:
        """
        of the distances between corners found and projected
        """
    @reprojection_rms_px.setter
    def reprojection_rms_px(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class MountingQuality:
    """
    How it was found where a camera sits on the IMU and by how much their clocks differ, and how far that may be trusted. What is not known is NaN.
    """
    verdict: Verdict
    def __init__(self) -> None:
        ...
    def set_deviations(self, T_body_camera: Pose3, covariance: numpy.typing.ArrayLike) -> None:
        """
        Sets the deviations from what a camera-IMU calibration finds. covariance (7, 7): of a small turn about the body's axes [rad] (R_camera_body Exp(turn)), of the translation of T_camera_body [m], of the time offset [s].
        """
    @property
    def line_delay_s(self) -> float:
        """
        a rolling shutter's time from one row to the next [s]; negative when it begins below
        """
    @line_delay_s.setter
    def line_delay_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def line_delay_sigma_s(self) -> float:
        """
        its deviation [s]
        """
    @line_delay_sigma_s.setter
    def line_delay_sigma_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def method(self) -> str:
        """
        "camera-imu"
        """
    @method.setter
    def method(self, arg0: str) -> None:
        ...
    @property
    def pictures(self) -> int:
        """
        that were used
        """
    @pictures.setter
    def pictures(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
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
    def rotation_sigma(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) [rad]: small turns of the camera about the body's axes
        """
    @rotation_sigma.setter
    def rotation_sigma(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def time_offset_sigma_s(self) -> float:
        """
        deviation of time_offset_s [s]
        """
    @time_offset_sigma_s.setter
    def time_offset_sigma_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def translation_sigma(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) [m]: of T_body_camera's translation, along the body's axes
        """
    @translation_sigma.setter
    def translation_sigma(self, arg1: numpy.typing.ArrayLike) -> None:
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
    def intrinsics_quality(self) -> IntrinsicsQuality | None:
        """
        How the intrinsics were found; None when nobody has said.
        """
    @intrinsics_quality.setter
    def intrinsics_quality(self, arg0: IntrinsicsQuality | None) -> None:
        ...
    @property
    def mounting_quality(self) -> MountingQuality | None:
        """
        How T_body_camera and time_offset_s were found; None when nobody has said.
        """
    @mounting_quality.setter
    def mounting_quality(self, arg0: MountingQuality | None) -> None:
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
    def calibrated(self, measurement: ImuMeasurement | MagnetometerMeasurement | ImageMeasurement | GpsMeasurement | ReferenceMeasurement | OdometryMeasurement | FeaturesMeasurement) -> ImuMeasurement | MagnetometerMeasurement | ImageMeasurement | GpsMeasurement | ReferenceMeasurement | OdometryMeasurement | FeaturesMeasurement:
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
    SCALE: typing.ClassVar[EstimateValid]
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
    BAD_COVARIANCE: typing.ClassVar[EstimateStatus]
    BRIDGED: typing.ClassVar[EstimateStatus]
    CALIBRATION_DOUBTFUL: typing.ClassVar[EstimateStatus]
    FEATURES_REJECTED: typing.ClassVar[EstimateStatus]
    FEW_FEATURES: typing.ClassVar[EstimateStatus]
    GAP: typing.ClassVar[EstimateStatus]
    GPS_REJECTED: typing.ClassVar[EstimateStatus]
    GPS_STAMPS_DOUBTFUL: typing.ClassVar[EstimateStatus]
    INITIALISING: typing.ClassVar[EstimateStatus]
    LOST: typing.ClassVar[EstimateStatus]
    MAGNETOMETER_DISTURBED: typing.ClassVar[EstimateStatus]
    MAGNETOMETER_IGNORED: typing.ClassVar[EstimateStatus]
    MAGNETOMETER_MISSING: typing.ClassVar[EstimateStatus]
    MAP_LINK_UNKNOWN: typing.ClassVar[EstimateStatus]
    NOT_FINITE: typing.ClassVar[EstimateStatus]
    NO_GPS: typing.ClassVar[EstimateStatus]
    NO_IMAGES: typing.ClassVar[EstimateStatus]
    NO_IMU: typing.ClassVar[EstimateStatus]
    ODOMETRY_REJECTED: typing.ClassVar[EstimateStatus]
    OUT_OF_RANGE: typing.ClassVar[EstimateStatus]
    RECOVERED: typing.ClassVar[EstimateStatus]
    REFOUND: typing.ClassVar[EstimateStatus]
    REINITIALISED: typing.ClassVar[EstimateStatus]
    SCALE_UNKNOWN: typing.ClassVar[EstimateStatus]
    STAMPS_DOUBTFUL: typing.ClassVar[EstimateStatus]
    TILT_DOUBTFUL: typing.ClassVar[EstimateStatus]
    TIME_NOT_INCREASING: typing.ClassVar[EstimateStatus]
    TOO_LATE: typing.ClassVar[EstimateStatus]
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
    def origin(self) -> tuple[float, float, float] | None:
        """
        Latitude, longitude [rad] and altitude [m] of world's origin; None when nothing ties it to the Earth.
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
    def scale(self) -> float:
        """
        of the odometry: its unit per metre; NaN when it is not estimated
        """
    @property
    def scale_sigma(self) -> float:
        """
        its deviation
        """
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
class ImuIntegration(enum.IntEnum):
    """
    How a step is integrated: with the attitude in its middle, or at its start.
    """
    EULER: typing.ClassVar[ImuIntegration]
    MIDPOINT: typing.ClassVar[ImuIntegration]
    @classmethod
    def __new__(cls, value):
        ...
    def __format__(self, format_spec):
        ...
class ImuSampling(enum.IntEnum):
    """
    What an IMU sample says: the value at its time, or the mean since the last one.
    """
    INTERVAL_MEAN: typing.ClassVar[ImuSampling]
    POINT: typing.ClassVar[ImuSampling]
    @classmethod
    def __new__(cls, value):
        ...
    def __format__(self, format_spec):
        ...
class ErrorStateOptions:
    """
    Options of ErrorStateFilter; every field is a keyword: ErrorStateOptions(clones=1, gate=False).
    """
    integration: ImuIntegration
    reset_jacobian: bool
    sampling: ImuSampling
    def __init__(self, **kwargs) -> None:
        """
        TypeError for an unknown field, ValueError for a value out of range.
        """
    def check(self) -> None:
        """
        ValueError names a field that is out of range.
        """
    @property
    def bridge_angular_velocity_sigma(self) -> float:
        """
        [rad/s]
        """
    @bridge_angular_velocity_sigma.setter
    def bridge_angular_velocity_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def bridge_specific_force_sigma(self) -> float:
        """
        [m/s^2]
        """
    @bridge_specific_force_sigma.setter
    def bridge_specific_force_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def clones(self) -> int:
        """
        Past poses that are kept, for relative odometry.
        """
    @clones.setter
    def clones(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def drift_sigma(self) -> float:
        """
        Steady state, one component [odometry's unit].
        """
    @drift_sigma.setter
    def drift_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def drift_time_constant_s(self) -> float:
        ...
    @drift_time_constant_s.setter
    def drift_time_constant_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def estimate_drift(self) -> bool:
        """
        Gauss-Markov drift of absolute odometry.
        """
    @estimate_drift.setter
    def estimate_drift(self, arg0: bool) -> None:
        ...
    @property
    def estimate_extrinsics(self) -> bool:
        """
        Where the odometry's sensor sits.
        """
    @estimate_extrinsics.setter
    def estimate_extrinsics(self, arg0: bool) -> None:
        ...
    @property
    def estimate_scale(self) -> bool:
        """
        Odometry's unit per metre.
        """
    @estimate_scale.setter
    def estimate_scale(self, arg0: bool) -> None:
        ...
    @property
    def gate(self) -> bool:
        """
        Chi-square gate before every update.
        """
    @gate.setter
    def gate(self, arg0: bool) -> None:
        ...
    @property
    def gate_probability(self) -> float:
        """
        Share of good measurements that pass it.
        """
    @gate_probability.setter
    def gate_probability(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gravity(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) in world [m/s^2]
        """
    @gravity.setter
    def gravity(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def history_ns(self) -> int:
        """
        How late a measurement may come.
        """
    @history_ns.setter
    def history_ns(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def max_bridge_ns(self) -> int:
        """
        Still longer ones are refused.
        """
    @max_bridge_ns.setter
    def max_bridge_ns(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def max_step_ns(self) -> int:
        """
        Longer steps between IMU samples are bridged and counted.
        """
    @max_step_ns.setter
    def max_step_ns(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def noise(self) -> ImuNoise:
        """
        ImuNoise; its turn-on sigmas are not used here.
        """
    @noise.setter
    def noise(self, arg0: ImuNoise) -> None:
        ...
    @property
    def scale_random_walk(self) -> float:
        """
        Relative [1/sqrt(s)].
        """
    @scale_random_walk.setter
    def scale_random_walk(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class FusionPresetSensors:
    """
    Sensors of the visual-inertial example, for FusionPreset; every field is a keyword.
    """
    def __init__(self, **kwargs) -> None:
        ...
    def check(self) -> None:
        ...
    @property
    def accelerometer_noise_density(self) -> float:
        """
        One-sided [m/s^2/sqrt(Hz)].
        """
    @accelerometer_noise_density.setter
    def accelerometer_noise_density(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def accelerometer_resolution(self) -> float:
        """
        [m/s^2]
        """
    @accelerometer_resolution.setter
    def accelerometer_resolution(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gyroscope_noise_density(self) -> float:
        """
        One-sided [rad/s/sqrt(Hz)].
        """
    @gyroscope_noise_density.setter
    def gyroscope_noise_density(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gyroscope_resolution(self) -> float:
        """
        [rad/s]
        """
    @gyroscope_resolution.setter
    def gyroscope_resolution(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def imu_rate_hz(self) -> float:
        ...
    @imu_rate_hz.setter
    def imu_rate_hz(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def odometry_drift_sigma(self) -> float:
        """
        [odometry's unit]
        """
    @odometry_drift_sigma.setter
    def odometry_drift_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def odometry_drift_tau(self) -> float:
        """
        Frames.
        """
    @odometry_drift_tau.setter
    def odometry_drift_tau(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def odometry_orientation_sigma(self) -> float:
        """
        [rad]
        """
    @odometry_orientation_sigma.setter
    def odometry_orientation_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def odometry_rate_hz(self) -> float:
        ...
    @odometry_rate_hz.setter
    def odometry_rate_hz(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def odometry_white_sigma(self) -> float:
        """
        [odometry's unit]
        """
    @odometry_white_sigma.setter
    def odometry_white_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class FusionPreset:
    """
    A ready configuration: options, start covariance (of a start at the truth) and noise of the odometry.
    """
    options: ErrorStateOptions
    @staticmethod
    def by_name(name: str, sensors: FusionPresetSensors = ...) -> FusionPreset:
        """
        "as_published", "16" or "19". ValueError for another name.
        """
    @property
    def odometry_orientation_cov(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def odometry_position_cov(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def start_cov(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
class PredictOutcome(enum.IntEnum):
    """
    What became of an IMU sample.
    """
    BRIDGED: typing.ClassVar[PredictOutcome]
    FIRST: typing.ClassVar[PredictOutcome]
    GAP: typing.ClassVar[PredictOutcome]
    NOT_FINITE: typing.ClassVar[PredictOutcome]
    NOT_STARTED: typing.ClassVar[PredictOutcome]
    PREDICTED: typing.ClassVar[PredictOutcome]
    TIME_NOT_INCREASING: typing.ClassVar[PredictOutcome]
    @classmethod
    def __new__(cls, value):
        ...
    def __format__(self, format_spec):
        ...
class FusionOutcome(enum.IntEnum):
    """
    What became of a measurement.
    """
    ACCEPTED: typing.ClassVar[FusionOutcome]
    BAD_COVARIANCE: typing.ClassVar[FusionOutcome]
    GATED: typing.ClassVar[FusionOutcome]
    MODEL_FAILED: typing.ClassVar[FusionOutcome]
    NOT_FINITE: typing.ClassVar[FusionOutcome]
    NOT_STARTED: typing.ClassVar[FusionOutcome]
    NO_CLONE: typing.ClassVar[FusionOutcome]
    TOO_EARLY: typing.ClassVar[FusionOutcome]
    TOO_LATE: typing.ClassVar[FusionOutcome]
    WAITING: typing.ClassVar[FusionOutcome]
    @classmethod
    def __new__(cls, value):
        ...
    def __format__(self, format_spec):
        ...
class FusionResult:
    """
    What became of a measurement, and why.
    """
    @property
    def accepted(self) -> bool:
        ...
    @property
    def dof(self) -> int:
        ...
    @property
    def innovation_cov(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def nis(self) -> float:
        ...
    @property
    def outcome(self) -> FusionOutcome:
        ...
    @property
    def residual(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def source(self) -> str:
        ...
    @property
    def time_ns(self) -> int | None:
        ...
class ErrorStateRun:
    """
    What ErrorStateFilter.run gives; row i is the state after IMU sample i.
    """
    @property
    def accelerometer_bias(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [m/s^2]
        """
    @property
    def covariance(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        (N, n, n) when asked for, otherwise None.
        """
    @property
    def drift(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3)
        """
    @property
    def gps_nis(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def gps_outcome(self) -> numpy.typing.NDArray[numpy.uint8]:
        ...
    @property
    def gyroscope_bias(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [rad/s]
        """
    @property
    def odometry_nis(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        One for each row of odometry; NaN where it was not applied.
        """
    @property
    def odometry_outcome(self) -> numpy.typing.NDArray[numpy.uint8]:
        """
        FusionOutcome; WAITING: newer than the last IMU sample.
        """
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [m]
        """
    @property
    def predict_outcome(self) -> numpy.typing.NDArray[numpy.uint8]:
        """
        (N,) PredictOutcome
        """
    @property
    def q_world_body_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 4)
        """
    @property
    def scale(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N,)
        """
    @property
    def variances(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, n), diagonal of the covariance: theta p v bg ba s c …
        """
    @property
    def velocity(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [m/s]
        """
class ErrorStateFilter:
    """
    Attitude, position, velocity and biases from an IMU, corrected by odometry without scale, GPS, velocity, height, heading, rest. Error state theta p v bg ba | scale | drift | extrinsics | clones, theta on the right. Late measurements are put where they belong.
    """
    def __init__(self, options: ErrorStateOptions | None = None) -> None:
        ...
    def correct(self, time_ns: typing.SupportsInt | typing.SupportsIndex, model: collections.abc.Callable) -> FusionResult:
        """
        A measurement of one's own: model(state) gives (residual, jacobian, noise_cov), shapes (d,), (d, n), (d, d), d <= 6; state is a dict of arrays: q_world_body_wxyz, position, velocity, gyroscope_bias, accelerometer_bias, scale, drift. It is called again when history is computed anew.
        """
    def counts(self) -> dict[str, int]:
        """
        {name: number}
        """
    def fuse_gps(self, time_ns: typing.SupportsInt | typing.SupportsIndex, position: numpy.typing.ArrayLike, position_cov: numpy.typing.ArrayLike, antenna: numpy.typing.ArrayLike = [0.0, 0.0, 0.0], velocity: numpy.typing.ArrayLike | None = None, velocity_cov: numpy.typing.ArrayLike | None = None) -> FusionResult:
        """
        Position in world [m], velocity in world [m/s], antenna in body axes [m].
        """
    def fuse_heading(self, time_ns: typing.SupportsInt | typing.SupportsIndex, heading: typing.SupportsFloat | typing.SupportsIndex, sigma: typing.SupportsFloat | typing.SupportsIndex) -> FusionResult:
        """
        [rad]
        """
    def fuse_height(self, time_ns: typing.SupportsInt | typing.SupportsIndex, height: typing.SupportsFloat | typing.SupportsIndex, sigma: typing.SupportsFloat | typing.SupportsIndex) -> FusionResult:
        """
        [m]
        """
    def fuse_velocity(self, time_ns: typing.SupportsInt | typing.SupportsIndex, velocity: numpy.typing.ArrayLike, velocity_cov: numpy.typing.ArrayLike, in_body: bool = False) -> FusionResult:
        ...
    def fuse_vo(self, time_ns: typing.SupportsInt | typing.SupportsIndex, position: numpy.typing.ArrayLike, position_cov: numpy.typing.ArrayLike, q_world_odometry_wxyz: numpy.typing.ArrayLike, orientation_cov: numpy.typing.ArrayLike) -> FusionResult:
        """
        Absolute odometry, position in its own unit.
        """
    def fuse_vo_relative(self, time0_ns: typing.SupportsInt | typing.SupportsIndex, time1_ns: typing.SupportsInt | typing.SupportsIndex, position: numpy.typing.ArrayLike, position_cov: numpy.typing.ArrayLike, rotation_wxyz: numpy.typing.ArrayLike, orientation_cov: numpy.typing.ArrayLike) -> FusionResult:
        """
        Pose of the odometry's sensor at time1 in its axes at time0; needs options.clones.
        """
    def fuse_zero_velocity(self, time_ns: typing.SupportsInt | typing.SupportsIndex, velocity_sigma: typing.SupportsFloat | typing.SupportsIndex, angular_velocity: numpy.typing.ArrayLike | None = None, angular_velocity_sigma: typing.SupportsFloat | typing.SupportsIndex = ...) -> FusionResult:
        """
        At rest: velocity zero, and the gyroscope reads its bias.
        """
    def keep_pose(self, time_ns: typing.SupportsInt | typing.SupportsIndex) -> FusionResult:
        ...
    def predict(self, time_ns: typing.SupportsInt | typing.SupportsIndex, gyro: numpy.typing.ArrayLike, force: numpy.typing.ArrayLike) -> PredictOutcome:
        """
        The next IMU sample [rad/s], [m/s^2].
        """
    def residual(self, model: collections.abc.Callable) -> FusionResult:
        """
        What correct() would find now, without applying it.
        """
    def run(self, times_ns: numpy.typing.NDArray[numpy.int64], gyro: numpy.typing.NDArray[numpy.float64], force: numpy.typing.NDArray[numpy.float64], *, odometry_times_ns: numpy.typing.NDArray[numpy.int64] | None = None, odometry_position: numpy.typing.NDArray[numpy.float64] | None = None, odometry_position_cov: numpy.typing.NDArray[numpy.float64] | None = None, odometry_wxyz: numpy.typing.NDArray[numpy.float64] | None = None, odometry_orientation_cov: numpy.typing.NDArray[numpy.float64] | None = None, odometry_arrivals_ns: numpy.typing.NDArray[numpy.int64] | None = None, odometry_start_times_ns: numpy.typing.NDArray[numpy.int64] | None = None, gps_times_ns: numpy.typing.NDArray[numpy.int64] | None = None, gps_position: numpy.typing.NDArray[numpy.float64] | None = None, gps_position_cov: numpy.typing.NDArray[numpy.float64] | None = None, gps_arrivals_ns: numpy.typing.NDArray[numpy.int64] | None = None, antenna: numpy.typing.ArrayLike = [0.0, 0.0, 0.0], with_covariance: bool = False) -> ErrorStateRun:
        """
        A whole recording in one call, without the GIL and without copies of the input.
        
        times_ns (N,) int64, gyro (N, 3) [rad/s], force (N, 3) [m/s^2]. Odometry: times (M,), position (M, 3), wxyz (M, 4), covariances (3, 3) or (M, 3, 3); with start times it is relative to the poses of then. GPS: position (K, 3) in world [m]. Arrivals say when a measurement comes (default: at once); they must not decrease.
        """
    def start(self, time_ns: typing.SupportsInt | typing.SupportsIndex, covariance: numpy.typing.ArrayLike, q_world_body_wxyz: numpy.typing.ArrayLike = [1.0, 0.0, 0.0, 0.0], position: numpy.typing.ArrayLike = [0.0, 0.0, 0.0], velocity: numpy.typing.ArrayLike = [0.0, 0.0, 0.0], gyroscope_bias: numpy.typing.ArrayLike = [0.0, 0.0, 0.0], accelerometer_bias: numpy.typing.ArrayLike = [0.0, 0.0, 0.0], scale: typing.SupportsFloat | typing.SupportsIndex = 1.0) -> None:
        """
        Starts, or starts anew. covariance (n, n) of the error state; ValueError unless symmetric and positive semidefinite.
        """
    def widen(self, variances: numpy.typing.ArrayLike) -> None:
        """
        Adds to the variances of the error state, (n,): a filter that rejects everything listens.
        """
    @property
    def T_body_odometry(self) -> Pose3:
        ...
    @property
    def accelerometer_bias(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def covariance(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def drift(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def finished(self) -> list[FusionResult]:
        """
        What became of the measurements that waited for the last predict().
        """
    @property
    def gyroscope_bias(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def q_world_body_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def scale(self) -> float:
        ...
    @property
    def started(self) -> bool:
        ...
    @property
    def time_ns(self) -> int | None:
        ...
    @property
    def velocity(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
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
    def position_cov(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3, 3) [m^2], east, north, up
        """
    @property
    def times_ns(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (N,) int64
        """
    @property
    def velocity_cov(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3, 3) [m^2/s^2]
        """
    @property
    def velocity_enu(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [m/s]
        """
class OdometryArrays:
    """
    Odometry, empty when there is none; lengths in its own unit.
    """
    @property
    def orientation_cov(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3, 3) [rad^2], axes of body
        """
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [odometry's unit]
        """
    @property
    def position_cov(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3, 3) [unit^2]
        """
    @property
    def q_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 4), takes body to world, or to body at the start
        """
    @property
    def start_times_ns(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (N,) int64, from when a relative pose counts; the smallest int64 (NO_TIME): absolute
        """
    @property
    def times_ns(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (N,) int64
        """
class FeaturesArrays:
    """
    Features of N frames, empty when there are none. Those of frame i are rows first[i]:first[i + 1] of id and pixel_px.
    """
    @property
    def camera(self) -> numpy.typing.NDArray[numpy.int32]:
        """
        (N,) int32, index of the camera in the rig
        """
    @property
    def first(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (N + 1,) int64
        """
    @property
    def id(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (M,) int64, the same for the same point of the scene
        """
    @property
    def pixel_px(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (M, 2), u and v in the distorted image
        """
    @property
    def sigma_px(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N,), deviation of one coordinate; NaN when unknown
        """
    @property
    def times_ns(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (N,) int64
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
    def features(self) -> FeaturesArrays:
        ...
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
    def odometry(self) -> OdometryArrays:
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
    def __next__(self) -> ImuMeasurement | MagnetometerMeasurement | ImageMeasurement | GpsMeasurement | ReferenceMeasurement | OdometryMeasurement | FeaturesMeasurement:
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
class EqvioSource(MeasurementSource):
    """
    Tracks and IMU of a file of GTSAM's EqVIO example.
    """
    @property
    def rig(self) -> Rig:
        """
        Has the camera that the pixels are of.
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
class MotionArrays:
    """
    States of a motion at N times.
    """
    @property
    def acceleration(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [m/s^2], in world, without gravity
        """
    @property
    def angular_acceleration(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [rad/s^2], in body axes
        """
    @property
    def angular_velocity(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [rad/s], in body axes
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
    def times_s(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N,)
        """
    @property
    def velocity(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [m/s], in world
        """
class Motion:
    """
    True motion of a body: what simulated sensors measure, without noise. World has z up; vehicles: x forward, y left, z up.
    """
    def sample(self, times_s: numpy.typing.NDArray[numpy.float64]) -> MotionArrays:
        """
        States at times_s, float64 (N,), each in [0, duration_s]; in any order. Raises ValueError naming the time.
        """
    @property
    def duration_s(self) -> float:
        """
        inf for motions that go on for ever
        """
class WaypointMotion(Motion):
    """
    A ground vehicle that passes way-points at given times: clothoids through the points with their courses, cubic distance over time with the given speeds, height a cubic (with the given vertical velocities, else shape-preserving), yaw along the path. The same place twice is a stop.
    """
    def __init__(self, times_s: numpy.typing.ArrayLike, positions: numpy.typing.ArrayLike, velocities: numpy.typing.ArrayLike | None = None, courses_rad: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex | None] = []) -> None:
        """
        times_s (N,), positions (N, 3) [m]; velocities (N, 3) [m/s]: none are estimated; courses_rad: N numbers or None, from x towards y, for points where the velocity is zero or not given; those left out are estimated. Raises ValueError naming index and value.
        """
    @property
    def courses_rad(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N,) as used, without steps of two pi.
        """
    @property
    def length(self) -> float:
        """
        Of the horizontal path [m].
        """
class LookAtMotion(Motion):
    """
    A camera (x right, y down, z forward) on a spline of positions that looks at a spline of points; both have two continuous derivatives. q_world_body_wxyz is that of the camera.
    """
    def __init__(self, times_s: numpy.typing.ArrayLike, positions: numpy.typing.ArrayLike, look_at: numpy.typing.ArrayLike, *, up: numpy.typing.ArrayLike | None = None, smallest_distance_m: typing.SupportsFloat | typing.SupportsIndex = 0.01, smallest_angle_rad: typing.SupportsFloat | typing.SupportsIndex = 0.01) -> None:
        """
        times_s (N,), positions and look_at (N, 3) [m]; up (3,), by default z. Raises ValueError naming the time at which the camera comes closer to the point than smallest_distance_m, or looks more steeply up or down than smallest_angle_rad.
        """
class RestMotion(Motion):
    """
    Stays where it is.
    """
    def __init__(self, T_world_body: Pose3 | None = None) -> None:
        ...
class CircleMotion(Motion):
    """
    Horizontal circle with constant speed; body x along it. Negative speed: clockwise.
    """
    def __init__(self, *, center: numpy.typing.ArrayLike | None = None, radius_m: typing.SupportsFloat | typing.SupportsIndex = 10.0, speed_mps: typing.SupportsFloat | typing.SupportsIndex = 5.0, start_angle_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        ...
class FigureEightMotion(Motion):
    """
    x = length/2 sin u, y = width/2 sin 2u, z = height/2 sin u, u = 2 pi t/period.
    """
    def __init__(self, *, center: numpy.typing.ArrayLike | None = None, length_m: typing.SupportsFloat | typing.SupportsIndex = 40.0, width_m: typing.SupportsFloat | typing.SupportsIndex = 20.0, height_m: typing.SupportsFloat | typing.SupportsIndex = 0.0, period_s: typing.SupportsFloat | typing.SupportsIndex = 30.0) -> None:
        ...
class HandHeldMotion(Motion):
    """
    A sensor shaken and turned by hand about a mean pose: sums of sines in six axes, frequencies and phases drawn at random. rotates and moves switch axes of the mean pose off, and leave the others as they were.
    """
    def __init__(self, random: Random, *, T_world_mean: Pose3 | None = None, angular_rate_rms: typing.SupportsFloat | typing.SupportsIndex = 0.9, acceleration_rms: typing.SupportsFloat | typing.SupportsIndex = 1.5, lowest_hz: typing.SupportsFloat | typing.SupportsIndex = 0.3, highest_hz: typing.SupportsFloat | typing.SupportsIndex = 2.0, scale: typing.SupportsFloat | typing.SupportsIndex = 1.0, rotates: typing.Annotated[collections.abc.Sequence[bool], "FixedSize(3)"] = [True, True, True], moves: typing.Annotated[collections.abc.Sequence[bool], "FixedSize(3)"] = [True, True, True]) -> None:
        """
        Takes a copy of random, which is left as it was.
        """
class CarMotion(Motion):
    """
    phases (N, 3): duration [s], speed at the end [m/s], turn to the left [rad], each passed smoothly; by default round a block. Exactly at rest between speeds of zero.
    """
    def __init__(self, phases: numpy.typing.ArrayLike | None = None, *, start: numpy.typing.ArrayLike | None = None, course_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0, speed_mps: typing.SupportsFloat | typing.SupportsIndex = 0.0, cycles: typing.SupportsInt | typing.SupportsIndex | None = None) -> None:
        ...
class PedestrianMotion(Motion):
    """
    phases as of CarMotion, by default round a square with pauses; bob, sway, nod and roll with the steps, glances to both sides.
    """
    def __init__(self, phases: numpy.typing.ArrayLike | None = None, *, start: numpy.typing.ArrayLike | None = None, course_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0, speed_mps: typing.SupportsFloat | typing.SupportsIndex = 0.0, cycles: typing.SupportsInt | typing.SupportsIndex | None = None, step_length_m: typing.SupportsFloat | typing.SupportsIndex = 0.74, walking_speed_mps: typing.SupportsFloat | typing.SupportsIndex = 1.4, bob_m: typing.SupportsFloat | typing.SupportsIndex = 0.02, sway_m: typing.SupportsFloat | typing.SupportsIndex = 0.015, nod_rad: typing.SupportsFloat | typing.SupportsIndex = 0.015, roll_rad: typing.SupportsFloat | typing.SupportsIndex = 0.02, head_turn_rad: typing.SupportsFloat | typing.SupportsIndex = 0.6, head_turn_s: typing.SupportsFloat | typing.SupportsIndex = 2.5, head_turn_period_s: typing.SupportsFloat | typing.SupportsIndex = 7.0) -> None:
        ...
class MountedMotion(Motion):
    """
    A sensor fixed to a moving body: its own pose, velocity, acceleration and rates.
    """
    def __init__(self, body: Motion, T_body_sensor: Pose3) -> None:
        ...
class RestFirstMotion(Motion):
    """
    A motion after a rest: then its own time begins to run, at a rate that goes smoothly from 0 to 1 in ease_s.
    """
    def __init__(self, motion: Motion, *, rest_s: typing.SupportsFloat | typing.SupportsIndex = 2.0, ease_s: typing.SupportsFloat | typing.SupportsIndex = 2.0) -> None:
        ...
    def motion_time_s(self, time_s: typing.SupportsFloat | typing.SupportsIndex) -> float:
        """
        The motion's own time at a time of this one.
        """
class Camera:
    """
    Projection of a calibrated camera. Points are in its axes (x right, y down, z forward) [m]; pixel (0, 0) is the centre of the top-left one. Rows without an answer are NaN: behind the camera, or outside the radius at which the distortion folds back.
    """
    def __init__(self, calibration: CameraCalibration) -> None:
        ...
    def in_image(self, pixels: numpy.typing.NDArray[numpy.float64], border_px: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> numpy.typing.NDArray[numpy.bool]:
        """
        bool (N,): at least so far from the image's border.
        """
    def project(self, points: numpy.typing.NDArray[numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
        """
        Points (N, 3) to pixels (N, 2).
        """
    def project_with_jacobians(self, points: numpy.typing.NDArray[numpy.float64]) -> tuple:
        """
        (pixels (N, 2), their derivatives by the point (N, 2, 3), and by fx fy cx cy and the distortion (N, 2, 8)).
        """
    def unproject(self, pixels: numpy.typing.NDArray[numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
        """
        Pixels (N, 2) to unit vectors (N, 3).
        """
    @property
    def max_angle(self) -> float:
        """
        Of a ray to the optical axis [rad].
        """
class Scene:
    """
    What a simulated camera looks at: points, and textured faces for pictures of them.
    """
    def __init__(self, points: numpy.typing.ArrayLike) -> None:
        """
        Points (N, 3) in world [m], seen from everywhere.
        """
    def add(self, other: Scene, T_world_other: Pose3 | None = None) -> int:
        """
        Adds another scene, moved. Returns the row of its first point.
        """
    def visible_from(self, eye: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.bool]:
        """
        bool (N,): the points that no face hides from a place (3,).
        """
    @property
    def faces(self) -> int:
        """
        how many
        """
    @property
    def points(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) in world [m]; the row is the identity of a feature
        """
class StreetModel:
    """
    Measures of a street [m]; every field is a keyword: StreetModel(road_width_m=6).
    """
    def __init__(self, **kwargs) -> None:
        ...
    @property
    def extend_m(self) -> float:
        """
        straight on before and beyond the path
        """
    @extend_m.setter
    def extend_m(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def kinds(self) -> int:
        """
        different houses
        """
    @kinds.setter
    def kinds(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def largest_gap_m(self) -> float:
        """
        between houses
        """
    @largest_gap_m.setter
    def largest_gap_m(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_facade_m(self) -> float:
        ...
    @max_facade_m.setter
    def max_facade_m(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_height_m(self) -> float:
        ...
    @max_height_m.setter
    def max_height_m(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def min_facade_m(self) -> float:
        ...
    @min_facade_m.setter
    def min_facade_m(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def min_height_m(self) -> float:
        ...
    @min_height_m.setter
    def min_height_m(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def pavement_m(self) -> float:
        """
        between road and facades
        """
    @pavement_m.setter
    def pavement_m(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def road_width_m(self) -> float:
        ...
    @road_width_m.setter
    def road_width_m(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def window_m(self) -> float:
        """
        distance of windows, about; four features each
        """
    @window_m.setter
    def window_m(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class CameraModel:
    """
    A simulated camera with its feature tracker; every field is a keyword: CameraModel(sigma_px=0.3).
    """
    def __init__(self, **kwargs) -> None:
        ...
    def check(self) -> None:
        """
        ValueError names a field that is out of range.
        """
    @property
    def border_px(self) -> float:
        """
        no features nearer to the image's border
        """
    @border_px.setter
    def border_px(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def loss_rate(self) -> float:
        """
        probability of losing a track in view, per frame
        """
    @loss_rate.setter
    def loss_rate(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_depth_m(self) -> float:
        ...
    @max_depth_m.setter
    def max_depth_m(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_features(self) -> int:
        """
        0: no limit
        """
    @max_features.setter
    def max_features(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def min_depth_m(self) -> float:
        ...
    @min_depth_m.setter
    def min_depth_m(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def min_separation_px(self) -> float:
        """
        of a new feature from the others
        """
    @min_separation_px.setter
    def min_separation_px(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def new_id_rate(self) -> float:
        """
        share of found ones that get a new identity
        """
    @new_id_rate.setter
    def new_id_rate(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def occlusion(self) -> bool:
        """
        faces hide what is behind them
        """
    @occlusion.setter
    def occlusion(self, arg0: bool) -> None:
        ...
    @property
    def outlier_rate(self) -> float:
        """
        share that is anywhere in the image
        """
    @outlier_rate.setter
    def outlier_rate(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def rate_hz(self) -> float:
        ...
    @rate_hz.setter
    def rate_hz(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def reappear_rate(self) -> float:
        """
        probability of finding a lost one in view, per frame
        """
    @reappear_rate.setter
    def reappear_rate(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def sigma_px(self) -> float:
        """
        white noise of each coordinate
        """
    @sigma_px.setter
    def sigma_px(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def stamp_jitter_s(self) -> float:
        ...
    @stamp_jitter_s.setter
    def stamp_jitter_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def start_time_ns(self) -> int:
        """
        time 0 of the motion on the IMU's clock
        """
    @start_time_ns.setter
    def start_time_ns(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def wrong_id_rate(self) -> float:
        """
        share that changed identities with another one
        """
    @wrong_id_rate.setter
    def wrong_id_rate(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class CameraRun:
    """
    F frames of a simulated camera, and the M features of all of them in order.
    """
    @property
    def depth_m(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (M,) along the optical axis
        """
    @property
    def feature(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (M,) measured identity
        """
    @property
    def frame(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (M,) index of the frame
        """
    @property
    def outlier(self) -> numpy.typing.NDArray[numpy.bool]:
        """
        (M,) bool
        """
    @property
    def pixel_px(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (M, 2) measured, u and v
        """
    @property
    def point(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (M,) truth: row of the scene's points
        """
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (F, 3) of camera in world [m]
        """
    @property
    def q_world_camera_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (F, 4)
        """
    @property
    def time_ns(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (F,) stamps, on the camera's clock
        """
    @property
    def true_pixel_px(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (M, 2)
        """
    @property
    def true_time_s(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (F,) since the start of the motion
        """
    @property
    def wrong_id(self) -> numpy.typing.NDArray[numpy.bool]:
        """
        (M,) bool
        """
class SceneRenderer:
    """
    Pictures of a scene as a calibrated camera takes them.
    """
    def __init__(self, scene: Scene, calibration: CameraCalibration, *, format: str = 'grey', texel_m: typing.SupportsFloat | typing.SupportsIndex = 0.0, blur_px: typing.SupportsFloat | typing.SupportsIndex = 2.0, gain: typing.SupportsFloat | typing.SupportsIndex = 1.0, noise_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        ...
    def render(self, T_world_camera: Pose3 | collections.abc.Sequence[Pose3], random: Random = None) -> numpy.typing.NDArray[numpy.uint8]:
        """
        uint8 (height, width) or (height, width, 3). Several poses: their mean, as motion blur.
        """
class CalibrationTarget:
    """
    A flat target: CalibrationTarget('checkerboard 9x6 0.025') with inner corners and the side of a square [m], or CalibrationTarget('aprilgrid 6x6 0.088 0.3') as Kalibr has it, with the side of a tag [m] and the spacing as a share of it. Origin at corner 0, x right, y up, z towards who looks at it.
    """
    @staticmethod
    def read_kalibr(path: os.PathLike | str | bytes) -> CalibrationTarget:
        """
        From Kalibr's target.yaml.
        """
    def __init__(self, text: str) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def __str__(self) -> str:
        ...
    def corners(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3): places of all corners [m]; the row is the corner's id.
        """
    def write_kalibr(self, path: os.PathLike | str | bytes) -> None:
        ...
    @property
    def columns(self) -> int:
        """
        inner corners or tags along x
        """
    @property
    def first_tag(self) -> int:
        ...
    @property
    def has_direction(self) -> bool:
        """
        False for a checkerboard that looks the same after half a turn.
        """
    @property
    def is_april_grid(self) -> bool:
        ...
    @property
    def rows(self) -> int:
        ...
    @property
    def size_m(self) -> float:
        """
        side of a square or tag
        """
    @property
    def spacing(self) -> float:
        ...
class TargetView:
    """
    The corners of the target in one picture: TargetView(ids, pixels_px).
    """
    def __init__(self, ids: numpy.typing.NDArray[numpy.int64], pixels_px: numpy.typing.NDArray[numpy.float64], time_ns: typing.SupportsInt | typing.SupportsIndex | None = None) -> None:
        ...
    def __len__(self) -> int:
        ...
    @property
    def ids(self) -> numpy.typing.NDArray[numpy.int64]:
        ...
    @property
    def pixels_px(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 2); (0, 0) is the centre of the top-left pixel
        """
    @property
    def time_ns(self) -> int | None:
        ...
class CameraFitOptions:
    """
    Options of calibrate_camera; every field is a keyword.
    """
    model: DistortionModel
    def __init__(self, **kwargs) -> None:
        ...
    def check(self) -> None:
        ...
    @property
    def compare_models(self) -> bool:
        """
        also fits the other distortion model
        """
    @compare_models.setter
    def compare_models(self, arg0: bool) -> None:
        ...
    @property
    def corner_limit(self) -> float:
        """
        corners farther off are dropped [sigmas]
        """
    @corner_limit.setter
    def corner_limit(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_iterations(self) -> int:
        ...
    @max_iterations.setter
    def max_iterations(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def min_corners(self) -> int:
        """
        pictures with fewer are not used
        """
    @min_corners.setter
    def min_corners(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def view_limit(self) -> float:
        """
        pictures with a larger rms are dropped [medians]
        """
    @view_limit.setter
    def view_limit(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class CameraFitView:
    """
    One picture in the result of calibrate_camera.
    """
    @property
    def T_camera_target(self) -> Pose3:
        ...
    @property
    def corners(self) -> int:
        ...
    @property
    def corners_dropped(self) -> int:
        ...
    @property
    def reason(self) -> str:
        """
        why it is not used; empty when it is
        """
    @property
    def rms_px(self) -> float:
        """
        NaN: there is no pose
        """
    @property
    def tilt(self) -> float:
        """
        [rad] 0: seen from straight ahead
        """
    @property
    def used(self) -> bool:
        ...
    @property
    def worst_px(self) -> float:
        ...
class CameraFit:
    """
    Result of calibrate_camera.
    """
    @property
    def camera(self) -> CameraCalibration:
        ...
    @property
    def converged(self) -> bool:
        ...
    @property
    def corner_id(self) -> numpy.typing.NDArray[numpy.int64]:
        ...
    @property
    def corner_pixel_px(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def corner_residual_px(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (M, 2) found less projected
        """
    @property
    def corner_used(self) -> numpy.typing.NDArray[numpy.bool]:
        ...
    @property
    def corner_view(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (M,) index of the picture of each corner that has a residual
        """
    @property
    def corners_dropped(self) -> int:
        ...
    @property
    def corners_used(self) -> int:
        ...
    @property
    def covariance(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (8, 8) of fx fy cx cy and the distortion, from the size of the residuals
        """
    @property
    def covered_share(self) -> float:
        """
        of 12 x 9 cells of the image, those with a corner
        """
    @property
    def iterations(self) -> int:
        ...
    @property
    def median_uncertainty_px(self) -> float:
        ...
    @property
    def noise_px(self) -> float:
        """
        deviation of one coordinate of a corner
        """
    @property
    def other_model_rms_px(self) -> float:
        """
        NaN: not compared
        """
    @property
    def quality(self) -> Quality:
        ...
    @property
    def radius_share(self) -> float:
        """
        farthest corner from the middle, of half the diagonal
        """
    @property
    def rms_px(self) -> float:
        """
        of the distances of all corners that were used
        """
    @property
    def sigma(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (8,) the larger of both
        """
    @property
    def sigma_by_views(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (8,) deviations from how differently the pictures pull; NaN for fewer than 16 pictures
        """
    @property
    def tilt_range(self) -> float:
        """
        largest angle between two of the target's normals [rad]
        """
    @property
    def uncertainty_px(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (9, 12) deviation of the pixel of a given ray across the image; NaN: no ray there
        """
    @property
    def views(self) -> list[CameraFitView]:
        """
        one for each picture that was given
        """
    @property
    def views_used(self) -> int:
        ...
    @property
    def worst_uncertainty_px(self) -> float:
        ...
class RotationForm:
    """
    How the IMU's attitude is written as a spline.
    
    Members:
    
      CUMULATIVE
    
      THREE_ANGLES
    """
    CUMULATIVE: typing.ClassVar[RotationForm]
    THREE_ANGLES: typing.ClassVar[RotationForm]
    __members__: typing.ClassVar[dict[str, RotationForm]]
    @typing.overload
    def __eq__(self, other: RotationForm) -> bool:
        ...
    @typing.overload
    def __eq__(self, other: typing.Any) -> bool:
        ...
    def __getstate__(self) -> int:
        ...
    def __hash__(self) -> int:
        ...
    def __index__(self) -> int:
        ...
    def __init__(self, value: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def __int__(self) -> int:
        ...
    @typing.overload
    def __ne__(self, other: RotationForm) -> bool:
        ...
    @typing.overload
    def __ne__(self, other: typing.Any) -> bool:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, state: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def __str__(self) -> str:
        ...
    @property
    def name(self) -> str:
        ...
    @property
    def value(self) -> int:
        ...
class CameraRecording:
    """
    What one camera of the rig has seen: CameraRecording(camera, views).
    """
    def __init__(self, camera: CameraCalibration, views: collections.abc.Sequence[TargetView]) -> None:
        ...
    @property
    def camera(self) -> CameraCalibration:
        """
        CameraCalibration: intrinsics, with their deviations when it has them; its pose plays no part
        """
    @property
    def views(self) -> list[TargetView]:
        """
        [TargetView] with their times on the camera's clock
        """
class CameraImuOptions:
    """
    Options of calibrate_camera_imu; every field is a keyword.
    """
    refine_intrinsics: bool
    rotation: RotationForm
    def __init__(self, **kwargs) -> None:
        ...
    def check(self) -> None:
        ...
    @property
    def adapt_noise(self) -> bool:
        """
        noise of both IMU sensors and of each picture from the residuals, then once more
        """
    @adapt_noise.setter
    def adapt_noise(self, arg0: bool) -> None:
        ...
    @property
    def bias_spacing_s(self) -> float:
        """
        biases run straight between knots so far apart
        """
    @bias_spacing_s.setter
    def bias_spacing_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def check_line_delay(self) -> bool:
        """
        where it is not estimated: would it be another than 0?
        """
    @check_line_delay.setter
    def check_line_delay(self, arg0: bool) -> None:
        ...
    @property
    def corner_sigma_px(self) -> float:
        """
        of a coordinate
        """
    @corner_sigma_px.setter
    def corner_sigma_px(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def estimate_drift(self) -> bool:
        """
        the offset changes evenly over the recording
        """
    @estimate_drift.setter
    def estimate_drift(self, arg0: bool) -> None:
        ...
    @property
    def estimate_gravity(self) -> bool:
        """
        its size too
        """
    @estimate_gravity.setter
    def estimate_gravity(self, arg0: bool) -> None:
        ...
    @property
    def estimate_imu_matrices(self) -> bool:
        """
        scale and misalignment of gyroscope and accelerometer
        """
    @estimate_imu_matrices.setter
    def estimate_imu_matrices(self, arg0: bool) -> None:
        ...
    @property
    def estimate_line_delay(self) -> bool:
        """
        rolling shutter: time from one row to the next
        """
    @estimate_line_delay.setter
    def estimate_line_delay(self, arg0: bool) -> None:
        ...
    @property
    def gravity(self) -> float:
        """
        [m/s^2]
        """
    @gravity.setter
    def gravity(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def knot_spacing_s(self) -> float:
        """
        0: from the IMU's spectrum
        """
    @knot_spacing_s.setter
    def knot_spacing_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def loss_sigmas(self) -> float:
        """
        Cauchy's: a corner so far off counts half
        """
    @loss_sigmas.setter
    def loss_sigmas(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_iterations(self) -> int:
        """
        in all
        """
    @max_iterations.setter
    def max_iterations(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def memory_limit_mb(self) -> float:
        """
        what needs more is refused
        """
    @memory_limit_mb.setter
    def memory_limit_mb(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def order(self) -> int:
        """
        of the pose's spline, 4 or 6 are usual
        """
    @order.setter
    def order(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def time_limit_s(self) -> float:
        """
        of the start and the solution; 0: none
        """
    @time_limit_s.setter
    def time_limit_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def time_offset_s(self) -> float | None:
        """
        known to half a second; None: all offsets are tried
        """
    @time_offset_s.setter
    def time_offset_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex | None) -> None:
        ...
class CameraImuProgress:
    """
    Where the solution stands.
    """
    @property
    def cost(self) -> float:
        ...
    @property
    def elapsed_s(self) -> float:
        ...
    @property
    def iteration(self) -> int:
        ...
    @property
    def time_offset_s(self) -> float:
        """
        of the first camera
        """
class CameraImuCheck:
    """
    A quantity, estimated, or (where it was held) one step from there with everything else free. NaN: not looked at.
    """
    @property
    def estimated(self) -> bool:
        ...
    @property
    def sigma(self) -> float:
        ...
    @property
    def value(self) -> float:
        ...
class CameraImuMatrixCheck:
    """
    Likewise a matrix, entry by entry.
    """
    @property
    def estimated(self) -> bool:
        ...
    @property
    def sigma(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3, 3)
        """
    @property
    def value(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3, 3)
        """
class CameraImuView:
    """
    What became of a picture.
    """
    @property
    def reason(self) -> str:
        """
        why it was not used
        """
    @property
    def rms_px(self) -> float:
        """
        of its corners' distances
        """
    @property
    def sigma_px(self) -> float:
        """
        that each coordinate of its corners was given
        """
    @property
    def used(self) -> bool:
        ...
class CameraImuStart:
    """
    Start values of a camera, from the recording alone.
    """
    @property
    def R_camera_imu_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def correlation(self) -> float:
        """
        of the turn rates, at the offset
        """
    @property
    def curve_correlation(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N,) correlation of the turn rates there
        """
    @property
    def curve_offset_s(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N,) all offsets that were tried
        """
    @property
    def excitation(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) deviations of the turn rate along its main axes [rad/s]
        """
    @property
    def gyroscope_bias(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) [rad/s]
        """
    @property
    def rate_ratio(self) -> float:
        """
        size of the gyroscope's rates over that of the camera's
        """
    @property
    def second_correlation(self) -> float:
        """
        the best elsewhere
        """
    @property
    def time_offset_s(self) -> float:
        ...
class CameraImuCamera:
    """
    One camera in the result of calibrate_camera_imu.
    """
    @property
    def T_camera_imu(self) -> Pose3:
        ...
    @property
    def by_intrinsics(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (7, 8) how the mounting moves with fx fy cx cy and the distortion that are held
        """
    @property
    def camera(self) -> CameraCalibration:
        """
        as given, with pose, offset and mounting_quality; when refined with intrinsics and their quality
        """
    @property
    def corner_chi(self) -> float:
        """
        root of the mean square of the residuals over their deviation: 1 is right
        """
    @property
    def corner_id(self) -> numpy.typing.NDArray[numpy.int64]:
        ...
    @property
    def corner_pixel_px(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def corner_residual_px(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (M, 2) found less projected
        """
    @property
    def corner_view(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (M,) index of the picture of each corner that was used
        """
    @property
    def corner_weight(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (M,) that the loss leaves it
        """
    @property
    def covariance(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (7, 7) of a small turn of the camera about the IMU's axes [rad] (R_camera_imu Exp(turn)), of the translation of T_camera_imu [m], of the offset [s]
        """
    @property
    def intrinsics_change(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (8,) that the recording would make, or has made when refined
        """
    @property
    def intrinsics_sigma(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (8,) that were taken for fx fy cx cy and the distortion; when refined: found
        """
    @property
    def line_delay_s(self) -> CameraImuCheck:
        """
        from one row to the next
        """
    @property
    def offset_drift(self) -> CameraImuCheck:
        """
        [s/s]
        """
    @property
    def sigma(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (7,) deviations of covariance: of all that follow
        """
    @property
    def sigma_by_blocks(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (7,) from how pieces of the recording pull
        """
    @property
    def sigma_by_intrinsics(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (7,) from the deviations of the intrinsics
        """
    @property
    def sigma_by_noise(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (7,) from the noise as given or adapted
        """
    @property
    def start(self) -> CameraImuStart:
        ...
    @property
    def time_offset_s(self) -> float:
        """
        t_imu = t_camera + offset; with a drift, in the middle of the recording
        """
    @property
    def views(self) -> list[CameraImuView]:
        """
        one for each picture that was given
        """
class CameraImuFit:
    """
    Result of calibrate_camera_imu.
    """
    @property
    def accelerometer_chi(self) -> float:
        ...
    @property
    def accelerometer_matrix(self) -> CameraImuMatrixCheck:
        """
        CameraImuMatrixCheck, likewise; a lower triangle: body is the frame in which it is one
        """
    @property
    def accelerometer_noise_scale(self) -> float:
        ...
    @property
    def bandwidth_hz(self) -> float:
        """
        below which the IMU's spectrum holds the motion
        """
    @property
    def bias_time_ns(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (K,)
        """
    @property
    def biases(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (K, 6) gyroscope [rad/s], then accelerometer [m/s^2], straight between bias_time_ns
        """
    @property
    def cameras(self) -> list[CameraImuCamera]:
        """
        [CameraImuCamera], one for each that was given
        """
    @property
    def converged(self) -> bool:
        ...
    @property
    def cost(self) -> float:
        ...
    @property
    def counts(self) -> dict:
        """
        {name: number} of samples used and skipped, and why
        """
    @property
    def gravity_direction_sigma(self) -> float:
        """
        [rad]
        """
    @property
    def gravity_size(self) -> CameraImuCheck:
        """
        CameraImuCheck [m/s^2]
        """
    @property
    def gravity_target(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) in target [m/s^2]
        """
    @property
    def gyroscope_chi(self) -> float:
        """
        root of the mean square of the residuals over their deviation: 1 is right
        """
    @property
    def gyroscope_matrix(self) -> CameraImuMatrixCheck:
        """
        CameraImuMatrixCheck: reading = matrix * what the sensor feels + bias
        """
    @property
    def gyroscope_noise_scale(self) -> float:
        """
        on the noise that was given, when adapted
        """
    @property
    def imu_residuals(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 6) predicted less read at imu_time_ns, over their deviations: gyroscope, then accelerometer
        """
    @property
    def imu_time_ns(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (N,) of the samples that were used
        """
    @property
    def iterations(self) -> int:
        ...
    @property
    def knot_reason(self) -> str:
        """
        why this spacing
        """
    @property
    def knot_spacing_s(self) -> float:
        ...
    @property
    def quality(self) -> Quality:
        ...
    @property
    def solve_cpu_s(self) -> float:
        ...
    @property
    def start_cpu_s(self) -> float:
        ...
    @property
    def stopped(self) -> str:
        """
        why, when it has not converged: 'interrupted', 'time limit'
        """
    @property
    def target_imu_position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) of the IMU in target at imu_time_ns [m]
        """
    @property
    def target_imu_q_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 4) attitude of the IMU in target at imu_time_ns
        """
    @property
    def target_scale(self) -> CameraImuCheck:
        """
        CameraImuCheck: the target's true size over what it was said to be, by the accelerometer; never estimated
        """
class CameraImuFinding:
    """
    What lint_camera_imu found. severity OK: to be known; FAIR: a better recording would help; WARN: the result is in doubt; REFUSED: the calibration would fail or be wrong.
    """
    def __repr__(self) -> str:
        ...
    @property
    def code(self) -> str:
        """
        "imu.gyroscope_unit", "camera.gaps", ...: the same in all versions
        """
    @property
    def severity(self) -> Verdict:
        ...
    @property
    def text(self) -> str:
        """
        complete sentences with the figures
        """
class RotationStates:
    """
    What a rotation spline gives at N times.
    """
    @property
    def angular_acceleration(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) in body [rad/s^2]
        """
    @property
    def angular_velocity(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) in body [rad/s]
        """
    @property
    def q_world_body_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 4)
        """
class PoseStates(RotationStates):
    """
    What a spline of poses gives at N times.
    """
    @property
    def acceleration(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) in world [m/s^2]
        """
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) in world [m]
        """
    @property
    def velocity(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) in world [m/s]
        """
class SplineGrid:
    """
    Knots of a uniform B-spline at start_s + i * spacing_s. Order 4 is cubic, 6 quintic; 3 to 8 can be had. ValueError names a field that is out of range.
    """
    @staticmethod
    def over(begin_s: typing.SupportsFloat | typing.SupportsIndex, end_s: typing.SupportsFloat | typing.SupportsIndex, spacing_s: typing.SupportsFloat | typing.SupportsIndex, order: typing.SupportsInt | typing.SupportsIndex = 4) -> SplineGrid:
        """
        The shortest grid that covers these times, beginning at begin_s.
        """
    def __init__(self, start_s: typing.SupportsFloat | typing.SupportsIndex, spacing_s: typing.SupportsFloat | typing.SupportsIndex, segments: typing.SupportsInt | typing.SupportsIndex, order: typing.SupportsInt | typing.SupportsIndex = 4) -> None:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def abscissae_s(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n,): the time at which each control point has its largest influence
        """
    @property
    def control_points(self) -> int:
        """
        their number, segments + order - 1
        """
    @property
    def end_s(self) -> float:
        """
        end of the last segment
        """
    @property
    def order(self) -> int:
        """
        degree + 1
        """
    @property
    def segments(self) -> int:
        ...
    @property
    def spacing_s(self) -> float:
        ...
    @property
    def start_s(self) -> float:
        """
        begin of the first segment
        """
class VectorSpline:
    """
    A function of time on R^d. Before the first and behind the last segment its polynomial goes on.
    """
    def __init__(self, grid: SplineGrid, control_points: numpy.typing.NDArray[numpy.float64]) -> None:
        """
        control_points (n, d), n = grid.control_points
        """
    def value(self, times_s: numpy.typing.NDArray[numpy.float64], derivative: typing.SupportsInt | typing.SupportsIndex = 0) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, d) at times (N,) [s]; derivative by time: 0, 1 or 2.
        """
    @property
    def control_points(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n, d), a copy
        """
    @property
    def grid(self) -> SplineGrid:
        ...
class RotationSpline:
    """
    An attitude R_world_body over time, a cumulative B-spline on SO(3): no attitude is special. Neighbouring control points must be less than half a turn apart.
    """
    def __init__(self, grid: SplineGrid, control_points: numpy.typing.NDArray[numpy.float64]) -> None:
        """
        control_points (n, 4) wxyz, n = grid.control_points
        """
    def at(self, times_s: numpy.typing.NDArray[numpy.float64]) -> RotationStates:
        """
        RotationStates at times (N,) [s].
        """
    @property
    def control_points(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n, 4) wxyz, a copy
        """
    @property
    def grid(self) -> SplineGrid:
        ...
class PoseSpline:
    """
    A pose T_world_body over time: rotation and position apart, on one grid.
    """
    def __init__(self, rotation: RotationSpline, position: VectorSpline) -> None:
        """
        ValueError when the grids differ or position has not three columns.
        """
    def at(self, times_s: numpy.typing.NDArray[numpy.float64]) -> PoseStates:
        """
        PoseStates at times (N,) [s].
        """
    def resample(self, times_ns: numpy.typing.NDArray[numpy.int64], origin_ns: typing.SupportsInt | typing.SupportsIndex = 0) -> Trajectory:
        """
        Trajectory with the poses at these times (N,) int64; origin_ns: the time that is 0 s of the spline.
        """
    @property
    def grid(self) -> SplineGrid:
        ...
    @property
    def position(self) -> VectorSpline:
        ...
    @property
    def rotation(self) -> RotationSpline:
        ...
class EulerTrajectory:
    """
    A pose T_world_body over time as six B-splines, three angles about a mean attitude and a position: R = R_mean Rz(phi3) Ry(phi2) Rx(phi1). For motion about one attitude; PoseSpline has no such limit.
    """
    def __init__(self, mean_wxyz: numpy.typing.ArrayLike, grid: SplineGrid, control_points: numpy.typing.NDArray[numpy.float64]) -> None:
        """
        control_points (n, 6): three angles [rad] and the position [m]
        """
    def at(self, times_s: numpy.typing.NDArray[numpy.float64]) -> PoseStates:
        """
        PoseStates at times (N,) [s].
        """
    def resample(self, times_ns: numpy.typing.NDArray[numpy.int64], origin_ns: typing.SupportsInt | typing.SupportsIndex = 0) -> Trajectory:
        """
        Trajectory with the poses at these times (N,) int64; origin_ns: the time that is 0 s of the spline.
        """
    @property
    def control_points(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n, 6), a copy
        """
    @property
    def grid(self) -> SplineGrid:
        ...
    @property
    def mean_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
class VectorSplineFit:
    """
    Result of fit_vector_spline.
    """
    @property
    def rms(self) -> float:
        """
        of the residuals' norms
        """
    @property
    def spline(self) -> VectorSpline:
        ...
class PoseSplineFit:
    """
    Result of fit_pose_spline.
    """
    @property
    def converged(self) -> bool:
        ...
    @property
    def iterations(self) -> int:
        ...
    @property
    def rms_position(self) -> float:
        """
        of their distances [m]
        """
    @property
    def rms_rotation(self) -> float:
        """
        of the residuals' angles [rad]
        """
    @property
    def spline(self) -> PoseSpline:
        ...
class EulerTrajectoryFit:
    """
    Result of fit_euler_trajectory.
    """
    @property
    def rms_position(self) -> float:
        """
        of their distances [m]
        """
    @property
    def rms_rotation(self) -> float:
        """
        of the residuals' angles [rad]
        """
    @property
    def trajectory(self) -> EulerTrajectory:
        ...
class FeatureVideo:
    """
    A video file of features over the camera's pictures: .mp4 or .avi.
    """
    def __init__(self, path: os.PathLike | str | bytes, width_px: typing.SupportsInt | typing.SupportsIndex, height_px: typing.SupportsInt | typing.SupportsIndex, rate_hz: typing.SupportsFloat | typing.SupportsIndex = 20.0, *, tail_frames: typing.SupportsInt | typing.SupportsIndex = 10, identities: bool = True, dot_radius_px: typing.SupportsInt | typing.SupportsIndex = 3) -> None:
        """
        DataError when it cannot be written; ValueError for sizes that are not positive and even.
        """
    def add(self, features: FeaturesMeasurement, picture: ImageMeasurement = None) -> None:
        """
        picture: ImageMeasurement; None: white.
        """
    def finish(self) -> None:
        """
        Closes the file and looks whether it holds what was added.
        """
    @property
    def codec(self) -> str:
        ...
    @property
    def frames(self) -> int:
        ...
class TargetDetection:
    """
    What a TargetDetector found in one picture.
    """
    @property
    def corners_left_out(self) -> int:
        """
        not sharp enough to be placed
        """
    @property
    def foreign_tags(self) -> int:
        """
        that are no part of the grid
        """
    @property
    def reason(self) -> str:
        """
        why there are no corners
        """
    @property
    def view(self) -> TargetView:
        """
        no corners: the target was not found
        """
class TargetDetector:
    """
    Finds a calibration target in pictures, its corners to a few hundredths of a pixel.
    """
    def __init__(self, target: CalibrationTarget, *, thorough: bool = True, min_tags: typing.SupportsInt | typing.SupportsIndex = 2, min_contrast: typing.SupportsFloat | typing.SupportsIndex = 15.0, max_disagreement_px: typing.SupportsFloat | typing.SupportsIndex = 0.35) -> None:
        ...
    def detect(self, image: numpy.ndarray) -> TargetDetection:
        """
        image: uint8, (height, width) or (height, width, 3) with blue first.
        """
class SlamMotion(enum.IntEnum):
    """
    What the filter knows of the motion.
    """
    CONSTANT_VELOCITY: typing.ClassVar[SlamMotion]
    INERTIAL: typing.ClassVar[SlamMotion]
    @classmethod
    def __new__(cls, value):
        ...
    def __format__(self, format_spec):
        ...
class SlamConsistency(enum.IntEnum):
    """
    What keeps the filter from learning what it cannot know (place, heading) out of its linearisation errors.
    """
    FIRST_ESTIMATE: typing.ClassVar[SlamConsistency]
    INVARIANT: typing.ClassVar[SlamConsistency]
    PLAIN: typing.ClassVar[SlamConsistency]
    @classmethod
    def __new__(cls, value):
        ...
    def __format__(self, format_spec):
        ...
class SlamPrecision(enum.IntEnum):
    """
    Numbers of the covariance.
    """
    DOUBLE: typing.ClassVar[SlamPrecision]
    FLOAT: typing.ClassVar[SlamPrecision]
    @classmethod
    def __new__(cls, value):
        ...
    def __format__(self, format_spec):
        ...
class SlamMapOptions:
    """
    Which features the map has; every field is a keyword of the constructor.
    """
    def __init__(self, **kwargs) -> None:
        """
        TypeError for an unknown field, ValueError for a value out of range.
        """
    def check(self) -> None:
        """
        ValueError names a field that is out of range.
        """
    @property
    def border_px(self) -> float:
        """
        Predicted nearer to the border: not expected to be seen [px].
        """
    @border_px.setter
    def border_px(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def cover_radius(self) -> float:
        """
        Nothing joins the map so near to features that are expected but hidden, and they stay in it for a while. A share of the picture's width; 0: off.
        """
    @cover_radius.setter
    def cover_radius(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def delete_after_tries(self) -> int:
        """
        Frames in which a feature was expected, before it is judged.
        """
    @delete_after_tries.setter
    def delete_after_tries(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def delete_below_ratio(self) -> float:
        """
        Measured in less than this share of them: deleted.
        """
    @delete_below_ratio.setter
    def delete_below_ratio(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def depth_from_neighbours(self) -> bool:
        """
        rho_0 of a new feature is the median of those that are known; its deviation grows with it.
        """
    @depth_from_neighbours.setter
    def depth_from_neighbours(self, arg0: bool) -> None:
        ...
    @property
    def grid_columns(self) -> int:
        """
        The picture's cells, over which new features are spread.
        """
    @grid_columns.setter
    def grid_columns(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def grid_rows(self) -> int:
        """
        The same.
        """
    @grid_rows.setter
    def grid_rows(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def inverse_depth(self) -> float:
        """
        Of a new feature (rho_0) [1/m].
        """
    @inverse_depth.setter
    def inverse_depth(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_added(self) -> int:
        """
        In one frame; the first one fills up to min_visible.
        """
    @max_added.setter
    def max_added(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def max_features(self) -> int:
        """
        In the map; bounds memory and time.
        """
    @max_features.setter
    def max_features(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def max_linearity_index(self) -> float:
        """
        Below it a feature becomes XYZ; 0: never.
        """
    @max_linearity_index.setter
    def max_linearity_index(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_measured(self) -> int:
        """
        In one frame: the most informative ones of those in view.
        """
    @max_measured.setter
    def max_measured(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def min_separation_px(self) -> float:
        """
        Of a new feature from those in the map [px].
        """
    @min_separation_px.setter
    def min_separation_px(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def min_visible(self) -> int:
        """
        Fewer measured: features are added.
        """
    @min_visible.setter
    def min_visible(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def sigma_inverse_depth(self) -> float:
        """
        Its deviation (sigma_rho); 0 must lie well within 2 sigma [1/m].
        """
    @sigma_inverse_depth.setter
    def sigma_inverse_depth(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def steer_after_frames(self) -> int:
        """
        While something hides many features at once, younger ones than that are estimated but move nothing else. 0: off.
        """
    @steer_after_frames.setter
    def steer_after_frames(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
class SlamAssociationOptions:
    """
    Which measurements are believed; every field is a keyword of the constructor.
    """
    def __init__(self, **kwargs) -> None:
        """
        TypeError for an unknown field, ValueError for a value out of range.
        """
    def check(self) -> None:
        """
        ValueError names a field that is out of range.
        """
    def gate(self, motion: SlamMotion) -> float:
        """
        gate_probability, or its default for that motion model.
        """
    @property
    def gate_probability(self) -> float:
        """
        Of a right measurement to pass (chi-square of 2); 0: what gate() says.
        """
    @gate_probability.setter
    def gate_probability(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_hypotheses(self) -> int:
        ...
    @max_hypotheses.setter
    def max_hypotheses(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def ransac(self) -> bool:
        """
        Hypotheses from one measurement each; without it the gate alone.
        """
    @ransac.setter
    def ransac(self, arg0: bool) -> None:
        ...
    @property
    def ransac_probability(self) -> float:
        """
        Of having tried one right measurement at least.
        """
    @ransac_probability.setter
    def ransac_probability(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def seed(self) -> int:
        """
        Of the draws.
        """
    @seed.setter
    def seed(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
class StandStillOptions:
    """
    When an IMU is at rest; every field is a keyword of the constructor.
    """
    def __init__(self, **kwargs) -> None:
        """
        TypeError for an unknown field, ValueError for a value out of range.
        """
    def check(self) -> None:
        """
        ValueError names a field that is out of range.
        """
    @property
    def force_sigma_floor(self) -> float:
        """
        Of one sample: quantisation, a desk [m/s^2].
        """
    @force_sigma_floor.setter
    def force_sigma_floor(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_angular_velocity(self) -> float:
        """
        Mean rate less the bias [rad/s].
        """
    @max_angular_velocity.setter
    def max_angular_velocity(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_force_change(self) -> float:
        """
        Of the mean force since this rest began [m/s^2].
        """
    @max_force_change.setter
    def max_force_change(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_force_error(self) -> float:
        """
        Length of the mean force less gravity [m/s^2].
        """
    @max_force_error.setter
    def max_force_error(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_rate_change(self) -> float:
        """
        Of the mean rate since this rest began [rad/s].
        """
    @max_rate_change.setter
    def max_rate_change(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def min_duration_s(self) -> float:
        """
        Calm for this long is rest; the window counts [s].
        """
    @min_duration_s.setter
    def min_duration_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def min_speed(self) -> float:
        """
        A speed that is surely higher says: not at rest [m/s].
        """
    @min_speed.setter
    def min_speed(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def rate_sigma_floor(self) -> float:
        """
        The same [rad/s].
        """
    @rate_sigma_floor.setter
    def rate_sigma_floor(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def threshold(self) -> float:
        """
        Of the test; 6 is white noise of the densities alone.
        """
    @threshold.setter
    def threshold(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def window_s(self) -> float:
        """
        [s]
        """
    @window_s.setter
    def window_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class FusionStartOptions:
    """
    Start of an inertial filter from its first second; every field is a keyword of the constructor.
    """
    def __init__(self, **kwargs) -> None:
        """
        TypeError for an unknown field, ValueError for a value out of range.
        """
    def check(self) -> None:
        """
        ValueError names a field that is out of range.
        """
    @property
    def duration_s(self) -> float:
        """
        So much of the data is looked at [s].
        """
    @duration_s.setter
    def duration_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def heading(self) -> float | None:
        """
        Of the body, from east to north [rad]; None: not known.
        """
    @heading.setter
    def heading(self, arg0: typing.SupportsFloat | typing.SupportsIndex | None) -> None:
        ...
    @property
    def heading_sigma(self) -> float:
        """
        Of the one that is given [rad].
        """
    @heading_sigma.setter
    def heading_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def magnetic_declination(self) -> float:
        """
        East of north positive [rad].
        """
    @magnetic_declination.setter
    def magnetic_declination(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def magnetic_heading_sigma(self) -> float:
        """
        Iron nearby, declination [rad].
        """
    @magnetic_heading_sigma.setter
    def magnetic_heading_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_gap_s(self) -> float:
        """
        A longer step begins anew [s].
        """
    @max_gap_s.setter
    def max_gap_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def moving_acceleration_sigma(self) -> float:
        """
        Of the mean over duration_s, when not at rest [m/s^2].
        """
    @moving_acceleration_sigma.setter
    def moving_acceleration_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def moving_velocity_sigma(self) -> float:
        """
        [m/s]
        """
    @moving_velocity_sigma.setter
    def moving_velocity_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def position_sigma(self) -> float:
        """
        The start is the origin [m].
        """
    @position_sigma.setter
    def position_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def still_bias_sigma_floor(self) -> float:
        """
        Of the gyroscope's bias from a rest: earth rate, swaying [rad/s].
        """
    @still_bias_sigma_floor.setter
    def still_bias_sigma_floor(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def still_velocity_sigma(self) -> float:
        """
        [m/s]
        """
    @still_velocity_sigma.setter
    def still_velocity_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def tilt_sigma_floor(self) -> float:
        """
        [rad]
        """
    @tilt_sigma_floor.setter
    def tilt_sigma_floor(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class SlamStartOptions:
    """
    Start of InertialSlam in motion, from a window of IMU samples and tracks; every field is a keyword of the constructor.
    """
    def __init__(self, **kwargs) -> None:
        """
        TypeError for an unknown field, ValueError for a value out of range.
        """
    def check(self) -> None:
        """
        ValueError names a field that is out of range.
        """
    @property
    def gyroscope_bias_sigma(self) -> float:
        """
        Wide prior [rad/s].
        """
    @gyroscope_bias_sigma.setter
    def gyroscope_bias_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_condition(self) -> float:
        """
        Of the normal equations.
        """
    @max_condition.setter
    def max_condition(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_duration_s(self) -> float:
        """
        Older ones are forgotten [s].
        """
    @max_duration_s.setter
    def max_duration_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_features(self) -> int:
        """
        Those with the longest tracks.
        """
    @max_features.setter
    def max_features(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def max_frames(self) -> int:
        """
        Of more, so many spread evenly are looked at.
        """
    @max_frames.setter
    def max_frames(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def max_gap_s(self) -> float:
        """
        Between IMU samples; a longer one begins anew [s].
        """
    @max_gap_s.setter
    def max_gap_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_scale_sigma(self) -> float:
        """
        Relative deviation of the scale.
        """
    @max_scale_sigma.setter
    def max_scale_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_sigma_ratio(self) -> float:
        """
        Residuals may be so much larger than sigma_px says.
        """
    @max_sigma_ratio.setter
    def max_sigma_ratio(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_tilt_sigma(self) -> float:
        """
        [rad]
        """
    @max_tilt_sigma.setter
    def max_tilt_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def min_duration_s(self) -> float:
        """
        Of the frames that are looked at [s].
        """
    @min_duration_s.setter
    def min_duration_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def min_features(self) -> int:
        ...
    @min_features.setter
    def min_features(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def min_frames(self) -> int:
        ...
    @min_frames.setter
    def min_frames(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def min_inliers(self) -> float:
        """
        Share of observations that must fit.
        """
    @min_inliers.setter
    def min_inliers(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def min_observations(self) -> int:
        """
        Of a feature.
        """
    @min_observations.setter
    def min_observations(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def min_parallax(self) -> float:
        """
        Median over the features of the largest, in deviations of an observation.
        """
    @min_parallax.setter
    def min_parallax(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def sampling(self) -> ImuSampling:
        """
        ImuSampling: what an IMU sample says.
        """
    @sampling.setter
    def sampling(self, arg0: ImuSampling) -> None:
        ...
    @property
    def sigma_px(self) -> float:
        """
        Not used by InertialSlam, which has its own [px].
        """
    @sigma_px.setter
    def sigma_px(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def velocity_floor(self) -> float:
        """
        A deviation of the velocity below max_scale_sigma times this is good enough [m/s].
        """
    @velocity_floor.setter
    def velocity_floor(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class KnownLandmark:
    """
    A point whose place in world is known: it gives the scale and ties the world.
    """
    def __init__(self, id: typing.SupportsInt | typing.SupportsIndex, position: numpy.typing.ArrayLike, sigma: typing.SupportsFloat | typing.SupportsIndex = 0.001) -> None:
        ...
    @property
    def id(self) -> int:
        ...
    @id.setter
    def id(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) in world [m]
        """
    @position.setter
    def position(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def sigma(self) -> float:
        """
        Of each coordinate [m].
        """
    @sigma.setter
    def sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class SlamOptions:
    """
    Options of MonoSlam and InertialSlam; every field is a keyword of the constructor: SlamOptions(camera=rig.cameras[0], sigma_px=0.5). Structs inside can be changed in place: options.map.max_features = 60.
    """
    consistency: SlamConsistency
    motion: SlamMotion
    precision: SlamPrecision
    def __copy__(self) -> SlamOptions:
        ...
    def __deepcopy__(self, memo: dict) -> SlamOptions:
        ...
    def __init__(self, **kwargs) -> None:
        """
        TypeError for an unknown field; ValueError for a value out of range, once a camera is given.
        """
    def check(self) -> None:
        """
        ValueError names a field that is out of range.
        """
    @property
    def acceleration_density(self) -> float:
        """
        Q, camera alone [m/s^2/sqrt(Hz)].
        """
    @acceleration_density.setter
    def acceleration_density(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def angular_acceleration_density(self) -> float:
        """
        Q, camera alone [rad/s^2/sqrt(Hz)].
        """
    @angular_acceleration_density.setter
    def angular_acceleration_density(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def angular_velocity(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Start: in body (3,) (X_cam_angular_velocity) [rad/s].
        """
    @angular_velocity.setter
    def angular_velocity(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def association(self) -> SlamAssociationOptions:
        """
        SlamAssociationOptions
        """
    @association.setter
    def association(self, arg0: SlamAssociationOptions) -> None:
        ...
    @property
    def camera(self) -> CameraCalibration:
        """
        CameraCalibration: K with distortion, pose in body, clock. Without an IMU body is what moves smoothly; T_body_camera may be the identity.
        """
    @camera.setter
    def camera(self, arg0: CameraCalibration) -> None:
        ...
    @property
    def camera_index(self) -> int:
        """
        Which frames are ours.
        """
    @camera_index.setter
    def camera_index(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def estimate_extrinsics(self) -> bool:
        """
        T_body_camera is part of the state.
        """
    @estimate_extrinsics.setter
    def estimate_extrinsics(self, arg0: bool) -> None:
        ...
    @property
    def estimate_time_offset(self) -> bool:
        """
        So is camera.time_offset_s.
        """
    @estimate_time_offset.setter
    def estimate_time_offset(self, arg0: bool) -> None:
        ...
    @property
    def gap_acceleration_sigma(self) -> float:
        """
        What the body may do in a gap [m/s^2].
        """
    @gap_acceleration_sigma.setter
    def gap_acceleration_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gap_angular_velocity_sigma(self) -> float:
        """
        The same [rad/s].
        """
    @gap_angular_velocity_sigma.setter
    def gap_angular_velocity_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gravity(self) -> float:
        """
        [m/s^2]
        """
    @gravity.setter
    def gravity(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def imu_noise(self) -> ImuNoise:
        """
        Q, with an IMU; biases begin with its deviations.
        """
    @imu_noise.setter
    def imu_noise(self, arg0: ImuNoise) -> None:
        ...
    @property
    def imu_sampling(self) -> ImuSampling:
        """
        ImuSampling: what a sample of the IMU says.
        """
    @imu_sampling.setter
    def imu_sampling(self, arg0: ImuSampling) -> None:
        ...
    @property
    def landmarks(self) -> list[KnownLandmark]:
        """
        Copies of the known landmarks: assign a list to change them.
        """
    @landmarks.setter
    def landmarks(self, arg1: collections.abc.Sequence[KnownLandmark]) -> None:
        ...
    @property
    def lost_after_s(self) -> float:
        """
        Without a frame that is found in the map: estimates say so (LOST; with an IMU FEW_FEATURES, too) [s].
        """
    @lost_after_s.setter
    def lost_after_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def map(self) -> SlamMapOptions:
        """
        SlamMapOptions
        """
    @map.setter
    def map(self, arg0: SlamMapOptions) -> None:
        ...
    @property
    def max_angular_velocity(self) -> float:
        """
        A sample with more is skipped [rad/s].
        """
    @max_angular_velocity.setter
    def max_angular_velocity(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_gap_s(self) -> float:
        """
        Camera alone: after a longer pause between frames the motion is unknown [s].
        """
    @max_gap_s.setter
    def max_gap_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_imu_bridge_s(self) -> float:
        """
        Beyond it a new start [s].
        """
    @max_imu_bridge_s.setter
    def max_imu_bridge_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_imu_step_s(self) -> float:
        """
        A longer step is a gap: bridged with more noise [s].
        """
    @max_imu_step_s.setter
    def max_imu_step_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_iterations(self) -> int:
        """
        Of an update that is far from linear; 1: plain EKF.
        """
    @max_iterations.setter
    def max_iterations(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def max_specific_force(self) -> float:
        """
        A sample with more is skipped [m/s^2].
        """
    @max_specific_force.setter
    def max_specific_force(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def moving_start(self) -> SlamStartOptions:
        """
        With an IMU: SlamStartOptions, start from motion.
        """
    @moving_start.setter
    def moving_start(self, arg0: SlamStartOptions) -> None:
        ...
    @property
    def moving_start_factor(self) -> float:
        """
        By which the deviations of a start from motion are multiplied: what it rests on is used again.
        """
    @moving_start_factor.setter
    def moving_start_factor(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def override_sigma(self) -> bool:
        """
        sigma_px also in place of what frames say.
        """
    @override_sigma.setter
    def override_sigma(self, arg0: bool) -> None:
        ...
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Start: of body in world (3,) (X_cam) [m].
        """
    @position.setter
    def position(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def q_world_body_wxyz(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        Start (4,) (X_cam_rotation). None, the default: the camera looks along x of a world with z up.
        """
    @q_world_body_wxyz.setter
    def q_world_body_wxyz(self, arg1: numpy.typing.ArrayLike | None) -> None:
        ...
    @property
    def recover_after(self) -> int:
        """
        Frames in a row of which most is not believed: the motion is taken for unknown (RECOVERED).
        """
    @recover_after.setter
    def recover_after(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def relocate_s(self) -> float:
        """
        For so long of frames that show something, but not the map, nothing is added to it: for front ends that look for it. 0: the next frame is one of new surroundings [s].
        """
    @relocate_s.setter
    def relocate_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def second_order_noise(self) -> bool:
        """
        A pixel's variance grows by what the product of the errors of depth and way makes.
        """
    @second_order_noise.setter
    def second_order_noise(self, arg0: bool) -> None:
        ...
    @property
    def sigma_angular_velocity(self) -> float:
        """
        Of the start, root of P_angular [rad/s].
        """
    @sigma_angular_velocity.setter
    def sigma_angular_velocity(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def sigma_extrinsic_position(self) -> float:
        """
        [m]
        """
    @sigma_extrinsic_position.setter
    def sigma_extrinsic_position(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def sigma_extrinsic_rotation(self) -> float:
        """
        [rad]
        """
    @sigma_extrinsic_rotation.setter
    def sigma_extrinsic_rotation(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def sigma_orientation(self) -> float:
        """
        Of the start [rad].
        """
    @sigma_orientation.setter
    def sigma_orientation(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def sigma_position(self) -> float:
        """
        Of the start [m]; 0: world is where the camera began.
        """
    @sigma_position.setter
    def sigma_position(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def sigma_px(self) -> float:
        """
        R: deviation of one coordinate, of frames that do not say [px].
        """
    @sigma_px.setter
    def sigma_px(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def sigma_time_offset(self) -> float:
        """
        [s]
        """
    @sigma_time_offset.setter
    def sigma_time_offset(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def sigma_velocity(self) -> float:
        """
        Of the start, root of P_velocity [m/s].
        """
    @sigma_velocity.setter
    def sigma_velocity(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def stand_still(self) -> StandStillOptions:
        """
        With an IMU: StandStillOptions, when the body rests.
        """
    @stand_still.setter
    def stand_still(self, arg0: StandStillOptions) -> None:
        ...
    @property
    def start(self) -> FusionStartOptions:
        """
        With an IMU: FusionStartOptions, start from rest.
        """
    @start.setter
    def start(self, arg0: FusionStartOptions) -> None:
        ...
    @property
    def still_picture_px(self) -> float:
        """
        The picture is, as a whole, that near to where it was: it stands still … [px].
        """
    @still_picture_px.setter
    def still_picture_px(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def still_picture_s(self) -> float:
        """
        … when it has been for so long [s].
        """
    @still_picture_s.setter
    def still_picture_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def velocity(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Start: in world (3,) (X_cam_velocity) [m/s].
        """
    @velocity.setter
    def velocity(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def vibration_part(self) -> float:
        """
        So much of the variance by which readings differ from sample to sample counts as white noise of the IMU.
        """
    @vibration_part.setter
    def vibration_part(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def zero_rate_sigma_floor(self) -> float:
        """
        What a body at rest may turn, earth rate included [rad/s].
        """
    @zero_rate_sigma_floor.setter
    def zero_rate_sigma_floor(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def zero_velocity(self) -> bool:
        """
        The velocity is zero while IMU and picture stand still.
        """
    @zero_velocity.setter
    def zero_velocity(self, arg0: bool) -> None:
        ...
    @property
    def zero_velocity_sigma(self) -> float:
        """
        [m/s]
        """
    @zero_velocity_sigma.setter
    def zero_velocity_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class InverseDepthPoint:
    """
    A point by the ray on which it was first seen: anchor + ray / inverse_depth. Its errors are six numbers: anchor, two of the ray along ray_basis, inverse depth.
    """
    def __init__(self, anchor: numpy.typing.ArrayLike, ray: numpy.typing.ArrayLike, inverse_depth: typing.SupportsFloat | typing.SupportsIndex) -> None:
        """
        anchor (3,) in world [m], ray (3,) in world, of any length, inverse_depth [1/m] of the distance.
        """
    def boxplus(self, error: numpy.typing.ArrayLike) -> InverseDepthPoint:
        """
        The point with the error (6,) applied.
        """
    def linearity_index(self, sigma_inverse_depth: typing.SupportsFloat | typing.SupportsIndex, camera: numpy.typing.ArrayLike) -> float:
        """
        How far the point is from having a Gaussian error in XYZ, seen from camera (3,) [m]; infinity for an inverse depth that is not positive.
        """
    def ray_basis(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3, 2), derivative of the ray by its two errors
        """
    def xyz(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) in world [m]; not finite when inverse_depth is 0.
        """
    def xyz_jacobian(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3, 6), derivative of xyz() by the errors
        """
    @property
    def anchor(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) in world [m]
        """
    @anchor.setter
    def anchor(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def azimuth(self) -> float:
        """
        [rad], of a world with y down, as in the source
        """
    @property
    def elevation(self) -> float:
        """
        [rad]
        """
    @property
    def frame_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (4,): its third axis in world is the ray, the errors of the ray are along the first two.
        """
    @frame_wxyz.setter
    def frame_wxyz(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def inverse_depth(self) -> float:
        """
        [1/m], of the distance
        """
    @inverse_depth.setter
    def inverse_depth(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def ray(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) unit vector in world
        """
class SlamFeatureState(enum.IntEnum):
    """
    What became of a feature in a frame.
    """
    MEASURED: typing.ClassVar[SlamFeatureState]
    NEW: typing.ClassVar[SlamFeatureState]
    PREDICTED: typing.ClassVar[SlamFeatureState]
    REJECTED: typing.ClassVar[SlamFeatureState]
    RESCUED: typing.ClassVar[SlamFeatureState]
    @classmethod
    def __new__(cls, value):
        ...
    def __format__(self, format_spec):
        ...
class SlamFeatureArrays:
    """
    Features of a frame, a row each.
    """
    @property
    def converted(self) -> numpy.typing.NDArray[numpy.bool]:
        """
        (M,) bool: is an XYZ point
        """
    @property
    def estimated_px(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (M, 2) after it
        """
    @property
    def id(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (M,) int64
        """
    @property
    def innovation_cov(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (M, 2, 2) of measured less predicted [px^2]
        """
    @property
    def inverse_depth(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (M,) [1/m]; of an XYZ point: of its distance
        """
    @property
    def pixel_px(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (M, 2) as measured; NaN when it was not
        """
    @property
    def predicted_px(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (M, 2) before the update
        """
    @property
    def sigma_inverse_depth(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (M,) its deviation; NaN for an XYZ point
        """
    @property
    def state(self) -> numpy.typing.NDArray[numpy.uint8]:
        """
        (M,) uint8, SlamFeatureState
        """
class SlamMapArrays:
    """
    Features of the map, a row each. What a point does not have is NaN.
    """
    def __len__(self) -> int:
        ...
    @property
    def anchor(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (K, 3) in world [m]: where the camera was when it saw the point first
        """
    @property
    def converted(self) -> numpy.typing.NDArray[numpy.bool]:
        """
        (K,) bool: is an XYZ point; otherwise inverse depth
        """
    @property
    def frame_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (K, 4): the third axis is the ray from the anchor
        """
    @property
    def id(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (K,) int64
        """
    @property
    def inverse_depth(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (K,) [1/m] along the ray
        """
    @property
    def inverse_depth_cov(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (K, 6, 6): anchor, two of the ray, inverse depth
        """
    @property
    def landmark(self) -> numpy.typing.NDArray[numpy.bool]:
        """
        (K,) bool: was known beforehand
        """
    @property
    def last_measured_ns(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (K,) int64; the smallest int64 (NO_TIME): never
        """
    @property
    def measured(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (K,) frames in which it was used
        """
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (K, 3) in world [m]; NaN where the inverse depth is not positive
        """
    @property
    def position_cov(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (K, 3, 3) [m^2]
        """
class SlamLandmarkArrays:
    """
    Features of a SlamSnapshot, a row each.
    """
    @property
    def anchor(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (K, 3) in world [m], unless converted
        """
    @property
    def converted(self) -> numpy.typing.NDArray[numpy.bool]:
        """
        (K,) bool: three errors, of position; otherwise six
        """
    @property
    def frame_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (K, 4): the third axis is the ray
        """
    @property
    def id(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (K,) int64
        """
    @property
    def inverse_depth(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (K,) [1/m]
        """
    @property
    def known(self) -> numpy.typing.NDArray[numpy.bool]:
        """
        (K,) bool: its place was given
        """
    @property
    def last_measured_ns(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (K,) int64; the smallest int64 (NO_TIME): never
        """
    @property
    def measured(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (K,) frames in which it was used
        """
    @property
    def offset(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (K,) int64: row of the covariance where its errors begin
        """
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (K, 3) in world [m], when converted
        """
class SlamCounts:
    """
    Numbers of features in one frame.
    """
    @property
    def added(self) -> int:
        """
        to the map
        """
    @property
    def converted(self) -> int:
        """
        from inverse depth to XYZ
        """
    @property
    def deleted(self) -> int:
        """
        from the map
        """
    @property
    def in_frame(self) -> int:
        """
        features that the frame has
        """
    @property
    def map(self) -> int:
        """
        features afterwards
        """
    @property
    def measured(self) -> int:
        """
        used, rescued ones included
        """
    @property
    def rejected(self) -> int:
        """
        not believed
        """
    @property
    def rescued(self) -> int:
        """
        used, after the others had moved the camera to where it agrees
        """
    @property
    def visible(self) -> int:
        """
        of the map, expected in view
        """
class SlamFrame:
    """
    What SLAM says about one frame.
    """
    @property
    def camera(self) -> int:
        ...
    @property
    def camera_position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) of camera in world [m]
        """
    @property
    def counts(self) -> SlamCounts:
        ...
    @property
    def estimate(self) -> Estimate:
        """
        after the update; pose of body
        """
    @property
    def features(self) -> SlamFeatureArrays:
        ...
    @property
    def nis(self) -> float:
        """
        of all that was used
        """
    @property
    def nis_dim(self) -> int:
        """
        numbers in it
        """
    @property
    def q_world_camera_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def reprojection_after_px(self) -> float:
        """
        the same after the update
        """
    @property
    def reprojection_before_px(self) -> float:
        """
        root of the mean square of |measured - predicted|, of those used; NaN without any
        """
    @property
    def sequence(self) -> int:
        ...
    @property
    def time_ns(self) -> int:
        ...
    @property
    def time_spent_s(self) -> float:
        """
        by the filter
        """
class SlamSnapshot:
    """
    All that a filter knows; restore() goes on from there.
    """
    @property
    def T_body_camera(self) -> Pose3:
        ...
    @property
    def accelerometer_bias(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def angular_velocity(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def covariance(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (n, n) of the errors: theta [rad, body axes], position, velocity, angular velocity or the biases of gyroscope and accelerometer; then, where estimated, rotation and place of the camera in body, its clock; then the features at their offsets.
        """
    @property
    def gyroscope_bias(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def landmarks(self) -> SlamLandmarkArrays:
        ...
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def q_world_body_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def time_ns(self) -> int | None:
        ...
    @property
    def time_offset_s(self) -> float:
        ...
    @property
    def velocity(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
class SlamRun:
    """
    What a whole recording gives: a row for each frame that was used.
    """
    def __len__(self) -> int:
        ...
    @property
    def accelerometer_bias(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [m/s^2]; NaN without an IMU
        """
    @property
    def angular_velocity(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) in body [rad/s]
        """
    @property
    def camera_position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) of camera in world [m]
        """
    @property
    def counts(self) -> dict:
        """
        {field of SlamCounts: (N,) int64}
        """
    @property
    def covariance(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, d, d) of the error (theta [rad, body axes], p, v, bg, ba), d = 9 without an IMU, 15 with one
        """
    @property
    def features(self) -> SlamFeatureArrays:
        """
        SlamFeatureArrays of all frames, when asked for
        """
    @property
    def first(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (N + 1,): features of frame i are rows first[i]:first[i + 1]
        """
    @property
    def gyroscope_bias(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [rad/s]; NaN without an IMU
        """
    @property
    def map(self) -> SlamMapArrays:
        """
        SlamMapArrays, at the end
        """
    @property
    def nis(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N,) of all that was used
        """
    @property
    def nis_dim(self) -> numpy.typing.NDArray[numpy.int32]:
        """
        (N,) numbers in it
        """
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) of body in world [m]
        """
    @property
    def q_world_body_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 4)
        """
    @property
    def q_world_camera_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 4)
        """
    @property
    def reprojection_after_px(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N,)
        """
    @property
    def reprojection_before_px(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N,); NaN where nothing was used
        """
    @property
    def sequence(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (N,) int64: row of the frame in what was given
        """
    @property
    def snapshot(self) -> SlamSnapshot | None:
        """
        SlamSnapshot at the end, to go on from; None before the start.
        """
    @property
    def status(self) -> numpy.typing.NDArray[numpy.uint32]:
        """
        (N,) uint32, EstimateStatus
        """
    @property
    def stopped(self) -> bool:
        """
        progress() asked for it
        """
    @property
    def time_ns(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (N,) int64
        """
    @property
    def time_spent_s(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N,) by the filter
        """
    @property
    def totals(self) -> dict[str, int]:
        """
        counts() of the estimator at the end: what was used and skipped, and why
        """
    @property
    def valid(self) -> numpy.typing.NDArray[numpy.uint32]:
        """
        (N,) uint32, EstimateValid
        """
    @property
    def velocity(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) in world [m/s]
        """
class MonoSlam:
    """
    SLAM with one camera alone: tracks of features in, pose of the camera and map out, from the first frame on. Not observable: the unit of lengths, unless landmarks are known; place and heading of the world.
    """
    def __init__(self, options: SlamOptions) -> None:
        """
        ValueError names a field that is out of range.
        """
    def counts(self) -> dict[str, int]:
        """
        What was used and what was skipped, and why: {name: number}.
        """
    def estimate(self) -> Estimate:
        ...
    def frame(self) -> SlamFrame:
        """
        SlamFrame: the last one that was used, a copy.
        """
    def map(self) -> SlamMapArrays:
        """
        SlamMapArrays
        """
    @typing.overload
    def process(self, measurement: ImuMeasurement | MagnetometerMeasurement | ImageMeasurement | GpsMeasurement | ReferenceMeasurement | OdometryMeasurement | FeaturesMeasurement) -> bool:
        """
        The next measurement in time order; says whether estimate() is new.
        """
    @typing.overload
    def process(self, time_ns: typing.SupportsInt | typing.SupportsIndex, id: numpy.typing.NDArray[numpy.int64], pixel_px: numpy.typing.NDArray[numpy.float64], sigma_px: typing.SupportsFloat | typing.SupportsIndex = ...) -> bool:
        """
        One frame: id int64 (M,), pixel_px (M, 2), deviation of one coordinate (NaN: that of the options).
        """
    def reset(self) -> None:
        """
        Forgets the past, not the options or the counts.
        """
    def restore(self, snapshot: SlamSnapshot) -> None:
        """
        Goes on from there: the next frame may come at any later time, or on another clock. ValueError when it does not fit the options.
        """
    def run(self, time_ns: numpy.typing.NDArray[numpy.int64], first: numpy.typing.NDArray[numpy.int64], id: numpy.typing.NDArray[numpy.int64], pixel_px: numpy.typing.NDArray[numpy.float64], *, camera: numpy.typing.ArrayLike | None = None, sigma_px: numpy.typing.ArrayLike | None = None, progress: collections.abc.Callable | None = None, with_covariance: bool = True, with_features: bool = False) -> SlamRun:
        """
        A whole recording in one call, without the GIL and without copies of the input; the same numbers as step by step, and the next call goes on from here.
        
        Frame i at time_ns[i] has the features first[i]:first[i + 1] of id (M,) and pixel_px (M, 2): the fields of Recording.features. sigma_px and camera: one, or one for each frame; by default those of the options. With an IMU: imu_time_ns int64 (S,), gyro (S, 3) [rad/s], force (S, 3) [m/s^2], at rest +9.81 upwards. progress(frames done, frames in all) is called a few times in a second; when it returns False the run ends, with what there is. KeyboardInterrupt leaves the estimator where it was then.
        """
    def snapshot(self) -> SlamSnapshot:
        ...
    @property
    def options(self) -> SlamOptions:
        """
        A copy.
        """
    @property
    def running(self) -> bool:
        ...
class InertialSlam:
    """
    SLAM with one camera and an IMU: metres, and a world with z up. It starts from rest or in motion; the first estimate comes late, for all frames. Not observable: place and heading of the world.
    """
    def __init__(self, options: SlamOptions) -> None:
        """
        ValueError names a field that is out of range.
        """
    def counts(self) -> dict[str, int]:
        """
        What was used and what was skipped, and why: {name: number}.
        """
    def estimate(self) -> Estimate:
        ...
    def finish(self) -> bool:
        """
        The end of a recording: samples that are held back are used, and frames that wait for a sample after them, when they are nearer to the last sample than the next one would be. Says whether estimate() is new; frames() has the frames.
        """
    def frames(self) -> list[SlamFrame]:
        """
        [SlamFrame]: those that the last process() or finish() has completed, usually none or one; at the start all that waited.
        """
    def map(self) -> SlamMapArrays:
        """
        SlamMapArrays
        """
    @typing.overload
    def process(self, measurement: ImuMeasurement | MagnetometerMeasurement | ImageMeasurement | GpsMeasurement | ReferenceMeasurement | OdometryMeasurement | FeaturesMeasurement) -> bool:
        """
        The next measurement in time order; says whether estimate() is new.
        """
    @typing.overload
    def process(self, time_ns: typing.SupportsInt | typing.SupportsIndex, id: numpy.typing.NDArray[numpy.int64], pixel_px: numpy.typing.NDArray[numpy.float64], sigma_px: typing.SupportsFloat | typing.SupportsIndex = ...) -> bool:
        """
        One frame: id int64 (M,), pixel_px (M, 2), deviation of one coordinate (NaN: that of the options).
        """
    def reset(self) -> None:
        """
        Forgets the past, not the options or the counts.
        """
    def restore(self, snapshot: SlamSnapshot) -> None:
        """
        Goes on from there: the next frame may come at any later time, or on another clock. ValueError when it does not fit the options.
        """
    def run(self, time_ns: numpy.typing.NDArray[numpy.int64], first: numpy.typing.NDArray[numpy.int64], id: numpy.typing.NDArray[numpy.int64], pixel_px: numpy.typing.NDArray[numpy.float64], imu_time_ns: numpy.typing.NDArray[numpy.int64], gyro: numpy.typing.NDArray[numpy.float64], force: numpy.typing.NDArray[numpy.float64], *, camera: numpy.typing.ArrayLike | None = None, sigma_px: numpy.typing.ArrayLike | None = None, progress: collections.abc.Callable | None = None, with_covariance: bool = True, with_features: bool = False, finish: bool = False) -> SlamRun:
        """
        A whole recording in one call, without the GIL and without copies of the input; the same numbers as step by step, and the next call goes on from here.
        
        Frame i at time_ns[i] has the features first[i]:first[i + 1] of id (M,) and pixel_px (M, 2): the fields of Recording.features. sigma_px and camera: one, or one for each frame; by default those of the options. With an IMU: imu_time_ns int64 (S,), gyro (S, 3) [rad/s], force (S, 3) [m/s^2], at rest +9.81 upwards. progress(frames done, frames in all) is called a few times in a second; when it returns False the run ends, with what there is. KeyboardInterrupt leaves the estimator where it was then. finish: it is the end of the recording, see finish().
        """
    def snapshot(self) -> SlamSnapshot:
        ...
    @property
    def options(self) -> SlamOptions:
        """
        A copy.
        """
    @property
    def running(self) -> bool:
        ...
class MapAnchorOptions:
    """
    How GPS ties a map to the Earth. MapAnchorOptions(inertial=True) is for real receivers and a map in metres; every field is a keyword of the constructor.
    """
    use_gps_velocity: bool
    def __copy__(self) -> MapAnchorOptions:
        ...
    def __init__(self, inertial: bool = True, **kwargs) -> None:
        """
        TypeError for an unknown field; ValueError for a value out of range.
        """
    @property
    def gate_probability(self) -> float:
        ...
    @gate_probability.setter
    def gate_probability(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gps_antenna(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) lever arm in body axes [m]
        """
    @gps_antenna.setter
    def gps_antenna(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def gps_correlation_time_s(self) -> float:
        """
        [s]; 0: white
        """
    @gps_correlation_time_s.setter
    def gps_correlation_time_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gps_sigma(self) -> float:
        """
        of a fix that does not say, horizontal [m]
        """
    @gps_sigma.setter
    def gps_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gps_sigma_floor(self) -> float:
        """
        [m]
        """
    @gps_sigma_floor.setter
    def gps_sigma_floor(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gps_time_sigma(self) -> float:
        """
        [s]
        """
    @gps_time_sigma.setter
    def gps_time_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gps_velocity_sigma(self) -> float:
        """
        [m/s]
        """
    @gps_velocity_sigma.setter
    def gps_velocity_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gps_velocity_sigma_floor(self) -> float:
        """
        [m/s]
        """
    @gps_velocity_sigma_floor.setter
    def gps_velocity_sigma_floor(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def heading_walk(self) -> float:
        """
        [rad/sqrt(m)]
        """
    @heading_walk.setter
    def heading_walk(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def history_s(self) -> float:
        """
        a fix may be so late [s]
        """
    @history_s.setter
    def history_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def origin(self) -> tuple[float, float, float] | None:
        """
        of world: latitude, longitude [rad], altitude [m]; None: the first fix
        """
    @origin.setter
    def origin(self, arg1: tuple[typing.SupportsFloat | typing.SupportsIndex, typing.SupportsFloat | typing.SupportsIndex, typing.SupportsFloat | typing.SupportsIndex] | None) -> None:
        ...
    @property
    def outage_s(self) -> float:
        """
        [s]
        """
    @outage_s.setter
    def outage_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def position_walk(self) -> float:
        """
        of the map [m/sqrt(m)]
        """
    @position_walk.setter
    def position_walk(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def reject_count(self) -> int:
        ...
    @reject_count.setter
    def reject_count(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def reject_time_s(self) -> float:
        ...
    @reject_time_s.setter
    def reject_time_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def scale_known(self) -> bool:
        """
        The map is in metres; otherwise scale and tilt are found, too.
        """
    @scale_known.setter
    def scale_known(self, arg0: bool) -> None:
        ...
    @property
    def scale_sigma(self) -> float:
        """
        of a scale that is known, relative
        """
    @scale_sigma.setter
    def scale_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def scale_walk(self) -> float:
        """
        relative [1/sqrt(m)]
        """
    @scale_walk.setter
    def scale_walk(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def start_heading_sigma(self) -> float:
        """
        [rad]
        """
    @start_heading_sigma.setter
    def start_heading_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def start_scale_sigma(self) -> float:
        """
        relative
        """
    @start_scale_sigma.setter
    def start_scale_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def tilt_sigma(self) -> float:
        """
        of the map's z against the vertical [rad]
        """
    @tilt_sigma.setter
    def tilt_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def tilt_walk(self) -> float:
        """
        [rad/sqrt(m)]
        """
    @tilt_walk.setter
    def tilt_walk(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class AnchoredRun:
    """
    A run of SLAM on the Earth; rows as those of the SlamRun.
    """
    @property
    def counts(self) -> dict[str, int]:
        ...
    @property
    def covariance(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, d, d), as SlamRun's; (0, 0, 0) when that has none
        """
    @property
    def georeferenced(self) -> numpy.typing.NDArray[numpy.bool]:
        """
        (N,) bool; False: as in the map
        """
    @property
    def origin(self) -> tuple[float, float, float] | None:
        """
        latitude, longitude [rad], altitude [m]; None when GPS never told enough
        """
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) east, north, up of origin [m]
        """
    @property
    def q_world_body_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 4)
        """
    @property
    def scale(self) -> float:
        """
        metres a unit of the map, at the end
        """
    @property
    def status(self) -> numpy.typing.NDArray[numpy.uint32]:
        """
        (N,) uint32, EstimateStatus
        """
    @property
    def time_ns(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (N,) int64
        """
    @property
    def valid(self) -> numpy.typing.NDArray[numpy.uint32]:
        """
        (N,) uint32, EstimateValid
        """
    @property
    def velocity(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [m/s]
        """
class SlamFile:
    """
    A saved map and state.
    """
    def why_not_restorable(self, options: SlamOptions) -> str:
        """
        What speaks against going on with these options; empty when nothing does.
        """
    @property
    def camera(self) -> CameraCalibration:
        """
        that the map was made with
        """
    @property
    def motion(self) -> SlamMotion:
        ...
    @property
    def options(self) -> str:
        """
        text of slam.yaml: what the filter ran with
        """
    @property
    def snapshot(self) -> SlamSnapshot:
        ...
class FeatureTrackerOptions:
    """
    Options of the front end (FeatureTracker); every field is a keyword of the constructor.
    """
    def __init__(self, **kwargs) -> None:
        """
        TypeError for an unknown field, ValueError for a value out of range.
        """
    def check(self) -> None:
        """
        ValueError names a field that is out of range.
        """
    @property
    def avoid_frames(self) -> int:
        """
        For so long no new track begins where something moved.
        """
    @avoid_frames.setter
    def avoid_frames(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def avoid_radius_px(self) -> float:
        """
        And so far around [px].
        """
    @avoid_radius_px.setter
    def avoid_radius_px(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def direct_below_px(self) -> float:
        """
        Larger deviation of the prediction: Lucas-Kanade first [px].
        """
    @direct_below_px.setter
    def direct_below_px(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def drop_after_rejected(self) -> int:
        """
        Times in a row by the filter.
        """
    @drop_after_rejected.setter
    def drop_after_rejected(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def exposure_step(self) -> float:
        """
        Relative change of the mean brightness that is taken out.
        """
    @exposure_step.setter
    def exposure_step(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def fast_threshold(self) -> int:
        """
        Of the brightness, for a corner to be looked at.
        """
    @fast_threshold.setter
    def fast_threshold(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def klt_levels(self) -> int:
        """
        Of the pyramid, the picture itself included.
        """
    @klt_levels.setter
    def klt_levels(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def klt_window_px(self) -> int:
        """
        Odd [px].
        """
    @klt_window_px.setter
    def klt_window_px(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def max_search_px(self) -> float:
        """
        Larger deviation of the prediction: not searched for [px].
        """
    @max_search_px.setter
    def max_search_px(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_tracks(self) -> int:
        """
        In one picture.
        """
    @max_tracks.setter
    def max_tracks(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def max_warp(self) -> float:
        """
        By which a patch may be stretched before it is cut anew.
        """
    @max_warp.setter
    def max_warp(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def min_corner(self) -> float:
        """
        Smaller eigenvalue of a corner [brightness^2/px^2].
        """
    @min_corner.setter
    def min_corner(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def min_correlation(self) -> float:
        """
        Of a patch with the picture, for a track to go on.
        """
    @min_correlation.setter
    def min_correlation(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def min_refind_correlation(self) -> float:
        """
        For one that was lost.
        """
    @min_refind_correlation.setter
    def min_refind_correlation(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def min_separation_px(self) -> float:
        """
        Of a new feature from the others [px].
        """
    @min_separation_px.setter
    def min_separation_px(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def search_sigmas(self) -> float:
        """
        Size of the ellipse in which is searched.
        """
    @search_sigmas.setter
    def search_sigmas(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def sigma_px(self) -> float:
        """
        What the tracks say of themselves; NaN: nothing [px].
        """
    @sigma_px.setter
    def sigma_px(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class TrackOrigin(enum.IntEnum):
    """
    How a feature was found in a picture.
    """
    CUT_ANEW: typing.ClassVar[TrackOrigin]
    NEW: typing.ClassVar[TrackOrigin]
    REFOUND: typing.ClassVar[TrackOrigin]
    SEARCHED: typing.ClassVar[TrackOrigin]
    TRACKED: typing.ClassVar[TrackOrigin]
    @classmethod
    def __new__(cls, value):
        ...
    def __format__(self, format_spec):
        ...
class TrackArrays:
    """
    How the features of one picture were found, a row each.
    """
    def __len__(self) -> int:
        ...
    @property
    def age(self) -> numpy.typing.NDArray[numpy.int32]:
        """
        (M,) int32, pictures in which it was seen before
        """
    @property
    def correlation(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (M,); NaN for a new one
        """
    @property
    def id(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (M,) int64
        """
    @property
    def origin(self) -> numpy.typing.NDArray[numpy.uint8]:
        """
        (M,) uint8, TrackOrigin
        """
class FeatureTrackerTimes:
    """
    How long the front end took for one picture [s].
    """
    @property
    def detect_s(self) -> float:
        ...
    @property
    def klt_s(self) -> float:
        ...
    @property
    def pyramid_s(self) -> float:
        ...
    @property
    def search_s(self) -> float:
        ...
    @property
    def total_s(self) -> float:
        ...
class FeatureTracker:
    """
    From pictures to tracks: which feature is where in which picture. Alone, without a filter that tells where to look; ImageSlam has one.
    """
    def __init__(self, camera: CameraCalibration, options: FeatureTrackerOptions = ...) -> None:
        """
        ValueError names a field that is out of range.
        """
    def counts(self) -> dict[str, int]:
        """
        {name: number}
        """
    def learn(self, frame: SlamFrame) -> None:
        """
        What became of the features: those that a filter rejects time and again are dropped.
        """
    def reset(self) -> None:
        """
        Forgets all tracks; identities go on.
        """
    def track(self, image: numpy.ndarray, time_ns: typing.SupportsInt | typing.SupportsIndex) -> FeaturesMeasurement:
        """
        image: uint8, (height, width) or (height, width, 3) with blue first. Gives its FeaturesMeasurement. ValueError for another size than the camera's.
        """
    @property
    def last(self) -> TrackArrays:
        """
        TrackArrays of the last picture, in the order of its features.
        """
    @property
    def options(self) -> FeatureTrackerOptions:
        ...
    @property
    def times(self) -> FeatureTrackerTimes:
        ...
class SlamPredictionArrays:
    """
    Where the features of the map were expected in a picture, a row each.
    """
    def __len__(self) -> int:
        ...
    @property
    def T_world_camera(self) -> Pose3:
        ...
    @property
    def id(self) -> numpy.typing.NDArray[numpy.int64]:
        """
        (K,) int64
        """
    @property
    def pixel_px(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (K, 2)
        """
    @property
    def search_cov(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (K, 2, 2) of measured less expected [px^2]
        """
    @property
    def time_ns(self) -> int | None:
        """
        of the picture; None before the first
        """
    @property
    def valid(self) -> bool:
        """
        False: nothing was expected; no rows
        """
    @property
    def visible(self) -> numpy.typing.NDArray[numpy.bool]:
        """
        (K,) bool: expected in the picture; otherwise the rest means nothing
        """
class ImageSlam:
    """
    SLAM from pictures: a front end (FeatureTracker) and the estimator that options.motion names (MonoSlam, InertialSlam), which tells it where to look. Start with slam_options_for_images().
    """
    def __init__(self, options: SlamOptions, front_end: FeatureTrackerOptions = ...) -> None:
        """
        ValueError names a field that is out of range.
        """
    def counts(self) -> dict[str, int]:
        """
        Of the estimator and the front end: what was used and what was skipped, and why.
        """
    def estimate(self) -> Estimate:
        ...
    def finish(self) -> bool:
        """
        The end of a recording: frames that wait for the IMU are taken.
        """
    def frames(self) -> list[SlamFrame]:
        """
        [SlamFrame]: those that the last call has completed; with an IMU a frame waits for the sample after it.
        """
    def map(self) -> SlamMapArrays:
        """
        SlamMapArrays
        """
    def process(self, measurement: ImuMeasurement | MagnetometerMeasurement | ImageMeasurement | GpsMeasurement | ReferenceMeasurement | OdometryMeasurement | FeaturesMeasurement) -> bool:
        """
        The next measurement in time order: a picture that is decoded, or an IMU sample. Says whether estimate() is new.
        """
    def process_image(self, time_ns: typing.SupportsInt | typing.SupportsIndex, image: numpy.ndarray) -> bool:
        """
        A picture of the camera: uint8, (height, width) or (height, width, 3) with blue first. ValueError for another size than the camera's.
        """
    def process_imu(self, time_ns: typing.SupportsInt | typing.SupportsIndex, gyro: numpy.typing.ArrayLike, force: numpy.typing.ArrayLike) -> bool:
        """
        A sample of the IMU: gyro (3,) [rad/s], force (3,) [m/s^2], at rest +9.81 upwards.
        """
    def record(self, with_covariance: bool = True, with_features: bool = False) -> None:
        """
        From now on every frame is kept for recorded().
        """
    def recorded(self, stopped: bool = False) -> tuple[SlamRun, dict]:
        """
        What was kept since record(), which ends: a SlamRun with a row for each frame, and {name: (P,)} with a row for each picture: time_ns; tracks, of these searched, klt, cut_anew, refound, new; lost since the picture before; pyramid_s, search_s, klt_s, detect_s, their sum front_end_s, and picture_s, which has besides what the filter did during the picture's call.
        """
    def reset(self) -> None:
        """
        Forgets the past, not the options or the counts.
        """
    @property
    def features(self) -> FeaturesMeasurement:
        """
        FeaturesMeasurement of the last picture.
        """
    @property
    def options(self) -> SlamOptions:
        """
        A copy.
        """
    @property
    def prediction(self) -> SlamPredictionArrays:
        """
        SlamPredictionArrays: by what the last picture was searched.
        """
    @property
    def running(self) -> bool:
        ...
    @property
    def times(self) -> FeatureTrackerTimes:
        """
        FeatureTrackerTimes of the last picture.
        """
    @property
    def tracks(self) -> TrackArrays:
        """
        TrackArrays beside features.
        """
class ImuSampleModel(enum.Enum):
    """
    Which true value a reading of a simulated IMU stands for.
    """
    INCREMENT: typing.ClassVar[ImuSampleModel]
    INTERVAL_MEAN: typing.ClassVar[ImuSampleModel]
    POINT: typing.ClassVar[ImuSampleModel]
    @classmethod
    def __new__(cls, value):
        ...
class InertialTriadModel:
    """
    A simulated gyroscope [u = rad/s] or accelerometer [u = m/s^2].
    """
    def __init__(self) -> None:
        ...
    @property
    def constant_bias(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) [u]
        """
    @constant_bias.setter
    def constant_bias(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def instability_sigma(self) -> float:
        """
        [u], Gauss-Markov part of the bias
        """
    @instability_sigma.setter
    def instability_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def instability_time_s(self) -> float:
        """
        its time constant [s]
        """
    @instability_time_s.setter
    def instability_time_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def matrix(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3, 3) scale and misalignment
        """
    @matrix.setter
    def matrix(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def noise_density(self) -> float:
        """
        [u/sqrt(Hz)], white
        """
    @noise_density.setter
    def noise_density(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def random_walk(self) -> float:
        """
        [u/s/sqrt(Hz)], of the bias
        """
    @random_walk.setter
    def random_walk(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def range(self) -> float:
        """
        [u], saturates beyond
        """
    @range.setter
    def range(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def resolution(self) -> float:
        """
        [u], step of a reading; 0: not rounded
        """
    @resolution.setter
    def resolution(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def turn_on_bias_sigma(self) -> float:
        """
        [u], drawn once a run
        """
    @turn_on_bias_sigma.setter
    def turn_on_bias_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class ImuModel:
    """
    A simulated IMU: reading = round(matrix * truth + bias + white noise).
    """
    accelerometer: InertialTriadModel
    gyroscope: InertialTriadModel
    sampling: ImuSampleModel
    @staticmethod
    def consumer() -> ImuModel:
        """
        MEMS of a phone, 200 Hz.
        """
    @staticmethod
    def perfect(rate_hz: typing.SupportsFloat | typing.SupportsIndex = 200.0) -> ImuModel:
        """
        No error at all.
        """
    @staticmethod
    def vio_example() -> ImuModel:
        """
        That of the example "Visual-Inertial Odometry Using Synthetic Data", with the sign of specific force.
        """
    def __init__(self) -> None:
        ...
    def calibration(self) -> ImuCalibration:
        """
        What calibration would tell of it.
        """
    def check(self) -> None:
        """
        Raises ValueError naming the field and its value.
        """
    @property
    def accelerometer_sign(self) -> int:
        """
        1: specific force, +9.81 upwards at rest; -1: its negative
        """
    @accelerometer_sign.setter
    def accelerometer_sign(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def gravity(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) [m/s^2], in world
        """
    @gravity.setter
    def gravity(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def rate_hz(self) -> float:
        """
        [Hz]
        """
    @rate_hz.setter
    def rate_hz(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class MagnetometerModel:
    """
    A simulated magnetometer: reading = soft_iron * field + hard_iron + noise.
    """
    def __init__(self) -> None:
        ...
    def add_dipole(self, position: numpy.typing.ArrayLike, moment: numpy.typing.ArrayLike, radius: typing.SupportsFloat | typing.SupportsIndex = 0.5) -> None:
        """
        A magnet at a place in world [m], moment [A m^2]; within radius [m] its field grows no more.
        """
    def add_disturbance(self, begin_s: typing.SupportsFloat | typing.SupportsIndex, end_s: typing.SupportsFloat | typing.SupportsIndex, field: numpy.typing.ArrayLike) -> None:
        """
        A field in world [T] that is there for a while.
        """
    def check(self) -> None:
        """
        Raises ValueError naming the field and its value.
        """
    @property
    def field(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) [T], of the world
        """
    @field.setter
    def field(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def hard_iron(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) [T]
        """
    @hard_iron.setter
    def hard_iron(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def range(self) -> float:
        """
        [T], saturates beyond
        """
    @range.setter
    def range(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def rate_hz(self) -> float:
        """
        [Hz]
        """
    @rate_hz.setter
    def rate_hz(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def resolution(self) -> float:
        """
        [T]; 0: not rounded
        """
    @resolution.setter
    def resolution(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def sigma(self) -> float:
        """
        [T], white, of a sample
        """
    @sigma.setter
    def sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def soft_iron(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3, 3)
        """
    @soft_iron.setter
    def soft_iron(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
class VisualOdometryModel:
    """
    A simulated visual odometry: scale, white noise, drift; the defaults are the example's.
    """
    @staticmethod
    def perfect(rate_hz: typing.SupportsFloat | typing.SupportsIndex = 25.0) -> VisualOdometryModel:
        """
        Metres, no error.
        """
    def __init__(self) -> None:
        ...
    def check(self) -> None:
        """
        Raises ValueError naming the field and its value.
        """
    @property
    def T_body_odometry(self) -> Pose3:
        """
        where the odometry's own axes are
        """
    @T_body_odometry.setter
    def T_body_odometry(self, arg0: Pose3) -> None:
        ...
    @property
    def drift_frames(self) -> float:
        """
        time constant of the drift in frames
        """
    @drift_frames.setter
    def drift_frames(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def drift_sigma(self) -> float:
        """
        [unit]
        """
    @drift_sigma.setter
    def drift_sigma(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def drift_start(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) [unit], before the first frame
        """
    @drift_start.setter
    def drift_start(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def drift_step_sigma(self) -> float:
        """
        [unit], of one step of the drift
        """
    @property
    def latency_s(self) -> float:
        """
        arrival after the frame [s]
        """
    @latency_s.setter
    def latency_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def outages(self) -> list[tuple[float, float]]:
        """
        [(begin, end), ...] [s]: no measurement
        """
    @outages.setter
    def outages(self, arg1: collections.abc.Sequence[tuple[typing.SupportsFloat | typing.SupportsIndex, typing.SupportsFloat | typing.SupportsIndex]]) -> None:
        ...
    @property
    def outlier_fraction(self) -> float:
        """
        share of frames
        """
    @outlier_fraction.setter
    def outlier_fraction(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def outlier_orientation(self) -> float:
        """
        [rad]
        """
    @outlier_orientation.setter
    def outlier_orientation(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def outlier_position(self) -> float:
        """
        [unit]
        """
    @outlier_position.setter
    def outlier_position(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def rate_hz(self) -> float:
        """
        [Hz]
        """
    @rate_hz.setter
    def rate_hz(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def relative(self) -> bool:
        """
        True: pose since the frame before
        """
    @relative.setter
    def relative(self, arg0: bool) -> None:
        ...
    @property
    def scale(self) -> float:
        """
        [unit/m]
        """
    @scale.setter
    def scale(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def scale_walk(self) -> float:
        """
        [1/sqrt(s)], random walk of the scale's logarithm
        """
    @scale_walk.setter
    def scale_walk(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def sigma_orientation(self) -> float:
        """
        [rad], white
        """
    @sigma_orientation.setter
    def sigma_orientation(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def sigma_position(self) -> float:
        """
        [unit], white
        """
    @sigma_position.setter
    def sigma_position(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def stamp_delay_s(self) -> float:
        """
        stamps are later than the frame by this [s]
        """
    @stamp_delay_s.setter
    def stamp_delay_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def told_sigma_orientation(self) -> float:
        """
        [rad]; NaN: 0.01
        """
    @told_sigma_orientation.setter
    def told_sigma_orientation(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def told_sigma_position(self) -> float:
        """
        [unit]; NaN: sigma_position
        """
    @told_sigma_position.setter
    def told_sigma_position(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class GpsModel:
    """
    A simulated GPS receiver: white and Gauss-Markov errors.
    """
    fix: GpsFixType
    with_velocity: bool
    @staticmethod
    def rtk() -> GpsModel:
        """
        Fixed ambiguities: 1 cm and 2 cm, 5 Hz.
        """
    @staticmethod
    def single() -> GpsModel:
        """
        A consumer's receiver: 0.5 m white, 1.5 m coloured, 1 Hz.
        """
    def __init__(self) -> None:
        ...
    def check(self) -> None:
        """
        Raises ValueError naming the field and its value.
        """
    @property
    def antenna_in_body(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3,) lever arm [m]
        """
    @antenna_in_body.setter
    def antenna_in_body(self, arg1: numpy.typing.ArrayLike) -> None:
        ...
    @property
    def coloured_sigma_horizontal(self) -> float:
        """
        [m], Gauss-Markov
        """
    @coloured_sigma_horizontal.setter
    def coloured_sigma_horizontal(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def coloured_sigma_vertical(self) -> float:
        """
        [m], Gauss-Markov
        """
    @coloured_sigma_vertical.setter
    def coloured_sigma_vertical(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def coloured_time_s(self) -> float:
        """
        its time constant [s]
        """
    @coloured_time_s.setter
    def coloured_time_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def latency_s(self) -> float:
        """
        arrival after the time of validity [s]
        """
    @latency_s.setter
    def latency_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def origin(self) -> tuple[float, float, float]:
        """
        latitude, longitude [rad], altitude [m] of the world's origin
        """
    @origin.setter
    def origin(self, arg1: tuple[typing.SupportsFloat | typing.SupportsIndex, typing.SupportsFloat | typing.SupportsIndex, typing.SupportsFloat | typing.SupportsIndex]) -> None:
        ...
    @property
    def outages(self) -> list[tuple[float, float]]:
        """
        [(begin, end), ...] [s]: no fix
        """
    @outages.setter
    def outages(self, arg1: collections.abc.Sequence[tuple[typing.SupportsFloat | typing.SupportsIndex, typing.SupportsFloat | typing.SupportsIndex]]) -> None:
        ...
    @property
    def rate_hz(self) -> float:
        """
        [Hz]
        """
    @rate_hz.setter
    def rate_hz(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def satellites(self) -> int:
        ...
    @satellites.setter
    def satellites(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def sigma_horizontal(self) -> float:
        """
        [m], white
        """
    @sigma_horizontal.setter
    def sigma_horizontal(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def sigma_velocity_horizontal(self) -> float:
        """
        [m/s]
        """
    @sigma_velocity_horizontal.setter
    def sigma_velocity_horizontal(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def sigma_velocity_vertical(self) -> float:
        """
        [m/s]
        """
    @sigma_velocity_vertical.setter
    def sigma_velocity_vertical(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def sigma_vertical(self) -> float:
        """
        [m], white
        """
    @sigma_vertical.setter
    def sigma_vertical(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def stamp_delay_s(self) -> float:
        """
        stamps are later than validity by this [s]
        """
    @stamp_delay_s.setter
    def stamp_delay_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class StreamClockModel:
    """
    The clock of a simulated sensor; perfect unless changed. More of it by Scenario.set: imu.clock.delay_exponential_ns, ...
    """
    @staticmethod
    def usb() -> StreamClockModel:
        """
        Own oscillator, 50 ppm off; delays of a USB device.
        """
    def __init__(self) -> None:
        ...
    @property
    def loss_fraction(self) -> float:
        """
        share of samples that never arrive
        """
    @loss_fraction.setter
    def loss_fraction(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def offset_s(self) -> float:
        """
        of the stamps, at the start [s]
        """
    @offset_s.setter
    def offset_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class ScenarioStreams:
    """
    Which streams a scenario has.
    """
    features: bool
    gps: bool
    imu: bool
    magnetometer: bool
    odometry: bool
    reference: bool
class Scenario:
    """
    A motion, the sensors that ride on it and the world around them. Change the models, then simulate() it.
    """
    gps: GpsModel
    gps_clock: StreamClockModel
    imu: ImuModel
    imu_clock: StreamClockModel
    magnetometer: MagnetometerModel
    magnetometer_clock: StreamClockModel
    name: str
    odometry: VisualOdometryModel
    odometry_clock: StreamClockModel
    streams: ScenarioStreams
    def __init__(self, name: str, *, duration_s: typing.SupportsFloat | typing.SupportsIndex | None = None, parameters: dict = {}) -> None:
        """
        A named one (scenario_names()). duration_s [s]: None: 60. parameters: {name: value}, as set() takes them.
        """
    def check(self) -> None:
        """
        Raises ValueError naming the field and its value.
        """
    def parameters(self) -> dict[str, str]:
        """
        All parameters and their values as text.
        """
    def rig(self) -> Rig:
        """
        What a careful calibration of the sensors would give.
        """
    def set(self, name: str, value: typing.Any) -> None:
        """
        Sets a parameter by name: "imu.sampling", "odometry.latency_s", "gps.outages", "camera.sigma_px"; see parameters(). Raises ValueError naming it.
        """
    @property
    def description(self) -> str:
        ...
    @property
    def duration_s(self) -> float:
        """
        [s], at most that of the motion
        """
    @duration_s.setter
    def duration_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def motion(self) -> Motion:
        """
        True motion.
        """
    @motion.setter
    def motion(self, arg1: Motion) -> None:
        ...
    @property
    def reference_rate_hz(self) -> float:
        """
        [Hz] of the truth
        """
    @reference_rate_hz.setter
    def reference_rate_hz(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def start_time_ns(self) -> int:
        """
        of time 0 of the motion, since 1970
        """
    @start_time_ns.setter
    def start_time_ns(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
class TruthArrays:
    """
    What was true, at the times of the reference measurements; NaN for sensors that the scenario has not.
    """
    @property
    def acceleration(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [m/s^2], in world, without gravity
        """
    @property
    def accelerometer_bias(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [m/s^2], likewise
        """
    @property
    def angular_velocity(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [rad/s], body axes
        """
    @property
    def gps_error(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [m], coloured part, east north up
        """
    @property
    def gyroscope_bias(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [rad/s], of readings corrected with the rig
        """
    @property
    def odometry_drift(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [unit]
        """
    @property
    def odometry_scale(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N,) [unit/m]
        """
    @property
    def position(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 3) [m], in world
        """
    @property
    def q_world_body_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        (N, 4)
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
class SimulatedRun:
    """
    A whole simulated recording with its truth.
    """
    @property
    def recording(self) -> typing.Any:
        """
        Recording, as read_recording() gives one.
        """
    @property
    def truth(self) -> TruthArrays:
        ...
class Simulation(MeasurementSource):
    """
    Runs a scenario and gives one measurement after the other; the same seed gives the same ones.
    """
    def __init__(self, scenario: Scenario, seed: typing.SupportsInt | typing.SupportsIndex, *, order: str = 'time') -> None:
        """
        order: "time" (of the stamps), or "arrival" (late ones come late).
        """
    def truth(self) -> TruthArrays:
        """
        Of the reference measurements so far.
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
def anchor_run(run: SlamRun, gps_times_ns: numpy.typing.NDArray[numpy.int64], latitude_longitude_altitude: numpy.typing.NDArray[numpy.float64], options: MapAnchorOptions, *, position_cov: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None, velocity_enu: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None, velocity_cov: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None, fix: typing.Annotated[numpy.typing.ArrayLike, numpy.int8] | None = None) -> AnchoredRun:
    """
    What loc-estimator does with GPS, for a run that is there already: fixes (K,) in the order of time, fields as those of Recording.gps. Rows from before the start are put on the Earth by what was known then.
    """
def april_grid(*, columns: typing.SupportsInt | typing.SupportsIndex = 6, rows: typing.SupportsInt | typing.SupportsIndex = 6, tag_m: typing.SupportsFloat | typing.SupportsIndex = 0.088, spacing: typing.SupportsFloat | typing.SupportsIndex = 0.3, first_tag: typing.SupportsInt | typing.SupportsIndex = 0, corner_squares: bool = True) -> Scene:
    """
    Kalibr's board of tags 36h11. Points are the tags' corners: 4 * tag + corner, lower left first, against the clock.
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
def box_room(random: Random, *, size_m: numpy.typing.ArrayLike = (8.0, 6.0, 3.0), cell_m: typing.SupportsFloat | typing.SupportsIndex = 0.5) -> Scene:
    """
    A room seen from inside, origin in the middle of its floor; one feature in each cell of its walls.
    """
def calibrate_camera(target: CalibrationTarget, views: collections.abc.Sequence[TargetView], width_px: typing.SupportsInt | typing.SupportsIndex, height_px: typing.SupportsInt | typing.SupportsIndex, options: CameraFitOptions | None = None) -> CameraFit:
    """
    Intrinsics and distortion of a camera from the target's corners in several pictures. DataError when there is nothing to be solved.
    """
def calibrate_camera_imu(target: CalibrationTarget, recordings: collections.abc.Sequence[CameraRecording], imu_times_ns: numpy.typing.NDArray[numpy.int64], angular_velocity: numpy.typing.NDArray[numpy.float64], specific_force: numpy.typing.NDArray[numpy.float64], noise: ImuNoise | None = None, options: CameraImuOptions | None = None, progress: typing.Any = None) -> CameraImuFit:
    """
    Where cameras sit on an IMU, and by how much their clocks differ, from a target that was waved in front of the rig (or the rig before the target). recordings: [CameraRecording], one for each camera; imu_times_ns (N,), angular_velocity (N, 3) [rad/s], specific_force (N, 3) [m/s^2] of the IMU, calibrated; noise: ImuNoise; progress: called with CameraImuProgress after each iteration, False stops. Ctrl-C stops too: the best so far is the result, with stopped = 'interrupted'. DataError for what cannot be calibrated, with the reason.
    """
def calibrate_clock(times_ns: numpy.typing.NDArray[numpy.int64], host_times_ns: numpy.typing.NDArray[numpy.int64], **kwargs) -> ClockCalibrationResult:
    """
    Stamps and arrivals of one stream, int64 (N,) in the order of arrival; options as of ClockModel.
    """
def checkerboard(*, columns: typing.SupportsInt | typing.SupportsIndex = 9, rows: typing.SupportsInt | typing.SupportsIndex = 6, square_m: typing.SupportsFloat | typing.SupportsIndex = 0.04) -> Scene:
    """
    Points are the inner corners: row * columns + column. Target: x right, y up, z out of the board.
    """
def chi_square_cdf(x: typing.SupportsFloat | typing.SupportsIndex, dof: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    P(X <= x) of the chi-square distribution. ValueError unless dof > 0.
    """
def chi_square_quantile(probability: typing.SupportsFloat | typing.SupportsIndex, dof: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    x with P(X <= x) = probability. ValueError unless 0 <= probability < 1 and dof > 0.
    """
def choose_views(target: CalibrationTarget, views: collections.abc.Sequence[TargetView], width_px: typing.SupportsInt | typing.SupportsIndex, height_px: typing.SupportsInt | typing.SupportsIndex, count: typing.SupportsInt | typing.SupportsIndex) -> list[int]:
    """
    Indices of at most so many views, as different as can be.
    """
def decode_image(image: ImageMeasurement, *, colour: bool = False) -> ImageMeasurement:
    """
    The same picture, grey or with blue first, whatever it is in. DataError for a damaged JPEG.
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
def euroc_cameras(folder: os.PathLike | str | bytes) -> list[int]:
    """
    The numbers of the cameras whose pictures are in a EuRoC / ASL recording, ascending.
    """
def example_drive() -> dict:
    """
    Arguments of WaypointMotion: the drive of the example 'Visual-Inertial Odometry Using Synthetic Data'.
    """
def find_stillness(times_ns: numpy.typing.NDArray[numpy.int64], gyroscope: numpy.typing.NDArray[numpy.float64] | None, accelerometer: numpy.typing.NDArray[numpy.float64] | None, options: StillnessOptions = ...) -> Stillness:
    """
    Still segments of a recording of any unit: int64 (N,) times, float64 (N, 3) readings; one sensor may be None. Bad data do not raise: see Stillness.quality.
    """
def finds_april_grids() -> bool:
    """
    True when AprilGrids can be found, not only checkerboards.
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
def fit_euler_trajectory(times_s: numpy.typing.NDArray[numpy.float64], q_world_body_wxyz: numpy.typing.NDArray[numpy.float64], position: numpy.typing.NDArray[numpy.float64], *, order: typing.SupportsInt | typing.SupportsIndex = 4, spacing_s: typing.SupportsFloat | typing.SupportsIndex = 0.1, smoothing: typing.SupportsFloat | typing.SupportsIndex = 1e-09) -> EulerTrajectoryFit:
    """
    The same as three angles about the mean attitude; DataError also for motion too wide for them (the second angle beyond 80 degrees).
    """
def fit_gyroscope(times_ns: numpy.typing.NDArray[numpy.int64], gyroscope: numpy.typing.NDArray[numpy.float64], segments: collections.abc.Sequence[StillSegment], accelerometer: AccelerometerFit, options: GyroscopeOptions = ...) -> GyroscopeFit:
    """
    Bias, scale and misalignment from the turns between the still segments of the same recording.
    """
def fit_gyroscope_bias(segments: collections.abc.Sequence[StillSegment]) -> GyroscopeFit:
    """
    Bias alone.
    """
def fit_pose_spline(times_s: numpy.typing.NDArray[numpy.float64], q_world_body_wxyz: numpy.typing.NDArray[numpy.float64], position: numpy.typing.NDArray[numpy.float64], *, order: typing.SupportsInt | typing.SupportsIndex = 4, spacing_s: typing.SupportsFloat | typing.SupportsIndex = 0.1, smoothing: typing.SupportsFloat | typing.SupportsIndex = 1e-09, max_iterations: typing.SupportsInt | typing.SupportsIndex = 20) -> PoseSplineFit:
    """
    Least squares of poses: times_s (N,) [s], q_world_body_wxyz (N, 4), position (N, 3) [m]. Otherwise as fit_vector_spline; DataError also for poses that follow each other by more than 120 degrees.
    """
def fit_vector_spline(times_s: numpy.typing.NDArray[numpy.float64], values: numpy.typing.NDArray[numpy.float64], *, order: typing.SupportsInt | typing.SupportsIndex = 4, spacing_s: typing.SupportsFloat | typing.SupportsIndex = 0.1, smoothing: typing.SupportsFloat | typing.SupportsIndex = 1e-09) -> VectorSplineFit:
    """
    Least squares: times_s (N,) [s] increasing, values (N, d). The grid begins at the first time and covers the last. smoothing: weight of the control points' second differences, which decides where there are no samples. DataError names what is not finite, not in order, or so late that the spline would take too many control points.
    """
def format_seconds(time_ns: typing.SupportsInt | typing.SupportsIndex) -> str:
    """
    Nanoseconds as seconds with nine decimals.
    """
def gps_from_unix(unix_time_ns: typing.SupportsInt | typing.SupportsIndex, *, leap_seconds: typing.SupportsInt | typing.SupportsIndex | None = None) -> int | None:
    """
    Nanoseconds since 1970 (UTC) to GPS time: since 1980-01-06, leap seconds counted. None before 1980 and after 2260. leap_seconds: GPS minus UTC, where the library's table is not to be used.
    """
def image_array(image: ImageMeasurement) -> numpy.typing.NDArray[numpy.uint8]:
    """
    An ImageMeasurement as uint8, (height, width) or (height, width, 3) in its own order. ValueError for a JPEG.
    """
def image_measurement(time_ns: typing.SupportsInt | typing.SupportsIndex, image: numpy.ndarray, camera: typing.SupportsInt | typing.SupportsIndex = 0) -> ImageMeasurement:
    """
    An ImageMeasurement of uint8, (height, width) or (height, width, 3) with blue first.
    """
def imu_noise_from(allan: ImuAllan, fallback: ImuNoise = ...) -> ImuNoiseFit:
    """
    What was not identified keeps the fallback's value, or the upper bound where that is lower.
    """
def is_eqvio(path: os.PathLike | str | bytes) -> bool:
    """
    Whether the first line is the heading of such a file.
    """
def leap_seconds_known_until() -> str:
    """
    First day, as YYYY-MM-DD, of which the library's table of leap seconds does not know.
    """
def lint_camera_imu(target: CalibrationTarget, recordings: collections.abc.Sequence[CameraRecording], imu_times_ns: numpy.typing.NDArray[numpy.int64], angular_velocity: numpy.typing.NDArray[numpy.float64], specific_force: numpy.typing.NDArray[numpy.float64], noise: ImuNoise | None = None, imu_rate_hz: typing.SupportsFloat | typing.SupportsIndex = 0) -> list[CameraImuFinding]:
    """
    Looks at a recording before it is calibrated: units, rates, gaps, times, saturation, clocks, the target in the pictures, noise densities. recordings: [CameraRecording]; imu_times_ns (N,), angular_velocity (N, 3) [rad/s], specific_force (N, 3) [m/s^2] of the IMU; imu_rate_hz nominal, 0 when unknown. The worst finding comes first; none for a good recording.
    """
def load_slam(path: os.PathLike | str | bytes) -> SlamFile:
    """
    DataError names the file when it is missing, cut, changed, or of another format.
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
    A CSV file whose first line names columns and units: time_ns or "t [s]", wx wy wz, ax ay az, mx my mz, qw qx qy qz, px py pz, latitude longitude altitude, odo_px odo_py odo_pz ... The units given here are for headings that have none.
    """
def open_eqvio(path: os.PathLike | str | bytes, *, camera: CameraCalibration | None = None, sigma_px: typing.SupportsFloat | typing.SupportsIndex = ...) -> EqvioSource:
    """
    Tracks and IMU of a file of GTSAM's EqVIO example, whose points are without pixels: as the camera would have seen them, by default a pinhole of the file's focal lengths.
    """
def open_euroc(folder: os.PathLike | str | bytes, *, reference: bool = True, magnetometer: bool = True, gps: bool = True, odometry: bool = True) -> MeasurementSource:
    """
    A EuRoC / ASL recording: the folder that holds mav0.
    """
def open_euroc_images(folder: os.PathLike | str | bytes, *, cameras: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex] = [], other: bool = True, reference: bool = True, colour: bool = False) -> MeasurementSource:
    """
    A EuRoC / ASL recording with its pictures. cameras: none are named: all. other: with IMU and all else.
    """
def open_image_folder(folder: os.PathLike | str | bytes, *, rate_hz: typing.SupportsFloat | typing.SupportsIndex = 0.0, first_time_ns: typing.SupportsInt | typing.SupportsIndex = 0, name_unit: str = '', times_file: os.PathLike | str | bytes | None = None, time_unit: str = '', camera: typing.SupportsInt | typing.SupportsIndex = 0, colour: bool = False) -> MeasurementSource:
    """
    A folder of pictures. One of these tells their times: rate_hz (the names are numbers), name_unit (the names are times in ns, us, ms, s), times_file; without any: rgb.txt or times.txt in the folder.
    """
def open_lcm_log(path: os.PathLike | str | bytes) -> MeasurementSource:
    """
    The measurements in an LCM log, in the order of the log: package loc's types and ASPN-23's. What cannot be decoded is counted.
    """
def open_nmea(path: os.PathLike | str | bytes, *, reference_date: typing.Any | None = None, leap_seconds: typing.SupportsInt | typing.SupportsIndex | None = None, geoid_separation: typing.SupportsFloat | typing.SupportsIndex | None = None, sigma_per_dop: typing.SupportsFloat | typing.SupportsIndex = 0.0, accept_not_measured: bool = False) -> MeasurementSource:
    """
    The fixes of an NMEA log as a recording, on GPS time. Options as parse_nmea.
    """
def open_video(path: os.PathLike | str | bytes, *, camera: typing.SupportsInt | typing.SupportsIndex = 0, start_time_ns: typing.SupportsInt | typing.SupportsIndex = 0, rate_hz: typing.SupportsFloat | typing.SupportsIndex = 0.0, colour: bool = False) -> MeasurementSource:
    """
    The pictures of a video. start_time_ns: of the file's beginning. rate_hz: in place of the file's times.
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
def read_points(path: os.PathLike | str | bytes) -> tuple[numpy.typing.NDArray[numpy.float64], dict[str, int]]:
    """
    Points (N, 3) from a text file with x y z a line, and what was read and skipped.
    """
def read_rig(path: os.PathLike | str | bytes) -> Rig:
    """
    rig.yaml. DataError names file, line, key and value.
    """
def read_slam_options(path: os.PathLike | str | bytes, options: SlamOptions | None = None) -> SlamOptions:
    """
    slam.yaml; what it does not say is as in options. DataError names file, line and key. Ranges are SlamOptions.check()'s, which needs the camera too.
    """
def read_tracks(path: os.PathLike | str | bytes) -> tuple[numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.float64], dict[str, int]]:
    """
    A tracks file (rows `frame feature dimension value`): frame (M,), feature (M,), pixel_px (M, 2), and what was read and skipped. DataError names file, line and value.
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
def sampled_path(motion: Motion, spacing_m: typing.SupportsFloat | typing.SupportsIndex = 1.0, height_m: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> numpy.typing.NDArray[numpy.float64]:
    """
    Where a motion goes, for street(): (N, 3), all at one height.
    """
def save_slam(path: os.PathLike | str | bytes, snapshot: SlamSnapshot, options: SlamOptions) -> None:
    """
    Saves what a filter knows, to go on from with restore(); options: the filter's. All numbers come back bit for bit.
    """
def scenario_names() -> dict[str, str]:
    """
    The named scenarios and what they are.
    """
def simulate(scenario: Scenario | str, seed: typing.SupportsInt | typing.SupportsIndex, *, duration_s: typing.SupportsFloat | typing.SupportsIndex | None = None, parameters: dict = {}, order: str = 'time') -> SimulatedRun:
    """
    A whole run as arrays, with its truth. scenario: a Scenario or the name of one; parameters: {name: value}, as Scenario.set takes them. The same seed gives the same numbers.
    """
def simulate_camera(motion: Motion, calibration: CameraCalibration, scene: Scene, random: Random, model: CameraModel | None = None, duration_s: typing.SupportsFloat | typing.SupportsIndex | None = None) -> CameraRun:
    """
    What a camera on a moving body sees of a scene, with the truth. The calibration is the true one; its time_offset_s is how much the stamps are early.
    """
def simulate_clock(scenario: str, duration_s: typing.SupportsFloat | typing.SupportsIndex, random: Random) -> tuple[numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.int64]]:
    """
    'usb_imu' (200 Hz), 'pps' or 'nmea_only': (device_times_ns, host_times_ns, truth_ns), int64 (N,) each; the truth is true host time + minimum delay.
    """
def simulate_gps_time(duration_s: typing.SupportsFloat | typing.SupportsIndex, random: Random, with_pulses: bool = True, label_next: bool = False) -> tuple[numpy.typing.NDArray[numpy.bool], numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.int64]]:
    """
    (is_pulse, host_times_ns, gps_times_ns) as GpsClock.update takes them, then the truth second by second: host times and GPS times, int64 (M,).
    """
def slam_options_for_images(options: SlamOptions) -> SlamOptions:
    """
    A copy that suits tracks of FeatureTracker: sigma_px, map.max_linearity_index, second_order_noise.
    """
def slam_options_text(options: SlamOptions) -> str:
    """
    As write_slam_options() writes it.
    """
def street(path: numpy.typing.ArrayLike, random: Random, model: StreetModel | None = None) -> Scene:
    """
    Facades on both sides of a path (N, 3) on the ground [m], and the road.
    """
def unix_from_gps(gps_time_ns: typing.SupportsInt | typing.SupportsIndex, *, leap_seconds: typing.SupportsInt | typing.SupportsIndex | None = None) -> int:
    """
    GPS time to nanoseconds since 1970 (UTC); a leap second has the number of the second after it.
    """
def update_rig(path: os.PathLike | str | bytes, change: collections.abc.Callable[[typing.Any], None]) -> Rig:
    """
    Reads rig.yaml (an empty rig when there is none), calls change(rig), which alters it, and writes it. What is not changed stays as it was to the last bit, but comments are lost. When anything raises, the file stays as it was.
    """
def write_geojson(path: os.PathLike | str | bytes, latitude_longitude_altitude: numpy.typing.NDArray[numpy.float64], *, utc_ns: numpy.typing.NDArray[numpy.int64] | None = None, sigma_horizontal: numpy.typing.NDArray[numpy.float64] | None = None, sigma_vertical: numpy.typing.NDArray[numpy.float64] | None = None, segments: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex] = [], name: str = 'path', description: str = '', geoid_height: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
    """
    GeoJSON (RFC 7946), arguments as of write_gpx; lines are cut at the antimeridian, altitudes are above the ellipsoid.
    """
def write_gpx(path: os.PathLike | str | bytes, latitude_longitude_altitude: numpy.typing.NDArray[numpy.float64], *, utc_ns: numpy.typing.NDArray[numpy.int64] | None = None, sigma_horizontal: numpy.typing.NDArray[numpy.float64] | None = None, sigma_vertical: numpy.typing.NDArray[numpy.float64] | None = None, segments: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex] = [], name: str = 'path', description: str = '', geoid_height: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
    """
    GPX 1.1: path (N, 3) [rad, rad, m above the ellipsoid], times int64 (N,) [ns since 1970, UTC], deviations (N,) [m]. segments: indices of points before which no line is drawn. geoid_height [m] is subtracted.
    """
def write_kalibr_camchain(path: os.PathLike | str | bytes, rig: Rig) -> None:
    """
    The rig's cameras as Kalibr's camchain: cam0, cam1, ... with T_cam_imu, T_cn_cnm1 and timeshift_cam_imu (t_imu = t_cam + shift). ValueError without a camera.
    """
def write_kalibr_imu(path: os.PathLike | str | bytes, rig: Rig) -> None:
    """
    The IMU's noise and rate as Kalibr's imu.yaml. ValueError without an IMU.
    """
def write_kml(path: os.PathLike | str | bytes, latitude_longitude_altitude: numpy.typing.NDArray[numpy.float64], *, utc_ns: numpy.typing.NDArray[numpy.int64] | None = None, sigma_horizontal: numpy.typing.NDArray[numpy.float64] | None = None, sigma_vertical: numpy.typing.NDArray[numpy.float64] | None = None, segments: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex] = [], name: str = 'path', description: str = '', geoid_height: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
    """
    KML 2.2, arguments as of write_gpx; deviations have no place in it.
    """
def write_ply(path: os.PathLike | str | bytes, position: numpy.typing.NDArray[numpy.float64], id: numpy.typing.NDArray[numpy.int64], sigma: numpy.typing.NDArray[numpy.float64], *, comments: collections.abc.Sequence[str] = [], ascii: bool = False) -> int:
    """
    Points (N, 3) [m] with identities int64 (N,) of 32 bit and deviations (N,) [m] for viewers. Points that are not finite are left out; returns how many.
    """
def write_points(path: os.PathLike | str | bytes, points: numpy.typing.ArrayLike) -> None:
    ...
def write_rig(path: os.PathLike | str | bytes, rig: Rig) -> None:
    """
    Writes rig.yaml; read_rig gives the same numbers back.
    """
def write_slam_options(path: os.PathLike | str | bytes, options: SlamOptions) -> None:
    """
    Writes slam.yaml: every field but the camera; numbers read back as the same.
    """
def write_tracks(path: os.PathLike | str | bytes, frame: numpy.typing.NDArray[numpy.int64], feature: numpy.typing.NDArray[numpy.int64], pixel_px: numpy.typing.NDArray[numpy.float64]) -> None:
    """
    Writes a tracks file from arrays (M,), (M,), (M, 2); frames must ascend.
    """
def write_tum(path: os.PathLike | str | bytes, trajectory: Trajectory, frame: str = 'body') -> None:
    """
    Writes a trajectory in TUM's format; frame: whose poses they are, for the heading.
    """
ESTIMATE_CHANNEL: str = 'LOC_ESTIMATE'
FUSION_CHANNEL: str = 'LOC_FUSION'
GPS_CHANNEL: str = 'LOC_GPS'
HAS_VISION: bool = True
IMAGE_CHANNEL: str = 'LOC_IMAGE'
IMU_CHANNEL: str = 'LOC_IMU'
MAGNETOMETER_CHANNEL: str = 'LOC_MAGNETOMETER'
NO_TIME: int = -9223372036854775808
ODOMETRY_CHANNEL: str = 'LOC_ODOMETRY'
REFERENCE_CHANNEL: str = 'LOC_REFERENCE'
SOURCE_STATUS_CHANNEL: str = 'LOC_SOURCE_STATUS'
STATISTICS_CHANNEL: str = 'LOC_STATISTICS'
TRACKS_CHANNEL: str = 'LOC_TRACKS'
