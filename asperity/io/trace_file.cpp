#include "asperity/io/trace_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <system_error>
#include <utility>

#include "asperity/io/detail/file_reading.h"

namespace asperity {
namespace {

using Bytes = std::vector<std::byte>;
using Json = nlohmann::json;

constexpr std::string_view magic = "ASPTRACE";
constexpr std::uint32_t trace_format_version = 2;
// The level of volumes shares four bytes with the flags: traces from before there were volumes have it 0.
constexpr unsigned level_shift = 24;
constexpr std::uint32_t byte_order_mark = 0x01020304U;
constexpr std::uint32_t frame_records = 1;
constexpr std::uint32_t frame_end = 2;
constexpr std::uint32_t frame_event = 3;
constexpr std::uint32_t frame_key = 4;
constexpr std::size_t header_fixed = 8 + 4 * 4;  // magic, version, byte order, record size, metadata length
constexpr std::size_t frame_overhead = 12;       // length, type, checksum
constexpr std::uint32_t max_metadata = 256U << 20U;
constexpr std::uint32_t max_event = 256U << 20U;
constexpr std::size_t max_records_per_frame = 65536;

constexpr std::uint64_t fnv_prime = 1099511628211ULL;

constexpr std::array<std::uint32_t, 256> crc_table = [] {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t value = i;
    for (int bit = 0; bit < 8; ++bit) value = (value >> 1U) ^ ((value & 1U) != 0 ? 0xEDB88320U : 0U);
    table[i] = value;
  }
  return table;
}();

/// CRC-32 as zlib and PNG have it.
std::uint32_t crc32(std::span<const std::byte> bytes) {
  std::uint32_t value = 0xFFFFFFFFU;
  for (const std::byte b : bytes)
    value = (value >> 8U) ^ crc_table[(value ^ std::to_integer<std::uint32_t>(b)) & 0xFFU];
  return ~value;
}

/// Appends integers and doubles, least significant byte first.
class Encoder {
 public:
  explicit Encoder(Bytes& bytes) : bytes_(bytes) {}
  void field(std::uint32_t value) { append(value, 4); }
  void field(std::uint64_t value) { append(value, 8); }
  void field(double value) { append(std::bit_cast<std::uint64_t>(value), 8); }
  void field(const Seconds& value) { field(value.count()); }
  void field(const Vec3& v) {
    for (int i = 0; i < 3; ++i) field(v[i]);
  }
  void field(const Quat& q) {
    for (const double number : {q.w(), q.x(), q.y(), q.z()}) field(number);
  }
  void status(const Flags& flags, const std::uint8_t& level) {
    field(flags.bits() | static_cast<std::uint32_t>(level) << level_shift);
  }

 private:
  void append(std::uint64_t value, int count) {
    for (int i = 0; i < count; ++i) bytes_.push_back(static_cast<std::byte>((value >> (8 * i)) & 0xFFU));
  }
  Bytes& bytes_;
};

/// Reads what Encoder wrote. The caller has checked that the bytes are there.
class Decoder {
 public:
  explicit Decoder(std::span<const std::byte> bytes) : bytes_(bytes) {}
  void field(std::uint32_t& value) { value = static_cast<std::uint32_t>(take(4)); }
  void field(std::uint64_t& value) { value = take(8); }
  void field(double& value) { value = std::bit_cast<double>(take(8)); }
  void field(Seconds& value) { value = Seconds(std::bit_cast<double>(take(8))); }
  void field(Vec3& v) {
    for (int i = 0; i < 3; ++i) field(v[i]);
  }
  void field(Quat& q) {
    for (double* number : {&q.w(), &q.x(), &q.y(), &q.z()}) field(*number);
  }
  void status(Flags& flags, std::uint8_t& level) {
    const auto bits = static_cast<std::uint32_t>(take(4));
    flags = Flags::from_bits(bits & ((1U << level_shift) - 1U));
    level = static_cast<std::uint8_t>(bits >> level_shift);
  }

 private:
  std::uint64_t take(std::size_t count) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < count; ++i) value |= std::to_integer<std::uint64_t>(bytes_[at_ + i]) << (8 * i);
    at_ += count;
    return value;
  }
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
};

