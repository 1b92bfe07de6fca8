#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

#include "libloc/calib/allan.hpp"
#include "libloc/core/check.hpp"
#include "libloc/core/random.hpp"
#include "support/data.hpp"
#include "support/xsens.hpp"

namespace loc {
namespace {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// White noise of density n, flicker noise of bias instability b, random walk k.
std::vector<double> noise(Random& random, std::size_t count, double rate_hz, double n, double b, double k) {
  // Flicker: first-order processes with time constants a factor of 3 apart have together the density b^2 / (2 pi f).
  struct Process {
    double keep, push, state;
  };
  std::vector<Process> processes;
  const double ratio = 3;
  for (double tau = 0.3 / rate_hz; tau < 30 * static_cast<double>(count) / rate_hz; tau *= ratio) {
    const double keep = std::exp(-1 / rate_hz / tau);
    const double variance = b * b * std::log(ratio) / std::numbers::pi;
    processes.push_back({keep, std::sqrt(variance * (1 - keep * keep)), std::sqrt(variance) * random.normal()});
  }
  std::vector<double> out;
  double walk = 0;
  for (std::size_t i = 0; i < count; ++i) {
    double value = n * std::sqrt(rate_hz) * random.normal() + walk;
    walk += k / std::sqrt(rate_hz) * random.normal();
    if (b > 0) {
      for (Process& p : processes) {
        p.state = p.keep * p.state + p.push * random.normal();
        value += p.state;
      }
    }
    out.push_back(value);
  }
  return out;
}

/// By its definition: half the mean square of the difference of neighbouring means, at every start.
double slow_deviation(const std::vector<double>& v, std::size_t m) {
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i + 2 * m <= v.size(); ++i, ++count) {
    double a = 0;
    double b = 0;
    for (std::size_t k = 0; k < m; ++k) {
      a += v[i + k] / static_cast<double>(m);
      b += v[i + m + k] / static_cast<double>(m);
    }
    sum += (b - a) * (b - a) / 2;
  }
  return std::sqrt(sum / static_cast<double>(count));
}

TEST(Allan, CurveIsTheDefinition) {
  Random random(1);
  std::vector<double> v = noise(random, 700, 50, 0.1, 0.01, 0.05);
  for (double& x : v) x += 1e4;
  const AllanFit fit = allan_fit(v, 50);
  ASSERT_GT(fit.points.size(), 20U);
  for (const AllanPoint& p : fit.points) {
    EXPECT_NEAR(p.deviation / slow_deviation(v, static_cast<std::size_t>(p.samples)), 1, 1e-7);
    EXPECT_NEAR(p.tau_s * 50, static_cast<double>(p.samples), 1e-9);
  }
}

TEST(Allan, SigmaOfThePointsIsThatOfTheErrors) {
  constexpr int kRuns = 150;
  std::vector<double> squares;
  for (int run = 0; run < kRuns; ++run) {
    Random random(static_cast<std::uint64_t>(run) + 1);
    const AllanFit fit = allan_fit(noise(random, 4000, 100, 0.02, 0, 0), 100);
    squares.resize(fit.points.size());
    for (std::size_t i = 0; i < fit.points.size(); ++i) {
      const AllanPoint& p = fit.points[i];
      const double truth = 0.02 / std::sqrt(p.tau_s);
      squares[i] += std::pow((p.deviation - truth) / (truth / std::sqrt(2 * p.freedom)), 2) / kRuns;
    }
  }
  for (std::size_t i = 0; i + 8 < squares.size(); ++i) EXPECT_NEAR(squares[i], 1, 0.6) << "point " << i;
}

TEST(Allan, WhiteNoiseAlone) {
  Random random(2);
  const AllanFit fit = allan_fit(noise(random, 60'000, 100, 0.003, 0, 0), 100);
  ASSERT_TRUE(fit.noise_density.identified);
  EXPECT_NEAR(fit.noise_density.value, 0.003, 5e-5);
  EXPECT_LT(std::abs(fit.noise_density.value - 0.003), 4 * fit.noise_density.sigma);
  EXPECT_FALSE(fit.bias_instability.identified);
  EXPECT_FALSE(fit.random_walk.identified);
  EXPECT_TRUE(std::isnan(fit.random_walk.value));
  EXPECT_GT(fit.random_walk.upper_bound, 0);
  EXPECT_EQ(fit.quality.verdict, Verdict::kFair);
  EXPECT_EQ(fit.quality.reasons.size(), 2U);
}

// The three terms at once, in a recording long enough to see each, over seeds.
TEST(Allan, FindsAllThreeTermsWithinTheirSigma) {
  constexpr int kRuns = 16;
  const double n = 0.01;
  const double b = 0.004;
  const double k = 4e-4;
  int found = 0;
  double sum[3] = {};
  double worst[3] = {};
  for (int run = 0; run < kRuns; ++run) {
    Random random(static_cast<std::uint64_t>(run) + 100);
    const AllanFit fit = allan_fit(noise(random, 200'000, 10, n, b, k), 10);
    EXPECT_TRUE(fit.noise_density.identified) << run;
    if (!fit.bias_instability.identified || !fit.random_walk.identified) continue;
    ++found;
    const double z[3] = {(fit.noise_density.value - n) / fit.noise_density.sigma,
                         (fit.bias_instability.value - b) / fit.bias_instability.sigma,
                         (fit.random_walk.value - k) / fit.random_walk.sigma};
    for (int i = 0; i < 3; ++i) {
      sum[i] += z[i] * z[i];
      worst[i] = std::max(worst[i], std::abs(z[i]));
    }
    EXPECT_GT(fit.random_walk.upper_bound, k);
  }
  std::printf("all three in %d of %d runs; mean z^2 %.2f %.2f %.2f, worst |z| %.1f %.1f %.1f\n", found, kRuns,
              sum[0] / found, sum[1] / found, sum[2] / found, worst[0], worst[1], worst[2]);
  EXPECT_GE(found, kRuns * 3 / 4);
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT(sum[i] / found, 2) << i;
    EXPECT_LT(worst[i], 4.5) << i;
  }
}

// Too short to see more than white noise: said, never guessed; and the bounds hold.
TEST(Allan, WhatIsTooShortIsSaid) {
  int claims = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Random random(seed);
    const AllanFit fit = allan_fit(noise(random, 6000, 100, 0.01, 1e-4, 1e-6), 100);
    EXPECT_TRUE(fit.noise_density.identified);
    claims += fit.bias_instability.identified || fit.random_walk.identified ? 1 : 0;
    EXPECT_GT(fit.bias_instability.upper_bound, 1e-4);
    EXPECT_GT(fit.random_walk.upper_bound, 1e-6);
  }
  EXPECT_LE(claims, 1);
}

TEST(Allan, AFilterInTheSensorIsSkipped) {
  Random random(3);
  std::vector<double> v = noise(random, 100'000, 200, 0.01, 0, 0);
  double state = 0;
  for (double& x : v) x = state += 0.2 * (x - state);
  const AllanFit fit = allan_fit(v, 200);
  EXPECT_GT(fit.fitted_from_tau_s, 0.01);
  ASSERT_TRUE(fit.noise_density.identified);
  EXPECT_NEAR(fit.noise_density.value, 0.01, 6e-4);
}

TEST(Allan, QuantisationAndRampDoNotPassForTheOthers) {
  Random random(4);
  std::vector<double> v = noise(random, 100'000, 100, 1e-3, 0, 0);
  for (std::size_t i = 0; i < v.size(); ++i) v[i] += 5e-6 * static_cast<double>(i) / 100;
  const AllanFit fit = allan_fit(v, 100);
  EXPECT_NEAR(fit.noise_density.value, 1e-3, 3e-5);
  EXPECT_FALSE(fit.bias_instability.identified);
}

TEST(Allan, HostileInput) {
  EXPECT_EQ(allan_fit({}, 100).quality.verdict, Verdict::kRefused);
  EXPECT_EQ(allan_fit(std::vector<double>(63, 1.0), 100).quality.verdict, Verdict::kRefused);
  const AllanFit constant = allan_fit(std::vector<double>(1000, 5.0), 100);
  EXPECT_EQ(constant.quality.verdict, Verdict::kRefused);
  EXPECT_FALSE(constant.noise_density.identified);
  std::vector<double> v(1000, 1.0);
  v[17] = std::nan("");
  EXPECT_THROW(allan_fit(v, 100), DataError);
  v[17] = 1e300;
  EXPECT_EQ(allan_fit(v, 100).quality.verdict, Verdict::kRefused);
  EXPECT_THROW(allan_fit(v, 0), std::invalid_argument);
  AllanOptions options;
  options.longest_share = 0.7;
  EXPECT_THROW(allan_fit(v, 100, options), std::invalid_argument);
  EXPECT_EQ(analyse_imu_noise({}, Rows(0, 3), Rows(0, 3)).quality.verdict, Verdict::kRefused);
}

struct Recording {
  std::vector<TimeNs> times;
  Rows gyro;
  Rows accel;
};

Recording still_recording(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  Recording r;
  r.gyro.resize(static_cast<Eigen::Index>(count), 3);
  r.accel.resize(static_cast<Eigen::Index>(count), 3);
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<double> g = noise(random, count, 100, 2e-4 * (1 + axis), 0, 0);
    const std::vector<double> a = noise(random, count, 100, 2e-3, 0, 4e-3);
    for (std::size_t i = 0; i < count; ++i) {
      r.gyro(static_cast<Eigen::Index>(i), axis) = g[i];
      r.accel(static_cast<Eigen::Index>(i), axis) = a[i] + (axis == 2 ? 9.8 : 0);
    }
  }
  for (std::size_t i = 0; i < count; ++i) r.times.push_back(static_cast<TimeNs>(i) * 10'000'000);
  return r;
}

TEST(ImuAllan, NoiseForTheEstimators) {
  const Recording r = still_recording(60'000, 5);
  StillnessOptions stillness;
  const ImuAllan allan = analyse_imu_noise(r.times, r.gyro, r.accel, {}, stillness);
  EXPECT_EQ(allan.begin, 0);
  EXPECT_EQ(allan.used_share, 1);
  const ImuNoiseFit fit = imu_noise_from(allan);
  EXPECT_NEAR(fit.noise.gyroscope_noise_density, 2e-4 * std::sqrt(14.0 / 3), 1e-5);
  EXPECT_NEAR(fit.noise.accelerometer_noise_density, 2e-3, 1e-4);
  EXPECT_NEAR(fit.noise.accelerometer_random_walk, 4e-3, 1e-3);
  // No walk in the gyroscope: the default stays, as it is within what the recording allows, or the bound is taken.
  EXPECT_LE(fit.noise.gyroscope_random_walk, 2e-5);
  EXPECT_EQ(fit.noise.gyroscope_bias_sigma, ImuNoise{}.gyroscope_bias_sigma);
  const std::vector<std::string> measured = {"gyroscope_noise_density", "accelerometer_noise_density",
                                             "accelerometer_random_walk"};
  EXPECT_EQ(fit.measured, measured);
  EXPECT_EQ(fit.quality.verdict, Verdict::kFair);
  ASSERT_FALSE(fit.quality.reasons.empty());
  EXPECT_NE(fit.quality.reasons[0].find("gyroscope_random_walk"), std::string::npos);
}

TEST(ImuAllan, ABoundBelowTheFallbackIsTaken) {
  const Recording r = still_recording(60'000, 6);
  ImuNoise fallback;
  fallback.gyroscope_random_walk = 1;
  const ImuNoiseFit fit = imu_noise_from(analyse_imu_noise(r.times, r.gyro, Rows(0, 3)), fallback);
  EXPECT_LT(fit.noise.gyroscope_random_walk, 1e-2);
  EXPECT_EQ(fit.noise.accelerometer_noise_density, fallback.accelerometer_noise_density);
  EXPECT_EQ(fit.quality.verdict, Verdict::kWarn);
  EXPECT_EQ(imu_noise_from(ImuAllan{}).quality.verdict, Verdict::kRefused);
}

TEST(ImuAllan, TheLongestGoodPartIsUsed) {
  Recording r = still_recording(30'000, 7);
  for (std::size_t i = 10'000; i < r.times.size(); ++i) r.times[i] += 100'000'000;  // ten samples lost
  for (int i = 0; i < 300; ++i) r.accel(22'000 + i, 0) += 3 * std::sin(0.05 * i);
  const ImuAllan allan = analyse_imu_noise(r.times, r.gyro, r.accel);
  EXPECT_EQ(allan.begin, 10'000);
  EXPECT_NEAR(static_cast<double>(allan.end), 22'000, 50);
  EXPECT_NEAR(allan.used_share, 0.4, 2e-3);
  EXPECT_EQ(allan.bridged, 0);
  EXPECT_NEAR(allan.gyroscope[0].rate_hz, 100, 1e-6);
  EXPECT_NE(allan.quality.reasons.at(0).find(" % of the recording is used"), std::string::npos);
}

TEST(ImuAllan, LostSamplesAndLateStampsAreBridged) {
  Recording r = still_recording(60'000, 8);
  const ImuAllan whole = analyse_imu_noise(r.times, r.gyro, r.accel);
  EXPECT_EQ(whole.bridged, 0);
  Recording bad;
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < r.gyro.rows(); ++i) {
    if (i % 1000 == 500 || i % 5000 == 501) continue;  // one, sometimes two lost
    kept.push_back(i);
    bad.times.push_back(r.times[static_cast<std::size_t>(i)] + (i % 700 == 0 ? 8'000'000 : 0));  // late stamps
  }
  bad.gyro = r.gyro(kept, Eigen::all);
  bad.accel = r.accel(kept, Eigen::all);
  bad.gyro(30'000, 1) = std::nan("");
  const ImuAllan allan = analyse_imu_noise(bad.times, bad.gyro, bad.accel);
  EXPECT_EQ(allan.used_share, 1);
  EXPECT_EQ(allan.bridged, 60 + 12 + 1);
  EXPECT_NEAR(allan.gyroscope[0].rate_hz, 100, 2e-3);  // the first stamp is late
  EXPECT_NEAR(allan.gyroscope[2].noise_density.value / whole.gyroscope[2].noise_density.value, 1, 0.01);
  EXPECT_EQ(allan.quality.verdict, whole.quality.verdict);
}

TEST(ImuAllan, ShortPartsWarnAndAxesShareASentence) {
  const Recording r = still_recording(5'000, 9);
  const ImuAllan allan = analyse_imu_noise(r.times, r.gyro, Rows(0, 3));
  EXPECT_EQ(allan.quality.verdict, Verdict::kWarn);
  EXPECT_NE(allan.quality.reasons.at(0).find("50 s"), std::string::npos);
  int walks = 0;
  for (const std::string& reason : allan.quality.reasons) {
    if (reason.find("gyroscope x y z: The random walk") != std::string::npos) ++walks;
  }
  EXPECT_EQ(walks, 1);
}

// The first pose of the recording: 50 s of raw counts, too short for more than white noise.
TEST(AllanReal, XsensFirstPose) {
  LOC_DATA_OR_SKIP(folder, "imu-tk-xsens");
  const test::XsensRecording r = test::read_xsens(folder);
  StillnessOptions stillness;
  stillness.gap_periods = 1.5;
  const ImuAllan allan = analyse_imu_noise(r.times_ns, r.gyroscope, r.accelerometer, {}, stillness);
  EXPECT_LT(allan.end, 5300);
  for (int axis = 0; axis < 3; ++axis) {
    const auto& g = allan.gyroscope[static_cast<std::size_t>(axis)].noise_density;
    const auto& a = allan.accelerometer[static_cast<std::size_t>(axis)].noise_density;
    std::printf("%c: gyroscope %.3f +- %.3f, accelerometer %.4f +- %.4f counts/sqrt(Hz)\n", "xyz"[axis], g.value,
                g.sigma, a.value, a.sigma);
    EXPECT_TRUE(g.identified);
  }
}

}  // namespace
}  // namespace loc
