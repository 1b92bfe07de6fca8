#include "tools/support/clock_link.hpp"

#include "libloc/core/check.hpp"
#include "msgs/decode.hpp"

namespace loc {

ClockLink::ClockLink(const std::string& url) : publisher_(url), receiver_(url) {
  receiver_.subscribe(kClockChannel, [this](std::string_view, std::span<const std::uint8_t> data) {
    try {
      target_->take(decode_message<clock_t>(data));
    } catch (const DataError&) {
      ++garbage_;
    }
  });
}

void ClockLink::poll(RestampedSource& source) {
  target_ = &source;
  while (receiver_.handle(0)) {
  }
}

}  // namespace loc
