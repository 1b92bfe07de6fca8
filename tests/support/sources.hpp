// Reading a source to its end, and looking at its counts.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "libloc/core/check.hpp"
#include "libloc/io/source.hpp"

namespace loc::test {

inline std::vector<Measurement> read_all(MeasurementSource& source) {
  std::vector<Measurement> all;
  while (auto m = source.next()) all.push_back(std::move(*m));
  return all;
}

template <class M>
std::vector<M> only(const std::vector<Measurement>& all) {
  std::vector<M> some;
  for (const Measurement& m : all) {
    if (const M* one = std::get_if<M>(&m)) some.push_back(*one);
  }
  return some;
}

/// 0 when there is no such count.
inline std::int64_t count(const NamedCounts& counts, const std::string& name) {
  for (const NamedCount& entry : counts) {
    if (entry.name == name) return entry.value;
  }
  return 0;
}

/// Expects a DataError whose message holds all the parts.
template <class Action>
void expect_data_error(Action action, const std::vector<std::string>& parts) {
  try {
    action();
    ADD_FAILURE() << "accepted";
  } catch (const DataError& error) {
    for (const std::string& part : parts) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << "'" << part << "' not in: " << error.what();
    }
  }
}

}  // namespace loc::test
