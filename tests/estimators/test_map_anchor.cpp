// MapAnchor against a drive whose map drifts as the model says: errors, their statistics, and what goes wrong in life.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "libloc/core/random.hpp"
#include "libloc/estimators/map_anchor.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

constexpr TimeNs kStep = 20'000'000;  // between two poses
const GeodeticPoint kOrigin{0.85, 0.2, 300};
const Eigen::Vector3d kAntenna(0.4, -0.2, 1.1);

std::int64_t count(const NamedCounts& counts, const std::string& name) {
  for (const NamedCount& c : counts) {
    if (c.name == name) return c.value;
  }
  return 0;
}

struct Truth {
  Eigen::Vector3d position, velocity, angular_velocity;
  Eigen::Quaterniond q;
};

// A car on a winding road that climbs, 8 m/s; x forward.
Truth truth_at(double t) {
  const auto place = [](double s) {
    return Eigen::Vector3d(60 * std::sin(0.1 * s), 8 * s - 30 * std::sin(0.15 * s), 2 * std::sin(0.05 * s));
  };
  constexpr double kH = 1e-4;
  const auto turn = [&](double s) {
    const Eigen::Vector3d v = (place(s + kH) - place(s - kH)) / (2 * kH);
    return Eigen::Quaterniond(Eigen::AngleAxisd(std::atan2(v.y(), v.x()), Eigen::Vector3d::UnitZ())) *
           Eigen::Quaterniond(Eigen::AngleAxisd(0.05 * std::sin(0.7 * s), Eigen::Vector3d::UnitX()));
  };
  Truth out;
  out.position = place(t);
  out.velocity = (place(t + kH) - place(t - kH)) / (2 * kH);
  out.q = turn(t);
  out.angular_velocity = so3::log(turn(t - kH).inverse() * turn(t + kH)) / (2 * kH);
  return out;
}

struct Ride {
  double duration_s = 60;
  double unit = 1;       // metres a unit of the map
  double heading = 2.3;  // of the map's x axis
  Eigen::Vector3d tilt = Eigen::Vector3d::Zero();
  bool drifts = true;
  double gps_every_s = 1;
  double gps_sigma = 1;
  double gps_velocity_sigma = 0.1;
  double gps_late_s = 0;
  bool gps_velocity = true;
  bool gps_height = true;
  std::function<bool(double)> gps_there = [](double) { return true; };
  std::function<void(double, GpsMeasurement&)> spoil_gps = [](double, GpsMeasurement&) {};
  std::function<void(double, Estimate&)> spoil_pose = [](double, Estimate&) {};
  std::function<void(double, const Estimate&, const Truth&)> see = [](double, const Estimate&, const Truth&) {};
};

MapAnchorOptions white(bool inertial) {
  MapAnchorOptions options = MapAnchorOptions::robust(inertial);
  options.gps_sigma_floor = options.gps_velocity_sigma_floor = options.gps_time_sigma = options.gps_correlation_time_s =
      0;
  options.gps_antenna = kAntenna;
  options.origin = kOrigin;
  return options;
}

// The pose in a map that drifts by the walks of the options.
class Drift {
 public:
  Drift(const Ride& ride, const MapAnchorOptions& options, std::uint64_t seed)
      : ride_(ride), options_(options), random_(seed) {
    turn_ = so3::exp(ride.tilt) * Eigen::AngleAxisd(ride.heading, Eigen::Vector3d::UnitZ());
  }

  Estimate pose(double t, const Truth& x) {
    const Eigen::Vector3d way = before_ ? Eigen::Vector3d(x.position - *before_) : Eigen::Vector3d::Zero();
    before_ = x.position;
    const double root = ride_.drifts ? std::sqrt(way.norm()) : 0;
    const auto vector = [&](double xy, double z) {
      return Eigen::Vector3d(xy * random_.normal(), xy * random_.normal(), z * random_.normal());
    };
    turn_ = so3::exp(vector(options_.tilt_walk * root, options_.heading_walk * root)) * turn_;
    unit_ *= std::exp(options_.scale_walk * root * random_.normal());
    position_ += turn_.inverse() * (way + vector(options_.position_walk * root, options_.position_walk * root)) /
                 (unit_ * ride_.unit);
    Estimate out;
    out.time_ns = from_seconds(t);
    out.valid = kValidOrientation | kValidPosition | kValidVelocity | kValidCovariance;
    if (!options_.scale_known) out.status |= kScaleUnknown;
    out.position = position_;
    out.q_world_body = turn_.inverse() * x.q;
    out.velocity = turn_.inverse() * x.velocity / (unit_ * ride_.unit);
    out.angular_velocity = x.angular_velocity;
    out.covariance_dim = kMaxEstimateDim;
    out.covariance.setZero();
    out.covariance.diagonal().setConstant(1e-8);
    return out;
  }

