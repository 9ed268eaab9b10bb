#include "asperity/render/state_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>
#include <utility>

#include "asperity/render/law_registry.h"

namespace asperity {
namespace {

using ImageBytes = std::vector<std::byte>;

constexpr std::uint32_t image_mark = 0x53505341U;  // "ASPS"
constexpr std::uint32_t image_version = 1;
constexpr std::size_t image_hash_bytes = 8;
// Of an identity: that of no surface, or of one that the scene has not.
constexpr std::uint32_t of_none = 0xFFFFFFFFU;
constexpr std::uint32_t of_another = 0xFFFFFFFEU;
// No identity and no epoch comes so far.
constexpr std::uint64_t another_identity = UINT64_MAX;
enum class EpochOf : std::uint32_t { none, this_scene, another };

/// FNV-1a, of 64 bits.
std::uint64_t image_hash(std::span<const std::byte> bytes) noexcept {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const std::byte b : bytes) hash = (hash ^ std::to_integer<std::uint64_t>(b)) * 1099511628211ULL;
  return hash;
}

bool is_of(const Scene& scene, std::size_t instance, std::uint64_t identity) noexcept {
  return instance < scene.instances().size() && surface_identity(scene.instances()[instance].surface) == identity;
}

/// Writes the plain values of a state, least significant byte first.
class ImageWriter {
 public:
  ImageWriter(ImageBytes& bytes, const Scene& scene) : bytes_(bytes), scene_(scene) {}

  void number(std::uint64_t value, int count) {
    for (int i = 0; i < count; ++i) bytes_.push_back(static_cast<std::byte>((value >> (8 * i)) & 0xFFU));
  }
  void field(const bool& value) { number(value ? 1 : 0, 1); }
  void field(const std::uint32_t& value) { number(value, 4); }
  void field(const int& value) { number(static_cast<std::uint32_t>(value), 4); }
  void field(const double& value) { number(std::bit_cast<std::uint64_t>(value), 8); }
  void field(const float& value) { number(std::bit_cast<std::uint32_t>(value), 4); }
  void byte(const std::byte& value) { bytes_.push_back(value); }
  template <HasNames E>
  void field(const E& value) {
    number(static_cast<std::uint64_t>(value), 1);
  }
  /// Where it stands, or nothing where there is none.
  template <class T, class Each>
  void list(const T& values, const Each& each) {
    number(values.size(), 1);
    for (const auto& value : values) each(value);
  }
  void identity(const std::uint64_t& identity, std::uint32_t instance) { number(owner_of(identity, instance), 4); }
  void epoch(const std::uint64_t& epoch) {
    const EpochOf of = epoch == 0 ? EpochOf::none : epoch == scene_.epoch() ? EpochOf::this_scene : EpochOf::another;
    number(static_cast<std::uint32_t>(of), 4);
  }
  void kind(const LawKind* kind) {
    const std::string_view name = kind == nullptr ? std::string_view() : kind->facts->name;
    number(name.size(), 2);
    for (const char c : name) byte(static_cast<std::byte>(c));
  }

 private:
  [[nodiscard]] std::uint32_t owner_of(std::uint64_t identity, std::uint32_t instance) const {
    if (identity == 0) return of_none;
    if (is_of(scene_, instance, identity)) return instance;
    for (std::uint32_t i = 0; i < scene_.instances().size(); ++i)
      if (is_of(scene_, i, identity)) return i;
    return of_another;
  }

  ImageBytes& bytes_;
  const Scene& scene_;
};

/// Reads them again; after the first thing that is wrong it answers zeros.
class ImageReader {
 public:
  ImageReader(std::span<const std::byte> bytes, const Scene& scene) : bytes_(bytes), scene_(scene) {}