/// The one place that lists a record's fields in their order in the file, for both directions.
template <class Coder, class Record>
void code_record(Coder& coder, Record& r) {
  coder.field(r.tick);
  coder.field(r.dt);
  coder.field(r.probe.pose.position);
  coder.field(r.probe.pose.orientation);
  coder.field(r.probe.twist.linear);
  coder.field(r.probe.twist.angular);
  coder.field(r.probe.buttons);
  coder.field(r.probe.time);
  coder.field(r.rendered.wrench.force);
  coder.field(r.rendered.wrench.torque);
  coder.field(r.rendered.proxy);
  coder.field(r.rendered.contact.count);
  coder.field(r.rendered.contact.instance);
  coder.field(r.rendered.contact.element);
  coder.field(r.rendered.contact.point);
  coder.field(r.rendered.contact.normal);
  coder.field(r.rendered.contact.penetration);
  coder.field(r.rendered.contact.height);
  coder.status(r.rendered.flags, r.rendered.level);
  coder.field(r.commanded);
  coder.field(r.hand);
  coder.field(r.update_seconds);
}

std::uint32_t record_bytes() {
  static const std::uint32_t size = [] {
    Bytes bytes;
    Encoder encoder(bytes);
    const TraceRecord record;
    code_record(encoder, record);
    return static_cast<std::uint32_t>(bytes.size());
  }();
  return size;
}

std::span<const std::byte> as_bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

Bytes encode_header(const std::string& metadata) {
  Bytes bytes;
  for (const std::byte b : as_bytes_of(magic)) bytes.push_back(b);
  Encoder encoder(bytes);
  encoder.field(trace_format_version);
  encoder.field(byte_order_mark);
  encoder.field(record_bytes());
  encoder.field(static_cast<std::uint32_t>(metadata.size()));
  const auto text = as_bytes_of(metadata);
  bytes.insert(bytes.end(), text.begin(), text.end());
  encoder.field(crc32(bytes));
  return bytes;
}

/// Starts a frame in `bytes`; its length is filled in by `close_frame`.
void open_frame(Bytes& bytes, std::uint32_t type) {
  bytes.clear();
  Encoder encoder(bytes);
  encoder.field(std::uint32_t{0});
  encoder.field(type);
}

void patch(Bytes& bytes, std::size_t at, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<std::byte>((value >> (8U * i)) & 0xFFU);
}

void close_frame(Bytes& bytes) {
  patch(bytes, 0, static_cast<std::uint32_t>(bytes.size() - 8));
  Encoder(bytes).field(crc32(bytes));
}

std::string system_reason(int code) {
  return std::generic_category().message(code);
}

Error unwritable(const std::string& path, const std::string& reason) {
  return refused_file(ErrorCode::file_unwritable, fmt::format("cannot be written ({})", reason), path,
                      "a file in a folder that exists and may be written");
}

/// Takes away a file that could not even get its header; a device or a pipe stays.
void remove_regular_file(const std::string& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) == 0 && S_ISREG(info.st_mode)) ::unlink(path.c_str());
}

Result<TraceMetadata> parse_metadata(std::string_view text) {
  const Json json = Json::parse(text.begin(), text.end(), nullptr, false);
  if (!json.is_object()) {
    return refused(ErrorCode::file_malformed, "metadata is no JSON object", fmt::format("byte {}", header_fixed));
  }
  const auto string_at = [&](const char* key) {
    const auto it = json.find(key);
    return it != json.end() && it->is_string() ? it->get<std::string>() : std::string();
  };
  TraceMetadata metadata;
  metadata.scene = string_at("scene");
  metadata.source = string_at("source");
  metadata.command = string_at("command");
  metadata.device = string_at("device");
  metadata.program = string_at("program");
  if (const auto it = json.find("rate"); it != json.end() && it->is_number()) metadata.rate = it->get<double>();
  if (const auto it = json.find("seed"); it != json.end() && it->is_number_unsigned())
    metadata.seed = it->get<std::uint64_t>();
  if (const auto it = json.find("extra"); it != json.end() && it->is_object()) {
    for (const auto& [key, value] : it->items()) {
      if (value.is_string()) metadata.extra[key] = value.get<std::string>();
    }
  }
  return metadata;
}

std::uint64_t hash_more(std::uint64_t hash, double value) noexcept {
  const auto bits = std::bit_cast<std::uint64_t>(value);
  for (unsigned shift = 0; shift < 64; shift += 8) hash = (hash ^ ((bits >> shift) & 0xFFU)) * fnv_prime;
  return hash;
}

}  // namespace