 private:
  const Ride& ride_;
  const MapAnchorOptions& options_;
  Random random_;
  Eigen::Quaterniond turn_;
  double unit_ = 1;
  Eigen::Vector3d position_ = Eigen::Vector3d(3, -2, 1);
  std::optional<Eigen::Vector3d> before_;
};

GpsMeasurement fix_at(double t, const Ride& ride, Random& random) {
  static const LocalFrame kWorld(kOrigin);
  const Truth x = truth_at(t);
  const auto noise = [&](double sigma) {
    return Eigen::Vector3d(sigma * random.normal(), sigma * random.normal(), sigma * random.normal());
  };
  const Eigen::Vector3d place = x.position + x.q * kAntenna + noise(ride.gps_sigma);
  const GeodeticPoint point = kWorld.to_geodetic(place);
  GpsMeasurement gps;
  gps.time_ns = from_seconds(t);
  gps.fix = GpsFixType::k3d;
  gps.latitude = point.latitude;
  gps.longitude = point.longitude;
  gps.altitude = ride.gps_height ? point.altitude : kUnknown;
  gps.position_cov = ride.gps_sigma * ride.gps_sigma * Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d R_enu_local = kWorld.R_local_enu(point).transpose();
  const Eigen::Vector3d v = x.velocity + x.q * x.angular_velocity.cross(kAntenna) + noise(ride.gps_velocity_sigma);
  if (ride.gps_velocity) {
    gps.velocity_enu = R_enu_local * v;
    gps.velocity_cov = ride.gps_velocity_sigma * ride.gps_velocity_sigma * Eigen::Matrix3d::Identity();
  }
  return gps;
}

MapAnchor run(const Ride& ride, const MapAnchorOptions& options, std::uint64_t seed) {
  MapAnchor anchor(options);
  Random random(seed + 1000);
  Drift drift(ride, options, seed);
  double next_gps = 0.013;
  for (TimeNs time = 0; time < from_seconds(ride.duration_s); time += kStep) {
    const double t = to_seconds(time);
    while (next_gps + ride.gps_late_s <= t) {
      GpsMeasurement gps = fix_at(next_gps, ride, random);
      ride.spoil_gps(next_gps, gps);
      if (ride.gps_there(next_gps)) anchor.fuse(gps);
      next_gps += ride.gps_every_s;
    }
    const Truth x = truth_at(t);
    Estimate pose = drift.pose(t, x);
    ride.spoil_pose(t, pose);
    anchor.move(pose);
    Estimate out = anchor.in_world(pose);
    out.status |= anchor.take_status();
    ride.see(t, out, x);
  }
  return anchor;
}

double position_error(const Estimate& e, const Truth& x) {
  return (e.position - x.position).norm();
}

double heading_error(const Estimate& e, const Truth& x) {
  return (x.q * e.q_world_body.inverse()).angularDistance(Eigen::Quaterniond::Identity());
}

// What estimate errors are worth by their covariance, after the start: theta, position, velocity.
struct Nees {
  double theta = 0, position = 0, velocity = 0;
  int n = 0;
  void add(const Estimate& e, const Truth& x) {
    const auto of = [](const Eigen::Vector3d& error, const Eigen::Matrix3d& cov) {
      return error.dot(cov.inverse() * error);
    };
    theta += of(so3::log(e.q_world_body.inverse() * x.q), e.covariance.block<3, 3>(0, 0));
    position += of(x.position - e.position, e.covariance.block<3, 3>(3, 3));
    velocity += of(x.velocity - e.velocity, e.covariance.block<3, 3>(6, 6));
    ++n;
  }
};

TEST(MapAnchor, PutsAMapOfMetresOnTheEarth) {
  double worst = 0;
  double worst_heading = 0;
  double began = -1;
  Ride ride;
  ride.see = [&](double t, const Estimate& e, const Truth& x) {
    const bool anchored = std::isfinite(e.origin.latitude);
    EXPECT_EQ(anchored, (e.valid & kValidHeading) != 0);
    if (t > 0.1) {
      EXPECT_EQ(anchored, (e.status & kNoGps) == 0) << t;
    }
    if (anchored && began < 0) began = t;
    if (t < 20) return;
    worst = std::max(worst, position_error(e, x));
    worst_heading = std::max(worst_heading, heading_error(e, x));
  };
  const MapAnchor anchor = run(ride, white(true), 1);
  EXPECT_GT(began, 1.5);
  EXPECT_LT(began, 5);
  EXPECT_LT(worst, 1.2);
  EXPECT_LT(worst_heading, 0.03);
  EXPECT_NEAR(std::remainder(so3::heading(anchor.state().q_world_map) - ride.heading, 2 * std::numbers::pi), 0, 0.03);
}

