#include "libloc/io/yaml_block.hpp"

#include <cmath>
#include <fstream>
#include <sstream>

#include "libloc/io/text_file.hpp"

namespace loc::io {
namespace {

constexpr std::uintmax_t kLargestFile = 1 << 20;

std::string read_text(const std::filesystem::path& path) {
  const auto status = status_of(path);
  if (!std::filesystem::exists(status)) throw DataError(path.string() + ": no such file");
  if (!std::filesystem::is_regular_file(status)) throw DataError(path.string() + ": not a file");
  if (size_of(path) > kLargestFile) {
    throw DataError(path.string() + ": larger than 1 MB, which no such file is");
  }
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file || text.str().empty()) throw DataError(path.string() + ": empty or cannot be read");
  return text.str();
}

}  // namespace

YamlBlock::YamlBlock(std::string file, std::string name, const YAML::Node& node)
    : file_(std::move(file)), name_(std::move(name)), node_(node) {
  if (!node_.IsMap()) throw DataError(where(node_) + ": '" + (name_.empty() ? "the file" : name_) + "' must hold keys");
  std::set<std::string> keys;
  for (const auto& entry : node_) {
    if (!entry.first.IsScalar()) throw DataError(where(entry.first) + ": a key must be a word");
    if (!keys.insert(entry.first.Scalar()).second) {
      throw DataError(where(entry.first) + ": key '" + full(entry.first.Scalar()) + "' comes twice");
    }
  }
}

YamlBlock YamlBlock::load(const std::filesystem::path& path, bool needs_end) {
  std::string text = read_text(path);
  if (text.starts_with("%YAML:")) {
    for (std::size_t i = 0; i < text.size() && text[i] != '\n'; ++i) text[i] = ' ';
  }
  if (!text.ends_with('\n')) throw DataError(path.string() + ": the last line has no end: the file may have been cut");
  if (needs_end) {
    const std::string_view body = std::string_view(text).substr(0, text.find_last_not_of(" \t\r\n") + 1);
    if (!body.ends_with("\n...")) {
      throw DataError(path.string() + ": the last line must be '...': the file may have been cut");
    }
  }
  try {
    return {path.string(), "", YAML::Load(text)};
  } catch (const YAML::Exception& error) {
    throw DataError(path.string() + ":" + std::to_string(error.mark.line + 1) + ": " + error.msg);
  }
}

std::string YamlBlock::where(const YAML::Node& node) const {
  return file_ + ":" + std::to_string(node.Mark().line + 1);
}

void YamlBlock::fail(const char* key, const std::string& what) const {
  const YAML::Node node = node_[key];
  throw DataError(where(node.IsDefined() ? node : node_) + ": key '" + full(key) + "' " + what);
}

std::vector<std::string> YamlBlock::keys() const {
  std::vector<std::string> keys;
  for (const auto& entry : node_) keys.push_back(entry.first.Scalar());
  return keys;
}

void YamlBlock::add_text(const YAML::Node& node, const std::string& name, std::string& text) const {
  if (node.IsSequence()) {
    for (const YAML::Node& item : node) add_text(item, name, text);
  } else if (node.IsScalar()) {
    text += (text.empty() ? "" : ", ") + node.Scalar();
  } else {
    throw DataError(where(node) + ": key '" + full(name) + "' must be a value or a list of values");
  }
}

void YamlBlock::add_leaves(const YAML::Node& node, const std::string& name, std::vector<Leaf>& leaves) const {
  if (!node.IsMap()) {
    std::string text;
    add_text(node, name, text);
    leaves.push_back({name, text, where(node)});
    return;
  }
  for (const auto& entry : node) {
    if (!entry.first.IsScalar()) throw DataError(where(entry.first) + ": a key must be a word");
    const std::string& key = entry.first.Scalar();
    add_leaves(entry.second, name.empty() ? key : name + "." + key, leaves);
  }
}

std::vector<YamlBlock::Leaf> YamlBlock::leaves() {
  std::vector<Leaf> leaves;
  add_leaves(node_, "", leaves);
  for (const std::string& key : keys()) asked_.insert(key);
  return leaves;
}