std::uint64_t hash_bytes(std::span<const std::byte> bytes) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const std::byte b : bytes) hash = (hash ^ std::to_integer<std::uint64_t>(b)) * fnv_prime;
  return hash;
}

std::uint64_t hash_text(std::string_view text) {
  return hash_bytes(as_bytes_of(text));
}

void ForceHash::add(const TraceRecord& record) noexcept {
  for (const Vec3* v : {&record.rendered.wrench.force, &record.rendered.wrench.torque, &record.commanded}) {
    for (int i = 0; i < 3; ++i) value_ = hash_more(value_, (*v)[i]);
  }
}

std::uint64_t force_hash(std::span<const TraceRecord> records) {
  ForceHash hash;
  for (const TraceRecord& record : records) hash.add(record);
  return hash.value();
}

std::string format_hash(std::uint64_t hash) {
  return fmt::format("{:016x}", hash);
}

std::string to_json(const TraceMetadata& metadata) {
  const Json json{{"scene", metadata.scene},   {"scene_hash", format_hash(metadata.scene_hash())},
                  {"source", metadata.source}, {"command", metadata.command},
                  {"device", metadata.device}, {"program", metadata.program},
                  {"rate", metadata.rate},     {"seed", metadata.seed},
                  {"extra", metadata.extra}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

// ---------------------------------------------------------------------------------------------------------- writing

struct TraceWriter::State {
  std::string path;
  int descriptor = -1;
  bool sync = false;
  std::size_t per_frame = 0;
  Bytes frame;                  // the frame being filled
  std::uint32_t pending = 0;    // records in it
  std::uint64_t written = 0;    // records appended in all
  std::uint64_t last_tick = 0;  // of the last of them
  ForceHash hash;
  std::optional<Error> failure;  // after it nothing more is written: the file ends in a cut frame, as after a crash

  ~State() { close(); }
  void close() {
    if (descriptor >= 0) ::close(std::exchange(descriptor, -1));
  }
  void start_frame() {
    open_frame(frame, frame_records);
    Encoder(frame).field(std::uint32_t{0});
    pending = 0;
  }
  Status fail(int code) {
    failure = unwritable(path, system_reason(code));
    close();
    return *failure;
  }
  Status write(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
      const ssize_t count = ::write(descriptor, bytes.data(), bytes.size());
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) return fail(count < 0 ? errno : EIO);
      bytes = bytes.subspan(static_cast<std::size_t>(count));
    }
    // A pipe has nothing to sync; that is no failure.
    if (sync && ::fdatasync(descriptor) != 0 && errno != EINVAL && errno != EROFS) return fail(errno);
    return success();
  }
  /// Why nothing can be written now.
  [[nodiscard]] Error refusal() const {
    return failure.value_or(refused_file(ErrorCode::bad_value, "the trace is finished already", path));
  }
  Status flush() {
    if (pending == 0) return success();
    patch(frame, 8, pending);
    close_frame(frame);
    ASPERITY_CHECK(write(frame));
    start_frame();
    return success();
  }
  /// A frame of its own behind what is pending.
  Status write_between(std::uint32_t type, std::uint64_t tick, std::string_view kind, std::span<const std::byte> body) {
    if (descriptor < 0) return refusal();
    if (kind.size() > max_event || body.size() > max_event - kind.size()) {
      return refused_file(ErrorCode::too_large, fmt::format("an event or key frame has {} bytes", body.size()), path,
                          "256 MiB at most");
    }
    if (written > 0 && tick <= last_tick) {
      return bad_value(fmt::format("is {}, and tick {} has been written", tick, last_tick), "tick",
                       "a tick that is yet to come");
    }
    ASPERITY_CHECK(flush());
    Bytes bytes;
    open_frame(bytes, type);
    Encoder encoder(bytes);
    encoder.field(tick);
    if (type == frame_event) {
      encoder.field(static_cast<std::uint32_t>(kind.size()));
      const auto name = as_bytes_of(kind);
      bytes.insert(bytes.end(), name.begin(), name.end());
    }
    bytes.insert(bytes.end(), body.begin(), body.end());
    close_frame(bytes);
    return write(bytes);
  }
};

TraceWriter::TraceWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
TraceWriter::TraceWriter(TraceWriter&&) noexcept = default;

