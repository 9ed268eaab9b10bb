#pragma once
// A contact law: how a surface is felt. Each law is a type that says all of itself (asperity/render/laws); `Law` holds
// any of them. Names, refusals, zoom, JSON, schema, help and comparisons follow from what the type says.

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <typeinfo>
#include <utility>
#include <vector>

#include "asperity/core/formulation.h"
#include "asperity/core/result.h"
#include "asperity/core/samples.h"
#include "asperity/material/material.h"
#include "asperity/render/law_facts.h"
#include "asperity/surface/view.h"

namespace asperity {

struct Instance;
struct Option;
class TouchedSurface;
struct Touched;

/// What a law answers, object frame; the zero of each member where the law has nothing to say of it.
struct LawForce {
  bool contact = false;              ///< false: nothing is felt, the rest is not read but `height` and `element`
  Vec3 force = Vec3::Zero();         ///< N
  Vec3 point = Vec3::Zero();         ///< felt place of the surface (m)
  Vec3 normal = Vec3::Zero();        ///< unit, the way that the surface pushes
  double penetration = 0.0;          ///< m
  double height = 0.0;               ///< relief height under the probe (m), where there is one
  std::uint32_t element = no_index;  ///< face, cell or patch
  /// Damping is part of the force already, and `spring` tells which part is not; otherwise the material's damping is
  /// added along the normal, and never pulls.
  bool damped = false;
  Vec3 spring = Vec3::Zero();  ///< N, the part of the force that is held: neither damping nor friction
  /// J, the energy that `spring` is the slope of: 0 where it ends, below it in a well. Where it is not told, the force
  /// gives back what the hand has put into it, and no more: it is softened.
  std::optional<double> stored = std::nullopt;
  double stiffness = 0.0;        ///< N/m: by how much `spring` changes with a motion, at most; 0: the material's
  bool keeps = false;            ///< `spring` holds whatever is put into it; set where `stored` is not told
  double local = 0.0;            ///< N/m: the material's where it is touched, if the law looks that up; 0: it does not
  double push = 0.0;             ///< N along the normal, before damping: what friction and texture go by
  Vec3 friction = Vec3::Zero();  ///< N, the part of the force that is friction
  Vec3 texture = Vec3::Zero();   ///< N, the part that is texture
  bool pulls = false;            ///< a sticky surface holds the probe back: `penetration` is how far it was drawn off
  double held = 0.0;             ///< J, in the spring of a friction law
  Vec3 drawn = Vec3::Zero();     ///< N, what that spring pulls with
  bool turns = false;            ///< `turn` is known
  Vec3 turn;                     ///< N, lateral force of consistent shading, to be added as far as it is paid
  bool bends = false;            ///< `bend` is known
  Mat3 bend;                     ///< 1/m: how the normal changes along the surface (shape operator)
};

/// Largest size of what a law may remember, one for each probe and instance (bytes).
inline constexpr std::size_t law_state_size = 64;
/// That, of whichever law it is.
struct LawMemory {
  bool begun = false;  ///< `bytes` are a State
  alignas(8) std::array<std::byte, law_state_size> bytes{};
};

namespace detail {
/// What a law's type may remember: its State, or nothing.
template <class L>
struct LawStateOf {
  struct type {};
};
template <class L>
requires requires {
  typename L::State;
}
struct LawStateOf<L> {
  using type = typename L::State;
};
}  // namespace detail

/// Whether a law's type answers forces from its State.
template <class L>
concept AnswersFromState = requires(const L& law, const TouchedSurface& surface, const Material& material,
                                    const Vec3& v, Seconds dt, typename detail::LawStateOf<L>::type& state) {
  { law.force(surface, material, v, v, dt, state) }
  noexcept->std::same_as<LawForce>;
};
/// Whether it answers them without one.
template <class L>
concept AnswersPlainly = requires(const L& law, const TouchedSurface& surface, const Material& material, const Vec3& v,
                                  Seconds dt) {
  { law.force(surface, material, v, v, dt) }
  noexcept->std::same_as<LawForce>;
};
/// Whether a type is a law: it says its `facts` (static constexpr), and where it adds a force, that:
///   LawForce force(const TouchedSurface&, const Material&, const Vec3& probe, const Vec3& velocity, Seconds dt[,
///                  State&]) const noexcept
/// `probe` (m) and `velocity` (m/s) in the object frame, `material` as it is there, `dt` since the last call. It may
/// have
///   formulation                    a Formulation: it has two forms, and the literal one's name ends in "-literal"
///   static options(std::vector<Option>& rows)   adds what scene files may say, bound to its members
///   State                          what it remembers: plain values, copied byte by byte, at most law_state_size. A
///   member
///                                  `previous` is kept the probe's last place (m, object frame) when the view changes
///   validate() const               Status: what the ranges of its options do not say
///   lacks(const Instance&) const   std::string: what it needs that the surface has not; empty: nothing
///   outside() const                LawReach: how far outside of a potential it reads it
///   well(const Material&) const    double: energy that it gives to a hand it draws in (J)
///   facets() const                 LawFacets: the triangles that its proxy goes along
///   finish(touch, foot, answer) const noexcept: changes what its proxy's force is, world frame
template <class L>
concept ContactLaw = std::is_same_v<std::remove_cv_t<decltype(L::facts)>, LawFacts> &&
    (L::facts.proxy != LawProxy::none || AnswersFromState<L> || AnswersPlainly<L>);

/// The kind of a law: what its type says, each null where it says nothing. One a type.
struct LawKind {
  const LawFacts* facts;
  const std::type_info* type;
  void (*options)(std::vector<Option>& rows);
  std::shared_ptr<void> (*copy)(const void* law);      ///< nullptr: with its defaults
  std::shared_ptr<void> (*in_form)(Formulation form);  ///< with the defaults of that form
  Formulation (*form)(const void* law) noexcept;
  Status (*validate)(const void* law);
  std::string (*lacks)(const void* law, const Instance& instance);
  LawReach (*outside)(const void* law) noexcept;
  double (*well)(const void* law, const Material& material) noexcept;
  LawFacets (*facets)(const void* law) noexcept;
  void (*finish)(const void* law, const Touched& touch, const Foot& foot, LawForce& answer) noexcept;
  LawForce (*force)(const void* law, const TouchedSurface& surface, const Material& material, const Vec3& probe,
                    const Vec3& velocity, Seconds dt, LawMemory& memory) noexcept;
  void (*seen_from)(LawMemory& memory, const Vec3& previous) noexcept;
  bool of_surface;          ///< what it remembers means something on another surface (State::of_surface)
  std::size_t state_bytes;  ///< of what it remembers; 0: nothing
};

namespace detail {

/// The settings behind a kind's pointer. [any]
template <class L>
const L& law_as(const void* law) noexcept {
  return *static_cast<const L*>(law);
}

/// The State in a memory, begun where there is none. It is copied with the bytes around it. [servo]
template <class State>
State& law_state(LawMemory& memory) noexcept {
  static_assert(std::is_trivially_destructible_v<State> && std::is_default_constructible_v<State>);
  static_assert(sizeof(State) <= law_state_size && alignof(State) <= 8, "a law may remember 64 bytes");
  if (memory.begun) return *std::launder(reinterpret_cast<State*>(memory.bytes.data()));
  memory.begun = true;
  return *new (memory.bytes.data()) State{};
}

/// With its State, where it has one. [servo]
template <class L>
LawForce ask_law(const void* law, const TouchedSurface& surface, const Material& material, const Vec3& probe,
                 const Vec3& velocity, Seconds dt, LawMemory& memory) noexcept {
  if constexpr (AnswersFromState<L>) {
    return law_as<L>(law).force(surface, material, probe, velocity, dt, law_state<typename L::State>(memory));
  } else {
    return law_as<L>(law).force(surface, material, probe, velocity, dt);
  }
}

/// What a type says. [any]
template <class L>
constexpr LawKind make_law_kind() {
  using State = typename LawStateOf<L>::type;
  LawKind kind{};
  kind.facts = &L::facts;
  kind.type = &typeid(L);
  kind.copy = [](const void* law) -> std::shared_ptr<void> {
    return law == nullptr ? std::make_shared<L>() : std::make_shared<L>(law_as<L>(law));
  };
  if constexpr (requires(std::vector<Option> & rows) { L::options(rows); }) kind.options = L::options;
  if constexpr (requires(L law) { law.formulation; }) {
    kind.in_form = [](Formulation form) -> std::shared_ptr<void> {
      return std::make_shared<L>(L{.formulation = form});
    };
    kind.form = [](const void* law) noexcept { return law_as<L>(law).formulation; };
  }
  if constexpr (requires(const L& law) { law.validate(); })
    kind.validate = [](const void* law) { return law_as<L>(law).validate(); };
  if constexpr (requires(const L& law, const Instance& instance) { law.lacks(instance); })
    kind.lacks = [](const void* law, const Instance& instance) { return law_as<L>(law).lacks(instance); };
  if constexpr (requires(const L& law) { law.outside(); })
    kind.outside = [](const void* law) noexcept { return law_as<L>(law).outside(); };
  if constexpr (requires(const L& law, const Material& material) { law.well(material); })
    kind.well = [](const void* law, const Material& material) noexcept { return law_as<L>(law).well(material); };
  if constexpr (requires(const L& law) { law.facets(); })
    kind.facets = [](const void* law) noexcept { return law_as<L>(law).facets(); };
  if constexpr (requires(const L& law, const Touched& touch, LawForce& answer) { law.finish(touch, Foot{}, answer); })
    kind.finish = [](const void* law, const Touched& touch, const Foot& foot, LawForce& answer) noexcept {
      law_as<L>(law).finish(touch, foot, answer);
    };
  if constexpr (L::facts.proxy == LawProxy::none) kind.force = ask_law<L>;
  if constexpr (requires(State state, const Vec3& p) { state.previous = p; })
    kind.seen_from = [](LawMemory& memory, const Vec3& previous) noexcept {
      law_state<State>(memory).previous = previous;
    };
  if constexpr (requires { State::of_surface; }) kind.of_surface = State::of_surface;
  if constexpr (requires { typename L::State; }) kind.state_bytes = sizeof(State);
  return kind;
}

template <class L>
inline constexpr LawKind law_kind = make_law_kind<L>();

}  // namespace detail

/// A law of any kind, with its settings. Immutable, and copied by reference.
class Law {
 public:
  template <ContactLaw L>
  Law(L settings)  // NOLINT(google-explicit-constructor): a law is a Law
      : kind_(&detail::law_kind<L>), settings_(std::make_shared<const L>(std::move(settings))) {}
  /// Of a kind, with its defaults. [build]
  explicit Law(const LawKind& kind) : kind_(&kind), settings_(kind.copy(nullptr)) {}

