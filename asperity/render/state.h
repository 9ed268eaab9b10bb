#pragma once
// What one probe carries from tick to tick, and what it may forget at any time.

#include <array>
#include <cstddef>
#include <memory>
#include <optional>

#include "asperity/core/fixed_vector.h"
#include "asperity/core/frames.h"
#include "asperity/core/place.h"
#include "asperity/material/friction.h"
#include "asperity/render/energy/account.h"
#include "asperity/render/law.h"
#include "asperity/render/view.h"
#include "asperity/surface/iso/kept_cells.h"
#include "asperity/surface/relief/blocks.h"
#include "asperity/surface/view.h"

namespace asperity {

class Scene;

// --- what a contact remembers, by what it belongs to ---

/// Of the law: goes on while the instance is felt by the same one.
struct OfLaw {
  const LawKind* kind = nullptr;
  LawMemory memory;
  FrictionState friction;      ///< of the friction law, where it is not within the proxy (object frame)
  Vec3 across = Vec3::Zero();  ///< direction across the lay, where it was known last (object frame)
};

/// Where folds of a surface hold a point between them: how long what was last looked at there stays farther from the
/// probe than the point is.
struct HeldBetween {
  Vec3 probe = Vec3::Zero();  ///< then (object frame)
  double distance = 0.0;      ///< from there to the proxy (m): another one means another place, or a changed surface
  double within = 0.0;        ///< while the probe is nearer than this to where it was (m); 0: not known
};

/// Of the surface: goes on while its mesh, its field or its formula does.
struct OfSurface {
  std::uint64_t identity = 0;    ///< of that (surface_identity); 0: of none
  FixedVector<Place, 3> places;  ///< where it was touched or nearest at the last tick
  Vec3 normal = Vec3::Zero();    ///< unit, at the first of them on the side touched (object frame)
  double height = 0.0;           ///< on triangles: of the proxy over the first of them (m)
  // Of an isosurface, felt now: on the way to the scene's own.
  double threshold = 0.0;
  int level = 0;
  bool rests = false;    ///< a point's proxy is at the first place
  bool sliding = false;  ///< friction was overcome there at the last tick
  HeldBetween held;
};

/// What one probe remembers of one instance between ticks.
struct Contact {
  std::uint32_t instance = no_index;
  float stiffness = 0.0F;     ///< N/m, of the material that it pushed with at the last tick; 0: it did not
  bool touching = false;      ///< pushed, or held the proxy, at the last tick
  bool placed = false;        ///< `pose` is of the last tick
  bool moved = false;         ///< the instance has changed under the probe since the tick before the last
  bool asked = false;         ///< law without a proxy: what was before the first tick in reach is known
  bool seen_outside = false;  ///< the same: being inside now means having come in from the front
  /// Of a surface that changes: whether the free probe was on the front of it.
  std::optional<bool> outside;
  Pose pose;                           ///< of the instance at the last tick
  std::optional<double> detail_level;  ///< of the coat, felt at the last tick
  HeldForce push;                      ///< of a law without a proxy, with its texture
  HeldForce drag;                      ///< of a friction law's spring
  HeldForce draw;                      ///< of what draws the probe from outside
  OfSurface surface;
  OfLaw law;

  /// The place that the proxy rests on, or was nearest to. [servo]
  [[nodiscard]] Place first() const noexcept { return surface.places.empty() ? Place{} : surface.places[0]; }
  void put(const Place& place) noexcept {
    surface.places.clear();
    surface.places.push_back(place);
  }
};
static_assert(sizeof(Contact) <= 560);

/// Instances that one probe feels at once.
inline constexpr std::size_t most_contacts = 8;

/// All that a probe carries from tick to tick. Copying it never allocates; assigning `ProxyState{}` resets it. One per
/// probe.
struct ProxyState {
  Vec3 proxy = Vec3::Zero();  ///< m, world; rests one skin above what it touches
  std::uint64_t epoch = 0;    ///< of the scene it belongs to; 0: no tick yet
  FixedVector<Contact, most_contacts> contacts;
  Vec3 previous_probe = Vec3::Zero();  ///< m, world, of the last tick
  Seconds previous_time{0.0};
  EnergyAccount account;
  HeldForce spring;                     ///< between probe and proxy, with its textures
  float stiffness = 0.0F;               ///< N/m, of the material behind it at the last tick; 0: free
  Vec3 force = Vec3::Zero();            ///< N, scene: answered at the last tick
  Vec3 residual = Vec3::Zero();         ///< N, scene: what is left of the force before the last change of the scene
  Vec3 workspace_probe = Vec3::Zero();  ///< m: the probe at the last tick, before the view
  View view;                            ///< of the last tick
  bool sliding = false;                 ///< several surfaces at once: friction was overcome at the last tick
  /// Level at which volumes larger than memory are felt: -1, the finest that is in memory; 0 or more, this one, as a
  /// replay does after having it fetched.
  int wanted_level = -1;
  /// Ticks one after the other, this one last, whose budget was spent before the proxy was at rest (work_left).
  std::uint32_t open_ticks = 0;
  bool idle = false;  ///< the last tick ended before the proxy was at rest, and brought it no nearer
};
static_assert(sizeof(ProxyState) <= 5120);

/// What a tick may remember of surfaces to be quick. Nothing in it changes an answer: it may be shared between probes
/// of one thread, dropped or replaced at any tick.
class ProxyCache {
 public:
  ProxyCache() = default;
  /// With room for what a ball looks at on reliefs and isosurfaces, where the scene has a ball and such: without it
  /// each of its ticks looks at all of that anew. [build]
  explicit ProxyCache(const Scene& scene);

  /// That of an instance, or the one that was not asked for longest. [servo]
  SurfaceCache& of(std::uint32_t instance) noexcept {
    Entry* oldest = &entries_[0];
    for (Entry& entry : entries_) {
      if (entry.instance == instance) {
        entry.used = ++clock_;
        return entry.told(work_);
      }
      if (entry.used < oldest->used) oldest = &entry;
    }
    oldest->instance = instance;
    oldest->used = ++clock_;
    return oldest->told(work_);
  }
  /// What the last tick looked at. [servo]
  [[nodiscard]] WorkMeter& work() noexcept { return work_; }

 private:
  struct Entry {
    std::uint32_t instance = no_index;
    std::uint64_t used = 0;
    SurfaceCache cache;
    std::unique_ptr<ReliefBlocks> blocks;
    std::unique_ptr<KeptCells> cells;

    Entry() = default;
    Entry(const Entry& other)
        : instance(other.instance),
          used(other.used),
          cache(other.cache),
          blocks(other.blocks ? std::make_unique<ReliefBlocks>(*other.blocks) : nullptr),
          cells(other.cells ? std::make_unique<KeptCells>(*other.cells) : nullptr) {}
    Entry(Entry&&) noexcept = default;
    Entry& operator=(Entry&&) noexcept = default;
    ~Entry() = default;
    SurfaceCache& told(WorkMeter& work) noexcept {
      cache.work = &work;
      cache.blocks = blocks.get();
      cache.cells.kept = cells.get();
      return cache;
    }
  };
  std::array<Entry, most_contacts> entries_;
  std::uint64_t clock_ = 0;
  WorkMeter work_;
};

}  // namespace asperity
