#pragma once
// A surface of one's own: a type that answers value and gradient of a field is enough, the queries come with it.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "asperity/core/named_numbers.h"
#include "asperity/core/result.h"
#include "asperity/surface/surface.h"

namespace asperity {

/// The least that a surface of one's own has: `eval`, whose value is below 0 inside and above 0 outside, with its
/// gradient and no faster change than `lipschitz` per metre (1 where it says nothing: a distance), and `bounds`, the
/// box (m) that holds it. Where the field's zeros go on beyond the box, the surface ends with the box.
///
/// What it may say as well, each without an argument and const:
///   lipschitz  largest change of the value per metre; default 1
///   bend       largest change of the gradient per metre (1/m), outside alone where it is a solid: the field has no
///              edges there, and searches take longer steps
///   grain      smallest length over which the surface changes (m); default a hundredth of the box's diagonal
///   sides      Sides::front (default): a solid, touched from outside; Sides::both: a sheet
/// What it may do itself, const and noexcept, with SurfaceQuery's arguments: segment, contacts, closest.
template <class T>
concept ImplicitField = requires(const T& t, const Vec3& p) {
  { t.eval(p) }
  noexcept->std::same_as<FieldSample>;
  { t.bounds() } -> std::same_as<Box>;
};

/// What a field says of itself.
struct CustomFacts {
  Box bounds;              ///< m
  double lipschitz = 1.0;  ///< largest change of the value per metre
  double bend = infinity;  ///< largest change of the gradient per metre (1/m); infinity: it may have edges
  double grain = 0.0;      ///< m; 0: a hundredth of the box's diagonal
  Sides sides = Sides::front;
};

/// What a type does, without its name: one indirection a query. Empty entries are done by CustomSurface. [servo]
struct CustomQueries {
  FieldSample (*eval)(const void* field, const Vec3& p) noexcept = nullptr;
  SweptHit (*segment)(const void* field, const Segment& motion, double radius, Sides sides,
                      Hint& hint) noexcept = nullptr;
  void (*contacts)(const void* field, const Vec3& position, double radius, Sides sides, Hint& hint,
                   ContactSet& out) noexcept = nullptr;
  Foot (*closest)(const void* field, const Vec3& p, double bound, Hint& hint) noexcept = nullptr;
};

/// The entries for one type. [build]
template <ImplicitField T>
constexpr CustomQueries custom_queries() {
  CustomQueries queries;
  queries.eval = [](const void* field, const Vec3& p) noexcept { return static_cast<const T*>(field)->eval(p); };
  if constexpr (requires { &T::segment; }) {
    queries.segment = [](const void* field, const Segment& motion, double radius, Sides sides, Hint& hint) noexcept {
      static_assert(noexcept(static_cast<const T*>(field)->segment(motion, radius, sides, hint)));
      return SweptHit(static_cast<const T*>(field)->segment(motion, radius, sides, hint));
    };
  }
  if constexpr (requires { &T::contacts; }) {
    queries.contacts = [](const void* field, const Vec3& position, double radius, Sides sides, Hint& hint,
                          ContactSet& out) noexcept {
      static_assert(noexcept(static_cast<const T*>(field)->contacts(position, radius, sides, hint, out)));
      static_cast<const T*>(field)->contacts(position, radius, sides, hint, out);
    };
  }
  if constexpr (requires { &T::closest; }) {
    queries.closest = [](const void* field, const Vec3& p, double bound, Hint& hint) noexcept {
      static_assert(noexcept(static_cast<const T*>(field)->closest(p, bound, hint)));
      return Foot(static_cast<const T*>(field)->closest(p, bound, hint));
    };
  }
  return queries;
}

/// A field's zeros as a surface: rays and motions by conservative steps (sphere tracing, Hart 1996), nearest points by
/// Newton's method. Immutable; any number of threads.
class CustomSurface {
 public:
  /// Keeps `field`. Measures it at a few thousand places of its box and refuses what would make the searches pass
  /// through: errors bad_value, naming "bounds", "lipschitz", "bend", "grain" or "eval" (a gradient that is not the
  /// value's, a value that is not finite, a box without surface). [build]
  template <ImplicitField T>
  static Result<CustomSurface> build(T field, std::string type = "custom") {
    static constexpr CustomQueries queries = custom_queries<T>();
    CustomFacts facts;
    facts.bounds = field.bounds();
    if constexpr (requires { field.lipschitz(); }) facts.lipschitz = field.lipschitz();
    if constexpr (requires { field.bend(); }) facts.bend = field.bend();
    if constexpr (requires { field.grain(); }) facts.grain = field.grain();
    if constexpr (requires { field.sides(); }) facts.sides = field.sides();
    return build(std::make_shared<const T>(std::move(field)), sizeof(T), &queries, facts, std::move(type));
  }

