// Log lines of the programs: text and arguments as fmt takes them. spdlog writes them (set up in program.cpp).
// Not spdlog's own calls: each file that makes one compiles fmt's formatting anew, 2 s and 5 s under the sanitizers.
#pragma once

#include <spdlog/fmt/fmt.h>

namespace loc {

enum class LogLevel { kDebug, kInfo, kWarning, kError };

/// Formats and writes nothing below the level that the program logs from.
void log_text(LogLevel level, fmt::string_view text, fmt::format_args args);

template <typename... Args>
void log_at(LogLevel level, fmt::format_string<Args...> text, const Args&... args) {
  log_text(level, text, fmt::make_format_args(args...));
}
template <typename... Args>
void log_debug(fmt::format_string<Args...> text, const Args&... args) {
  log_at<Args...>(LogLevel::kDebug, text, args...);
}
template <typename... Args>
void log_info(fmt::format_string<Args...> text, const Args&... args) {
  log_at<Args...>(LogLevel::kInfo, text, args...);
}
template <typename... Args>
void log_warning(fmt::format_string<Args...> text, const Args&... args) {
  log_at<Args...>(LogLevel::kWarning, text, args...);
}
template <typename... Args>
void log_error(fmt::format_string<Args...> text, const Args&... args) {
  log_at<Args...>(LogLevel::kError, text, args...);
}

}  // namespace loc