TEST(MapAnchor, ErrorsAreAsLargeAsTheirCovariance) {
  for (const bool inertial : {true, false}) {
    Nees nees;
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
      Ride ride;
      ride.duration_s = 40;
      ride.unit = inertial ? 1 : 3.7;
      if (!inertial) ride.tilt = {0.1, -0.12, 0};
      ride.see = [&](double t, const Estimate& e, const Truth& x) {
        if (t > 12 && std::abs(t - std::round(t)) < 0.001 && std::isfinite(e.origin.latitude)) nees.add(e, x);
      };
      run(ride, white(inertial), seed);
    }
    ASSERT_GT(nees.n, 1000) << inertial;
    // Tilt of the map is what the test gives the pose (1e-8) and no error at all: one of three numbers with an IMU.
    EXPECT_NEAR(nees.theta / nees.n, inertial ? 1 : 3, inertial ? 0.35 : 0.8) << inertial;
    EXPECT_NEAR(nees.position / nees.n, 3, 0.7) << inertial;
  }
}

TEST(MapAnchor, GivesACamerasMapItsMetresAndItsVertical) {
  double worst = 0;
  Ride ride;
  ride.unit = 0.27;
  ride.drifts = false;
  ride.tilt = {0.12, 0.08, 0};
  ride.see = [&](double t, const Estimate& e, const Truth& x) {
    if (t > 25) worst = std::max(worst, position_error(e, x));
    const bool anchored = std::isfinite(e.origin.latitude);
    EXPECT_EQ((e.status & kScaleUnknown) == 0, anchored);
    if (t > 59) {
      EXPECT_NEAR(1 / e.scale, 0.27, 0.02);
      EXPECT_LT((e.velocity - x.velocity).norm(), 0.8);
      EXPECT_LT(heading_error(e, x), 0.06);
    }
  };
  const MapAnchor anchor = run(ride, white(false), 3);
  EXPECT_LT(worst, 2);
  EXPECT_TRUE(anchor.anchored());
}

TEST(MapAnchor, WithoutVelocityTheWayTellsTheHeading) {
  Ride ride;
  ride.gps_velocity = false;
  double began = -1;
  ride.see = [&](double t, const Estimate& e, const Truth& x) {
    if (!std::isfinite(e.origin.latitude)) return;
    if (began < 0) {
      began = t;
      EXPECT_LT(heading_error(e, x), 0.35);
    }
    if (t > 20) {
      EXPECT_LT(heading_error(e, x), 0.1);
    }
  };
  run(ride, white(true), 4);
  EXPECT_GT(began, 2);
  EXPECT_LT(began, 8);
}

TEST(MapAnchor, StandingStillTellsNoHeading) {
  MapAnchor anchor(white(true));
  Ride ride;
  Random random(1);
  Estimate pose = Drift(ride, white(true), 1).pose(0, truth_at(0));
  pose.velocity.setZero();
  pose.angular_velocity.setZero();
  for (int i = 0; i < 6000; ++i) {
    const double t = 0.02 * i;
    pose.time_ns = from_seconds(t);
    pose.position = 1e-3 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    anchor.move(pose);
    if (i % 50 != 0) continue;
    GpsMeasurement gps = fix_at(0, ride, random);
    gps.time_ns = pose.time_ns;
    gps.velocity_enu = 0.1 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    anchor.fuse(gps);
    EXPECT_FALSE(anchor.anchored());
    EXPECT_NE(anchor.take_status() & kNoGps, 0U);
  }
  // Something else knows it.
  anchor.hint_heading(2.3, 0.2);
  GpsMeasurement gps = fix_at(0, ride, random);
  gps.time_ns = pose.time_ns;
  anchor.fuse(gps);
  EXPECT_TRUE(anchor.anchored());
  EXPECT_NEAR(so3::heading(anchor.state().q_world_map), 2.3, 1e-3);
}

TEST(MapAnchor, OutagesAreBridgedByTheMapAndSaid) {
  double at_end = 0;
  double sigma_at_end = 0;
  Ride ride;
  ride.gps_there = [](double t) { return t < 20 || t > 45; };
  ride.see = [&](double t, const Estimate& e, const Truth& x) {
    if (t > 24 && t < 44.9) {
      EXPECT_NE(e.status & kNoGps, 0U) << t;
    }
    if (t > 14 && t < 20) {
      EXPECT_EQ(e.status & kNoGps, 0U) << t;
    }
    if (t > 47) {
      EXPECT_EQ(e.status & kNoGps, 0U) << t;
    }
    if (t > 44.9 && t < 45) {
      at_end = position_error(e, x);
      sigma_at_end = std::sqrt(e.covariance.block<3, 3>(3, 3).trace());
    }
    if (t > 55) {
      EXPECT_LT(position_error(e, x), 2);
    }
  };
  run(ride, white(true), 6);
  EXPECT_LT(at_end, 8);  // after 300 m without a fix
  EXPECT_LT(at_end, 3 * sigma_at_end);
  EXPECT_GT(sigma_at_end, 1);
}