  std::uint64_t number(std::size_t count) {
    if (count > bytes_.size() - at_) refuse(ErrorCode::file_truncated, "ends within the state");
    if (failure_) return 0;
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < count; ++i) value |= std::to_integer<std::uint64_t>(bytes_[at_ + i]) << (8 * i);
    at_ += count;
    return value;
  }
  void field(bool& value) {
    const std::uint64_t read = number(1);
    if (read > 1) refuse(ErrorCode::file_malformed, fmt::format("holds a yes or no that is {}", read));
    value = read == 1;
  }
  void field(std::uint32_t& value) { value = static_cast<std::uint32_t>(number(4)); }
  void field(int& value) { value = static_cast<int>(static_cast<std::uint32_t>(number(4))); }
  void field(double& value) { value = std::bit_cast<double>(number(8)); }
  void field(float& value) { value = std::bit_cast<float>(static_cast<std::uint32_t>(number(4))); }
  void byte(std::byte& value) { value = static_cast<std::byte>(number(1)); }
  template <HasNames E>
  void field(E& value) {
    const auto read = static_cast<E>(number(1));
    if (place_of_name(read) == Names<E>::table.size())
      refuse(ErrorCode::file_malformed, fmt::format("holds a kind {} that there is not", static_cast<int>(read)));
    value = read;
  }
  template <class T, class Each>
  void list(T& values, const Each& each) {
    const std::uint64_t count = number(1);
    if (count > values.capacity()) refuse(ErrorCode::file_malformed, fmt::format("holds {} of what has room", count));
    values.clear();
    for (std::uint64_t i = 0; i < count && !failure_; ++i) each(*values.emplace_back());
  }
  void identity(std::uint64_t& identity, std::uint32_t) {
    const auto owner = static_cast<std::uint32_t>(number(4));
    const auto instances = scene_.instances();
    if (owner == of_none) {
      identity = 0;
    } else if (owner == of_another) {
      identity = another_identity;
    } else if (owner < instances.size()) {
      identity = surface_identity(instances[owner].surface);
    } else {
      refuse(ErrorCode::mismatch, fmt::format("is of a scene with a surface {}", owner));
    }
  }
  void epoch(std::uint64_t& epoch) {
    switch (static_cast<EpochOf>(number(4))) {
      case EpochOf::none: epoch = 0; return;
      case EpochOf::this_scene: epoch = scene_.epoch(); return;
      case EpochOf::another: epoch = another_identity; return;
    }
    refuse(ErrorCode::file_malformed, "is of no scene");
  }
  void kind(const LawKind*& kind) {
    std::string name(std::min<std::uint64_t>(number(2), bytes_.size() - at_), '\0');
    for (char& c : name) c = static_cast<char>(number(1));
    if (name.empty()) {
      kind = nullptr;
      return;
    }
    // Also a law that the scene has and nobody registered.
    for (const Instance& instance : scene_.instances())
      if (instance.law.facts().name == name) kind = &instance.law.kind();
    for (const LawKind* known : law_kinds())
      if (known->facts->name == name) kind = known;
    if (kind == nullptr) refuse(ErrorCode::mismatch, fmt::format("is felt by a law \"{}\" that there is not", name));
  }
  void refuse(ErrorCode code, std::string what) {
    if (!failure_) failure_ = refused(code, std::move(what), fmt::format("byte {}", at_), "an image of this scene");
  }
  [[nodiscard]] const std::optional<Error>& failure() const noexcept { return failure_; }
  [[nodiscard]] std::size_t left() const noexcept { return bytes_.size() - at_; }

 private:
  std::span<const std::byte> bytes_;
  const Scene& scene_;
  std::size_t at_ = 0;
  std::optional<Error> failure_;
};

// Every member in its order, for both directions. Whoever adds one does not get past the names in brackets.

template <class Coder, class V>
void code_vector(Coder& coder, V& v) {
  for (int i = 0; i < 3; ++i) coder.field(v[i]);
}

template <class Coder, class Q>
void code_turn(Coder& coder, Q& q) {
  for (int i = 0; i < 4; ++i) coder.field(q.coeffs()[i]);
}

template <class Coder, class P>
void code_pose(Coder& coder, P& pose) {
  auto& [position, orientation] = pose;
  code_vector(coder, position);
  code_turn(coder, orientation);
}

template <class Coder, class S>
void code_seconds(Coder& coder, S& seconds) {
  double count = seconds.count();
  coder.field(count);
  if constexpr (!std::is_const_v<S>) seconds = Seconds(count);
}

template <class Coder, class O>
void code_optional(Coder& coder, O& value) {
  bool there = value.has_value();
  coder.field(there);
  if constexpr (!std::is_const_v<O>) {
    if (there)
      value.emplace();
    else
      value.reset();
  }
  if (there) coder.field(*value);
}

