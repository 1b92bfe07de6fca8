// Where the real recordings are: $LIBLOC_DATA, or shared/data beside the project's folder. Tests that need them skip
// with a message when they are absent.
#pragma once

#include <cstdlib>
#include <filesystem>

namespace loc::test {

inline std::filesystem::path data_folder() {
  if (const char* folder = std::getenv("LIBLOC_DATA"); folder != nullptr && *folder != 0) return folder;
  return std::filesystem::path(LOC_SOURCE_DIR).parent_path() / "shared" / "data";
}

}  // namespace loc::test

/// In a test: gives the path of name_in_folder, or skips the test.
#define LOC_DATA_OR_SKIP(variable, name_in_folder)                                    \
  const std::filesystem::path variable = loc::test::data_folder() / (name_in_folder); \
  if (!std::filesystem::exists(variable)) {                                           \
    GTEST_SKIP() << variable.string() << " is absent; LIBLOC_DATA names the folder";  \
  }                                                                                   \
  static_assert(true)
