#include "asperity/io/trace_file.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <bit>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>

namespace asperity::trace_file_test {
namespace {

namespace fs = std::filesystem;

/// A folder of its own for every test, gone afterwards.
class TraceFile : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "asperity-trace-XXXXXX").string();
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }
  [[nodiscard]] std::string at(const std::string& name) const { return (folder_ / name).string(); }

  fs::path folder_;
};

std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void put(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

/// A record in which every field has a value of its own, made from `n`.
TraceRecord record_of(std::uint64_t n) {
  double next = static_cast<double>(n) * 100.0;
  const auto fill = [&next](Vec3& v) {
    for (int i = 0; i < 3; ++i) v[i] = next += 0.7;
  };
  TraceRecord r;
  r.tick = n;
  r.dt = Seconds(1e-3);
  r.probe.time = Seconds(1e-3 * static_cast<double>(n));
  r.probe.buttons = 5;
  r.probe.pose.orientation = Quat(next + 0.1, next + 0.2, next + 0.3, next + 0.4);
  r.rendered.contact.count = 2;
  r.rendered.contact.instance = 3;
  r.rendered.contact.element = static_cast<std::uint32_t>(n);
  r.rendered.contact.penetration = next + 0.5;
  r.rendered.contact.height = -0.0;
  r.rendered.flags = Flags::from_bits(0x41U);
  r.update_seconds = next + 0.6;
  for (Vec3* v : {&r.probe.pose.position, &r.probe.twist.linear, &r.probe.twist.angular, &r.rendered.wrench.force,
                  &r.rendered.wrench.torque, &r.rendered.proxy, &r.rendered.contact.point, &r.rendered.contact.normal,
                  &r.commanded, &r.hand}) {
    fill(*v);
  }
  return r;
}

std::vector<TraceRecord> records_of(std::size_t count) {
  std::vector<TraceRecord> records;
  for (std::size_t n = 0; n < count; ++n) records.push_back(record_of(n));
  return records;
}

/// All bits of all fields, one after the other.
std::vector<std::uint64_t> bits_of(const TraceRecord& r) {
  std::vector<std::uint64_t> bits{r.tick,
                                  r.probe.buttons,
                                  r.rendered.contact.count,
                                  r.rendered.contact.instance,
                                  r.rendered.contact.element,
                                  r.rendered.flags.bits()};
  const auto add = [&bits](double value) { bits.push_back(std::bit_cast<std::uint64_t>(value)); };
  for (const double value : {r.dt.count(), r.probe.time.count(), r.rendered.contact.penetration,
                             r.rendered.contact.height, r.update_seconds}) {
    add(value);
  }
  for (int i = 0; i < 4; ++i) add(r.probe.pose.orientation.coeffs()[i]);
  for (const Vec3* v : {&r.probe.pose.position, &r.probe.twist.linear, &r.probe.twist.angular, &r.rendered.wrench.force,
                        &r.rendered.wrench.torque, &r.rendered.proxy, &r.rendered.contact.point,
                        &r.rendered.contact.normal, &r.commanded, &r.hand}) {
    for (int i = 0; i < 3; ++i) add((*v)[i]);
  }
  return bits;
}

void expect_bit_equal(const std::vector<TraceRecord>& a, const std::vector<TraceRecord>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) ASSERT_EQ(bits_of(a[i]), bits_of(b[i])) << "tick " << i;
}

TraceMetadata some_metadata() {
  TraceMetadata metadata;
  metadata.scene = R"({"surfaces": ["bunny.obj"]})";
  metadata.source = "bunny.obj";
  metadata.command = "asperity touch bunny.obj";
  metadata.device = "omega.7";
  metadata.program = "asperity 0.1.0";
  metadata.rate = 1000.0;
  metadata.seed = 18446744073709551615ULL;
  metadata.extra["note"] = "quoted \"text\",\nwith a line";
  return metadata;
}

Result<Trace> parsed(const std::string& bytes) {
  return parse_trace(std::as_bytes(std::span(bytes)));
}

/// Writes `count` records, `per_frame` in a frame, and gives the file's bytes.
std::string trace_bytes(const std::string& path, std::size_t count, std::size_t per_frame, bool finish) {
  {
    TraceWriter writer = TraceWriter::open(path, some_metadata(), {.records_per_frame = per_frame}).value();
    for (const TraceRecord& record : records_of(count)) EXPECT_TRUE(writer.append(record).ok());
    if (finish) {
      EXPECT_TRUE(writer.finish().ok());
    }
  }
  return bytes_of(path);
}

