// Hub (where needed), logger, estimator and driver as processes of one session: started in this order, watched, stopped
// in the opposite one. What each of them does is its own business.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/support/child_process.hpp"
#include "tools/support/lcm_link.hpp"

namespace loc {

enum class Transport { kAuto, kUdpm, kHub };

struct LiveSessionOptions {
  /// The driver sends as fast as the estimator takes it: faster than the stock logger does, whose queue on multicast
  /// holds 30 messages. auto is the hub then.
  bool as_fast_as_taken = false;
  Transport transport = Transport::kAuto;  ///< auto: multicast where it works, otherwise a hub
  std::string lcm_url;                     ///< not empty: that one, nothing is started for it
  std::string log_path;                    ///< empty: no logger
  std::vector<std::string> driver;         ///< arguments
  std::vector<std::string> estimator;      ///< arguments
  std::vector<std::string> common;         ///< arguments of all programs of ours
  bool restart = false;                    ///< a dead estimator, logger or hub is started anew
  int max_restarts = 5;                    ///< of each
  double ready_timeout_s = 10;
};

class LiveSession {
 public:
  explicit LiveSession(LiveSessionOptions options);

  /// From start to end. @return true when every process did what it should.
  /// @throws std::runtime_error when one cannot be started.
  bool run();

 private:
  struct Member {
    std::string name;
    std::unique_ptr<ChildProcess> process;
    int restarts = 0;
    bool given_up = false;
  };

  void choose_transport();
  void start_hub();
  void start_logger();
  void start_estimator();
  void start_driver();
  bool watch();
  void look_after(Member& member, void (LiveSession::*start)());
  void finish();
  void wait_until_logged();
  void stop_all();
  void stop(Member& member);
  std::vector<std::string> command(const std::string& program, const std::vector<std::string>& arguments) const;

  LiveSessionOptions options_;
  std::string url_;
  bool own_hub_ = false;
  std::uint16_t hub_port_ = 0;
  std::string log_path_;  // of the logger that runs now
  Member hub_{"loc-hub", nullptr};
  Member logger_{"lcm-logger", nullptr};
  Member estimator_{"loc-estimator", nullptr};
  Member driver_{"loc-driver", nullptr};
  bool all_well_ = true;
};

}  // namespace loc