bool YamlBlock::has(const char* key) const {
  return node_[key].IsDefined();
}

YAML::Node YamlBlock::get(const char* key) {
  asked_.insert(key);
  YAML::Node node = node_[key];
  if (!node.IsDefined()) fail(key, "is missing");
  return node;
}

double YamlBlock::number_of(const YAML::Node& node, const std::string& name) const {
  const auto value = node.IsScalar() ? parse_number(node.Scalar()) : std::nullopt;
  if (!value || !std::isfinite(*value)) {
    throw DataError(where(node) + ": key '" + name + "' = '" + (node.IsScalar() ? node.Scalar() : "(not a scalar)") +
                    "' is not a finite number");
  }
  return *value;
}

double YamlBlock::number(const char* key) {
  return number_of(get(key), full(key));
}

std::string YamlBlock::text(const char* key) {
  const YAML::Node node = get(key);
  if (!node.IsScalar() || node.Scalar().empty()) fail(key, "must be a word");
  return node.Scalar();
}

std::int64_t YamlBlock::integer(const char* key) {
  const YAML::Node node = get(key);
  const auto value = node.IsScalar() ? parse_integer(node.Scalar()) : std::nullopt;
  if (!value) fail(key, "= '" + (node.IsScalar() ? node.Scalar() : "(not a scalar)") + "' is not a whole number");
  return *value;
}

std::vector<std::string> YamlBlock::texts(const char* key) {
  const YAML::Node node = get(key);
  if (!node.IsSequence()) fail(key, "must be a list of words");
  std::vector<std::string> list;
  for (const auto& entry : node) {
    if (!entry.IsScalar() || entry.Scalar().empty()) fail(key, "must be a list of words");
    list.push_back(entry.Scalar());
  }
  return list;
}

std::vector<double> YamlBlock::numbers(const char* key, int size) {
  const YAML::Node node = get(key);
  if (!node.IsSequence() || (size >= 0 && node.size() != static_cast<std::size_t>(size))) {
    fail(key, "must be a list of " + (size >= 0 ? std::to_string(size) + " numbers" : std::string("numbers")));
  }
  std::vector<double> values;
  for (const auto& entry : node) values.push_back(number_of(entry, full(key)));
  return values;
}

Eigen::Vector3d YamlBlock::vector3(const char* key) {
  const std::vector<double> values = numbers(key, 3);
  return {values[0], values[1], values[2]};
}

Eigen::MatrixXd YamlBlock::matrix(const char* key, int rows, int columns) {
  const YAML::Node node = get(key);
  const std::string size = std::to_string(rows) + " lists of " + std::to_string(columns) + " numbers";
  if (!node.IsSequence() || node.size() != static_cast<std::size_t>(rows)) fail(key, "must be " + size);
  Eigen::MatrixXd m(rows, columns);
  for (int i = 0; i < rows; ++i) {
    const YAML::Node row = node[i];
    if (!row.IsSequence() || row.size() != static_cast<std::size_t>(columns)) fail(key, "must be " + size);
    for (int j = 0; j < columns; ++j) m(i, j) = number_of(row[j], full(key));
  }
  return m;
}

YamlBlock YamlBlock::block(const char* key) {
  return {file_, full(key), get(key)};
}

std::vector<YamlBlock> YamlBlock::blocks(const char* key) {
  const YAML::Node node = get(key);
  if (!node.IsSequence()) fail(key, "must be a list");
  std::vector<YamlBlock> list;
  for (std::size_t i = 0; i < node.size(); ++i) {
    list.push_back(YamlBlock(file_, full(key) + "[" + std::to_string(i) + "]", node[i]));
  }
  return list;
}

void YamlBlock::finish() const {
  for (const auto& entry : node_) {
    if (!asked_.contains(entry.first.Scalar())) {
      throw DataError(where(entry.first) + ": key '" + full(entry.first.Scalar()) + "' is not known");
    }
  }
}

}  // namespace loc::io
