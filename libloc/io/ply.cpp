#include "libloc/io/ply.hpp"

#include <bit>
#include <cmath>
#include <limits>
#include <ostream>

#include "libloc/core/check.hpp"
#include "libloc/io/text_file.hpp"

namespace loc {
namespace {

template <typename Bits>
void append_little_endian(std::string& out, Bits bits) {
  for (std::size_t i = 0; i < sizeof bits; ++i) out += static_cast<char>(bits >> (8 * i) & 0xff);
}

void append_binary(std::string& out, const PlyPoint& point) {
  for (const double value : point.position) append_little_endian(out, std::bit_cast<std::uint64_t>(value));
  append_little_endian(out, static_cast<std::uint32_t>(point.id));
  append_little_endian(out, std::bit_cast<std::uint64_t>(point.sigma));
}

void append_text(std::string& out, const PlyPoint& point) {
  for (const double value : point.position) {
    io::append_number(out, value);
    out += ' ';
  }
  out += std::to_string(point.id) + ' ';
  io::append_number(out, point.sigma);
  out += '\n';
}

}  // namespace

std::int64_t write_ply(const std::filesystem::path& path, std::span<const PlyPoint> points,
                       const std::vector<std::string>& comments, PlyFormat format) {
  std::string body;
  std::int64_t written = 0;
  for (const PlyPoint& point : points) {
    require(
        point.id >= std::numeric_limits<std::int32_t>::min() && point.id <= std::numeric_limits<std::int32_t>::max(),
        "PlyPoint.id = " + std::to_string(point.id) + ": a PLY file holds 32 bit");
    require(!(point.sigma < 0), "PlyPoint.sigma", point.sigma, "must not be negative");
    if (!point.position.allFinite() || !std::isfinite(point.sigma)) continue;
    ++written;
    format == PlyFormat::kAscii ? append_text(body, point) : append_binary(body, point);
  }
  std::string head = "ply\nformat ";
  head += format == PlyFormat::kAscii ? "ascii 1.0\n" : "binary_little_endian 1.0\n";
  for (const std::string& comment : comments) {
    require(comment.find_first_of("\r\n") == std::string::npos, "a comment of a PLY file must be one line: " + comment);
    head += "comment " + comment + '\n';
  }
  head += "element vertex " + std::to_string(written) +
          "\nproperty double x\nproperty double y\nproperty double z\nproperty int id\nproperty double sigma\n"
          "end_header\n";
  io::AtomicFile file(path);
  file.stream() << head << body;
  file.commit();
  return static_cast<std::int64_t>(points.size()) - written;
}

}  // namespace loc