TraceWriter& TraceWriter::operator=(TraceWriter&& other) noexcept {
  TraceWriter moved(std::move(other));
  std::swap(state_, moved.state_);
  return *this;
}

TraceWriter::~TraceWriter() {
  // Best effort: a caller who wants to know calls flush() or finish().
  if (state_ && state_->descriptor >= 0) static_cast<void>(state_->flush().ok());
}

Result<TraceWriter> TraceWriter::open(const std::string& path, const TraceMetadata& metadata,
                                      const TraceWriterSettings& settings) {
  if (settings.records_per_frame < 1 || settings.records_per_frame > max_records_per_frame) {
    return bad_value(fmt::format("is {}", settings.records_per_frame), "records_per_frame",
                     fmt::format("1 to {}", max_records_per_frame));
  }
  const std::string text = to_json(metadata);
  if (text.size() > max_metadata) {
    return refused_file(ErrorCode::too_large, fmt::format("metadata has {} bytes", text.size()), path,
                        "256 MiB at most");
  }
  auto state = std::make_unique<State>();
  state->path = path;
  state->descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOCTTY, 0666);
  if (state->descriptor < 0) return unwritable(path, system_reason(errno));
  state->sync = settings.sync_each_frame;
  state->per_frame = settings.records_per_frame;
  state->frame.reserve(frame_overhead + 4 + settings.records_per_frame * record_bytes());
  state->start_frame();
  if (Status status = state->write(encode_header(text)); !status) {
    remove_regular_file(path);
    return std::move(status).error();
  }
  return TraceWriter(std::move(state));
}

Status TraceWriter::append(const TraceRecord& record) {
  if (state_->descriptor < 0) return state_->refusal();
  Encoder encoder(state_->frame);
  code_record(encoder, record);
  state_->hash.add(record);
  ++state_->pending;
  ++state_->written;
  state_->last_tick = record.tick;
  return state_->pending == state_->per_frame ? state_->flush() : success();
}

Status TraceWriter::event(const TraceEvent& event) {
  return state_->write_between(frame_event, event.tick, event.kind, as_bytes_of(event.text));
}

Status TraceWriter::key_frame(const TraceKeyFrame& key_frame) {
  return state_->write_between(frame_key, key_frame.tick, {}, key_frame.state);
}

Status TraceWriter::flush() {
  if (state_->failure) return *state_->failure;
  return state_->descriptor >= 0 ? state_->flush() : success();
}

Status TraceWriter::finish() {
  if (state_->failure) return *state_->failure;
  if (state_->descriptor < 0) return success();
  ASPERITY_CHECK(state_->flush());
  open_frame(state_->frame, frame_end);
  Encoder encoder(state_->frame);
  encoder.field(state_->written);
  encoder.field(state_->hash.value());
  close_frame(state_->frame);
  ASPERITY_CHECK(state_->write(state_->frame));
  // Some file systems report a full disk only when the file is closed.
  const int descriptor = std::exchange(state_->descriptor, -1);
  if (::close(descriptor) != 0 && errno != EINTR) return unwritable(state_->path, system_reason(errno));
  return success();
}

std::uint64_t TraceWriter::records() const noexcept {
  return state_->written;
}
std::uint64_t TraceWriter::hash() const noexcept {
  return state_->hash.value();
}

Status write_trace(const std::string& path, const TraceMetadata& metadata, std::span<const TraceRecord> records) {
  ASPERITY_TRY(TraceWriter writer, TraceWriter::open(path, metadata));
  for (const TraceRecord& record : records) ASPERITY_CHECK(writer.append(record));
  return writer.finish();
}

// ---------------------------------------------------------------------------------------------------------- reading

