// Throughput of the NMEA reader, beside the usual way to write one: lines, a vector of strings, stod. Both check the
// checksum and decode RMC and GGA; ours also the other four types, and every field's range.
#include <benchmark/benchmark.h>

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "libloc/io/nmea_fix.hpp"
#include "support/nmea_text.hpp"

namespace loc {
namespace {

/// Epochs of one receiver; gsv: with the satellites in view, as receivers send them, which nobody decodes.
std::string stream(bool gsv) {
  std::string text;
  for (int i = 0; i < 3000; ++i) {
    char time[16];
    std::snprintf(time, sizeof time, "%02d%02d%02d.00", i / 3600 % 24, i / 60 % 60, i % 60);
    const std::string t = time;
    const auto add = [&](const std::string& body) { text += test::sentence(body); };
    add("GNRMC," + t + ",A,4552.65403,S,17030.00668,E,10.025,301.29,120419,,,A,V");
    add("GNVTG,301.29,T,,M,10.025,N,18.566,K,A");
    add("GNGGA," + t + ",4552.65403,S,17030.00668,E,1,12,0.64,14.2,M,1.8,M,,");
    for (const char* system : {"1", "2", "3", "4"}) {
      add(std::string("GNGSA,A,3,13,16,21,15,10,29,27,20,,,,,1.05,0.64,0.83,") + system);
    }
    for (int k = 0; gsv && k < 20; ++k) add("GPGSV,3,1,12,05,06,110,19,10,24,284,34,13,37,124,29,15,63,083,11,1");
    add("GNGST," + t + ",23,3.9,2.1,45.0,2.3,3.5,4.0");
    add("GNZDA," + t + ",12,04,2019,00,00");
  }
  return text;
}

void set_rate(benchmark::State& state, const std::string& text) {
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) * static_cast<std::int64_t>(text.size()));
}

void read_stream(benchmark::State& state, const std::string& text, std::size_t piece) {
  for (auto _ : state) {
    NmeaReader reader;
    std::span<const std::uint8_t> rest = test::bytes_of(text);
    while (!rest.empty()) {
      std::span<const std::uint8_t> part = rest.first(std::min(piece, rest.size()));
      rest = rest.subspan(part.size());
      while (const NmeaSentence* s = reader.next(part)) benchmark::DoNotOptimize(s);
    }
    if (reader.counts().bad_checksum + reader.counts().bytes_skipped > 0)
      state.SkipWithError("the stream is not clean");
  }
  set_rate(state, text);
}

void reader_all_decoded(benchmark::State& state) {
  read_stream(state, stream(false), 1 << 16);
}
void reader_with_gsv(benchmark::State& state) {
  read_stream(state, stream(true), 1 << 16);
}
void reader_pieces_of_32_bytes(benchmark::State& state) {
  read_stream(state, stream(false), 32);
}

void reader_and_fixes(benchmark::State& state) {
  const std::string text = stream(false);
  for (auto _ : state) {
    NmeaReader reader;
    NmeaFixAssembler assembler;
    int fixes = 0;
    std::span<const std::uint8_t> bytes = test::bytes_of(text);
    while (const NmeaSentence* s = reader.next(bytes)) fixes += assembler.process(*s) ? 1 : 0;
    if (fixes != 2999) state.SkipWithError("fixes are missing");
  }
  set_rate(state, text);
}

void reader_of_binary(benchmark::State& state) {
  std::string text(1 << 20, '\0');
  std::uint32_t x = 1;
  for (char& c : text) c = static_cast<char>((x = x * 1664525 + 1013904223) >> 24);
  for (auto _ : state) {
    NmeaReader reader;
    std::span<const std::uint8_t> bytes = test::bytes_of(text);
    while (reader.next(bytes) != nullptr) {
    }
    benchmark::DoNotOptimize(reader.counts().bytes_skipped);
  }
  set_rate(state, text);
}

void lines_and_strings(benchmark::State& state) {
  const std::string text = stream(false);
  for (auto _ : state) {
    std::istringstream in(text);
    std::string line;
    double sum = 0;
    while (std::getline(in, line)) {
      const auto star = line.find('*');
      unsigned check = 0;
      for (std::size_t i = 1; i < star; ++i) check ^= static_cast<unsigned char>(line[i]);
      if (std::stoul(line.substr(star + 1, 2), nullptr, 16) != check) continue;
      std::vector<std::string> fields;
      std::istringstream cells(line.substr(0, star));
      for (std::string cell; std::getline(cells, cell, ',');) fields.push_back(cell);
      const std::string type = fields[0].substr(3);
      if (type != "RMC" && type != "GGA") continue;
      const std::size_t at = type == "RMC" ? 3 : 2;
      const double latitude = std::stod(fields[at]);
      const double longitude = std::stod(fields[at + 2]);
      sum += std::floor(latitude / 100) + std::fmod(latitude, 100) / 60 + longitude;
      for (std::size_t k = at + 4; k < fields.size(); ++k) {
        if (!fields[k].empty() && fields[k][0] >= '0' && fields[k][0] <= '9') sum += std::stod(fields[k]);
      }
    }
    benchmark::DoNotOptimize(sum);
  }
  set_rate(state, text);
}

BENCHMARK(reader_all_decoded)->Unit(benchmark::kMillisecond);
BENCHMARK(reader_with_gsv)->Unit(benchmark::kMillisecond);
BENCHMARK(reader_pieces_of_32_bytes)->Unit(benchmark::kMillisecond);
BENCHMARK(reader_and_fixes)->Unit(benchmark::kMillisecond);
BENCHMARK(reader_of_binary)->Unit(benchmark::kMillisecond);
BENCHMARK(lines_and_strings)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace loc

BENCHMARK_MAIN();
