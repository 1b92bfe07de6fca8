// YAML read strictly: every value has a kind and a size, errors name file, line and key. Internal to io.
#pragma once

#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "libloc/core/check.hpp"

namespace loc::io {

/// Runs action; what Rig::check() and the like throw about values from a file becomes a DataError that names it.
template <class Action>
auto as_data_error(const std::filesystem::path& path, Action action) {
  try {
    return action();
  } catch (const std::invalid_argument& error) {
    throw DataError(path.string() + ": " + error.what());
  }
}

/// A mapping. Keys that were not asked for are errors in finish().
class YamlBlock {
 public:
  /// The document in a file. OpenCV's first line "%YAML:1.0" is passed over.
  /// @param needs_end the last line must be "..."
  /// @throws DataError: missing, empty, cut, not YAML, not a mapping, a key that comes twice.
  static YamlBlock load(const std::filesystem::path& path, bool needs_end);

  bool has(const char* key) const;
  /// In the order of the file.
  std::vector<std::string> keys() const;
  double number(const char* key);
  std::int64_t integer(const char* key);
  std::string text(const char* key);
  /// A list of words.
  std::vector<std::string> texts(const char* key);
  /// size < 0: any
  std::vector<double> numbers(const char* key, int size);
  Eigen::Vector3d vector3(const char* key);
  /// Rows of a list of lists.
  Eigen::MatrixXd matrix(const char* key, int rows, int columns);
  YamlBlock block(const char* key);
  /// A list of mappings.
  std::vector<YamlBlock> blocks(const char* key);

  /// What all of the block's values are, as text: names of nested keys are joined by points, the values of (nested)
  /// lists by commas. All keys count as asked for. @throws DataError for mappings inside lists.
  struct Leaf {
    std::string name;
    std::string text;
    std::string where;  ///< "file:line"
  };
  std::vector<Leaf> leaves();

  /// Passes over a key that may be there and is of no interest.
  void ignore(const char* key) { asked_.insert(key); }
  /// @throws DataError for a key that was not asked for.
  void finish() const;
  [[noreturn]] void fail(const char* key, const std::string& what) const;

 private:
  YamlBlock(std::string file, std::string name, const YAML::Node& node);
  YAML::Node get(const char* key);
  void add_leaves(const YAML::Node& node, const std::string& name, std::vector<Leaf>& leaves) const;
  void add_text(const YAML::Node& node, const std::string& name, std::string& text) const;
  std::string where(const YAML::Node& node) const;
  std::string full(const std::string& key) const { return name_.empty() ? key : name_ + "." + key; }
  double number_of(const YAML::Node& node, const std::string& name) const;

  std::string file_;
  std::string name_;  // of the block, with those above it
  YAML::Node node_;
  std::set<std::string> asked_;
};

}  // namespace loc::io