TEST_F(TraceFile, RoundTripKeepsEveryBit) {
  std::vector<TraceRecord> records = records_of(700);
  records[1].rendered.wrench.force = Vec3(-0.0, 5e-324, std::bit_cast<double>(0x7FF8000000001234ULL));
  records[2].commanded = Vec3(infinity, -infinity, std::bit_cast<double>(0xFFF8000000000001ULL));
  ASSERT_TRUE(write_trace(at("a.trace"), some_metadata(), records).ok());
  const Trace trace = read_trace(at("a.trace")).value();
  EXPECT_TRUE(trace.complete);
  EXPECT_EQ(trace.lost_bytes, 0U);
  EXPECT_EQ(trace.damage, "");
  expect_bit_equal(trace.records, records);
  EXPECT_EQ(force_hash(trace.records), force_hash(records));
}

TEST_F(TraceFile, MetadataComesBack) {
  ASSERT_TRUE(write_trace(at("a.trace"), some_metadata(), {}).ok());
  const Trace trace = read_trace(at("a.trace")).value();
  EXPECT_TRUE(trace.complete);
  EXPECT_TRUE(trace.records.empty());
  EXPECT_EQ(to_json(trace.metadata), to_json(some_metadata()));
  EXPECT_EQ(trace.metadata.seed, 18446744073709551615ULL);
  EXPECT_EQ(trace.metadata.extra.at("note"), "quoted \"text\",\nwith a line");
  TraceMetadata odd;
  odd.command = "caf\xE9";
  ASSERT_TRUE(write_trace(at("b.trace"), odd, {}).ok());
  EXPECT_EQ(read_trace(at("b.trace")).value().metadata.command, "caf\xEF\xBF\xBD");
}

TEST_F(TraceFile, CutAtEveryByteGivesAllCompleteFrames) {
  const std::size_t per_frame = 2;
  const std::size_t count = 6;
  const std::string whole = trace_bytes(at("a.trace"), count, per_frame, true);
  const std::size_t record = 340;
  const std::size_t frame = 12 + 4 + per_frame * record;
  const std::size_t end_frame = 12 + 16;
  const std::size_t header = whole.size() - 3 * frame - end_frame;
  const std::vector<TraceRecord> records = records_of(count);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const Result<Trace> result = parsed(whole.substr(0, size));
    if (size < header) {
      ASSERT_FALSE(result.ok()) << size;
      const ErrorCode expected = size == 0 ? ErrorCode::file_empty : ErrorCode::file_truncated;
      ASSERT_EQ(result.error().code, expected) << size;
      continue;
    }
    ASSERT_TRUE(result.ok()) << size;
    const std::size_t frames = std::min<std::size_t>(3, (size - header) / frame);
    ASSERT_FALSE(result->complete) << size;
    ASSERT_NE(result->damage, "") << size;
    ASSERT_EQ(result->lost_bytes, size - header - frames * frame) << size;
    expect_bit_equal(result->records,
                     {records.begin(), records.begin() + static_cast<std::ptrdiff_t>(frames * per_frame)});
  }
}

TEST_F(TraceFile, AnyFlippedByteIsDetectedAndNothingWrongIsRead) {
  const std::string whole = trace_bytes(at("a.trace"), 3, 1, true);
  const std::vector<TraceRecord> records = records_of(3);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    for (const unsigned mask : {0x01U, 0x80U, 0xFFU}) {
      std::string bytes = whole;
      bytes[i] = static_cast<char>(static_cast<unsigned char>(bytes[i]) ^ mask);
      const Result<Trace> result = parsed(bytes);
      if (!result) continue;
      ASSERT_FALSE(result->complete) << "byte " << i;
      ASSERT_NE(result->damage, "") << "byte " << i;
      ASSERT_GT(result->lost_bytes, 0U) << "byte " << i;
      ASSERT_LE(result->records.size(), records.size());
      const auto kept = static_cast<std::ptrdiff_t>(result->records.size());
      expect_bit_equal(result->records, {records.begin(), records.begin() + kept});
    }
  }
}