TEST(MapAnchor, LateFixesCountWhereTheyBelong) {
  for (const double late : {0.0, 0.3, 0.9}) {
    double worst = 0;
    Ride ride;
    ride.gps_late_s = late;
    ride.drifts = false;
    ride.gps_sigma = 0.02;
    ride.gps_velocity_sigma = 0.02;
    ride.see = [&](double t, const Estimate& e, const Truth& x) {
      if (t > 15) worst = std::max(worst, position_error(e, x));
    };
    run(ride, white(true), 7);
    EXPECT_LT(worst, 0.15) << late;  // 0.3 s are 3 m
  }
  Ride ride;
  ride.gps_late_s = 1.5;
  const MapAnchor anchor = run(ride, white(true), 7);
  EXPECT_GT(count(anchor.counts(), "gps.too_late"), 50);
  EXPECT_FALSE(anchor.anchored());
}

TEST(MapAnchor, OutliersAreRejectedAndALastingStepIsBelieved) {
  double worst = 0;
  Ride ride;
  ride.gps_every_s = 0.5;
  ride.spoil_gps = [](double t, GpsMeasurement& gps) {
    if (t > 15 && std::fmod(t, 4) < 0.5) gps.latitude += 50 / 6.37e6;
  };
  ride.see = [&](double t, const Estimate& e, const Truth& x) {
    if (t > 15) worst = std::max(worst, position_error(e, x));
  };
  const MapAnchor anchor = run(ride, white(true), 8);
  EXPECT_LT(worst, 1.5);
  EXPECT_GT(count(anchor.counts(), "gps.rejected"), 8);
  EXPECT_EQ(count(anchor.counts(), "anchor.widened"), 0);

  // Another receiver's idea of the place, from 20 s on.
  double at_end = 0;
  bool told = false;
  ride.spoil_gps = [](double t, GpsMeasurement& gps) {
    if (t > 20) gps.latitude += 50 / 6.37e6;
  };
  ride.see = [&](double t, const Estimate& e, const Truth& x) {
    if ((e.status & (kGpsRejected | kRecovered)) != 0) told = true;
    if (t > 59.9) at_end = (e.position - x.position - Eigen::Vector3d(0, 50, 0)).norm();
  };
  run(ride, white(true), 8);
  EXPECT_TRUE(told);
  EXPECT_LT(at_end, 3);
}

TEST(MapAnchor, AFixOfTwoDimensionsSaysNothingOfTheHeight) {
  Ride ride;
  ride.drifts = false;
  ride.gps_height = false;
  ride.gps_sigma = 0.1;
  double worst = 0;
  double height_sigma = 0;
  MapAnchorOptions options = white(true);
  ride.see = [&](double t, const Estimate& e, const Truth& x) {
    if (t < 15) return;
    worst = std::max(worst, (e.position - x.position).head<2>().norm());
    height_sigma = std::sqrt(e.covariance(5, 5));
  };
  run(ride, options, 9);
  EXPECT_LT(worst, 0.4);
  EXPECT_GT(height_sigma, 100);
}

// From 30 to 34 s the pose is dead reckoning that goes astray, then the map corrects it.
TEST(MapAnchor, LostAndFoundAgain) {
  for (const bool fixes : {false, true}) {
    Ride ride;
    ride.gps_there = [&](double t) { return t < 28 || t > 36 || fixes; };
    ride.spoil_pose = [](double t, Estimate& pose) {
      if (t < 30 || t > 34) return;
      const double astray = 2 * (t - 30) * (t - 30);
      pose.position.x() += astray;
      pose.velocity.x() += 4 * (t - 30);
      pose.status |= kLost;
      pose.covariance.block<3, 3>(3, 3) += (0.1 + astray * astray) * Eigen::Matrix3d::Identity();
    };
    double worst_lost = 0;
    double worst_after = 0;
    double jump = 0;
    double sigma_lost = 0;
    std::optional<Eigen::Vector3d> error_before;
    ride.see = [&](double t, const Estimate& e, const Truth& x) {
      const double error = position_error(e, x);
      if (t > 30 && t < 34) {
        worst_lost = std::max(worst_lost, error);
        sigma_lost = std::sqrt(e.covariance.block<3, 3>(3, 3).trace());
        EXPECT_LT(error, 4 * sigma_lost + 1) << t;
      }
      if (t > 34.1) worst_after = std::max(worst_after, error);
      if (error_before && t > 34 && t < 34.1) jump = std::max(jump, (e.position - x.position - *error_before).norm());
      error_before = e.position - x.position;
    };
    run(ride, white(true), 10);
    EXPECT_LT(worst_after, 3) << fixes;
    if (!fixes) {
      EXPECT_GT(worst_lost, 20);
    }
  }
}

