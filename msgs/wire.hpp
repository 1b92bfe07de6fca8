// Walks over an encoded LCM message and checks every length in it before generated code trusts them: lcm-gen's decoders
// resize a vector to whatever the message states (a 70-byte message can ask for 2 GB, and a product of sizes can
// overflow an int and read past the end). Big endian, as LCM is.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace loc::wire {

class Walker {
 public:
  /// @param data whole message, fingerprint included
  explicit Walker(std::span<const std::uint8_t> data) : data_(data) { skip(8); }

  void skip(std::int64_t bytes) {
    if (bytes < 0 || bytes > static_cast<std::int64_t>(data_.size() - at_)) {
      ok_ = false;
      at_ = data_.size();
    } else {
      at_ += static_cast<std::size_t>(bytes);
    }
  }
  std::int64_t int16() { return static_cast<std::int16_t>(read(2)); }
  std::int64_t int32() { return static_cast<std::int32_t>(read(4)); }
  /// count elements; count is at most 2^31, so the product does not overflow for elements of a few bytes.
  void array(std::int64_t count, std::int64_t bytes_each) {
    if (count < 0) {
      ok_ = false;
    } else {
      skip(count * bytes_each);
    }
  }
  void matrix(std::int64_t count, std::int64_t bytes_each) {
    if (count > kMaxMatrix) {
      ok_ = false;
    } else {
      array(count < 0 ? -1 : count * count, bytes_each);
    }
  }
  /// Length with the closing zero, then that many bytes.
  void string() {
    const std::int64_t length = int32();
    if (length < 1) {
      ok_ = false;
      return;
    }
    skip(length);
    if (ok_ && data_[at_ - 1] != 0) ok_ = false;
  }

  /// True when every length fitted and the message ends where the last field ends.
  bool complete() const { return ok_ && at_ == data_.size(); }
  bool ok() const { return ok_; }

 private:
  static constexpr std::int64_t kMaxMatrix = 4096;

  std::uint32_t read(std::size_t bytes) {
    const std::size_t from = at_;
    skip(static_cast<std::int64_t>(bytes));
    if (!ok_) return 0;
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i) value = (value << 8U) | data_[from + i];
    return value;
  }

  std::span<const std::uint8_t> data_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

/// First eight bytes, 0 when there are fewer.
inline std::int64_t fingerprint(std::span<const std::uint8_t> data) {
  if (data.size() < 8) return 0;
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < 8; ++i) value = (value << 8U) | data[i];
  return static_cast<std::int64_t>(value);
}

}  // namespace loc::wire
