// loc-hub: the server behind LCM URLs that begin with tcpq://, for places without multicast.
// Prints that URL to stdout once it listens.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <iostream>

#include "msgs/convert.hpp"
#include "tools/support/hub.hpp"
#include "tools/support/log.hpp"
#include "tools/support/program.hpp"
#include "tools/support/statistics.hpp"

namespace {

constexpr loc::TimeNs kSecond = 1'000'000'000;

int serve(const loc::HubOptions& options, bool statistics) {
  loc::Hub hub(options);
  std::cout << "tcpq://" << options.bind_address << ":" << hub.port() << std::endl;
  loc::log_info("event=listening address={} port={}", options.bind_address, hub.port());
  if (options.bind_address != "127.0.0.1") {
    loc::log_warning("event=open_to_others address={} reason=\"LCM has no access control\"", options.bind_address);
  }
  loc::TimeNs next_report = loc::steady_now() + kSecond;
  while (!loc::stop_requested()) {
    hub.run_once(std::chrono::milliseconds(100));
    if (!statistics || loc::steady_now() < next_report) continue;
    next_report += kSecond;
    const loc::NamedCounts counts = hub.statistics();
    loc::log_info("event=statistics {}", loc::format_counts(counts));
    const auto message = loc::statistics_message("loc-hub", counts);
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    hub.publish(loc::kStatisticsChannel, bytes);
  }
  loc::log_info("event=ended {}", loc::format_counts(hub.statistics()));
  return loc::kExitOk;
}

}  // namespace

int main(int argc, char** argv) {
  loc::HubOptions options;
  bool statistics = false;
  std::int64_t greeting_timeout_ms = options.greeting_timeout.count();
  std::string config;
  loc::Program program("loc-hub", "Hands LCM messages on between programs whose --lcm-url is tcpq://ADDRESS:PORT.");
  program.add_config(config)->description("Taken like by all programs; the hub needs nothing of it");
  program.app()
      .add_option("--bind", options.bind_address, "IPv4 address to listen at; 0.0.0.0 serves other hosts too")
      ->capture_default_str();
  program.app().add_option("--port", options.port, "Port; 0: any free one, printed")->capture_default_str();
  program.app().add_option("--max-clients", options.max_clients, "Connections served at a time")->capture_default_str();
  program.app()
      .add_option("--max-queue-bytes", options.max_queue_bytes,
                  "What may wait for one slow client before new messages for it are dropped")
      ->capture_default_str();
  program.app()
      .add_option("--max-total-bytes", options.max_total_bytes,
                  "What may wait for all clients together before the slowest is closed")
      ->capture_default_str();
  program.app()
      .add_option("--max-message-bytes", options.limits.max_data_bytes, "Longest message")
      ->capture_default_str();
  program.app()
      .add_option("--greeting-timeout-ms", greeting_timeout_ms, "Time a new client has to say that it is one")
      ->capture_default_str();
  program.app().add_flag("--statistics", statistics, "Log and publish counters once per second");
  return program.run(argc, argv, [&] {
    options.greeting_timeout = std::chrono::milliseconds(greeting_timeout_ms);
    return serve(options, statistics);
  });
}