// A fix of another clock before the first pose must not spoil those that follow.
TEST(MapAnchor, FixesBeforeTheFirstPoseMayBeOfAnotherClock) {
  MapAnchor anchor(white(true));
  Ride ride;
  Random random(1);
  for (const double t : {1e6, 0.01}) {
    GpsMeasurement gps = fix_at(0, ride, random);
    gps.time_ns = from_seconds(t);
    anchor.fuse(gps);
  }
  const MapAnchorOptions options = white(true);
  Drift drift(ride, options, 1);
  for (int i = 0; i < 5; ++i) anchor.move(drift.pose(0.02 * i, truth_at(0.02 * i)));
  EXPECT_EQ(count(anchor.counts(), "gps.skipped.ahead"), 1);
  EXPECT_EQ(count(anchor.counts(), "gps.too_late"), 0);
}

// The map of an IMU that begins elsewhere is not a way that the body went.
TEST(MapAnchor, AMapThatBeginsElsewhereIsFoundAnew) {
  Ride ride;
  double worst = 0;
  bool anew = false;
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  ride.spoil_pose = [&](double t, Estimate& pose) {
    if (t < 30) return;
    if (!anew) {
      anew = true;
      shift = -pose.position;
      pose.status |= kReinitialised;
    }
    pose.position += shift;
  };
  ride.see = [&](double t, const Estimate& e, const Truth& x) {
    if (std::isfinite(e.origin.latitude) && t > 15) worst = std::max(worst, position_error(e, x));
    if (t > 59) {
      EXPECT_TRUE(std::isfinite(e.origin.latitude));
    }
  };
  const MapAnchor anchor = run(ride, white(true), 13);
  EXPECT_LT(worst, 3);
  EXPECT_EQ(count(anchor.counts(), "anchor.started"), 2);
  EXPECT_GT(anchor.map_number(), 0);
}

TEST(MapAnchor, BadFixesAreCountedAndLeaveAllAsItWas) {
  Ride ride;
  const auto spoiled = [&](const std::function<void(GpsMeasurement&)>& spoil, const std::string& name,
                           std::uint32_t status) {
    std::uint32_t all = 0;
    Ride bad = ride;
    bad.duration_s = 20;
    bad.spoil_gps = [&](double t, GpsMeasurement& gps) {
      if (t > 15) spoil(gps);
    };
    double worst = 0;
    bad.see = [&](double t, const Estimate& e, const Truth& x) {
      if (t <= 15) return;
      all |= e.status;
      EXPECT_TRUE(e.position.allFinite());
      worst = std::max(worst, position_error(e, x));
    };
    const MapAnchor anchor = run(bad, white(true), 11);
    EXPECT_EQ(count(anchor.counts(), name), 5) << name;
    EXPECT_EQ(all & status, status) << name;
    EXPECT_LT(worst, 2.5) << name;
  };
  spoiled([](GpsMeasurement& gps) { gps.fix = GpsFixType::kNone; }, "gps.skipped.no_fix", kNoGps);
  spoiled([](GpsMeasurement& gps) { gps.latitude = kUnknown; }, "gps.skipped.not_finite", kNotFinite);
  spoiled([](GpsMeasurement& gps) { gps.latitude = 2; }, "gps.skipped.out_of_range", kOutOfRange);
  spoiled([](GpsMeasurement& gps) { gps.position_cov(1, 1) = -1; }, "gps.bad_covariance", kBadCovariance);
  spoiled([](GpsMeasurement& gps) { gps.time_ns += from_seconds(100); }, "gps.skipped.ahead", kOutOfRange);
  spoiled([](GpsMeasurement& gps) { gps.time_ns -= from_seconds(5); }, "gps.too_late", kTooLate);
  spoiled([](GpsMeasurement& gps) { gps.velocity_cov.setConstant(std::numeric_limits<double>::infinity()); },
          "gps_velocity.bad_covariance", kBadCovariance);
  spoiled([](GpsMeasurement& gps) { gps.altitude = 1e20; }, "gps.skipped.out_of_range", kOutOfRange);
  MapAnchorOptions wrong = white(true);
  wrong.gate_probability = 1;
  EXPECT_THROW(MapAnchor{wrong}, std::invalid_argument);
}