TEST_F(TraceFile, UnfinishedWriterLeavesAReadableFile) {
  trace_bytes(at("a.trace"), 5, 2, false);
  const Trace trace = read_trace(at("a.trace")).value();
  EXPECT_EQ(trace.records.size(), 5U);
  EXPECT_FALSE(trace.complete);
  EXPECT_EQ(trace.lost_bytes, 0U);
  EXPECT_NE(trace.damage.find("end frame"), std::string::npos);
}

TEST_F(TraceFile, FramesAreOnTheDiskWhileTheSessionRuns) {
  TraceWriter writer = TraceWriter::open(at("a.trace"), {}, {.records_per_frame = 4, .sync_each_frame = true}).value();
  for (std::uint64_t n = 0; n < 10; ++n) ASSERT_TRUE(writer.append(record_of(n)).ok());
  EXPECT_EQ(read_trace(at("a.trace")).value().records.size(), 8U);
  ASSERT_TRUE(writer.flush().ok());
  EXPECT_EQ(read_trace(at("a.trace")).value().records.size(), 10U);
  EXPECT_EQ(writer.records(), 10U);
  EXPECT_EQ(writer.hash(), force_hash(records_of(10)));
  ASSERT_TRUE(writer.finish().ok());
  EXPECT_FALSE(writer.append(record_of(10)).ok());
  EXPECT_TRUE(read_trace(at("a.trace")).value().complete);
}

TEST_F(TraceFile, BytesAfterTheEndAreReported) {
  const std::string whole = trace_bytes(at("a.trace"), 2, 1, true);
  put(at("a.trace"), whole + "tail");
  const Trace trace = read_trace(at("a.trace")).value();
  EXPECT_EQ(trace.records.size(), 2U);
  EXPECT_EQ(trace.lost_bytes, 4U);
  EXPECT_NE(trace.damage.find("4 bytes after"), std::string::npos);
}

TEST_F(TraceFile, AMissingFrameIsNoticedAtTheEnd) {
  const std::string whole = trace_bytes(at("a.trace"), 3, 1, true);
  const std::size_t frame = 12 + 4 + 340;
  const std::size_t header = whole.size() - 3 * frame - 28;
  put(at("a.trace"), whole.substr(0, header + frame) + whole.substr(header + 2 * frame));
  EXPECT_FALSE(read_trace(at("a.trace")).value().complete);
}

/// Everything in its order: a number of each tick, the kind of each event, "key" of a key frame.
std::string order_of(const Trace& trace) {
  std::string order;
  std::size_t event = 0;
  std::size_t key = 0;
  const auto before = [&](std::uint64_t tick) {
    for (bool more = true; more;) {
      const bool has_key = key < trace.key_frames.size() && trace.key_frames[key].tick <= tick;
      const bool has_event = event < trace.events.size() && trace.events[event].tick <= tick;
      more = has_key || has_event;
      if (has_key && trace.key_frames[key].events_before <= event) {
        order += "key" + std::to_string(trace.key_frames[key++].state.size()) + " ";
      } else if (has_event) {
        order += trace.events[event].kind + "=" + trace.events[event].text + " ";
        ++event;
      } else {
        return;
      }
    }
  };
  for (const TraceRecord& record : trace.records) {
    before(record.tick);
    order += std::to_string(record.tick) + " ";
  }
  before(UINT64_MAX);
  return order;
}

/// Ticks, events and key frames, more ticks in a frame than there ever are between two events.
void write_live(TraceWriter& writer) {
  const auto ticks = [&](std::uint64_t from, std::uint64_t to) {
    for (std::uint64_t n = from; n < to; ++n) ASSERT_TRUE(writer.append(record_of(n)).ok());
  };
  ASSERT_TRUE(writer.key_frame({0, std::vector<std::byte>(3, std::byte{7})}).ok());
  ticks(0, 2);
  ASSERT_TRUE(writer.event({2, "edit", "zoom"}).ok());
  ASSERT_TRUE(writer.key_frame({2, {}}).ok());
  ASSERT_TRUE(writer.event({2, "note", ""}).ok());
  ticks(2, 3);
  ASSERT_TRUE(writer.event({6, "lost", "3"}).ok());
  ticks(6, 8);
}