  [[nodiscard]] const LawKind& kind() const noexcept { return *kind_; }
  [[nodiscard]] const LawFacts& facts() const noexcept { return *kind_->facts; }
  /// Whether the law moves the proxy rather than adding a force of its own. [any]
  [[nodiscard]] bool constrains() const noexcept { return facts().proxy != LawProxy::none; }
  /// Whether of a coated mesh it feels the triangles alone. [any]
  [[nodiscard]] bool feels_mesh_alone() const noexcept { return constrains() && facts().coat == LawCoat::nothing; }
  /// Its settings, as the type that it is; nullptr: it is another. [servo]
  template <ContactLaw L>
  [[nodiscard]] const L* as() const noexcept {
    return is<L>() ? static_cast<const L*>(settings_.get()) : nullptr;
  }
  template <ContactLaw L>
  [[nodiscard]] bool is() const noexcept {
    return kind_ == &detail::law_kind<L>;
  }
  /// Whether a probe with a radius feels it: forms as printed are of points. [any]
  [[nodiscard]] bool takes_ball() const noexcept {
    return (constrains() || facts().ball) && formulation() != Formulation::literal;
  }
  /// The triangles that its proxy goes along. [servo]
  [[nodiscard]] LawFacets facets() const noexcept {
    return kind_->facets == nullptr ? LawFacets{} : kind_->facets(settings_.get());
  }
  /// How far outside of a potential it reads it. [any]
  [[nodiscard]] LawReach outside() const noexcept {
    return kind_->outside == nullptr ? LawReach{} : kind_->outside(settings_.get());
  }
  /// Energy that it gives to a hand that it draws in (J). [any]
  [[nodiscard]] double well(const Material& material) const noexcept {
    return kind_->well == nullptr ? 0.0 : kind_->well(settings_.get(), material);
  }
  /// What it needs, beside its facts, that the surface has not; empty: nothing. [any]
  [[nodiscard]] std::string lacks(const Instance& instance) const {
    return kind_->lacks == nullptr ? std::string() : kind_->lacks(settings_.get(), instance);
  }
  /// Those, for the kind's functions. [servo]
  [[nodiscard]] const void* settings() const noexcept { return settings_.get(); }
  /// The same law, its settings changed by what gets them as a kind's options do. [build]
  template <class Change>
  [[nodiscard]] Law changed(Change&& change) const {
    std::shared_ptr<void> copy = kind_->copy(settings_.get());
    change(copy.get());
    return {*kind_, std::move(copy)};
  }
  /// Its form, where it has two; nothing where it has one. [any]
  [[nodiscard]] std::optional<Formulation> formulation() const noexcept {
    if (kind_->form == nullptr) return std::nullopt;
    return kind_->form(settings_.get());
  }
  /// A law of the same kind in that form, with the default options of that form. A law with one form: the law itself.
  /// [build]
  [[nodiscard]] Law in_form(Formulation form) const {
    return kind_->in_form == nullptr ? *this : Law(*kind_, kind_->in_form(form));
  }

 private:
  Law(const LawKind& kind, std::shared_ptr<void> settings) : kind_(&kind), settings_(std::move(settings)) {}

  const LawKind* kind_;
  std::shared_ptr<const void> settings_;
};

}  // namespace asperity