TEST(MapAnchor, FramesAndPointsComeToTheSamePlaceAsThePose) {
  Ride ride;
  ride.unit = 2.5;
  const MapAnchor anchor = run(ride, white(false), 12);
  ASSERT_TRUE(anchor.anchored());
  SlamFrame frame;
  frame.estimate.valid = kValidOrientation | kValidPosition;
  frame.estimate.q_world_body = so3::exp({0.1, 0.2, 0.3});
  frame.estimate.position = {1, 2, 3};
  frame.camera_position = {1.5, 2.5, 3.5};
  frame.q_world_camera = frame.estimate.q_world_body;
  frame.features.resize(1);
  frame.features[0].inverse_depth = 0.1;
  SlamMapPoint point;
  point.position = {1.5, 2.5, 3.5};
  point.position_cov = 1e-4 * Eigen::Matrix3d::Identity();
  point.inverse_depth.anchor = {1, 2, 3};
  point.inverse_depth.inverse_depth = 2;
  point.inverse_depth.frame = frame_of_ray(Eigen::Vector3d(1, 1, 1));
  point.position = point.inverse_depth.xyz();
  point.inverse_depth_cov = 1e-4 * Eigen::Matrix<double, 6, 6>::Identity();
  SlamFrame in_world = frame;
  SlamMapPoint point_in_world = point;
  anchor.put_in_world(in_world);
  anchor.put_in_world(point_in_world);
  const double s = anchor.state().scale;
  EXPECT_NEAR((in_world.camera_position - in_world.estimate.position).norm(), s * std::sqrt(0.75), 1e-9);
  EXPECT_NEAR(in_world.features[0].inverse_depth, 0.1 / s, 1e-12);
  EXPECT_LT((point_in_world.inverse_depth.anchor - in_world.estimate.position).norm(), 1e-9);
  EXPECT_LT((point_in_world.inverse_depth.xyz() - point_in_world.position).norm(), 1e-9);
  EXPECT_GT(point_in_world.position_cov(0, 0), anchor.covariance()(0, 0));
}

// The deviation of the heading is the anchor's, not that of the pose in its map beside it.
// SLAM that has diverged says so by an estimate without a pose, and begins a new map with the next one.
TEST(MapAnchor, AMapThatDivergesLeavesNothingBehind) {
  for (const bool inertial : {true, false}) {
    Ride ride;
    ride.unit = inertial ? 1 : 0.4;
    ride.drifts = false;
    bool anew = false;
    double worst = 0;
    ride.spoil_pose = [&](double t, Estimate& pose) {
      if (t < 30) return;
      if (t < 30.5) {
        pose.valid = 0;
        pose.position.setConstant(1e300);
        pose.covariance.setConstant(kUnknown);
        return;
      }
      if (!std::exchange(anew, true)) pose.status |= kReinitialised;
      pose.position = 3 * pose.position + Eigen::Vector3d(1000, 0, 5);
      pose.velocity *= 3;
    };
    if (inertial) {
      ride.spoil_pose = [&](double t, Estimate& pose) {
        if (t >= 30 && t < 30.5) pose.valid = 0, pose.position.setConstant(1e300);
        if (t < 30.5) return;
        if (!std::exchange(anew, true)) pose.status |= kReinitialised;
        pose.position += Eigen::Vector3d(1000, 0, 5);
      };
    }
    ride.see = [&](double t, const Estimate& e, const Truth& x) {
      if (t > 30 && t < 30.5) {
        EXPECT_TRUE(std::isnan(e.origin.latitude)) << t;
        EXPECT_EQ(e.valid, 0U);
      }
      if (std::isfinite(e.origin.latitude) && t > 20) worst = std::max(worst, position_error(e, x));
      if (t > 59) {
        EXPECT_TRUE(std::isfinite(e.origin.latitude));
      }
    };
    const MapAnchor anchor = run(ride, white(inertial), 21);
    EXPECT_LT(worst, inertial ? 3 : 5) << inertial;
    EXPECT_EQ(count(anchor.counts(), "anchor.map_began_anew"), 1);
    EXPECT_EQ(count(anchor.counts(), "anchor.started"), 2);
    EXPECT_EQ(count(anchor.counts(), "gps.rejected"), 0);
  }
}

