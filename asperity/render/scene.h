#pragma once
// The immutable snapshot that the servo thread reads: what is touched, how it is felt, what it is made of.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "asperity/core/result.h"
#include "asperity/render/energy/account.h"
#include "asperity/render/field_effects.h"
#include "asperity/render/instance.h"

namespace asperity {

/// What is true of a scene as a whole.
struct SceneSettings {
  double probe_radius = 0.0;  ///< m, workspace: of the probe's tip; 0 is a point
  /// Radius (m, workspace) of the tip whose path a point follows on coats with levels of detail by dilation; 0: none.
  double tip_radius = 0.0;
  /// From the tip to where the hand holds the tool (m, workspace), `tool_axis` the way there in the probe's own frame,
  /// unit: about there torque is answered. 0: none is.
  double tool_length = 0.0;
  Vec3 tool_axis = Vec3::UnitY();
  View view = {};
  /// Over how long a change of the scene is spread, as far as the account pays for it (s); 0: felt at once.
  Seconds handover{0.01};
  /// Power (W) that moving, deforming and changing surfaces may give to the hand beyond what it has spent on them: 0,
  /// the default, keeps every change passive.
  double change_power = 0.0;
  /// J that the hand may get back later, through something else than it has put it in by. What a force holds it gives
  /// back in any case.
  double energy_capacity = EnergyAccount::default_capacity;
  /// How fast coats change their level of detail (levels a second), above 0.
  double level_rate = 8.0;
  /// What a tick may look at, in evaluations of a surface (WorkCount::sum), at least least_budget; 0: no limit. A proxy
  /// that is not at rest by then goes on from where it is in the next tick (work_left). Where that is also hangs on how
  /// a mesh's tree was cut, which no other force does. Without a value budget_for.
  std::optional<std::uint32_t> budget = {};
  static constexpr std::uint32_t least_budget = 100;
  /// For a point 40 to 60 us. A ball looks at all around it at once, and several times where it is led fast over what
  /// is rough: 3 to 9 ms, up to 23 where the reliefs of many faces meet. Seldom spent at 50 mm/s. [any]
  static constexpr std::uint32_t budget_for(double probe_radius) noexcept { return probe_radius > 0.0 ? 150'000 : 600; }
};

/// Whether a ball of the settings' radius can be felt on an instance; otherwise why not.
/// Errors: unsupported_pair, bad_value. [build]
Status takes_ball(const Instance& instance, const SceneSettings& settings);

/// Validated and immutable: `step` cannot fail on it. Copies share the surfaces.
class Scene {
 public:
  /// Validates everything. Errors: unsupported_pair (a law that needs a coat on a bare mesh), bad_value (material, law
  /// option, probe radius, pose not finite), too_large (a dense mesh of too many triangles), each with the instance's
  /// place. [build]
  static Result<Scene> build(std::vector<Instance> instances, double probe_radius,
                             std::vector<FieldEffect> effects = {});

  /// The same with all that can be set. Errors: those above, and bad_value (view, motion, a time or power below 0).
  /// [build]
  static Result<Scene> build(std::vector<Instance> instances, const SceneSettings& settings = {},
                             std::vector<FieldEffect> effects = {});

  [[nodiscard]] std::span<const Instance> instances() const noexcept { return given_.empty() ? felt_ : given_; }
  [[nodiscard]] const SceneSettings& settings() const noexcept { return settings_; }
  /// The instances with their materials as a zoomed hand feels them: what a tick goes by. [servo]
  [[nodiscard]] std::span<const Instance> felt() const noexcept { return felt_; }
  [[nodiscard]] std::span<const FieldEffect> felt_effects() const noexcept { return felt_effects_; }
  /// What is felt everywhere in a volume, without a surface. [servo]
  [[nodiscard]] std::span<const FieldEffect> effects() const noexcept {
    return given_effects_.empty() ? felt_effects_ : given_effects_;
  }
  /// Whether a tick may read a volume that is larger than memory: for an isosurface or an effect. [servo]
  [[nodiscard]] bool reads_bricks() const noexcept { return reads_bricks_; }
  /// Whether the scene is the workspace: the view changes nothing. [servo]
  [[nodiscard]] bool direct() const noexcept { return direct_; }
  /// Whether an instance moves on by itself. [servo]
  [[nodiscard]] bool moves() const noexcept { return moves_; }
  /// Whether an instance draws the probe from outside. [servo]
  [[nodiscard]] bool draws() const noexcept { return draws_; }
  /// What the scene's magnets give to a hand that they draw in, at most (J): by leaving them it gives that back.
  /// [servo]
  [[nodiscard]] double lends() const noexcept { return lends_; }
  /// Whether a surface that moves the proxy may move or change its shape under it. [servo]
  [[nodiscard]] bool changes() const noexcept { return changes_; }
  /// What a tick may look at; 0: no limit. [servo]
  [[nodiscard]] std::uint32_t budget() const noexcept {
    return settings_.budget.value_or(SceneSettings::budget_for(settings_.probe_radius));
  }
  /// Radius of the probe's tip in the scene (m); 0 is a point. [servo]
  [[nodiscard]] double probe_radius() const noexcept { return settings_.probe_radius / settings_.view.zoom; }
  /// Tells snapshots apart, never 0. A state made for another one re-acquires its contacts. [servo]
  [[nodiscard]] std::uint64_t epoch() const noexcept { return epoch_; }
  /// World bounds of instance `index`, coat and motion included (m). [servo]
  [[nodiscard]] const Box& world_bounds(std::size_t index) const noexcept { return bounds_[index]; }
  [[nodiscard]] Box world_bounds() const noexcept;
  /// Calls visit(instance) for each whose world bounds meet `box`, but for those in boxes around several of which
  /// matters(box) is false. [servo]
  template <class Visit, class Matters>
  void for_each_in_box(const Box& box, Visit&& visit, Matters&& matters) const noexcept {
    for (std::uint32_t i = 0; i < tree_.size();) {
      const Node& node = tree_[i];
      const bool near = node.box.overlaps(box) && matters(node.box);
      if (near && node.instance != no_index) visit(node.instance);
      i = near ? i + 1 : node.past;
    }
  }
  /// [servo]
  [[nodiscard]] const InstanceFacts& facts(std::size_t index) const noexcept { return facts_[index]; }
  [[nodiscard]] std::size_t memory_bytes() const noexcept;

 private:
  Scene() = default;

  std::vector<Instance> felt_;
  std::vector<FieldEffect> felt_effects_;
  std::vector<Instance> given_;  ///< empty: they are felt as they are
  std::vector<FieldEffect> given_effects_;
  /// Over the instances' bounds: a node stands before all that it holds.
  struct Node {
    Box box;
    std::uint32_t past = 0;             ///< the first node that it does not hold
    std::uint32_t instance = no_index;  ///< of a leaf
  };
  void plant(std::vector<std::uint32_t>& order, std::size_t from, std::size_t to);

  std::vector<Box> bounds_;
  std::vector<Node> tree_;
  std::vector<InstanceFacts> facts_;
  SceneSettings settings_;
  std::uint64_t epoch_ = 0;
  bool reads_bricks_ = false;
  bool moves_ = false;
  bool draws_ = false;
  double lends_ = 0.0;
  bool changes_ = false;
  bool direct_ = true;
};

}  // namespace asperity
