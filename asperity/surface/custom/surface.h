#pragma once
// A surface of one's own: a type that answers value and gradient of a field is enough, the queries come with it.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "asperity/core/named_numbers.h"
#include "asperity/core/result.h"
#include "asperity/surface/view.h"

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
/// What it may do itself, const and noexcept, as a SurfaceView does: SweptHit first_touch(const Segment&, Sides) and
/// Foot nearest(const Vec3& p, double bound).
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

/// What a type does, without its name: one indirection a query. Empty entries are done by CustomView. [servo]
struct CustomQueries {
  FieldSample (*eval)(const void* field, const Vec3& p) noexcept = nullptr;
  SweptHit (*first_touch)(const void* field, const Segment& motion, Sides sides) noexcept = nullptr;
  Foot (*nearest)(const void* field, const Vec3& p, double bound) noexcept = nullptr;
};

/// The entries for one type. [build]
template <ImplicitField T>
constexpr CustomQueries custom_queries() {
  CustomQueries queries;
  queries.eval = [](const void* field, const Vec3& p) noexcept { return static_cast<const T*>(field)->eval(p); };
  if constexpr (requires { &T::first_touch; }) {
    queries.first_touch = [](const void* field, const Segment& motion, Sides sides) noexcept {
      static_assert(noexcept(static_cast<const T*>(field)->first_touch(motion, sides)));
      return SweptHit(static_cast<const T*>(field)->first_touch(motion, sides));
    };
  }
  if constexpr (requires { &T::nearest; }) {
    queries.nearest = [](const void* field, const Vec3& p, double bound) noexcept {
      static_assert(noexcept(static_cast<const T*>(field)->nearest(p, bound)));
      return Foot(static_cast<const T*>(field)->nearest(p, bound));
    };
  }
  return queries;
}

class CustomView;

/// A field's zeros as a surface: rays and motions by conservative steps (sphere tracing, Hart 1996), nearest points by
/// Newton's method. Immutable; any number of threads.
class CustomSurface {
 public:
  /// Keeps `field`. Measures it at a few thousand places of its box and refuses what would make the searches pass
  /// through: errors bad_value, naming "bounds", "lipschitz", "bend", "grain" or "eval" (a gradient that is not the
  /// value's, a value that is not finite, a box without surface). [build]
  template <ImplicitField T>
  static Result<CustomSurface> build(T field, std::string type = "custom") {
    static_assert(
        !requires { &T::closest; } && !requires { &T::segment; } && !requires { &T::contacts; },
        "a type's own queries are first_touch and nearest");
    static constexpr CustomQueries queries = custom_queries<T>();
    CustomFacts facts;
    facts.bounds = field.bounds();
    if constexpr (requires { field.lipschitz(); }) facts.lipschitz = field.lipschitz();
    if constexpr (requires { field.bend(); }) facts.bend = field.bend();
    if constexpr (requires { field.grain(); }) facts.grain = field.grain();
    if constexpr (requires { field.sides(); }) facts.sides = field.sides();
    return build(std::make_shared<const T>(std::move(field)), sizeof(T), &queries, facts, std::move(type));
  }

  /// What is touched of it. `work`: what its field is asked is counted there. [servo]
  [[nodiscard]] CustomView view(WorkMeter* work = nullptr) const noexcept;
  /// The field itself. [servo]
  [[nodiscard]] FieldSample eval(const Vec3& p) const noexcept;
  [[nodiscard]] double skin() const noexcept { return skin_; }
  [[nodiscard]] Box bounds() const noexcept { return facts_.bounds; }

  /// Leads q along the gradient onto the surface, to within settled(); `asked`, where it is given, counts the field's
  /// answers. [servo]
  [[nodiscard]] bool land(Vec3& q, WorkMeter* asked = nullptr) const noexcept;
  /// Whether q lies in the box that holds the surface. [servo]
  [[nodiscard]] bool holds(const Vec3& q) const noexcept {
    const Box box = facts_.bounds.grown(skin_);
    return (q.array() >= box.lower.array()).all() && (q.array() <= box.upper.array()).all();
  }
  /// Two places that are nearer to each other are one (m). [servo]
  [[nodiscard]] double settled() const noexcept { return 1e-3 * skin_; }
  /// What the type does itself, to be asked with field(). [servo]
  [[nodiscard]] const CustomQueries& queries() const noexcept { return *queries_; }
  [[nodiscard]] const void* field() const noexcept { return field_.get(); }
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
  std::shared_ptr<const void> field_;
  const CustomQueries* queries_ = nullptr;
  CustomFacts facts_;
  double skin_ = 0.0;
  std::size_t bytes_ = 0;
  std::string type_;
  std::uint64_t identity_ = 0;
};

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

}  // namespace asperity