// Lost, and then in surroundings that are new to the map: the guess is not taken for a place in the map.
TEST(MapAnchor, GoingOnElsewhereIsNotFindingBack) {
  for (const bool inertial : {true, false}) {
    Ride ride;
    ride.drifts = false;
    ride.gps_there = [](double t) { return t < 28 || t > 44; };
    ride.spoil_pose = [&](double t, Estimate& pose) {
      if (t < 30) return;
      const double astray = 2 * std::min(t - 30, 4.0) * std::min(t - 30, 4.0);
      pose.position.x() += astray;
      pose.status |= t < 34 ? kLost : kMapLinkUnknown;
      pose.covariance.block<3, 3>(3, 3) += (0.1 + astray * astray) * Eigen::Matrix3d::Identity();
    };
    double scale_sigma = 0;
    double at_end = 0;
    ride.see = [&](double t, const Estimate& e, const Truth& x) {
      const double error = position_error(e, x);
      if (t > 30 && t < 44) {
        EXPECT_LT(error, 3 * std::sqrt(e.covariance.block<3, 3>(3, 3).trace()) + 1) << t;
      }
      if (t > 35 && t < 35.1) {
        EXPECT_GT(error, 20);
        scale_sigma = inertial ? 0 : e.scale_sigma / e.scale;
      }
      if (t > 59) at_end = std::max(at_end, error);
    };
    const MapAnchor anchor = run(ride, white(inertial), 22);
    EXPECT_EQ(count(anchor.counts(), "anchor.went_on_elsewhere"), 1);
    EXPECT_LT(at_end, 3) << inertial;
    if (!inertial) {
      EXPECT_GT(scale_sigma, 0.3);
    }
  }
}

// Back in the map without having been lost once more: nothing of what was seen elsewhere is mixed with it.
TEST(MapAnchor, LinkedAgainItsUnitIsOpenOnceMore) {
  for (const bool inertial : {true, false}) {
    Ride ride;
    ride.drifts = false;
    ride.gps_there = [](double t) { return t < 28 || t > 36; };
    ride.spoil_pose = [&](double t, Estimate& pose) {
      if (t < 30 || t > 48) return;
      const double astray = 2 * std::min(t - 30, 4.0) * std::min(t - 30, 4.0);
      pose.position.x() += astray;
      pose.status |= t < 34 ? kLost : kMapLinkUnknown;
      pose.covariance.block<3, 3>(3, 3) += (0.1 + astray * astray) * Eigen::Matrix3d::Identity();
    };
    double before = 0;
    double after = 0;
    double at_end = 0;
    ride.see = [&](double t, const Estimate& e, const Truth& x) {
      if (t > 47.8 && t < 47.9) before = inertial ? 0 : e.scale_sigma / e.scale;
      if (t > 48.05 && t < 48.15) after = inertial ? 0 : e.scale_sigma / e.scale;
      if (t > 59) at_end = std::max(at_end, position_error(e, x));
    };
    const MapAnchor anchor = run(ride, white(inertial), 22);
    EXPECT_EQ(count(anchor.counts(), "anchor.went_on_elsewhere"), 1);
    EXPECT_EQ(count(anchor.counts(), "anchor.linked_again"), 1);
    EXPECT_LT(at_end, 3) << inertial;
    if (!inertial) {
      EXPECT_LT(before, 0.2);
      EXPECT_GT(after, 0.3);
    }
  }
}

// A magnetic heading that GPS contradicts for long is not believed again. (A receiver that strays ever further has the
// anchor begin anew; any other is believed before.)
TEST(MapAnchor, AHintThatGpsContradictsIsForgotten) {
  const MapAnchorOptions options = white(true);
  MapAnchor anchor(options);
  Ride ride;
  ride.drifts = false;
  Drift drift(ride, options, 23);
  Random random(23);
  anchor.hint_heading(ride.heading + 1.5, 0.002);
  double worst = 0;
  for (int i = 0; i < 3000; ++i) {
    const double t = 0.02 * i;
    const Truth x = truth_at(t);
    const Estimate pose = drift.pose(t, x);
    anchor.move(pose);
    if (i % 50 == 0) {
      GpsMeasurement gps = fix_at(t, ride, random);
      gps.velocity_enu.setConstant(kUnknown);
      if (t > 3) gps.latitude += 200 * std::pow(10, std::min(2.0, std::floor((t - 3) / 5))) / 6.37e6;
      anchor.fuse(gps);
    }
    if (t > 50) worst = std::max(worst, heading_error(anchor.in_world(pose), x));
  }
  EXPECT_GE(count(anchor.counts(), "anchor.started"), 2);
  EXPECT_LT(worst, 0.1);
}

