// loc-driver with gpsd: the real one where it is installed, and one of our own making that tells what it is told to.
#include <gtest/gtest.h>
#include <sys/poll.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "gps_driver_test.hpp"

namespace loc::test {
namespace {

#ifdef LOC_HAVE_LIBGPS

constexpr double kDeg = std::numbers::pi / 180;

const std::string kVersion = R"({"class":"VERSION","release":"3.22","rev":"3.22","proto_major":3,"proto_minor":14})"
                             "\r\n";
const std::string kDevices =
    R"({"class":"DEVICES","devices":[{"class":"DEVICE","path":"/dev/gps","activated":"2026-11-22T12:00:00.000Z"}]})"
    "\r\n";

std::string tpv(const std::string& rest) {
  return R"({"class":"TPV","device":"/dev/gps",)" + rest + "}\r\n";
}
const std::string kFull =
    R"("mode":3,"time":"2024-06-01T12:00:00.250Z","leapseconds":18,"lat":45.5,"lon":-7.25,"altHAE":348.5,"altMSL":300.5,)"
    R"("epx":3.0,"epy":4.0,"epv":8.0,"track":90.0,"speed":10.0,"climb":-0.5,"eps":0.5,"epc":2.0)";

class Gpsd : public GpsDriverTest {
 protected:
  void SetUp() override {
    start_driver({"gpsd", server_.address(), "--reconnect", "0.1", "--silence", "0.5"});
    greet();
  }
  void greet() {
    ASSERT_TRUE(server_.accept()) << log();
    ASSERT_TRUE(server_.send(kVersion));
    EXPECT_NE(server_.receive_until("\"pps\":true").find("\"enable\":true"), std::string::npos);
    ASSERT_TRUE(server_.send(kDevices));
  }
  /// The fix that one TPV gives.
  GpsMeasurement fix_of(const std::string& rest) {
    const std::size_t before = fixes_.size();
    EXPECT_TRUE(server_.send(tpv(rest)));
    EXPECT_TRUE(receive(before + 1)) << rest << log();
    return fixes_.size() > before ? fixes_.back() : GpsMeasurement{};
  }
  TcpServer server_;
};

TEST_F(Gpsd, EveryFieldArrives) {
  ASSERT_TRUE(
      server_.send(R"({"class":"SKY","device":"/dev/gps","satellites":[)"
                   R"({"PRN":1,"el":10,"az":20,"ss":30,"used":true},{"PRN":2,"el":10,"az":20,"ss":30,"used":false}]})"
                   "\r\n"));
  const GpsMeasurement m = fix_of(kFull);
  EXPECT_EQ(m.fix, GpsFixType::k3d);
  EXPECT_EQ(m.satellites, 1);
  EXPECT_EQ(m.gps_time_ns, *gps_from_utc({{2024, 6, 1}, 12, 0, 0, 250'000'000}));
  EXPECT_NEAR(m.latitude, 45.5 * kDeg, 1e-14);
  EXPECT_NEAR(m.longitude, -7.25 * kDeg, 1e-14);
  EXPECT_DOUBLE_EQ(m.altitude, 348.5);
  EXPECT_TRUE(m.position_cov.isApprox(Eigen::Vector3d(9, 16, 64).asDiagonal().toDenseMatrix()));
  EXPECT_TRUE(m.velocity_enu.isApprox(Eigen::Vector3d(10, 0, -0.5), 1e-12));
  EXPECT_TRUE(m.velocity_cov.isApprox(Eigen::Vector3d(0.25, 0.25, 4).asDiagonal().toDenseMatrix()));
  EXPECT_EQ(m.time_ns, m.host_time_ns);
  EXPECT_LT(std::abs(m.time_ns - host_now()), 20 * kSecond);
}

TEST_F(Gpsd, WhatIsNotToldIsNotKnown) {
  EXPECT_EQ(fix_of(R"("mode":1,"time":"2024-06-01T12:00:00.000Z","lat":45.5,"lon":7.25)").fix, GpsFixType::kNone);
  const GpsMeasurement none = fixes_.back();
  EXPECT_TRUE(std::isnan(none.latitude));
  EXPECT_EQ(none.gps_time_ns, kNoTime) << "without fix no time";
  EXPECT_EQ(fix_of(R"("mode":3)").fix, GpsFixType::kNone) << "a mode without position";
  const GpsMeasurement flat =
      fix_of(R"("mode":2,"lat":45.5,"lon":7.25,"altHAE":348.5,"eph":5.0,"epv":9.0,"climb":1.0)");
  EXPECT_EQ(flat.fix, GpsFixType::k2d);
  EXPECT_EQ(flat.gps_time_ns, kNoTime);
  EXPECT_TRUE(std::isnan(flat.altitude)) << "2-D: an assumption";
  EXPECT_DOUBLE_EQ(flat.position_cov(0, 0) + flat.position_cov(1, 1), 25);
  EXPECT_TRUE(std::isnan(flat.position_cov(2, 2)));
  EXPECT_TRUE(flat.velocity_enu.array().isNaN().all());
  EXPECT_EQ(fix_of(R"("mode":3,"status":2,"lat":45.5,"lon":7.25)").fix, GpsFixType::kDifferential);
  EXPECT_TRUE(std::isnan(fixes_.back().altitude));
  EXPECT_TRUE(fixes_.back().position_cov.array().isNaN().all());
  EXPECT_EQ(fix_of(R"("mode":3,"status":3,"lat":45.5,"lon":7.25)").fix, GpsFixType::kFixed);
  EXPECT_EQ(fix_of(R"("mode":3,"status":4,"lat":45.5,"lon":7.25)").fix, GpsFixType::kFloat);
  EXPECT_EQ(fix_of(R"("mode":3,"status":5,"lat":45.5,"lon":7.25)").fix, GpsFixType::kNone) << "dead reckoning";
  EXPECT_EQ(fix_of(R"("mode":3,"lat":112.0,"lon":7.25)").fix, GpsFixType::kNone) << "no such latitude";
  EXPECT_EQ(end_and_count("gps.not_measured"), 1);
  EXPECT_EQ(end_and_count("gps.refused"), 1);
}

TEST_F(Gpsd, LeapSecondsOfTheReceiverCountWhereTheTableEnds) {
  EXPECT_EQ(fix_of(R"("mode":2,"time":"2024-06-01T12:00:00.000Z","leapseconds":15,"lat":1.0,"lon":2.0)").gps_time_ns,
            *gps_from_utc({{2024, 6, 1}, 12, 0, 0, 0}))
      << "a factory value";
  EXPECT_EQ(fix_of(R"("mode":2,"time":"2031-06-01T12:00:00.000Z","leapseconds":19,"lat":1.0,"lon":2.0)").gps_time_ns,
            *gps_from_utc({{2031, 6, 1}, 12, 0, 0, 0}) + kSecond);
  EXPECT_EQ(end_and_count("gps.leap_seconds_differ"), 2);
}

TEST_F(Gpsd, ItsTimeMessagesAreEvents) {
  ASSERT_TRUE(server_.send(R"({"class":"TOFF","device":"/dev/gps","real_sec":1700000000,"real_nsec":0,)"
                           R"("clock_sec":1700000000,"clock_nsec":123456789,"precision":-2})"
                           "\r\n"));
  for (int i = 0; i < 3; ++i) {
    const std::string second = std::to_string(1700000001 + i);
    ASSERT_TRUE(server_.send(R"({"class":"PPS","device":"/dev/pps0","real_sec":)" + second +
                             R"(,"real_nsec":0,"clock_sec":)" + second + R"(,"clock_nsec":1234,"precision":-20})" +
                             "\r\n"));
  }
  (void)fix_of(kFull);
  EXPECT_EQ(end_and_count("gps.time_labels"), 1);
  EXPECT_EQ(end_and_count("gps.pulses"), 3);
}

TEST_F(Gpsd, ItGoesAndComesBack) {
  (void)fix_of(kFull);
  ASSERT_TRUE(server_.send(tpv(kFull).substr(0, 50)));
  server_.drop_client();
  ASSERT_NO_FATAL_FAILURE(greet());
  ASSERT_TRUE(wait_for([&] { return troubles_.find("is a receiver attached") != std::string::npos; })) << log();
  (void)fix_of(kFull);
  const int port = server_.port();
  server_.close();
  ASSERT_TRUE(wait_for([&] { return troubles_.find("is gpsd running there?") != std::string::npos; })) << log();
  server_ = TcpServer(port);
  ASSERT_NO_FATAL_FAILURE(greet());
  (void)fix_of(kFull);
  EXPECT_EQ(end_and_count("gps.connections"), 3);
  EXPECT_EQ(end_and_count("gps.connections_lost"), 2);
  EXPECT_EQ(end_and_count("gps.published"), 3);
}

TEST_F(Gpsd, NonsenseIsNoFix) {
  ASSERT_TRUE(server_.send("\r\n{}\r\nnonsense\r\n{\"class\":\"TPV\"\r\n{\"class\":\"TPV\",\"mode\":\"x\"}\r\n"));
  ASSERT_TRUE(server_.send(tpv(R"("mode":3,"lat":1e999,"lon":1.0)")));
  (void)fix_of(kFull);
  for (const GpsMeasurement& m : fixes_) {
    EXPECT_TRUE(m.fix == GpsFixType::kNone || std::abs(m.latitude - 45.5 * kDeg) < 1e-9) << m.latitude;
  }
}

// gpsd itself, reading from our TCP server.
TEST_F(GpsDriverTest, TheRealGpsd) {
  const char* gpsd = "/usr/sbin/gpsd";
  if (!std::filesystem::exists(gpsd)) GTEST_SKIP() << "gpsd is not installed";
  TcpServer receiver;
  const int port = TcpServer().port();  // free a moment ago
  const auto start_gpsd = [&] {
    return start(gpsd, {"-N", "-n", "-S", std::to_string(port), "tcp://" + receiver.address()}, path("gpsd.err"));
  };
  ChildProcess daemon = start_gpsd();
  ASSERT_TRUE(receiver.accept()) << text_of(path("gpsd.err"));
  ASSERT_TRUE(wait_until(
      [&] {
        // The driver wants it to be there.
        try {
          (void)tcp_connection("127.0.0.1:" + std::to_string(port)).open();
          return true;
        } catch (const GpsConnectionError&) {
          return false;
        }
      },
      10 * kSecond));
  start_driver({"gpsd", "127.0.0.1:" + std::to_string(port), "--reconnect", "0.2"});
  ASSERT_TRUE(connected(1)) << log();
  int sent = 0;
  const auto feed_until = [&](std::size_t fixes) {
    const TimeNs give_up = steady_now() + 30 * kSecond;
    while (fixes_.size() < fixes && steady_now() < give_up) {
      if (!receiver.send(epoch(sent++))) return false;
      receiver_.handle(20);
      ::poll(nullptr, 0, 50);
    }
    return fixes_.size() >= fixes;
  };
  const auto check_last = [&] {
    const GpsMeasurement& m = fixes_.back();
    const auto i = static_cast<int>((m.gps_time_ns - epoch_gps_time_ns(0)) / kSecond);
    EXPECT_TRUE(i >= 0 && i < sent) << m.gps_time_ns;
    EXPECT_NEAR(m.latitude, epoch_latitude(i), 1e-10) << "position and time of one epoch";
    EXPECT_NE(m.fix, GpsFixType::kNone);
    EXPECT_LE(m.fix, GpsFixType::k3d);
  };
  const auto located = [&] { return !fixes_.empty() && fixes_.back().fix != GpsFixType::kNone; };
  for (std::size_t wanted = 1; !located() && wanted < 20; ++wanted) ASSERT_TRUE(feed_until(wanted)) << log();
  check_last();

  EXPECT_TRUE(daemon.stop(5 * kSecond));
  ASSERT_TRUE(wait_for([&] { return troubles_.find("gpsd has closed the connection") != std::string::npos; })) << log();
  ChildProcess second = start_gpsd();
  ASSERT_TRUE(receiver.accept()) << text_of(path("gpsd.err"));
  ASSERT_TRUE(connected(2)) << log();
  const std::size_t before = fixes_.size();
  fixes_.push_back({});
  for (std::size_t wanted = before + 2; !located() && wanted < before + 20; ++wanted) {
    ASSERT_TRUE(feed_until(wanted)) << log();
  }
  check_last();
  EXPECT_GT(end_and_count("gps.time_labels"), 0) << "TOFF";
  EXPECT_TRUE(second.stop(5 * kSecond));
}

#else

TEST(Gpsd, WithoutItsLibraryTheProgramSaysSo) {
  const TemporaryFolder folder;
  EXPECT_EQ(run("loc-driver", {"gpsd", "--lcm-url", "memq://"}, folder.path("err")), 2);
  EXPECT_NE(text_of(folder.path("err")).find("libgps-dev"), std::string::npos);
  GTEST_SKIP() << "libgps is not installed: gpsd is not tested";
}

#endif

}  // namespace
}  // namespace loc::test
