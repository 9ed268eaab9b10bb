#pragma once
// What stands between the loop and a device, real or simulated.

#include <concepts>
#include <cstdint>
#include <utility>

#include "asperity/core/samples.h"

namespace asperity {

/// What a device has told last.
struct PortReading {
  ProbeSample probe;
  std::uint64_t beat = 0;      ///< the device's own count of what it told: while it stands still the device is silent
  std::uint64_t released = 0;  ///< how often the device let go of its force by itself, since nothing came
  bool finished = false;       ///< nothing more will come, and all is well (the end of a simulated stroke)
};

/// A device as the loop sees it. `read()` and `write()` never wait; every `write` tells the device that the loop is
/// alive: one that hears nothing for a few periods goes to zero by itself. `halt()` and `resume()` may be called from
/// any thread: from the first to the second the device puts out no force, whatever is written. [servo]
template <class P>
concept Port = requires(P& port, const Vec3& force) {
  { port.read() }
  noexcept->std::same_as<PortReading>;
  { port.write(force) }
  noexcept;
  { port.halt() }
  noexcept;
  { port.resume() }
  noexcept;
};

/// A port as a loop's device: what the device tells, held until it tells something new, and how long it has told
/// nothing. [servo]
template <Port P>
class PortDevice {
 public:
  /// `longest_silence`: s, above 0, after which the device counts as lost.
  PortDevice(P port, Seconds longest_silence) noexcept : port_(std::move(port)), longest_silence_(longest_silence) {}

  ProbeSample read() noexcept {
    const PortReading reading = port_.read();
    // The same once more, or an older one: nothing was told.
    if (reading.beat > last_.beat) silence_ = Seconds(0.0);
    if (reading.released != last_.released) has_released_ = true;
    if (reading.beat >= last_.beat) last_ = reading;
    return last_.probe;
  }
  void apply(const Vec3& force, Seconds dt) noexcept {
    port_.write(force);
    silence_ += dt;
  }
  [[nodiscard]] Vec3 aim() const noexcept { return last_.probe.pose.position; }
  [[nodiscard]] bool finished() const noexcept { return last_.finished; }

  /// Whether it has been silent for too long.
  [[nodiscard]] bool lost() const noexcept { return silence_ > longest_silence_ && !last_.finished; }
  /// Whether it has let go of its force since the last call.
  bool take_released() noexcept { return std::exchange(has_released_, false); }
  /// As the port's, from any thread.
  void halt() noexcept { port_.halt(); }
  void resume() noexcept { port_.resume(); }

 private:
  P port_;
  Seconds longest_silence_;
  PortReading last_;
  Seconds silence_{0.0};
  bool has_released_ = false;
};

}  // namespace asperity