// Fixes whose stamps are a second off against the poses, with the receiver's errors that last.
TEST(MapAnchor, StampsOfGpsThatAreOffAreTold) {
  for (const bool inertial : {true, false}) {
    for (const double late : {0.0, 1.0, -1.0}) {
      Ride ride;
      ride.duration_s = inertial ? 240 : 600;
      ride.unit = inertial ? 1 : 2.5;
      Random random(31);
      ride.spoil_gps = [&](double t, GpsMeasurement& gps) {
        gps = fix_at(t - late, ride, random);
        gps.time_ns = from_seconds(t);
      };
      bool said = false;
      ride.see = [&](double, const Estimate& e, const Truth&) { said |= (e.status & kGpsStampsDoubtful) != 0; };
      MapAnchorOptions options = white(inertial);
      options.gps_time_sigma = 0.1;
      const MapAnchor anchor = run(ride, options, 31);
      EXPECT_EQ(said, late != 0) << inertial << " " << late << ": " << anchor.lag_watch().offset_s() << " +- "
                                 << anchor.lag_watch().sigma_s();
      EXPECT_NEAR(anchor.lag_watch().offset_s(), -late, 0.3);
      EXPECT_EQ(count(anchor.counts(), "stamps.gps_to_add_ms") != 0, late != 0);
    }
  }
}

std::vector<AnchorPair> pairs_on_the_road(double unit, double sigma, std::uint64_t seed) {
  Random random(seed);
  std::vector<AnchorPair> pairs;
  for (int i = 0; i < 25; ++i) {
    const Truth x = truth_at(i);
    AnchorPair& pair = pairs.emplace_back();
    pair.fix.time_ns = from_seconds(i);
    pair.fix.position = x.position + sigma * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    pair.fix.position_cov = sigma * sigma * Eigen::Matrix3d::Identity();
    pair.fix.has_height = true;
    pair.position = x.position / unit;
    pair.velocity = x.velocity / unit;
    pair.lever = pair.lever_velocity = Eigen::Vector3d::Zero();
    pair.way = 8.0 * i / unit;
  }
  return pairs;
}

TEST(MapAnchorStart, AnOutlierCountsLittle) {
  for (const bool scale_known : {true, false}) {
    std::vector<AnchorPair> pairs = pairs_on_the_road(1, 1, 5);
    pairs[12].fix.position += Eigen::Vector3d(150, -200, 0);
    AnchorPrior prior;
    prior.scale_known = scale_known;
    prior.tilt_sigma = 0.01;
    const auto found = find_anchor(pairs, prior, pairs.back().position, pairs.back().way);
    ASSERT_TRUE(found);
    EXPECT_LT((found->state.position - truth_at(24).position).norm(), 2) << scale_known;
    EXPECT_NEAR(so3::heading(found->state.q_world_map), 0, 0.03);
    EXPECT_NEAR(found->state.scale, 1, 0.03);
  }
}

// The same drive in maps of other units: what the map drifts is in metres.
TEST(MapAnchorStart, TheDriftOfTheMapIsInMetresWhateverItsUnit) {
  const auto sigma = [](double unit, double walk) {
    const std::vector<AnchorPair> pairs = pairs_on_the_road(unit, 0.1, 6);
    AnchorPrior prior;
    prior.scale_known = false;
    prior.tilt_sigma = 0.01;
    prior.position_walk = walk;
    const auto found = find_anchor(pairs, prior, pairs.back().position, pairs.back().way);
    return found ? std::sqrt(found->covariance.topLeftCorner<3, 3>().trace()) : 0;
  };
  const double in_metres = sigma(1, 0.1);
  EXPECT_GT(in_metres, 1.5 * sigma(1, 0));
  for (const double unit : {0.05, 40.0}) EXPECT_NEAR(sigma(unit, 0.1) / in_metres, 1, 0.02) << unit;
}

TEST(MapAnchor, TheHeadingsDeviationIsThatAgainstNorth) {
  const MapAnchor anchor = run(Ride(), white(true), 14);
  Estimate pose;
  pose.valid = kValidOrientation | kValidPosition | kValidVelocity | kValidCovariance;
  pose.q_world_body = so3::exp({0.3, -0.2, 0.5});
  pose.position = {1, 2, 3};
  pose.velocity = {1, 0, 0};
  pose.covariance_dim = kMaxEstimateDim;
  pose.covariance = 0.04 * Eigen::Matrix<double, kMaxEstimateDim, kMaxEstimateDim>::Identity();
  const Estimate e = anchor.in_world(pose);
  const Eigen::Vector3d up = e.q_world_body.inverse() * Eigen::Vector3d::UnitZ();
  const Eigen::Matrix3d cov = e.covariance.topLeftCorner<3, 3>();
  EXPECT_NEAR(up.dot(cov * up), anchor.covariance()(kAnchorTurn + 2, kAnchorTurn + 2), 1e-9);
  EXPECT_NEAR(cov.trace() - up.dot(cov * up), 0.08, 1e-6);  // the tilt is the map's
}

}  // namespace
}  // namespace loc
