#pragma once
// Traces: every tick of a session, in a file that survives a crash.
//
// The file is only ever appended to. Little-endian, no padding:
//   header  "ASPTRACE", version u32, byte-order mark u32 (0x01020304), bytes per record u32, metadata length u32,
//           metadata (JSON, UTF-8), CRC-32 u32 of all of the header before it
//   frame   payload length u32, type u32, payload, CRC-32 u32 of length, type and payload
//     type 1  record count u32, records
//     type 2  end: record count u64, force hash u64; a finished file has it, a file cut by a crash has not
//     type 3  event: tick u64, length of its kind u32, kind, text (UTF-8)
//     type 4  key frame: tick u64, state
// Version 1 has no types 3 and 4. The order of frames is the order in time.
// One record is the fields of TraceRecord in the order of its declaration, f64, u64 or u32 each; quaternions w, x, y,
// z. All bits are kept: -0, denormals and NaN with their payload.

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "asperity/core/result.h"
#include "asperity/core/trace_record.h"

namespace asperity {

/// Hash of a text or any bytes (FNV-1a, 64 bits): equal bytes, equal hash, on every machine. [any]
std::uint64_t hash_bytes(std::span<const std::byte> bytes);
std::uint64_t hash_text(std::string_view text);

/// Running FNV-1a hash over the bit patterns of every tick's rendered force and torque and commanded force: two runs
/// are bit-equal in what the hand felt when it is equal. -0 and 0 differ. Does not allocate. [servo]
class ForceHash {
 public:
  void add(const TraceRecord& record) noexcept;
  [[nodiscard]] std::uint64_t value() const noexcept { return value_; }

 private:
  std::uint64_t value_ = 14695981039346656037ULL;
};

/// ForceHash over all of `records`. [any]
std::uint64_t force_hash(std::span<const TraceRecord> records);
/// Sixteen hexadecimal digits, as reports and JSON show it.
std::string format_hash(std::uint64_t hash);

/// What a trace is a trace of. Texts may be empty where they do not apply.
struct TraceMetadata {
  std::string scene;    ///< the scene's JSON text, complete, so that a trace can be replayed alone
  std::string source;   ///< path of the scene or mesh as the user gave it
  std::string command;  ///< the command line
  std::string device;   ///< profile name
  std::string program;  ///< name and version of the program that wrote it
  double rate = 0.0;    ///< ticks a second (Hz)
  std::uint64_t seed = 0;
  std::map<std::string, std::string> extra;  ///< anything else, for people

  [[nodiscard]] std::uint64_t scene_hash() const { return hash_text(scene); }
};

/// Metadata as the JSON text that stands in the file. Text that is not UTF-8 is kept readable by replacing bad bytes.
/// [any]
std::string to_json(const TraceMetadata& metadata);

/// What happened before tick `tick` was rendered, beside the probe. Kinds and their texts:
///   "scene"        another scene from here on: its canonical JSON
///   "edit"         one change of the scene that shares all else: JSON of a SceneEdit
///   "raise"        a fault that the loop has seen: its name
///   "acknowledge"  of that
///   "released"     the device has let go of the force by itself: the safety stage's last one counts as zero
///   "stopping"     from here on the safety stage withholds the force: what ServoThread's last ticks are
///   "lost"         a gap before this tick: how many ticks the recorder could not keep
///   "note"         for people
struct TraceEvent {
  std::uint64_t tick = 0;
  std::string kind;
  std::string text;
};

/// The state as it was before tick `tick` was rendered, what happened before it in the file included: from here on a
/// trace can be replayed (live_trace.h).
struct TraceKeyFrame {
  std::uint64_t tick = 0;
  std::vector<std::byte> state;
  std::size_t events_before = 0;  ///< of the trace's events, in the file; filled by reading
};

/// How often a trace reaches the file.
struct TraceWriterSettings {
  std::size_t records_per_frame = 256;  ///< a crash loses at most this many ticks; 1 to 65536
  bool sync_each_frame = false;  ///< true: each frame is on the disk before `append` returns (power loss); slower
};

/// Writes a trace, frame by frame. Not for the servo thread: `append` may write to the disk. After a failed write every
/// call returns that failure; the file then ends in a cut frame, as after a crash. A writer that was moved from may
/// only be destroyed or assigned to. [main]
class TraceWriter {
 public:
  /// Creates the file, or empties it if it exists, and writes the header. Errors: file_unwritable (no such folder, a
  /// folder itself, no permission, disk full), bad_value (records_per_frame). [main]
  static Result<TraceWriter> open(const std::string& path, const TraceMetadata& metadata,
                                  const TraceWriterSettings& settings = {});
  TraceWriter(TraceWriter&&) noexcept;
  TraceWriter& operator=(TraceWriter&&) noexcept;
  /// Writes what is pending, without an end frame: only finish() says that the session came to its end.
  ~TraceWriter();

  /// Adds a tick; a full frame is written out. Errors: file_unwritable (disk full); bad_value after finish().
  Status append(const TraceRecord& record);
  /// Writes what is pending, and the event behind it. Errors: file_unwritable; bad_value (after finish(), a tick
  /// that is written already); too_large (more than 256 MiB).
  Status event(const TraceEvent& event);
  /// Writes what is pending, and the key frame behind it. Errors: as event().
  Status key_frame(const TraceKeyFrame& key_frame);
  /// Writes what is pending as a frame now.
  Status flush();
  /// Writes what is pending and the end frame, and closes. Errors: file_unwritable.
  Status finish();

  [[nodiscard]] std::uint64_t records() const noexcept;
  [[nodiscard]] std::uint64_t hash() const noexcept;

 private:
  struct State;
  explicit TraceWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// A trace as it was read, and how whole it was.
struct Trace {
  TraceMetadata metadata;
  std::vector<TraceRecord> records;
  bool complete = false;         ///< the end frame was there and agrees
  std::uint64_t lost_bytes = 0;  ///< at the end of the file, behind the last good frame
  std::string damage;            ///< empty when complete; else one sentence saying what and at which byte
  std::vector<TraceEvent> events = {};
  std::vector<TraceKeyFrame> key_frames = {};
};

/// Reads a trace. Frames are taken up to the first one that is cut or damaged; what follows is counted in `lost_bytes`
/// and described in `damage` (later frames are not used: a replay needs ticks without a gap). Errors: file_missing,
/// file_empty, file_truncated (inside the header), file_malformed (not a trace, header damaged), file_unsupported
/// (newer version, other byte order or record layout). Versions 1 and 2 are read. [main]
Result<Trace> read_trace(const std::string& path);
/// The same from the bytes of a file; errors have no file name. [any]
Result<Trace> parse_trace(std::span<const std::byte> bytes);

/// True when the file begins like a trace; false also when it cannot be read. [main]
bool is_trace_file(const std::string& path);

/// Writes a whole trace at once, by the same writer. [main]
Status write_trace(const std::string& path, const TraceMetadata& metadata, std::span<const TraceRecord> records);

}  // namespace asperity
