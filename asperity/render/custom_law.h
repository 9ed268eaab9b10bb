#pragma once
// A force law of one's own: a type with one function, which answers what a probe feels of a surface.

#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "asperity/core/named_numbers.h"
#include "asperity/core/units.h"
#include "asperity/render/felt.h"
#include "asperity/render/state.h"

namespace asperity {

struct LawForce;

/// What a law of one's own answers, object frame.
struct CustomForce {
  bool contact = false;              ///< false: nothing is felt, the rest is not read
  Vec3 force = Vec3::Zero();         ///< N
  Vec3 point = Vec3::Zero();         ///< felt place of the surface (m)
  Vec3 normal = Vec3::Zero();        ///< unit, the way that the surface pushes
  double penetration = 0.0;          ///< m
  double height = 0.0;               ///< relief height under the probe (m), where there is one
  std::uint32_t element = no_index;  ///< face, cell or patch
  /// The force has its damping already; otherwise the material's is added along the normal, and never pulls.
  bool damped = false;
  /// Of a force that has it: the part that resists the motion (N), which the hand never gets back.
  Vec3 damping = Vec3::Zero();
  /// The energy whose slope the rest is (J, 0 where it ends). Where it is not told, the force gives back what the hand
  /// has put into it, and no more: it is softened.
  std::optional<double> stored = std::nullopt;
  double stiffness = 0.0;  ///< N/m, the most by which the force changes with a motion; 0: the material's
};

/// The surface that a law touches, object frame, whatever kind it is. [servo]
class TouchedSurface {
 public:
  TouchedSurface(const Instance& instance, const FeltView& view) noexcept : instance_(&instance), view_(&view) {}
  /// Signed value and gradient: below 0 inside; a distance on meshes, and to first order elsewhere. [servo]
  [[nodiscard]] FieldSample eval(const Vec3& p) const noexcept;
  /// The nearest point within `bound` (m). [servo]
  [[nodiscard]] Foot nearest(const Vec3& p, double bound) const noexcept;
  [[nodiscard]] Sides sides() const noexcept { return sides_of(*instance_); }
  /// What it is, for laws of one kind of surface. [servo]
  [[nodiscard]] const Surface& surface() const noexcept { return instance_->surface; }

 private:
  const Instance* instance_;
  const FeltView* view_;
};

/// Largest size of what a law may remember, one for each probe and instance (bytes).
inline constexpr std::size_t custom_state_size = sizeof(CustomMemory::bytes);

/// What a type that is a law may remember: its State, or nothing.
template <class T>
struct CustomStateOf {
  struct type {};
};
/// The same where it has one.
template <class T>
requires requires {
  typename T::State;
}
struct CustomStateOf<T> {
  using type = typename T::State;
};

/// Whether a type answers forces from its State.
template <class T>
concept StatefulForceLaw = requires(const T& law, const TouchedSurface& surface, const Material& material,
                                    const Vec3& v, Seconds dt, typename CustomStateOf<T>::type& state) {
  { law.force(surface, material, v, v, dt, state) }
  noexcept->std::same_as<CustomForce>;
};
/// Whether it answers them without one.
template <class T>
concept PlainForceLaw = requires(const T& law, const TouchedSurface& surface, const Material& material, const Vec3& v,
                                 Seconds dt) {
  { law.force(surface, material, v, v, dt) }
  noexcept->std::same_as<CustomForce>;
};
/// Whether a type answers forces, with its State or without one:
///   CustomForce force(const TouchedSurface&, const Material&, const Vec3& probe, const Vec3& velocity, Seconds dt[,
///                     State&]) const noexcept
/// `probe` (m) and `velocity` (m/s) in the object frame, `material` as it is there, `dt` since the last call. It may
/// have, const: `bool fits(const Surface&)`, which surfaces it can be felt on (default: all), and `Status validate()`,
/// whether its numbers are right.
template <class T>
concept ForceLaw = StatefulForceLaw<T> || PlainForceLaw<T>;

/// A law that a program has added. Immutable; its state is in the contact's memory. A force that is not finite counts
/// as none.
class CustomLaw {
 public:
  /// Keeps `law` under a name. Errors: those of its validate(). [build]
  template <ForceLaw T>
  static Result<CustomLaw> build(T law, std::string name = "custom") {
    using State = typename CustomStateOf<T>::type;
    static_assert(std::is_trivially_copyable_v<State> && std::is_default_constructible_v<State>);
    static_assert(sizeof(State) <= custom_state_size, "a law may remember 64 bytes");
    if constexpr (requires { law.validate(); }) {
      if (Status valid = law.validate(); !valid) return std::move(valid).error();
    }
    CustomLaw made(std::move(name));
    made.law_ = std::make_shared<const T>(std::move(law));
    made.reset_ = [](std::byte* bytes) noexcept {
      const State state{};
      std::memcpy(bytes, &state, sizeof(State));
    };
    made.force_ = [](const void* own, const TouchedSurface& surface, const Material& material, const Vec3& probe,
                     const Vec3& velocity, Seconds dt, std::byte* bytes) noexcept {
      const T& self = *static_cast<const T*>(own);
      if constexpr (requires(State & s) { self.force(surface, material, probe, velocity, dt, s); }) {
        State state;
        std::memcpy(&state, bytes, sizeof(State));
        const CustomForce answer = self.force(surface, material, probe, velocity, dt, state);
        std::memcpy(bytes, &state, sizeof(State));
        return answer;
      } else {
        return self.force(surface, material, probe, velocity, dt);
      }
    };
    if constexpr (requires(const Surface& s) { law.fits(s); })
      made.fits_ = [](const void* own, const Surface& surface) {
        return bool(static_cast<const T*>(own)->fits(surface));
      };
    return made;
  }

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  /// The numbers that it was made from, as scene files have them. [any]
  [[nodiscard]] const NamedNumbers& numbers() const noexcept { return numbers_; }
  /// The same law, said to be made from these. [build]
  [[nodiscard]] CustomLaw made_from(NamedNumbers numbers) const {
    CustomLaw law = *this;
    law.numbers_ = std::move(numbers);
    return law;
  }
  [[nodiscard]] bool fits(const Surface& surface) const { return fits_ == nullptr || fits_(law_.get(), surface); }
  /// Asks it once; the contact keeps its state, which starts anew with another law. [servo]
  [[nodiscard]] LawForce force(const Instance& instance, const FeltView& view, const Material& material,
                               const Vec3& probe, const Vec3& velocity, Seconds dt, Contact& contact) const noexcept;

 private:
  explicit CustomLaw(std::string name);

  std::shared_ptr<const void> law_;
  void (*reset_)(std::byte* bytes) noexcept = nullptr;
  CustomForce (*force_)(const void* law, const TouchedSurface& surface, const Material& material, const Vec3& probe,
                        const Vec3& velocity, Seconds dt, std::byte* bytes) noexcept = nullptr;
  bool (*fits_)(const void* law, const Surface& surface) = nullptr;
  std::string name_;
  NamedNumbers numbers_;
  std::uint64_t identity_ = 0;
};

}  // namespace asperity
