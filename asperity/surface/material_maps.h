#pragma once
// Properties of a surface that vary over it, as maps on its coat (hrm-2010, section 4: "additional entries").

#include <array>
#include <cstddef>
#include <memory>

#include "asperity/core/math.h"
#include "asperity/core/result.h"
#include "asperity/field/height/map.h"

namespace asperity {

/// What a map gives.
enum class MaterialChannel : std::size_t {
  stiffness,   ///< N/m
  damping,     ///< N s/m, along the normal
  viscosity,   ///< N s/m, against any motion while in touch
  friction,    ///< factor of both coefficients
  magnetism,   ///< N/m: how steeply the surface draws the probe (Material::magnetism)
  stickiness,  ///< N: how hard it holds the probe back
};
/// As in scene files.
template <>
struct Names<MaterialChannel> {
  static constexpr auto table = std::to_array<Named<MaterialChannel>>({{MaterialChannel::stiffness, "stiffness"},
                                                                       {MaterialChannel::damping, "damping"},
                                                                       {MaterialChannel::viscosity, "viscosity"},
                                                                       {MaterialChannel::friction, "friction"},
                                                                       {MaterialChannel::magnetism, "magnetism"},
                                                                       {MaterialChannel::stickiness, "stickiness"}});
};
inline constexpr std::size_t mapped_channels = 6;

/// What the maps say at one place.
struct LocalMaterial {
  LocalMaterial() noexcept { slope.fill(Vec2::Zero()); }
  std::array<double, mapped_channels> value{};  ///< by channel; means something where there is a map
  std::array<Vec2, mapped_channels> slope{};    ///< d value / d(s, t); of a coat: / d(u, v) of the triangle
  Vec2 lay = Vec2::Zero();    ///< direction of least friction in (s, t), of a coat in (u, v); zero: none
  double lay_strength = 0.0;  ///< 0: friction is alike in all directions, 1: none along the lay
};

/// Maps by channel, in the coat's texture coordinates. Immutable; any number of threads may read it.
class MaterialMaps {
 public:
  /// What goes into them; nullptr: no map.
  struct Parts {
    std::array<std::shared_ptr<const HeightMap>, mapped_channels> channels;
    std::shared_ptr<const HeightMap> lay_s;  ///< directed friction: components along s and t, -1 to 1; both or none
    std::shared_ptr<const HeightMap> lay_t;
  };
  /// Errors: bad_value (a value below 0, a stiffness of 0, a component of the lay beyond 1) naming the channel,
  /// mismatch (one component of the lay alone). [build]
  static Result<MaterialMaps> build(Parts parts);

  [[nodiscard]] bool has(MaterialChannel channel) const noexcept {
    return parts_.channels[static_cast<std::size_t>(channel)] != nullptr;
  }
  [[nodiscard]] bool has_lay() const noexcept { return parts_.lay_s != nullptr; }
  /// Greatest value of a channel that has a map. [any]
  [[nodiscard]] double most(MaterialChannel channel) const noexcept {
    return parts_.channels[static_cast<std::size_t>(channel)]->highest();
  }
  /// [servo]
  [[nodiscard]] LocalMaterial sample(const Vec2& st) const noexcept;
  [[nodiscard]] std::size_t memory_bytes() const noexcept;

 private:
  MaterialMaps() = default;
  Parts parts_;
};

}  // namespace asperity
