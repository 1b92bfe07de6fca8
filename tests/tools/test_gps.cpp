// loc-driver with receivers that are connected now: ports that are unplugged, servers that hang up, garbage, gpsd.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <tuple>

#include "gps_driver_test.hpp"
#include "support/nmea_text.hpp"
#include "tools/support/open_source.hpp"

namespace loc::test {
namespace {

using Arguments = std::vector<std::string>;

using LiveGps = GpsDriverTest;

std::vector<int> range(int begin, int end) {
  std::vector<int> out;
  for (int i = begin; i < end; ++i) out.push_back(i);
  return out;
}

TEST_F(LiveGps, ASerialPortAtFullSpeedWithGarbageInBetween) {
  if (!SerialCable::available()) GTEST_SKIP() << "this machine has no pseudo-terminals (/dev/pts)";
  SerialCable cable(path("gps"));
  start_driver({"gps-serial", path("gps"), "--baud", "115200"});
  ASSERT_TRUE(connected(1)) << log();
  std::string wrong = epoch(900);
  wrong[20] = '9';
  for (int i = 0; i < 300; ++i) {
    ASSERT_TRUE(cable.send(epoch(i)));
    const std::string binary("\xb5\x62$\x00\x01$GP\xff\x11\x13\x03\x1a", 13);
    ASSERT_TRUE(cable.send(i % 3 == 0 ? binary : ""));
    ASSERT_TRUE(cable.send(i % 10 == 0 ? wrong.substr(0, wrong.find('\n') + 1) + "$GNRMC,1200" : ""));
  }
  EXPECT_TRUE(receive(300)) << fixes_.size() << log();
  EXPECT_EQ(end_and_count("nmea.bad_checksum"), 30);
  EXPECT_EQ(end_and_count("nmea.malformed.cut"), 30);
  EXPECT_EQ(end_and_count("nmea.rmc"), 300);
  EXPECT_EQ(end_and_count("gps.time_labels"), 300);
  EXPECT_EQ(end_and_count("gps.published"), 300);
  expect_epochs(range(0, 300));
}

TEST_F(LiveGps, ThePauseAfterABurstEndsItsEpoch) {
  if (!SerialCable::available()) GTEST_SKIP() << "this machine has no pseudo-terminals (/dev/pts)";
  SerialCable cable(path("gps"));
  start_driver({"gps-serial", path("gps")});
  ASSERT_TRUE(connected(1)) << log();
  // VTG in front of its burst belongs to what follows the pause, not to what was before it.
  for (int i = 0; i < 3; ++i) {
    std::string burst = epoch(i);
    burst = burst.replace(burst.find(",1.0,90.0,"), 10, ",,,").substr(burst.find("$GNGGA"));
    ASSERT_TRUE(cable.send(sentence("GNVTG,90.0,T,,M,,N,3" + std::to_string(i) + ".0,K,A") + burst));
    ASSERT_TRUE(receive(static_cast<std::size_t>(i) + 1, 2 * kSecond)) << "the next burst is not waited for";
    EXPECT_NEAR(fixes_.back().velocity_enu.x(), (30 + i) / 3.6, 1e-9);
  }
}

TEST_F(LiveGps, AnUnpluggedPortComesBack) {
  if (!SerialCable::available()) GTEST_SKIP() << "this machine has no pseudo-terminals (/dev/pts)";
  SerialCable cable(path("gps"));
  start_driver({"gps-serial", path("gps"), "--reconnect", "0.1"});
  ASSERT_TRUE(connected(1)) << log();
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(cable.send(epoch(i)));
  ASSERT_TRUE(cable.send(epoch(20).substr(0, 40)));
  ASSERT_TRUE(receive(20));
  cable.unplug();
  ASSERT_TRUE(wait_for([&] { return troubles_.find("is the receiver plugged in?") != std::string::npos; })) << log();
  const int before = statuses_;
  EXPECT_TRUE(wait_for([&] { return statuses_ > before + 1; }, 5 * kSecond)) << "it goes on telling its state";
  cable.plug();
  ASSERT_TRUE(connected(2)) << log();
  for (int i = 30; i < 50; ++i) ASSERT_TRUE(cable.send(epoch(i)));
  ASSERT_TRUE(receive(40)) << log();
  EXPECT_EQ(end_and_count("gps.connections"), 2);
  EXPECT_EQ(end_and_count("gps.connections_lost"), 1);
  EXPECT_GT(end_and_count("gps.connections_failed"), 0);
  EXPECT_EQ(end_and_count("nmea.malformed.cut"), 1);
  std::vector<int> epochs = range(0, 20);
  for (const int i : range(30, 50)) epochs.push_back(i);
  expect_epochs(epochs);
}

TEST_F(LiveGps, AWrongRateAndASilentPortAreTold) {
  if (!SerialCable::available()) GTEST_SKIP() << "this machine has no pseudo-terminals (/dev/pts)";
  SerialCable cable(path("gps"));
  start_driver({"gps-serial", path("gps"), "--silence", "0.3"});
  ASSERT_TRUE(wait_for([&] { return troubles_.find("connected and silent") != std::string::npos; })) << log();
  const TimeNs end = steady_now() + 10 * kSecond;
  while (troubles_.find("is --baud 9600 right") == std::string::npos && steady_now() < end) {
    ASSERT_TRUE(cable.send(std::string(100, '\xf8')));
    receiver_.handle(20);
  }
  EXPECT_NE(troubles_.find("is --baud 9600 right"), std::string::npos) << log();
  ASSERT_TRUE(cable.send(epoch(1)));
  ASSERT_TRUE(receive(1));
  EXPECT_NE(log().find("event=gps_well"), std::string::npos);
}

TEST_F(LiveGps, AServerThatHangsUpInTheMiddleOfASentence) {
  TcpServer server;
  start_driver({"gps-tcp", server.address(), "--reconnect", "0.1"});
  for (int round = 0; round < 3; ++round) {
    ASSERT_TRUE(server.accept()) << log();
    for (int i = 20 * round; i < 20 * round + 10; ++i) ASSERT_TRUE(server.send(epoch(i)));
    ASSERT_TRUE(server.send(epoch(20 * round + 10).substr(0, 90)));
    ASSERT_TRUE(receive(static_cast<std::size_t>(10 * round + 10))) << log();
    server.drop_client();
  }
  const int port = server.port();
  server.close();
  ASSERT_TRUE(wait_for([&] { return troubles_.find("Connection refused") != std::string::npos; })) << log();
  TcpServer again(port);
  ASSERT_TRUE(again.accept()) << log();
  ASSERT_TRUE(again.send(epoch(100)));
  // RMC of the epoch that was cut had come: 11 fixes a round.
  ASSERT_TRUE(receive(34)) << log();
  EXPECT_EQ(end_and_count("gps.connections"), 4);
  EXPECT_EQ(end_and_count("gps.connections_lost"), 3);
  EXPECT_EQ(end_and_count("nmea.malformed.cut"), 3);
  EXPECT_EQ(fixes_.size(), 34U);
  EXPECT_EQ(fixes_.back().gps_time_ns, epoch_gps_time_ns(100));
}

// RMC as epoch() has it, of another day.
std::string rmc_of(const std::string& date, const std::string& time) {
  return sentence("GNRMC," + time + ",A,4500.0000,N,00730.0000,E,1.0,90.0," + date + ",,,A");
}

TEST_F(LiveGps, OldDatesStayAsTheyAreAndRolledOnesAreMendedAloud) {
  if (!SerialCable::available()) GTEST_SKIP() << "this machine has no pseudo-terminals (/dev/pts)";
  SerialCable cable(path("gps"));
  start_driver({"gps-serial", path("gps"), "--silence", "0.5", "--leap-seconds", "18"});
  ASSERT_TRUE(connected(1)) << log();
  ASSERT_TRUE(cable.send(rmc_of("260514", "120000.00")));
  ASSERT_TRUE(receive(1)) << log();
  EXPECT_EQ(fixes_[0].gps_time_ns, *gps_from_utc({{2014, 5, 26}, 12, 0, 0, 0}, LeapSeconds::constant(18)));
  EXPECT_EQ(log().find("event=gps_date"), std::string::npos);
  ASSERT_TRUE(cable.send(rmc_of("080407", "120001.00")));
  ASSERT_TRUE(receive(2)) << log();
  EXPECT_EQ(fixes_[1].gps_time_ns, *gps_from_utc({{2026, 11, 22}, 12, 0, 1, 0}, LeapSeconds::constant(18)));
  EXPECT_NE(log().find("tells 2007-04-08, which is taken for 2026-11-22"), std::string::npos) << log();
  EXPECT_EQ(end_and_count("gps.rollover_mended"), 1);
}

TEST_F(LiveGps, AFixAndItsLossAreTold) {
  if (!SerialCable::available()) GTEST_SKIP() << "this machine has no pseudo-terminals (/dev/pts)";
  SerialCable cable(path("gps"));
  start_driver({"gps-serial", path("gps"), "--silence", "0.4"});
  ASSERT_TRUE(wait_for([&] { return log().find("event=gps_no_fix state=\"none so far\"") != std::string::npos; }));
  EXPECT_EQ(log().find("event=gps_well"), std::string::npos) << "nothing has come";
  const auto lines = [&](const std::string& what) {
    std::size_t n = 0;
    for (auto at = log().find(what); at != std::string::npos; at = log().find(what, at + 1)) ++n;
    return n;
  };
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(cable.send(epoch(i)));
  ASSERT_TRUE(receive(3)) << log();
  EXPECT_NE(log().find("event=gps_fix time=2026-11-22T12:00:00"), std::string::npos) << log();
  EXPECT_NE(log().find("satellites=9 fix=3d"), std::string::npos) << log();
  EXPECT_NE(log().find("event=gps_well"), std::string::npos) << "after silence";
  ASSERT_TRUE(wait_for([&] { return log().find("event=gps_no_fix state=\"lost\"") != std::string::npos; })) << log();
  ASSERT_TRUE(cable.send(epoch(5)));
  ASSERT_TRUE(wait_for([&] { return lines("event=gps_fix ") == 2; })) << log();
  EXPECT_EQ(lines("event=gps_no_fix"), 2U) << "once for each change";
}

TEST_F(LiveGps, WhatWasNotSentIsNotCountedAsPublished) {
  if (!SerialCable::available()) GTEST_SKIP() << "this machine has no pseudo-terminals (/dev/pts)";
  SerialCable cable(path("gps"));
  start_driver({"gps-serial", path("gps")});
  ASSERT_TRUE(connected(1)) << log();
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(cable.send(epoch(i)));
  ASSERT_TRUE(receive(5)) << log();
  ASSERT_TRUE(hub_.process.stop(3 * kSecond));
  for (int i = 10; i < 20; ++i) {
    ASSERT_TRUE(cable.send(epoch(i)));
    ASSERT_TRUE(sleep_for(150 * kMs));
  }
  const std::int64_t read = end_and_count("gps.read");
  EXPECT_EQ(read, 15);
  EXPECT_GT(end_and_count("live.not_sent"), 5);
  EXPECT_EQ(end_and_count("gps.published") + end_and_count("live.not_sent"), read);
}

TEST_F(LiveGps, TheDurationIsThatOfTheClockOnTheWall) {
  if (!SerialCable::available()) GTEST_SKIP() << "this machine has no pseudo-terminals (/dev/pts)";
  SerialCable cable(path("gps"));
  start_driver({"gps-serial", path("gps"), "--duration", "1"});
  ASSERT_TRUE(connected(1)) << log();
  EXPECT_TRUE(driver_->wait(10 * kSecond)) << "also when nothing comes" << log();
  EXPECT_TRUE(driver_->succeeded()) << log();
  EXPECT_NE(log().find("event=ended interrupted=false"), std::string::npos) << log();
}

TEST_F(LiveGps, WhatCannotBeOpenedSaysWhatToDo) {
  std::ofstream(path("log.nmea")) << epoch(0);
  const std::vector<std::tuple<Arguments, int, std::string>> wrong = {
      {{"gps-serial", path("absent")}, 1, "is the receiver plugged in? Serial ports here:"},
      {{"gps-serial", path("log.nmea")}, 1, "read it with loc-driver nmea"},
      {{"gps-serial", "/dev/null"}, 1, "is not a serial port"},
      {{"gps-serial", "/dev/null", "--baud", "9601"}, 2, "must be one of 1200"},
      {{"gps-serial", "/dev/null", "--silence", "0"}, 2, "silence"},
      {{"gps-serial", path("absent"), "--silence", "1e300"}, 2, "silence"},
      {{"gps-serial", path("absent"), "--reconnect", "1e300"}, 2, "reconnect"},
      {{"gps-serial", path("absent"), "--duration", "1e300"}, 2, "duration"},
      {{"gps-serial", path("absent"), "--time-base", "utc"}, 2, "must be device, host or gps"},
      {{"gps-serial", path("absent"), "--gps-label-delay", "1e300"}, 2, "--gps-label-delay"},
      {{"gpsd", "127.0.0.1:1", "--silence", "0"}, 2, "silence"},
      {{"nmea", path("log.nmea"), "--time-base", "host"}, 2, "its fixes are on GPS time"},
      {{"gps-tcp", "127.0.0.1:1"}, 1, "Connection refused"},
      {{"gps-tcp", "127.0.0.1"}, 2, "is not HOST:PORT"},
      {{"gps-tcp", "127.0.0.1:70000"}, 2, "is not HOST:PORT"},
      {{"gps-tcp", "127.0.0.1:1", "--speed", "2"}, 2, "for recordings"},
      {{"nmea", path("log.nmea"), "--reference-date", "2026-02-30"}, 2, "is not a day"},
      {{"nmea", path("log.nmea"), "--leap-seconds", "300"}, 2, ""},
      {{"nmea", path("log.nmea"), "--leap-seconds-list", path("log.nmea")}, 2, "leap-seconds.list, line"},
      {{"nmea", path("log.nmea"), "--geoid-separation", "1000"}, 2, "geoid_separation"},
  };
  for (const auto& [arguments, code, text] : wrong) {
    Arguments all = arguments;
    all.insert(all.end(), {"--lcm-url", hub_.url});
    EXPECT_EQ(run("loc-driver", all, path("wrong.err")), code) << arguments[0] << " " << arguments[1];
    EXPECT_NE(text_of(path("wrong.err")).find(text), std::string::npos) << text << "\n" << text_of(path("wrong.err"));
  }
}

TEST_F(LiveGps, ALogIsOnGpsTime) {
  std::ofstream(path("log.nmea")) << epoch(0) << epoch(1) << epoch(2);
  start_driver({"nmea", path("log.nmea"), "--speed", "100", "--time-base", "gps"});
  ASSERT_TRUE(receive(3)) << log();
  for (int i = 0; i < 3; ++i) EXPECT_EQ(fixes_[static_cast<std::size_t>(i)].time_ns, epoch_gps_time_ns(i));
}

TEST_F(LiveGps, ALogIsPlayedLikeAnyRecording) {
  std::ofstream file(path("log.nmea"));
  for (int i = 0; i < 40; ++i) file << epoch(i);
  file.close();
  start_driver({"nmea", path("log.nmea"), "--speed", "100"});
  ASSERT_TRUE(receive(40)) << log();
  ASSERT_TRUE(driver_->wait(5 * kSecond));
  EXPECT_EQ(end_and_count("gps.read"), 40);
  for (int i = 0; i < 40; ++i) EXPECT_EQ(fixes_[static_cast<std::size_t>(i)].time_ns, epoch_gps_time_ns(i));
  EXPECT_EQ(guess_source_kind(path("log.nmea")), "nmea");
  std::filesystem::rename(path("log.nmea"), path("log.txt"));
  EXPECT_EQ(guess_source_kind(path("log.txt")), "nmea") << "by its content";
  std::ofstream(path("other.log")) << "nothing of the kind";
  EXPECT_EQ(guess_source_kind(path("other.log")), "lcm-log");
}

TEST(GpsAddress, HostAndPort) {
  EXPECT_EQ(parse_address("a.b:80", "").host, "a.b");
  EXPECT_EQ(parse_address("a.b:80", "").port, "80");
  EXPECT_EQ(parse_address("a.b", "2947").port, "2947");
  EXPECT_EQ(parse_address("[::1]:80", "").host, "::1");
  EXPECT_EQ(parse_address("[::1]", "2947").port, "2947");
  for (const char* wrong : {"", ":80", "a:", "a:b", "a:0", "a:65536", "a:80x", "[::1", "[::1]80", "[]:80", "a"}) {
    EXPECT_THROW(parse_address(wrong, ""), UsageError) << wrong;
  }
}

}  // namespace
}  // namespace loc::test