  /// First touch of a moving point, to within a skin; nothing is passed through as long as `lipschitz` holds. A search
  /// that takes too many steps ends early, as if touched there. A ball goes by the nearest point found. [servo]
  [[nodiscard]] SweptHit segment(const Segment& motion, double radius, Sides sides, Hint& hint) const noexcept;
  /// Planes at the nearest places found within the radius and the skin. [servo]
  void contacts(const Vec3& position, double radius, Sides sides, Hint& hint, ContactSet& out) const noexcept;
  /// Nearest point within `bound`: the best of descents from p, from the last one, and from four places around p. What
  /// all of these miss is not found. [servo]
  [[nodiscard]] Foot closest(const Vec3& p, double bound, Hint& hint) const noexcept;
  /// The field itself. [servo]
  [[nodiscard]] FieldSample eval(const Vec3& p, Hint&) const noexcept { return eval(p); }
  /// The same. [servo]
  [[nodiscard]] FieldSample eval(const Vec3& p) const noexcept;
  [[nodiscard]] double skin() const noexcept { return skin_; }
  [[nodiscard]] Box bounds() const noexcept { return facts_.bounds; }

  /// The gradient at p, unit; zero where there is none. [servo]
  [[nodiscard]] Vec3 outward(const Vec3& p) const noexcept;
  [[nodiscard]] double grain() const noexcept { return facts_.grain; }
  /// Whether it may have edges. [servo]
  [[nodiscard]] bool has_folds() const noexcept { return !(facts_.bend < infinity); }
  [[nodiscard]] Sides natural_sides() const noexcept { return facts_.sides; }
  [[nodiscard]] const CustomFacts& facts() const noexcept { return facts_; }
  /// The name that it was registered with. [any]
  [[nodiscard]] const std::string& type() const noexcept { return type_; }
  /// Tells surfaces apart, never 0. [servo]
  [[nodiscard]] std::uint64_t identity() const noexcept { return identity_; }
  [[nodiscard]] std::size_t memory_bytes() const noexcept { return sizeof(*this) + bytes_; }

 private:
  CustomSurface() = default;
  static Result<CustomSurface> build(std::shared_ptr<const void> field, std::size_t bytes, const CustomQueries* queries,
                                     const CustomFacts& facts, std::string type);
  [[nodiscard]] Status measure() const;
  [[nodiscard]] bool land(Vec3& q) const noexcept;
  [[nodiscard]] bool descend(const Vec3& p, Vec3& q) const noexcept;
  void feet(const Vec3& p, double bound, Hint& hint, ContactSet& out) const noexcept;
  [[nodiscard]] Foot foot_at(const Vec3& p, const Vec3& q) const noexcept;
  [[nodiscard]] SweptHit trace(const Segment& motion, Sides sides) const noexcept;
  [[nodiscard]] SweptHit trace_ball(const Segment& motion, double radius, Sides sides, Hint& hint) const noexcept;

  std::shared_ptr<const void> field_;
  const CustomQueries* queries_ = nullptr;
  CustomFacts facts_;
  double skin_ = 0.0;
  std::size_t bytes_ = 0;
  std::string type_;
  std::uint64_t identity_ = 0;
};
static_assert(SurfaceQuery<CustomSurface>);

/// Makes a surface of the numbers in a scene file.
using CustomSurfaceFactory = std::function<Result<CustomSurface>(NamedNumbers& numbers)>;

/// Makes a type known to scene files: "custom": {"type": NAME, numbers}. To be called before scenes are read, by one
/// thread. Errors: bad_value (no plain name, or registered already). [build]
Status register_custom_surface(std::string name, CustomSurfaceFactory factory);
/// The same for a type that is made from its numbers: T(NamedNumbers&). [build]
template <ImplicitField T>
Status register_custom_surface(const std::string& name) {
  return register_custom_surface(name,
                                 [name](NamedNumbers& numbers) { return CustomSurface::build(T(numbers), name); });
}
/// A surface of a registered type; `numbers` then tells what was read. Errors: bad_value (unknown type, listing the
/// known ones), bad_key (a number that the type does not read), and the factory's own. [build]
Result<CustomSurface> make_custom_surface(std::string_view name, NamedNumbers& numbers);
/// Every registered type. [any]
const std::vector<std::string>& custom_surface_names();

}  // namespace asperity