TEST_F(TraceFile, EventsAndKeyFramesKeepTheirOrder) {
  TraceWriter writer = TraceWriter::open(at("a.trace"), some_metadata(), {.records_per_frame = 100}).value();
  write_live(writer);
  ASSERT_TRUE(writer.finish().ok());
  const Trace trace = read_trace(at("a.trace")).value();
  EXPECT_TRUE(trace.complete);
  EXPECT_EQ(order_of(trace), "key3 0 1 edit=zoom key0 note= 2 lost=3 6 7 ");
  ASSERT_EQ(trace.key_frames.size(), 2U);
  EXPECT_EQ(trace.key_frames[0].state, std::vector<std::byte>(3, std::byte{7}));
  EXPECT_EQ(trace.key_frames[1].events_before, 1U);
  EXPECT_EQ(trace.events[2].tick, 6U);
}

TEST_F(TraceFile, AnEventOfATickThatIsWrittenIsRefused) {
  TraceWriter writer = TraceWriter::open(at("a.trace"), {}, {.records_per_frame = 2}).value();
  ASSERT_TRUE(writer.append(record_of(5)).ok());
  EXPECT_EQ(writer.event({5, "note", "late"}).error().code, ErrorCode::bad_value);
  EXPECT_EQ(writer.key_frame({5, {}}).error().code, ErrorCode::bad_value);
  EXPECT_TRUE(writer.event({6, "note", "in time"}).ok());
  ASSERT_TRUE(writer.finish().ok());
  EXPECT_FALSE(writer.event({7, "note", ""}).ok());
  EXPECT_EQ(order_of(read_trace(at("a.trace")).value()), "5 note=in time ");
}

TEST_F(TraceFile, AnyFlippedByteOfEventsIsDetected) {
  TraceWriter writer = TraceWriter::open(at("a.trace"), {}).value();
  write_live(writer);
  ASSERT_TRUE(writer.finish().ok());
  const std::string whole = bytes_of(at("a.trace"));
  const std::string order = order_of(read_trace(at("a.trace")).value());
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string bytes = whole;
    bytes[i] = static_cast<char>(static_cast<unsigned char>(bytes[i]) ^ 0x80U);
    const Result<Trace> result = parsed(bytes);
    if (!result) continue;
    ASSERT_FALSE(result->complete) << "byte " << i;
    ASSERT_TRUE(order.starts_with(order_of(*result))) << "byte " << i;
  }
}

TEST_F(TraceFile, AWriterThatIsKilledLeavesWhatItHadWritten) {
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    TraceWriter writer = TraceWriter::open(at("a.trace"), some_metadata(), {.records_per_frame = 100}).value();
    write_live(writer);
    ::kill(::getpid(), SIGKILL);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  const Trace trace = read_trace(at("a.trace")).value();
  EXPECT_FALSE(trace.complete);
  EXPECT_EQ(trace.lost_bytes, 0U);
  EXPECT_EQ(to_json(trace.metadata), to_json(some_metadata()));
  EXPECT_EQ(order_of(trace), "key3 0 1 edit=zoom key0 note= 2 lost=3 ");
}

TEST_F(TraceFile, EachBadFileHasItsError) {
  const auto code_of = [&](const std::string& path) {
    const Result<Trace> result = read_trace(path);
    EXPECT_FALSE(result.ok()) << path;
    if (result) return ErrorCode::mismatch;
    EXPECT_EQ(result.error().file, path);
    return result.error().code;
  };
  EXPECT_EQ(code_of(at("missing.trace")), ErrorCode::file_missing);
  EXPECT_EQ(code_of(folder_.string()), ErrorCode::file_unsupported);
  put(at("empty.trace"), "");
  EXPECT_EQ(code_of(at("empty.trace")), ErrorCode::file_empty);
  put(at("other.trace"), "solid bunny\nfacet normal 0 0 1\n");
  EXPECT_EQ(code_of(at("other.trace")), ErrorCode::file_malformed);
  std::string newer = trace_bytes(at("a.trace"), 1, 1, true);
  newer[8] = 3;
  put(at("newer.trace"), newer);
  EXPECT_EQ(code_of(at("newer.trace")), ErrorCode::file_unsupported);
  EXPECT_NE(read_trace(at("newer.trace")).error().message().find("version 3"), std::string::npos);
  std::string swapped = trace_bytes(at("a.trace"), 1, 1, true);
  std::swap(swapped[12], swapped[15]);
  std::swap(swapped[13], swapped[14]);
  put(at("swapped.trace"), swapped);
  EXPECT_EQ(code_of(at("swapped.trace")), ErrorCode::file_unsupported);
}

