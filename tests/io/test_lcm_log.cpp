// LCM event logs: round trips with liblcm, damage anywhere, constant memory.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <lcm/lcm-cpp.hpp>

#include "libloc/io/lcm_log.hpp"
#include "tests/support/sources.hpp"
#include "tests/support/temp_folder.hpp"

namespace loc {
namespace {

using test::expect_data_error;

struct Event {
  std::int64_t time_us;
  std::string channel;
  std::string data;
  bool operator==(const Event&) const = default;
};

std::vector<Event> read_all(LcmLogReader& reader) {
  std::vector<Event> events;
  while (const LcmLogEvent* e = reader.next()) {
    events.push_back({e->log_time_us, std::string(e->channel), std::string(e->data.begin(), e->data.end())});
  }
  return events;
}

class LcmLog : public testing::Test {
 protected:
  std::filesystem::path file() const { return folder_.path() / "a.log"; }
  std::string write(const std::vector<Event>& events) const {
    LcmLogWriter writer(file());
    for (const Event& e : events) {
      writer.write(e.time_us, e.channel,
                   std::span(reinterpret_cast<const std::uint8_t*>(e.data.data()), e.data.size()));
    }
    writer.flush();
    return test::read_file(file());
  }
  std::vector<Event> read(const std::string& text, LcmLogDamage* damage = nullptr) const {
    LcmLogReader reader(folder_.write("b.log", text));
    auto events = read_all(reader);
    EXPECT_EQ(reader.next(), nullptr) << "the end stays the end";
    if (damage != nullptr) *damage = reader.damage();
    return events;
  }
  test::TempFolder folder_;
  const std::vector<Event> three_{{100, "A", "first"}, {200, "BB", ""}, {300, "CCC", std::string("\0third\xED", 7)}};
};

TEST_F(LcmLog, what_is_written_is_read) {
  LcmLogDamage damage;
  EXPECT_EQ(read(write(three_), &damage), three_);
  EXPECT_EQ(damage.gaps, 0);
  EXPECT_FALSE(damage.truncated_at);
}

TEST_F(LcmLog, liblcm_reads_what_we_write_and_we_read_what_it_writes) {
  write(three_);
  lcm::LogFile theirs(file().string(), "r");
  for (const Event& e : three_) {
    const lcm::LogEvent* got = theirs.readNextEvent();
    ASSERT_NE(got, nullptr);
    EXPECT_EQ(got->channel, e.channel);
    EXPECT_EQ(got->timestamp, e.time_us);
    EXPECT_EQ(std::string(static_cast<const char*>(got->data), static_cast<std::size_t>(got->datalen)), e.data);
  }
  const std::string path = (folder_.path() / "theirs.log").string();
  {
    lcm::LogFile log(path, "w");
    std::string data = "payload";
    lcm::LogEvent event{};
    event.timestamp = 5;
    event.channel = "X";
    event.data = data.data();
    event.datalen = static_cast<std::int32_t>(data.size());
    log.writeEvent(&event);
  }
  LcmLogReader reader(path);
  EXPECT_EQ(read_all(reader), (std::vector<Event>{{5, "X", "payload"}}));
}

TEST_F(LcmLog, test_messages_of_lcm_are_left_out) {
  EXPECT_EQ(read(write({{1, "LCM_SELF_TEST", "x"}, {2, "A", "y"}})), (std::vector<Event>{{2, "A", "y"}}));
}

TEST_F(LcmLog, offsets_and_numbers) {
  write(three_);
  LcmLogReader reader(file());
  EXPECT_EQ(reader.next()->offset, 0U);
  const LcmLogEvent* second = reader.next();
  EXPECT_EQ(second->offset, 28U + 1 + 5);
  EXPECT_EQ(second->number, 1);
}

TEST_F(LcmLog, files_that_are_none_are_refused) {
  expect_data_error([&] { LcmLogReader(folder_.path() / "none.log"); }, {"none.log", "no such file"});
  expect_data_error([&] { LcmLogReader reader(folder_.path()); }, {"not a file"});
  std::filesystem::create_symlink("loop.log", folder_.path() / "loop.log");
  expect_data_error([&] { LcmLogReader reader(folder_.path() / "loop.log"); }, {"loop.log", "symbolic links"});
  expect_data_error([&] { read(""); }, {"empty"});
  expect_data_error([&] { read(std::string(5000, 'x')); }, {"not an LCM log", "5000"});
  expect_data_error([&] { LcmLogWriter writer(folder_.path() / "no" / "a.log"); }, {"cannot be written"});
}

TEST_F(LcmLog, a_cut_tail_is_reported_at_every_byte) {
  const std::string text = write(three_);
  const std::size_t first = 28 + 1 + 5;
  const std::size_t second = first + 28 + 2;
  for (std::size_t size = 1; size < text.size(); ++size) {
    SCOPED_TRACE(size);
    if (size < first) {
      EXPECT_THROW(read(text.substr(0, size)), DataError);
      continue;
    }
    LcmLogDamage damage;
    const auto events = read(text.substr(0, size), &damage);
    EXPECT_EQ(events.size(), size < second ? 1U : 2U);
    EXPECT_EQ(damage.gaps, 0);
    if (size == first || size == second) {
      EXPECT_FALSE(damage.truncated_at);
    } else {
      ASSERT_TRUE(damage.truncated_at);
      EXPECT_EQ(*damage.truncated_at, size < second ? first : second);
      EXPECT_EQ(damage.truncated_bytes, static_cast<std::int64_t>(size - *damage.truncated_at));
    }
  }
}

TEST_F(LcmLog, one_wrong_byte_anywhere_loses_at_most_its_own_event) {
  const std::string text = write(three_);
  const std::size_t first = 28 + 1 + 5;
  for (std::size_t at = 0; at < text.size(); ++at) {
    for (const int value : {0x00, 0x7f, 0xff}) {
      std::string changed = text;
      changed[at] = static_cast<char>(value);
      if (changed == text) continue;
      SCOPED_TRACE(std::to_string(at) + " " + std::to_string(value));
      LcmLogDamage damage;
      const auto events = read(changed, &damage);
      // Times, numbers, channels and data carry no checksum: a wrong one there cannot be seen.
      std::size_t intact = 0;
      for (const Event& e : three_) intact += static_cast<std::size_t>(std::ranges::count(events, e));
      EXPECT_GE(intact, 2U);
      EXPECT_TRUE(events.size() == 3 || damage.gaps == 1 || damage.truncated_at);
      if (at < 4) {
        EXPECT_EQ(events.size(), 2U);
        EXPECT_EQ(damage.skipped_bytes, static_cast<std::int64_t>(first));
        EXPECT_EQ(*damage.first_gap_offset, 0U);
      }
    }
  }
}

TEST_F(LcmLog, garbage_between_events_is_skipped_and_counted) {
  const std::string text = write(three_);
  const std::string garbage = "garbage \xED\xA1 and more";
  LcmLogDamage damage;
  EXPECT_EQ(read(text + garbage + text, &damage).size(), 6U);
  EXPECT_EQ(damage.gaps, 1);
  EXPECT_EQ(damage.skipped_bytes, static_cast<std::int64_t>(garbage.size()));
  EXPECT_EQ(*damage.first_gap_offset, text.size());
  EXPECT_EQ(read(garbage + text + garbage, &damage).size(), 3U);
  EXPECT_EQ(damage.gaps, 2);
  EXPECT_FALSE(damage.truncated_at) << "garbage at the end is no event that was cut";
}

TEST_F(LcmLog, data_that_looks_like_an_event_is_data) {
  const std::string inner = write({{7, "INNER", "inner data"}});
  const std::vector<Event> events{{1, "OUTER", "x" + inner + "y"}, {2, "A", "b"}};
  EXPECT_EQ(read(write(events)), events);
}

TEST_F(LcmLog, absurd_lengths_allocate_nothing) {
  std::string text = write(three_);
  // The second event states 2 GB of data.
  const std::size_t at = 28 + 1 + 5 + 24;
  text[at] = 0x7f;
  text[at + 1] = text[at + 2] = text[at + 3] = static_cast<char>(0xff);
  rusage before{};
  getrusage(RUSAGE_SELF, &before);
  LcmLogDamage damage;
  EXPECT_EQ(read(text, &damage).size(), 2U);
  EXPECT_EQ(damage.skipped_bytes, 28 + 2);
  rusage after{};
  getrusage(RUSAGE_SELF, &after);
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 20'000) << "kB";
}

// Each of 100 000 headers states 50 MB that end inside the file, and none is an event.
TEST_F(LcmLog, many_headers_that_state_long_events_take_no_memory) {
  constexpr std::uint64_t kHeaders = 100'000;
  constexpr std::uint64_t kSpacing = 32;
  constexpr std::uint64_t kGoodAt = 40'000'000;
  const std::string good = write(three_);
  std::string header = good.substr(0, 28);
  header.replace(24, 4, std::string("\x03\x20\x00\x00", 4));  // 50 MB
  header.resize(kSpacing, '.');
  const auto path = folder_.path() / "long.log";
  {
    std::ofstream out(path, std::ios::binary);
    for (std::uint64_t i = 0; i < kHeaders; ++i) out << header;
    out.seekp(kGoodAt);
    out << good;
  }
  std::filesystem::resize_file(path, 60'000'000);  // zeros to the end, which take no room on the disk
  rusage before{};
  getrusage(RUSAGE_SELF, &before);
  LcmLogReader reader(path);
  EXPECT_EQ(read_all(reader), three_);
  rusage after{};
  getrusage(RUSAGE_SELF, &after);
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 10'000) << "kB";
  EXPECT_EQ(reader.damage().gaps, 2);
  EXPECT_EQ(*reader.damage().first_gap_offset, 0U);
  EXPECT_EQ(reader.damage().skipped_bytes, static_cast<std::int64_t>(60'000'000 - good.size()));
}

TEST_F(LcmLog, an_event_inside_a_long_damaged_one_is_found_wherever_it_lies) {
  const std::string good = write(three_);
  constexpr std::size_t kChunk = 1 << 20;
  for (const std::size_t before :
       {std::size_t{0}, kChunk - 29, kChunk - 28, kChunk - 27, kChunk - 2, kChunk, 2 * kChunk}) {
    SCOPED_TRACE(before);
    std::string text = good.substr(0, 28);
    text.replace(24, 4, std::string("\x00\x40\x00\x00", 4));  // 4 MB
    text += std::string(before, 'x') + good + std::string(5 * kChunk, 'y');
    LcmLogDamage damage;
    EXPECT_EQ(read(text, &damage), three_);
    EXPECT_EQ(damage.gaps, 2);
    EXPECT_EQ(damage.skipped_bytes, static_cast<std::int64_t>(text.size() - good.size()));
  }
}

TEST_F(LcmLog, long_events_are_read) {
  std::vector<Event> events;
  for (const std::size_t size : {(1 << 20) - 40, (1 << 20) - 29, 1 << 20, 5 << 20, 3, 2 << 20}) {
    events.push_back({1, "A", std::string(size, static_cast<char>('a' + events.size()))});
  }
  const std::string text = write(events);
  LcmLogDamage damage;
  EXPECT_EQ(read(text, &damage), events);
  EXPECT_EQ(damage.gaps, 0);
  EXPECT_EQ(read(text + "end", &damage), events) << "what follows is no event, and none lies inside the last one";
  EXPECT_EQ(damage.skipped_bytes, 3);
}

TEST_F(LcmLog, a_limit_on_the_size_of_an_event_holds) {
  write({{1, "A", std::string(1000, 'x')}, {2, "B", "y"}});
  LcmLogReader reader(file(), 500);
  EXPECT_EQ(read_all(reader), (std::vector<Event>{{2, "B", "y"}}));
  EXPECT_EQ(reader.damage().skipped_bytes, 28 + 1 + 1000);
}

TEST_F(LcmLog, the_writer_checks_what_it_is_given) {
  LcmLogWriter writer(file());
  EXPECT_THROW(writer.write(0, "", {}), std::invalid_argument);
  EXPECT_THROW(writer.write(0, std::string(64, 'c'), {}), std::invalid_argument);
  EXPECT_NO_THROW(writer.write(0, std::string(63, 'c'), {}));
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  LcmLogWriter full("/dev/full");
  EXPECT_THROW(
      {
        full.write(0, "A", std::vector<std::uint8_t>(100));
        full.flush();
      },
      DataError);
}

}  // namespace
}  // namespace loc
