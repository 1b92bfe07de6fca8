#include "tools/support/log.hpp"

#include <spdlog/spdlog.h>

namespace loc {
namespace {

spdlog::level::level_enum spdlog_level(LogLevel level) {
  switch (level) {
    case LogLevel::kDebug:
      return spdlog::level::debug;
    case LogLevel::kInfo:
      return spdlog::level::info;
    case LogLevel::kWarning:
      return spdlog::level::warn;
    case LogLevel::kError:
      break;
  }
  return spdlog::level::err;
}

}  // namespace

void log_text(LogLevel level, fmt::string_view text, fmt::format_args args) {
  const auto as = spdlog_level(level);
  if (spdlog::should_log(as)) spdlog::log(as, fmt::vformat(text, args));
}

}  // namespace loc
