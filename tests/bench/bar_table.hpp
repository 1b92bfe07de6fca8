// For programs that print figures beside their bars.
#pragma once

#include <algorithm>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

namespace loc::bench {

/// Counts what is beyond its bar. NaN is.
class BarTable {
 public:
  void at_most(const char* what, double value, double bar) { line(what, value, value <= bar, "<=", bar); }
  void at_least(const char* what, double value, double bar) { line(what, value, value >= bar, ">=", bar); }
  void between(const char* what, double value, double low, double high) {
    const bool ok = value >= low && value <= high;
    std::printf("  %-54s %10.4g   bar %.4g to %.4g   %s\n", what, value, low, high, ok ? "ok" : "FAILED");
    count(ok);
  }
  /// A figure without a bar.
  static void figure(const char* what, double value) { std::printf("  %-54s %10.4g\n", what, value); }
  int failed() const { return failed_; }

 private:
  void line(const char* what, double value, bool ok, const char* sign, double bar) {
    std::printf("  %-54s %10.4g   bar %s %.4g   %s\n", what, value, sign, bar, ok ? "ok" : "FAILED");
    count(ok);
  }
  void count(bool ok) {
    if (!ok) ++failed_;
    std::fflush(stdout);
  }
  int failed_ = 0;
};

/// `--only=WORD,WORD`: rows whose name holds one of the words; `--seeds=N`.
struct RowChoice {
  std::vector<std::string> only;
  int seeds = 0;  ///< 0: each row's own

  /// @param rows all that there are: a word that is in none of them is a mistake
  RowChoice(int argc, char** argv, const std::vector<std::string>& rows) {
    for (int i = 1; i < argc; ++i) {
      const std::string text = argv[i];
      if (text.starts_with("--only=")) {
        for (std::size_t begin = 7; begin <= text.size();) {
          const std::size_t end = std::min(text.find(',', begin), text.size());
          if (end > begin) only.push_back(text.substr(begin, end - begin));
          begin = end + 1;
        }
      } else if (text.starts_with("--seeds=")) {
        seeds = std::stoi(text.substr(8));
        if (seeds <= 0) throw std::invalid_argument("'" + text + "': a number of at least 1 is needed");
      } else {
        throw std::invalid_argument("'" + text + "': only --only=WORD,… and --seeds=N are known");
      }
    }
    for (const std::string& word : only) {
      if (std::ranges::none_of(rows, [&](const std::string& row) { return row.find(word) != std::string::npos; })) {
        throw std::invalid_argument("'" + word + "' is no row");
      }
    }
  }
  bool has(const std::string& row) const {
    for (const std::string& word : only) {
      if (row.find(word) != std::string::npos) return true;
    }
    return only.empty();
  }
};

}  // namespace loc::bench