namespace {

/// Closes a file descriptor when it goes out of scope.
struct Descriptor {
  int value = -1;
  ~Descriptor() {
    if (value >= 0) ::close(value);
  }
};

/// Up to `limit` bytes of a regular file.
Result<Bytes> read_bytes(const std::string& path, std::size_t limit) {
  const Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
  const auto unreadable = [&] {
    return refused_file(ErrorCode::file_missing, fmt::format("cannot be read ({})", system_reason(errno)), path);
  };
  struct stat info {};
  if (file.value < 0 || ::fstat(file.value, &info) != 0) return unreadable();
  if (!S_ISREG(info.st_mode)) {
    return refused_file(ErrorCode::file_unsupported, S_ISDIR(info.st_mode) ? "is a folder" : "is no regular file", path,
                        "a trace file");
  }
  Bytes bytes(std::min(limit, static_cast<std::size_t>(info.st_size)));
  std::size_t have = 0;
  while (have < bytes.size()) {
    const ssize_t count = ::read(file.value, bytes.data() + have, bytes.size() - have);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return unreadable();
    if (count == 0) break;
    have += static_cast<std::size_t>(count);
  }
  bytes.resize(have);
  return bytes;
}

bool begins_like_a_trace(std::span<const std::byte> bytes) {
  const std::size_t count = std::min(bytes.size(), magic.size());
  return std::memcmp(bytes.data(), magic.data(), count) == 0;
}

Error truncated_header(std::size_t size, std::size_t needed) {
  return refused(ErrorCode::file_truncated, fmt::format("ends inside its header, after {} of {} bytes", size, needed),
                 fmt::format("byte {}", size));
}

template <class Number>
Number number_at(std::span<const std::byte> bytes, std::size_t at) {
  Number value = 0;
  Decoder(bytes.subspan(at, sizeof(Number))).field(value);
  return value;
}

/// Checks the fixed part of the header; gives the length of the whole header.
Result<std::size_t> check_header(std::span<const std::byte> bytes) {
  const auto refuse = [](ErrorCode code, std::string what, std::size_t at, std::string accepted) {
    return refused(code, std::move(what), fmt::format("byte {}", at), std::move(accepted));
  };
  if (bytes.empty()) return refused(ErrorCode::file_empty, "is empty", {}, "a trace file");
  if (!begins_like_a_trace(bytes)) {
    return refuse(ErrorCode::file_malformed, "is no trace", 0,
                  "a file written by asperity, which begins with ASPTRACE");
  }
  if (bytes.size() < header_fixed) return truncated_header(bytes.size(), header_fixed);
  if (number_at<std::uint32_t>(bytes, 12) != byte_order_mark) {
    return refuse(ErrorCode::file_unsupported, "has another byte order, or its header is damaged", 12, "little-endian");
  }
  if (const std::uint32_t version = number_at<std::uint32_t>(bytes, 8); version < 1 || version > trace_format_version) {
    return refuse(ErrorCode::file_unsupported,
                  fmt::format("has version {} of the trace format, or its header is damaged", version), 8,
                  fmt::format("versions 1 to {}", trace_format_version));
  }
  const std::uint32_t length = number_at<std::uint32_t>(bytes, 20);
  if (length > max_metadata) {
    return refuse(ErrorCode::file_malformed, fmt::format("header is damaged: metadata of {} bytes", length), 20, {});
  }
  const std::size_t total = header_fixed + length + 4;
  if (bytes.size() < total) return truncated_header(bytes.size(), total);
  if (crc32(bytes.first(total - 4)) != number_at<std::uint32_t>(bytes, total - 4)) {
    return refuse(ErrorCode::file_malformed, "header is damaged: its checksum does not match", total - 4, {});
  }
  if (const std::uint32_t size = number_at<std::uint32_t>(bytes, 16); size != record_bytes()) {
    return refuse(ErrorCode::file_unsupported, fmt::format("has records of {} bytes", size), 16,
                  fmt::format("records of {} bytes", record_bytes()));
  }
  return total;
}

/// Reads frames one after the other into a Trace, up to the first that is not good.
class FrameReader {
 public:
  FrameReader(std::span<const std::byte> bytes, Trace& trace) : bytes_(bytes), trace_(trace) {}

  void read(std::size_t at) {
    while (at < bytes_.size() && !trace_.complete) {
      const std::optional<std::size_t> next = frame(at);
      if (!next) {
        trace_.lost_bytes = bytes_.size() - at;
        return;
      }
      at = *next;
    }
    trace_.lost_bytes = bytes_.size() - at;
    if (!trace_.complete) {
      trace_.damage = "ends without an end frame: the session was cut short";
    } else if (trace_.lost_bytes > 0) {
      trace_.damage = fmt::format("has {} bytes after its end frame, at byte {}", trace_.lost_bytes, at);
    }
  }

 private:
  std::optional<std::size_t> stop(std::string damage) {
    trace_.damage = std::move(damage);
    return std::nullopt;
  }