TEST_F(TraceFile, EachUnwritablePlaceHasItsError) {
  const auto refused = [&](const std::string& path) {
    const auto writer = TraceWriter::open(path, {});
    EXPECT_FALSE(writer.ok()) << path;
    return !writer.ok() && writer.error().code == ErrorCode::file_unwritable && writer.error().file == path;
  };
  EXPECT_TRUE(refused(at("no/such/folder/a.trace")));
  EXPECT_TRUE(refused(folder_.string()));
  EXPECT_TRUE(refused(""));
  EXPECT_TRUE(refused("/proc/asperity.trace"));
  EXPECT_EQ(TraceWriter::open(at("a.trace"), {}, {.records_per_frame = 0}).error().place, "records_per_frame");
  EXPECT_FALSE(fs::exists(at("a.trace")));
}

TEST_F(TraceFile, FullDiskIsAnError) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  EXPECT_EQ(TraceWriter::open("/dev/full", {}).error().code, ErrorCode::file_unwritable);
}

TEST_F(TraceFile, DiskThatFillsUpFailsAndLeavesWhatWasWritten) {
  TraceWriter writer = TraceWriter::open(at("a.trace"), {}, {.records_per_frame = 1}).value();
  struct rlimit before {};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  struct rlimit small = before;
  small.rlim_cur = 2000;
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  std::uint64_t written = 0;
  while (written < 100 && writer.append(record_of(written)).ok()) ++written;
  const Status again = writer.append(record_of(0));
  const Status finished = writer.finish();
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, old_handler);
  EXPECT_EQ(again.error().code, ErrorCode::file_unwritable);
  EXPECT_EQ(finished.error().code, ErrorCode::file_unwritable);
  const Trace trace = read_trace(at("a.trace")).value();
  EXPECT_EQ(trace.records.size(), written);
  EXPECT_GT(written, 2U);
  EXPECT_FALSE(trace.complete);
}

TEST_F(TraceFile, IsRecognisedByItsBeginning) {
  trace_bytes(at("a.trace"), 1, 1, true);
  put(at("b.csv"), "time,x,y,z\n");
  EXPECT_TRUE(is_trace_file(at("a.trace")));
  EXPECT_FALSE(is_trace_file(at("b.csv")));
  EXPECT_FALSE(is_trace_file(at("missing")));
  EXPECT_FALSE(is_trace_file(folder_.string()));
}

TEST(ForceHashTest, MatchesTheDefinitionOfFnv1a) {
  EXPECT_EQ(hash_text(""), 0xcbf29ce484222325ULL);
  EXPECT_EQ(hash_text("a"), 0xaf63dc4c8601ec8cULL);
  EXPECT_EQ(hash_text("foobar"), 0x85944171f73967e8ULL);
  EXPECT_EQ(format_hash(0x1fULL), "000000000000001f");
}

TEST(ForceHashTest, SeesEveryBitOfTheForcesAndNothingElse) {
  const std::vector<TraceRecord> base = records_of(3);
  const std::uint64_t hash = force_hash(base);
  std::vector<TraceRecord> changed = base;
  changed[1].update_seconds = 9.0;
  changed[1].hand.x() = 9.0;
  EXPECT_EQ(force_hash(changed), hash);
  for (int i = 0; i < 3; ++i) {
    changed = base;
    changed[1].commanded[i] = std::nextafter(changed[1].commanded[i], infinity);
    EXPECT_NE(force_hash(changed), hash);
    changed = base;
    changed[2].rendered.wrench.force[i] = std::nextafter(changed[2].rendered.wrench.force[i], infinity);
    EXPECT_NE(force_hash(changed), hash);
  }
  std::vector<TraceRecord> zero(1);
  std::vector<TraceRecord> minus(1);
  minus[0].commanded.x() = -0.0;
  EXPECT_NE(force_hash(zero), force_hash(minus));
}

/// CRC-32 by long division, a bit at a time: an oracle for the reader's table.
std::string checksum(const std::string& bytes) {
  std::uint32_t value = 0xFFFFFFFFU;
  for (const char c : bytes) {
    value ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) value = (value & 1U) != 0 ? (value >> 1U) ^ 0xEDB88320U : value >> 1U;
  }
  value = ~value;
  std::string text;
  for (unsigned shift = 0; shift < 32; shift += 8) text += static_cast<char>((value >> shift) & 0xFFU);
  return text;
}