template <class Coder, class H>
void code_held(Coder& coder, H& held) {
  auto& [force, energy, stiffness, softened] = held;
  code_vector(coder, force);
  coder.field(energy);
  coder.field(stiffness);
  coder.field(softened);
}

template <class Coder, class P>
void code_place(Coder& coder, P& place) {
  auto& [element, back, at] = place;
  coder.field(element);
  coder.field(back);
  code_vector(coder, at);
}

template <class Coder, class F>
void code_friction(Coder& coder, F& friction) {
  auto& [stretch, stiffness, kind, sliding, fast, held] = friction;
  code_vector(coder, stretch);
  coder.field(stiffness);
  coder.field(kind);
  coder.field(sliding);
  coder.field(fast);
  coder.field(held);
}

template <class Coder, class L>
void code_of_law(Coder& coder, L& of_law) {
  auto& [kind, memory, friction, across] = of_law;
  coder.kind(kind);
  auto& [begun, bytes] = memory;
  coder.field(begun);
  for (auto& byte : bytes) coder.byte(byte);
  code_friction(coder, friction);
  code_vector(coder, across);
}

template <class Coder, class S>
void code_of_surface(Coder& coder, S& of_surface, std::uint32_t instance) {
  auto& [identity, places, normal, height, threshold, level, rests, sliding, held] = of_surface;
  coder.identity(identity, instance);
  coder.list(places, [&](auto& place) { code_place(coder, place); });
  code_vector(coder, normal);
  coder.field(height);
  coder.field(threshold);
  coder.field(level);
  coder.field(rests);
  coder.field(sliding);
  auto& [probe, distance, within] = held;
  code_vector(coder, probe);
  coder.field(distance);
  coder.field(within);
}

template <class Coder, class C>
void code_contact(Coder& coder, C& contact) {
  auto& [instance, stiffness, touching, placed, moved, asked, seen_outside, outside, pose, detail_level, push, drag,
         draw, surface, law] = contact;
  coder.field(instance);
  coder.field(stiffness);
  coder.field(touching);
  coder.field(placed);
  coder.field(moved);
  coder.field(asked);
  coder.field(seen_outside);
  code_optional(coder, outside);
  code_pose(coder, pose);
  code_optional(coder, detail_level);
  for (auto* held : {&push, &drag, &draw}) code_held(coder, *held);
  code_of_surface(coder, surface, instance);
  code_of_law(coder, law);
}

template <class Coder, class V>
void code_view(Coder& coder, V& view) {
  auto& [camera, zoom, focus, home, orientation] = view;
  auto& [eye, target, field_of_view, pixels] = camera;
  code_vector(coder, eye);
  code_vector(coder, target);
  coder.field(field_of_view);
  coder.field(pixels);
  coder.field(zoom);
  code_vector(coder, focus);
  code_vector(coder, home);
  code_turn(coder, orientation);
}

/// For EnergyAccount, which hands out its members itself.
template <class Coder>
struct AccountCoder {
  Coder& coder;
  template <class V>
  requires requires(V& v) { v.norm(); }
  void operator()(V& v) const { code_vector(coder, v); }
  template <class N>
  requires std::is_arithmetic_v<N>
  void operator()(N& number) const { coder.field(number); }
};

template <class Coder, class S>
void code_state(Coder& coder, S& state) {
  auto& [proxy, epoch, contacts, previous_probe, previous_time, account, spring, stiffness, force, residual,
         workspace_probe, view, sliding, wanted_level, open_ticks, idle] = state;
  code_vector(coder, proxy);
  coder.epoch(epoch);
  coder.list(contacts, [&](auto& contact) { code_contact(coder, contact); });
  code_vector(coder, previous_probe);
  code_seconds(coder, previous_time);
  EnergyAccount::each_member(account, AccountCoder<Coder>{coder});
  code_held(coder, spring);
  coder.field(stiffness);
  for (auto* v : {&force, &residual, &workspace_probe}) code_vector(coder, *v);
  code_view(coder, view);
  coder.field(sliding);
  coder.field(wanted_level);
  coder.field(open_ticks);
  coder.field(idle);
}

// ------------------------------------------------------------------------------------------------------- what fits