  std::optional<std::size_t> frame(std::size_t at) {
    const std::size_t left = bytes_.size() - at;
    if (left < frame_overhead) return stop(fmt::format("is cut inside the frame at byte {}", at));
    const std::size_t length = number_at<std::uint32_t>(bytes_, at);
    if (length > left - frame_overhead) return stop(fmt::format("is cut or damaged in the frame at byte {}", at));
    const auto content = bytes_.subspan(at, 8 + length);
    if (crc32(content) != number_at<std::uint32_t>(bytes_, at + 8 + length)) {
      return stop(fmt::format("is damaged in the frame at byte {}: its checksum does not match", at));
    }
    const std::uint32_t type = number_at<std::uint32_t>(bytes_, at + 4);
    const auto payload = content.subspan(8);
    if (!content_of(type, payload)) return stop(fmt::format("has a frame at byte {} that contradicts itself", at));
    return at + frame_overhead + length;
  }

  bool content_of(std::uint32_t type, std::span<const std::byte> payload) {
    const bool has_events = number_at<std::uint32_t>(bytes_, 8) > 1;
    switch (type) {
      case frame_records: return records(payload);
      case frame_end: return end(payload);
      case frame_event: return has_events && event(payload);
      case frame_key: return has_events && key_frame(payload);
      default: return false;
    }
  }

  /// What lies between two ticks belongs before the later one.
  bool follows_records(std::uint64_t tick) const { return trace_.records.empty() || tick > trace_.records.back().tick; }

  bool event(std::span<const std::byte> payload) {
    constexpr std::size_t fixed = 12;
    if (payload.size() < fixed) return false;
    const std::size_t kind = number_at<std::uint32_t>(payload, 8);
    const auto tick = number_at<std::uint64_t>(payload, 0);
    if (kind > payload.size() - fixed || !follows_records(tick)) return false;
    const auto text = [](std::span<const std::byte> bytes) {
      std::string copy(bytes.size(), '\0');
      std::transform(bytes.begin(), bytes.end(), copy.begin(), [](std::byte b) { return static_cast<char>(b); });
      return copy;
    };
    trace_.events.push_back({tick, text(payload.subspan(fixed, kind)), text(payload.subspan(fixed + kind))});
    return true;
  }

  bool key_frame(std::span<const std::byte> payload) {
    if (payload.size() < 8) return false;
    const auto tick = number_at<std::uint64_t>(payload, 0);
    const auto state = payload.subspan(8);
    if (!follows_records(tick)) return false;
    trace_.key_frames.push_back({tick, {state.begin(), state.end()}, trace_.events.size()});
    return true;
  }

  bool records(std::span<const std::byte> payload) {
    const std::size_t size = record_bytes();
    if (payload.size() < 4) return false;
    const std::size_t count = number_at<std::uint32_t>(payload, 0);
    if (payload.size() != 4 + count * size) return false;
    for (std::size_t i = 0; i < count; ++i) {
      Decoder decoder(payload.subspan(4 + i * size, size));
      TraceRecord record;
      code_record(decoder, record);
      trace_.records.push_back(record);
      hash_.add(record);
    }
    return true;
  }

  bool end(std::span<const std::byte> payload) {
    if (payload.size() != 16) return false;
    trace_.complete = number_at<std::uint64_t>(payload, 0) == trace_.records.size() &&
                      number_at<std::uint64_t>(payload, 8) == hash_.value();
    return trace_.complete;
  }

  std::span<const std::byte> bytes_;
  Trace& trace_;
  ForceHash hash_;
};

}  // namespace

Result<Trace> parse_trace(std::span<const std::byte> bytes) {
  ASPERITY_TRY(const std::size_t header, check_header(bytes));
  std::string text(header - header_fixed - 4, '\0');
  std::memcpy(text.data(), bytes.data() + header_fixed, text.size());
  Trace trace;
  ASPERITY_TRY(trace.metadata, parse_metadata(text));
  FrameReader(bytes, trace).read(header);
  return trace;
}

Result<Trace> read_trace(const std::string& path) {
  ASPERITY_TRY(const Bytes bytes, read_bytes(path, static_cast<std::size_t>(-1)));
  return in_file(parse_trace(bytes), path);
}

bool is_trace_file(const std::string& path) {
  const Result<Bytes> bytes = read_bytes(path, magic.size());
  return bytes && bytes->size() == magic.size() && begins_like_a_trace(*bytes);
}

}  // namespace asperity
