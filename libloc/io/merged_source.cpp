#include "libloc/io/merged_source.hpp"

#include <optional>
#include <utility>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

class MergedSource final : public MeasurementSource {
 public:
  MergedSource(std::vector<MergeInput> inputs, bool must_overlap) : must_overlap_(must_overlap) {
    for (MergeInput& input : inputs) {
      require(input.source != nullptr, "a source to merge is missing");
      inputs_.push_back({std::move(input), {}, false, kNoTime, kNoTime});
    }
  }

  std::optional<Measurement> next() override {
    Input* first = nullptr;
    for (Input& input : inputs_) {
      // Read when it is asked for, so that a bad row does not take the good one before it along.
      if (!input.loaded) load(input);
      if (!input.head) continue;
      if (first == nullptr || stamp_of(*input.head).time_ns < stamp_of(*first->head).time_ns) first = &input;
    }
    if (first == nullptr) return std::nullopt;
    first->loaded = false;
    return std::exchange(first->head, std::nullopt);
  }

  void stop() override {
    for (Input& input : inputs_) input.given.source->stop();
  }

  NamedCounts counts() const override {
    NamedCounts out;
    for (const Input& input : inputs_) {
      for (NamedCount& count : input.given.source->counts()) out.push_back(std::move(count));
    }
    return out;
  }

 private:
  struct Input {
    MergeInput given;
    std::optional<Measurement> head;
    bool loaded = false;
    TimeNs first_ns = kNoTime;
    TimeNs last_ns = kNoTime;
  };

  void load(Input& input) {
    input.loaded = true;
    input.head = input.given.source->next();
    if (input.head) {
      input.last_ns = stamp_of(*input.head).time_ns;
      if (input.first_ns == kNoTime) input.first_ns = input.last_ns;
    } else if (must_overlap_ && input.first_ns != kNoTime) {
      for (const Input& other : inputs_) check_overlap(input, other);
    }
  }

  static void check_overlap(const Input& ended, const Input& other) {
    if (other.first_ns == kNoTime || other.first_ns <= ended.last_ns) return;
    throw DataError(ended.given.name + " (" + format_seconds(ended.first_ns) + " s to " +
                    format_seconds(ended.last_ns) + " s) ends before " + other.given.name + " begins (" +
                    format_seconds(other.first_ns) + " s): they are not on one clock");
  }

  bool must_overlap_;
  std::vector<Input> inputs_;
};

}  // namespace

std::unique_ptr<MeasurementSource> merge_sources(std::vector<MergeInput> inputs, bool must_overlap) {
  return std::make_unique<MergedSource>(std::move(inputs), must_overlap);
}

}  // namespace loc
