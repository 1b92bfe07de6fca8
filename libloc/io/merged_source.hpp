// Several recordings of one event as one: a camera's pictures beside the IMU, a video beside a CSV file. They must be
// on one clock.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "libloc/io/source.hpp"

namespace loc {

struct MergeInput {
  std::string name;  ///< for errors: "drive.mp4"
  std::unique_ptr<MeasurementSource> source;
};

/// Their measurements in order of time; at equal times in the order of the inputs. Each input must itself be in order
/// of time. Counts are those of all of them.
/// @param must_overlap next() @throws DataError, naming both and their times, when one input ends before another one
/// begins: then they are not on one clock, or not of one event.
std::unique_ptr<MeasurementSource> merge_sources(std::vector<MergeInput> inputs, bool must_overlap = false);

}  // namespace loc