/// The same bytes as a file of version 1.
std::string as_version_1(std::string bytes) {
  bytes[8] = 1;
  const std::size_t header = 24 + static_cast<unsigned char>(bytes[20]) + 256U * static_cast<unsigned char>(bytes[21]);
  return bytes.replace(header, 4, checksum(bytes.substr(0, header)));
}

TEST_F(TraceFile, FilesOfVersion1AreReadAndHaveNoEvents) {
  const Trace plain = parsed(as_version_1(trace_bytes(at("a.trace"), 5, 2, true))).value();
  EXPECT_TRUE(plain.complete);
  expect_bit_equal(plain.records, records_of(5));
  TraceWriter writer = TraceWriter::open(at("b.trace"), {}).value();
  ASSERT_TRUE(writer.append(record_of(0)).ok());
  ASSERT_TRUE(writer.event({1, "note", "no such thing then"}).ok());
  ASSERT_TRUE(writer.finish().ok());
  const Trace odd = parsed(as_version_1(bytes_of(at("b.trace")))).value();
  EXPECT_EQ(odd.records.size(), 1U);
  EXPECT_TRUE(odd.events.empty());
  EXPECT_NE(odd.damage.find("contradicts itself"), std::string::npos);
}

const std::string& small_trace() {
  static const std::string bytes = [] {
    const std::string path = (fs::temp_directory_path() / ("asperity-small-" + std::to_string(::getpid()))).string();
    std::string content = trace_bytes(path, 2, 1, true);
    fs::remove(path);
    return content;
  }();
  return bytes;
}

rc::Gen<std::string> any_bytes() {
  return rc::gen::map(rc::gen::container<std::vector<int>>(rc::gen::inRange(0, 256)),
                      [](const std::vector<int>& values) {
                        std::string bytes;
                        for (const int value : values) bytes += static_cast<char>(value);
                        return bytes;
                      });
}

RC_GTEST_PROP(TraceFileFuzz, RandomBytesAfterAGoodBeginningNeverCrash, ()) {
  const auto keep = *rc::gen::inRange<std::size_t>(0, small_trace().size());
  const Result<Trace> result = parsed(small_trace().substr(0, keep) + *any_bytes());
  if (!result.ok()) return;
  RC_ASSERT(result->records.size() <= 2U);
  RC_ASSERT(!result->complete);
}

RC_GTEST_PROP(TraceFileFuzz, NonsenseWithAGoodChecksumIsRefused, ()) {
  const std::size_t header = small_trace().size() - 2 * (12 + 4 + 340) - 28;
  const std::string payload = *any_bytes();
  RC_PRE(payload.size() < 256U);
  const int type = *rc::gen::inRange(0, 6);
  std::string frame{static_cast<char>(payload.size()), 0, 0, 0, static_cast<char>(type), 0, 0, 0};
  frame += payload;
  const Result<Trace> result = parsed(small_trace().substr(0, header) + frame + checksum(frame));
  RC_ASSERT(result.ok());
  RC_ASSERT(!result->complete);
  // The only sense there is in so few bytes: an empty frame of records, four zero bytes, an event whose kind fits in,
  // and a key frame of any state.
  const bool empty_frame = frame == std::string{4, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0};
  const bool event = type == 3 && payload.size() >= 12 && payload.substr(9, 3) == std::string(3, '\0') &&
                     static_cast<unsigned char>(payload[8]) <= payload.size() - 12;
  const bool key_frame = type == 4 && payload.size() >= 8;
  RC_ASSERT((result->lost_bytes == 0U) == (empty_frame || event || key_frame));
  RC_ASSERT(result->events.size() == (event ? 1U : 0U));
  RC_ASSERT(result->key_frames.size() == (key_frame ? 1U : 0U));
}

TEST(TraceFileFuzz, ChecksumIsTheUsualCrc32) {
  EXPECT_EQ(checksum("123456789"), std::string("\x26\x39\xF4\xCB"));
  const std::string& whole = small_trace();
  EXPECT_EQ(checksum(whole.substr(whole.size() - 28, 24)), whole.substr(whole.size() - 4));
}

}  // namespace
}  // namespace asperity::trace_file_test
