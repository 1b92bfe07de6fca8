#include "msgs/lcm_log_writer.hpp"

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "libloc/io/lcm_log.hpp"
#include "msgs/convert.hpp"

namespace loc {
namespace {

class LcmRecordingWriter final : public RecordingWriter {
 public:
  explicit LcmRecordingWriter(const std::filesystem::path& path) : unfinished_(path) {
    log_.emplace(unfinished_.path());
  }

  void write(const Measurement& measurement) override {
    const StreamKind kind = kind_of(measurement);
    const Stamp& stamp = stamp_of(measurement);
    std::visit([this](const auto& m) { encode(to_message(m)); }, measurement);
    const TimeNs arrival = stamp.host_time_ns == kNoTime ? stamp.time_ns : stamp.host_time_ns;
    log_->write(arrival / 1000, default_channel(kind), buffer_);
    ++counts_[kind];
  }
  void write(const ReferenceMeasurement& reference, const ReferenceBiases& /*biases*/) override {
    write(Measurement(reference));
  }

  void finish() override {
    log_->flush();
    log_.reset();
    unfinished_.keep();
  }

  NamedCounts counts() const override {
    NamedCounts out;
    for (const auto& [kind, count] : counts_) out.push_back({std::string(stream_name(kind)) + ".written", count});
    return out;
  }
  std::filesystem::path unfinished() const override { return unfinished_.path(); }

 private:
  template <class Message>
  void encode(const Message& message) {
    buffer_.resize(static_cast<std::size_t>(message.getEncodedSize()));
    message.encode(buffer_.data(), 0, static_cast<int>(buffer_.size()));
  }

  Unfinished unfinished_;
  std::optional<LcmLogWriter> log_;
  std::vector<std::uint8_t> buffer_;
  std::map<StreamKind, std::int64_t> counts_;
};

}  // namespace

std::unique_ptr<RecordingWriter> create_lcm_log(const std::filesystem::path& path) {
  return std::make_unique<LcmRecordingWriter>(path);
}

}  // namespace loc