/// Whether an element may be one of the surface's own.
bool has_element(const Instance& instance, std::uint32_t element) {
  const MeshSurface* base = iso_of(instance.surface) == nullptr ? base_of(instance.surface) : nullptr;
  if (base == nullptr || element == no_index) return true;
  std::size_t faces = base->mesh().triangles().size();
  if (instance.dense != nullptr) faces = std::max(faces, instance.dense->surface.mesh().triangles().size());
  return element < faces;
}

/// What is wrong with a contact of an instance of this scene; empty: nothing.
std::string contradiction(const Contact& contact, const Instance& instance, bool same_surface) {
  const Quat& turn = contact.pose.orientation;
  if (!contact.pose.position.allFinite() || !(std::abs(turn.norm() - 1.0) <= 1e-6)) return "has a surface nowhere";
  const std::size_t remembered = contact.law.kind == nullptr ? 0 : contact.law.kind->state_bytes;
  if (contact.law.memory.begun && remembered == 0) return "remembers what its law does not";
  // What is of another surface is dropped before anybody looks at it.
  if (!same_surface) return {};
  const OfSurface& surface = contact.surface;
  for (const Place& place : surface.places) {
    if (!has_element(instance, place.element)) return fmt::format("touches an element {}", place.element);
    if (!place.at.allFinite()) return "touches no place";
  }
  if (surface.rests && surface.places.empty()) return "rests nowhere";
  if (!surface.normal.allFinite() || !std::isfinite(contact.detail_level.value_or(0.0))) return "touches nothing";
  const IsoSurface* iso = iso_of(instance.surface);
  if (iso != nullptr && (surface.level < 0 || surface.level >= iso->field().levels() || std::isnan(surface.threshold)))
    return fmt::format("feels a level {}", surface.level);
  return {};
}

/// The same of a state whose bytes are whole.
std::string contradiction(const ProxyState& state, const Scene& scene) {
  for (const Vec3* place : {&state.proxy, &state.previous_probe, &state.workspace_probe})
    if (!place->allFinite()) return "has no place";
  if (!validate(state.view)) return "has no view";
  const bool same_scene = state.epoch == scene.epoch();
  for (const Contact& contact : state.contacts) {
    if (contact.instance < scene.instances().size()) {
      const Instance& instance = scene.instances()[contact.instance];
      const bool same_surface = same_scene || contact.surface.identity == surface_identity(instance.surface);
      if (std::string what = contradiction(contact, instance, same_surface); !what.empty()) return what;
    } else if (same_scene) {
      return fmt::format("touches a surface {}", contact.instance);
    }
  }
  return {};
}

}  // namespace

std::vector<std::byte> save_state(const ProxyState& state, const Scene& scene) {
  ImageBytes bytes;
  ImageWriter writer(bytes, scene);
  writer.number(image_mark, 4);
  writer.number(image_version, 4);
  code_state(writer, state);
  writer.number(image_hash(bytes), image_hash_bytes);
  return bytes;
}

Result<ProxyState> restore_state(std::span<const std::byte> image, const Scene& scene) {
  const auto refuse = [](ErrorCode code, std::string what, std::size_t at) {
    return refused(code, std::move(what), fmt::format("byte {}", at), "an image that save_state made");
  };
  if (image.size() < 8 + image_hash_bytes)
    return refuse(ErrorCode::file_truncated, fmt::format("has {} bytes and is no state", image.size()), 0);
  const std::size_t end = image.size() - image_hash_bytes;
  if (ImageReader(image.first(4), scene).number(4) != image_mark)
    return refuse(ErrorCode::file_malformed, "is no image of a state", 0);
  if (const std::uint64_t version = ImageReader(image.subspan(4, 4), scene).number(4); version != image_version)
    return refuse(ErrorCode::file_unsupported, fmt::format("has version {} of states", version), 4);
  if (ImageReader(image.subspan(end), scene).number(image_hash_bytes) != image_hash(image.first(end)))
    return refuse(ErrorCode::file_malformed, "is damaged: its hash does not match", end);
  ImageReader reader(image.first(end), scene);
  static_cast<void>(reader.number(8));
  ProxyState state;
  code_state(reader, state);
  if (reader.left() > 0) reader.refuse(ErrorCode::file_malformed, fmt::format("has {} bytes more", reader.left()));
  if (reader.failure()) return *reader.failure();
  if (std::string what = contradiction(state, scene); !what.empty())
    return refuse(ErrorCode::mismatch, "is of another scene: it " + what, 8);
  return state;
}

}  // namespace asperity
