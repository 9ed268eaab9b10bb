// Whatever a scene holds and whatever happens to it: at no tick has a hand got more than it has put in, beyond what
// holding a force still over a tick gives (docs/methods/energy.md). Hands that wander, that take what they are offered,
// and that look for ways to be paid.
//   ASPERITY_ENERGY       how many ticks (default: a million, over all)
//   ASPERITY_ENERGY_SEED  default 17; every failure tells its own

#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <sstream>

#include "asperity/render/law_registry.h"
#include "asperity/render/touched_surface.h"
#include "tests/render/textures.h"
#include "tests/strokes/bodies.h"

namespace asperity::strokes {

namespace {

double asked_for(const char* variable, double otherwise) {
  const char* text = std::getenv(variable);
  return text == nullptr ? otherwise : std::strtod(text, nullptr);
}

/// Pushes outwards and around, as no potential does.
struct Swirl {
  static constexpr LawFacts facts{.name = "swirl", .title = "pushes outwards and around", .source = "none"};
  [[nodiscard]] LawForce force(const TouchedSurface& surface, const Material& material, const Vec3& probe, const Vec3&,
                               Seconds) const noexcept {
    LawForce answer;
    const FieldSample field = surface.eval(probe);
    const double slope = field.gradient.norm();
    if (!(field.value < 0.0) || !(slope > 0.0)) return answer;
    answer.contact = true;
    answer.normal = field.gradient / slope;
    answer.penetration = std::min(5e-3, -field.value / slope);
    const double push = material.stiffness * answer.penetration;
    answer.force = push * (answer.normal + 0.5 * answer.normal.cross(Vec3(0.3, 0.5, 0.8)));
    answer.point = probe + answer.penetration * answer.normal;
    return answer;
  }
};

/// Says of its energy whatever lets it give most: that its spring holds nothing, or is as steep as anything, and that
/// what pushes along with the hand is its damping.
struct Liar {
  static constexpr LawFacts facts{.name = "liar", .title = "lies", .source = "none"};
  [[nodiscard]] LawForce force(const TouchedSurface& surface, const Material& material, const Vec3& probe,
                               const Vec3& velocity, Seconds) const noexcept {
    LawForce answer = Swirl{}.force(surface, material, probe, velocity, Seconds(0.0));
    const double depth = answer.penetration;
    answer.spring = answer.force;
    answer.damped = depth > 1e-3;
    if (answer.damped) answer.force += 5.0 * velocity;
    answer.stored = std::fmod(1e5 * depth, 2.0) < 1.0 ? -1.0 : 0.0;
    answer.stiffness = std::fmod(1e4 * depth, 2.0) < 1.0 ? 1e9 : 1.0;
    answer.push = depth;
    answer.local = 1e-3;
    return answer;
  }
};

/// A relief with levels of detail.
Body layered(Rng& rng) {
  Body body = relief(rng);
  DetailSettings detail;
  detail.kind = DetailKind::low_pass;
  const auto map = test::tiled(test::wavy_map(rng.uniform(1e-4, 4e-4), 32), 0.01);
  const auto whole = std::make_shared<const Mesostructure>(map->with_detail(
      std::make_shared<const DetailPyramid>(test::must(DetailPyramid::build(map->heights(), map->tile(), detail)))));
  TriangleMesh mesh = test::mesh_of(plane_grid(0.06, 0.06, 2, 2));
  Coat coat = test::must(Coat::build(mesh, whole, CoatSettings{Mapping::uv, Vec2::Ones(), {}}));
  body.instance.surface =
      std::make_shared<const ReliefSurface>(MeshSurface(TriangleIndex::build(std::move(mesh))), std::move(coat));
  body.name = "layered relief";
  return body;
}

double chance(Rng& rng, double share, double low, double high) {
  return rng.uniform() < share ? rng.uniform(low, high) : 0.0;
}

Material any_material(Rng& rng) {
  Material material;
  material.stiffness = rng.uniform(200.0, 2000.0);
  material.damping = chance(rng, 0.3, 0.0, 2.0);
  material.viscosity = chance(rng, 0.2, 0.0, 2.0);
  if (rng.uniform() < 0.6) {
    material.dynamic_friction = rng.uniform(0.0, 1.0);
    material.static_friction = material.dynamic_friction * rng.uniform(1.0, 1.5);
    material.friction_named = rng.uniform() < 0.5;
    if (material.friction_named) {
      const auto& kinds = Names<FrictionKind>::table;
      material.friction.kind = kinds[rng.below(static_cast<std::uint32_t>(kinds.size()))].value;
      const std::vector<std::string>& read = friction_parameters(material.friction.kind);
      const auto maybe = [&](const char* key, double& member, double share, double low, double high) {
        const double value = chance(rng, share, low, high);
        if (std::find(read.begin(), read.end(), key) != read.end()) member = value;
      };
      maybe("viscosity", material.friction.viscosity, 0.5, 0.0, 2.0);
      maybe("stiffness", material.friction.stiffness, 0.3, 200.0, 2000.0);
      maybe("damping", material.friction.damping, 0.3, 0.0, 1.0);
    }
  }
  return material;
}

std::shared_ptr<const FineFeatures> any_texture(Rng& rng) {
  const double wavelength = rng.uniform(0.5e-3, 3e-3);
  return test::fine(
      test::fine_settings({test::grating(rng.uniform(0.01, 0.1) * wavelength, wavelength, rng.uniform(0.0, 3.0))}));
}

Law any_law(Rng& rng) {
  static const std::vector<Law> laws = [] {
    std::vector<Law> all;
    for (const std::string& name : law_names()) {
      const Law law = test::must(law_by_name(name));
      if (law.formulation() != Formulation::literal) all.push_back(law);
    }
    all.push_back(Swirl{});
    all.push_back(Liar{});
    return all;
  }();
  return laws[rng.below(static_cast<std::uint32_t>(laws.size()))];
}

FieldEffect any_effect(Rng& rng) {
  FieldEffect effect;
  effect.name = "wind";
  effect.field = volumes::sampled(volumes::cube(0.03, 9), [](const Vec3& p) { return 2.0 + 30.0 * p.x() + p.z(); });
  effect.kind = rng.below(2) == 0 ? FieldEffectKind::gradient : FieldEffectKind::viscosity;
  effect.transfer = test::must(TransferFunction::build({{0.0, 0.0}, {4.0, rng.uniform(0.01, 0.5)}}));
  effect.largest_force = rng.uniform(0.1, 2.0);
  return effect;
}

/// What the hands of one world meet.
class World {
 public:
  /// `plain`: by the laws that move a proxy alone, which are springs of the material's stiffness.
  explicit World(Rng& rng, bool plain = false) : rng_(rng), plain_(plain) {
    const std::uint32_t count = 1 + rng.below(3);
    for (std::uint32_t i = 0; i < count; ++i) add(i == 0 ? Vec3(Vec3::Zero()) : around(0.01));
    if (!plain_ && rng.below(6) == 0) effects_.push_back(any_effect(rng));
    if (rng.below(4) == 0) settings_.probe_radius = rng.uniform(2e-4, 2e-3);
    build();
  }

  [[nodiscard]] const Scene& scene() const { return *scene_; }
  /// The stiffest material in it (N/m).
  [[nodiscard]] double stiffest() const {
    double most = 0.0;
    for (const Body& body : bodies_) most = std::max(most, body.instance.material.stiffness);
    return most;
  }
  [[nodiscard]] const std::string& told() const { return told_; }
  /// J that its magnets have held ready at once.
  [[nodiscard]] double lent() const { return lent_; }
  /// Laws by name, and what has been changed, with how often.
  static std::map<std::string, int>& seen() {
    static std::map<std::string, int> all;
    return all;
  }
  /// A place near a surface: above it, or as deep in it as a hand may press.
  Vec3 place() {
    const Body& body = bodies_[rng_.below(static_cast<std::uint32_t>(bodies_.size()))];
    const Vec3 local = rng_.uniform(0.0, 1.2) * body.size * test::random_direction(rng_);
    return settings_.view.to_workspace(body.instance.world_from_object.apply(local));
  }
  [[nodiscard]] Vec3 home() const { return settings_.view.to_workspace(Vec3(0.0, 0.0, 0.08)); }

  /// Makes something else of one thing in it.
  void change(double now) {
    const std::vector<Body> before = bodies_;
    const SceneSettings settings_before = settings_;
    const std::size_t which = rng_.below(static_cast<std::uint32_t>(bodies_.size()));
    Instance& instance = bodies_[which].instance;
    std::string what;
    switch (rng_.below(9)) {
      case 0:
        what = "material", instance.material = any_material(rng_);
        if (plain_) instance.material.friction_named = false, instance.material.friction = {};
        break;
      case 1: what = "law", instance.law = plain_ ? Law(ProxyLaw{}) : any_law(rng_); break;
      case 2:
        what = "pose", instance.world_from_object.position += test::random_point(rng_, 1e-3);
        instance.world_from_object.orientation =
            Quat(Eigen::AngleAxisd(rng_.uniform(0.0, 0.05), test::random_direction(rng_))) *
            instance.world_from_object.orientation;
        break;
      case 3: what = "texture", instance.fine = !plain_ && rng_.below(2) == 0 ? any_texture(rng_) : nullptr; break;
      case 4: what = "surface", bodies_[which] = dressed(instance.world_from_object); break;
      case 5: what = "another", add(around(0.01)); break;
      case 6:
        if (bodies_.size() > 1) what = "fewer", bodies_.erase(bodies_.begin() + static_cast<std::ptrdiff_t>(which));
        break;
      case 7:
        what = "motion", instance.world_from_object = instance.motion.at(instance.world_from_object, Seconds(now));
        instance.motion = {};
        if (rng_.below(2) == 0) {
          instance.motion.velocity = {test::random_point(rng_, 0.03), test::random_point(rng_, 2.0)};
          instance.motion.since = Seconds(now);
          instance.motion.horizon = Seconds(0.5);
        }
        break;
      default:
        what = "view", settings_.view.camera.pixels = rng_.below(2) == 0 ? 0 : 200;
        if (rng_.below(3) == 0) settings_.view.zoom = std::exp(rng_.uniform(-0.5, 0.5));
        settings_.handover = Seconds(rng_.below(2) == 0 ? 0.0 : 0.01);
    }
    if (const auto* iso = std::get_if<std::shared_ptr<const IsoSurface>>(&instance.surface);
        what == "material" && iso != nullptr && rng_.below(2) == 0) {
      if (auto other = (*iso)->with_threshold((*iso)->threshold() + rng_.uniform(-5e-4, 5e-4)); other) {
        what = "threshold";
        instance.surface = std::make_shared<const IsoSurface>(std::move(*other));
      }
    }
    auto built = Scene::build(instances(), settings_, effects_);
    if (!built || bodies_.size() > 4) {
      bodies_ = before;
      settings_ = settings_before;
      return;
    }
    ++seen()["changed: " + what];
    adopt(std::move(*built));
  }

 private:
  Vec3 around(double size) { return test::random_point(rng_, size); }
  Body dressed(const Pose& pose) {
    Body body =
        rng_.below(8) == 0 ? layered(rng_) : makers()[rng_.below(static_cast<std::uint32_t>(makers().size()))](rng_);
    Instance& instance = body.instance;
    instance.material = any_material(rng_);
    instance.law = any_law(rng_);
    if (plain_) {
      instance.law = rng_.below(3) == 0 ? Law(GodObjectLaw{}) : Law(ProxyLaw{});
      instance.material.friction_named = false;
      instance.material.friction = {};
    } else if (rng_.below(3) == 0) {
      instance.fine = any_texture(rng_);
    }
    if (!plain_ && rng_.below(4) == 0 && relief_of(instance) != nullptr) {
      instance.material.magnetism = chance(rng_, 0.5, 50.0, 500.0);
      instance.material.stickiness = chance(rng_, 0.5, 0.0, 1.0);
    }
    // What its law does not go with is left out, the rarest first.
    const auto fits = [&] { return Scene::build({instance}, settings_).ok(); };
    if (!fits()) instance.material.magnetism = instance.material.stickiness = 0.0;
    if (!fits()) instance.fine = nullptr;
    for (int attempt = 0; attempt < 8 && !fits(); ++attempt) instance.law = any_law(rng_);
    if (!fits()) instance.law = ProxyLaw{};
    instance.world_from_object = pose;
    return body;
  }
  void add(const Vec3& at) {
    bodies_.push_back(dressed({at, Quat(Eigen::AngleAxisd(rng_.uniform(0.0, 3.0), test::random_direction(rng_)))}));
  }
  [[nodiscard]] std::vector<Instance> instances() const {
    std::vector<Instance> all;
    for (const Body& body : bodies_) all.push_back(body.instance);
    return all;
  }
  void build() {
    auto built = Scene::build(instances(), settings_, effects_);
    if (!built) {
      settings_ = {};
      built = Scene::build(instances(), settings_, effects_);
    }
    adopt(test::must(std::move(built)));
  }
  void adopt(Scene scene) {
    scene_.emplace(std::move(scene));
    lent_ = std::max(lent_, scene_->lends());
    std::ostringstream told;
    for (const Body& body : bodies_) {
      const Instance& instance = body.instance;
      told << body.name << " by " << law_name(instance.law) << ", k " << instance.material.stiffness << ", friction "
           << friction_name(instance.material.friction.kind) << (instance.material.friction_named ? " named " : " ")
           << instance.material.dynamic_friction << ", b " << instance.material.damping << ", viscosity "
           << instance.material.viscosity << (instance.fine != nullptr ? ", textured" : "")
           << (instance.motion.moves() ? ", moving" : "") << ", magnetism " << instance.material.magnetism
           << ", stickiness " << instance.material.stickiness << "\n";
      ++seen()["law: " + std::string(law_name(instance.law))];
      ++seen()["body: " + body.name];
    }
    told << "radius " << settings_.probe_radius << ", zoom " << settings_.view.zoom << ", effects " << effects_.size();
    told_ = told.str();
  }

  Rng& rng_;
  bool plain_;
  std::vector<Body> bodies_;
  std::vector<FieldEffect> effects_;
  SceneSettings settings_;
  std::optional<Scene> scene_;
  std::string told_;
  double lent_ = 0.0;
};

/// A probe that is led, and what it has been given.
struct Led {
  ProxyState state;
  Vec3 at = Vec3::Zero();     ///< m, workspace
  Vec3 force = Vec3::Zero();  ///< N: held until the next tick
  double time = 0.0;          ///< s
  double given = 0.0;         ///< J: the claim's sum
  double work = 0.0;          ///< J
  double stiffness = 0.0;     ///< N/m
  int softened = 0;
  int touched = 0;

  /// Goes by `way` (m), having told so before, and then tells that it goes on by `next`.
  void go(const Scene& scene, const Vec3& way, const Vec3& next) {
    constexpr double dt = 1e-3;
    at += way;
    time += dt;
    ProbeSample probe;
    probe.pose.position = at;
    probe.twist.linear = next / dt;
    probe.time = Seconds(time);
    const ForceSample felt = step(scene, state, probe, Seconds(dt));
    // Of the tick before, felt on the way here. Its stiffness is told now, in the scene.
    const double zoom = scene.settings().view.zoom;
    stiffness = state.account.stiffness() / (zoom * zoom);
    work += force.dot(way);
    given += force.dot(way) - 0.5 * stiffness * way.squaredNorm();
    force = felt.wrench.force;
    softened += felt.flags.has(TickFlag::energy_limited) ? 1 : 0;
    touched += felt.flags.has(TickFlag::contact) ? 1 : 0;
  }
};

/// Somewhere, in small steps.
class Wanderer {
 public:
  Vec3 next(Rng& rng, World& world, const Vec3& at) {
    if (left_-- <= 0) {
      const Vec3 goal = rng.below(6) == 0 ? world.home() : world.place();
      const double speed = std::exp(rng.uniform(std::log(0.01), std::log(2.0)));
      left_ = std::min(400, 1 + static_cast<int>((goal - at).norm() / (speed * 1e-3)));
      step_ = rng.below(8) == 0 ? Vec3(Vec3::Zero()) : Vec3((goal - at) / left_);
      if (step_.norm() > 2e-3) step_ *= 2e-3 / step_.norm();
    }
    return step_;
  }
  void stop() { left_ = 0; }

 private:
  Vec3 step_ = Vec3::Zero();
  int left_ = 0;
};

/// A closed way that begins and ends at home: a hand that looks for a better one.
struct Loop {
  std::array<Vec3, 7> wave{};  ///< m
  Vec3 centre = Vec3::Zero();

  [[nodiscard]] Vec3 at(double t, const Vec3& home) const {
    Vec3 p = centre;
    const double turn = 2.0 * std::numbers::pi * t;
    for (int k = 0; k < 3; ++k) {
      const auto i = static_cast<std::size_t>(2 * k);
      p += std::cos((k + 1) * turn) * wave[i] + std::sin((k + 1) * turn) * wave[i + 1];
    }
    const double in = std::clamp(std::min(t, 1.0 - t) / 0.15, 0.0, 1.0);
    return home + in * in * (3.0 - 2.0 * in) * (p - home);
  }
};

class EnergyClaim : public testing::TestWithParam<int> {};

constexpr int parts = 8;

void judge(const Led& hand, const World& world, std::uint64_t seed, const char* who) {
  ASSERT_LE(hand.given, 1e-9 + world.lent())
      << who << " of seed " << seed << " at " << hand.time << " s, worked " << hand.work << " J, force "
      << hand.force.transpose() << ", stiffness " << hand.stiffness << "\n"
      << world.told();
}

/// One world until `ticks` are over.
void live(std::uint64_t seed, int ticks, bool plain, int& softened, int& touched) {
  Rng rng(seed);
  World world(rng, plain);
  double by_material = 0.0;
  Led hand;
  hand.at = world.home();
  hand.go(world.scene(), Vec3::Zero(), Vec3::Zero());
  hand.given = 0.0;
  Wanderer wanderer;
  Vec3 way = Vec3::Zero();
  const bool greedy = rng.below(2) == 0;
  bool taking = false;
  for (int i = 0; i < ticks; ++i) {
    const double stiffest = world.stiffest();
    if (rng.below(400) == 0) world.change(hand.time);
    if (rng.below(60) == 0) taking = greedy && !taking;
    // Told before the next force is known: where the last one leads, as far as holding it pays.
    Vec3 next = wanderer.next(rng, world, hand.at + way);
    if (taking && hand.stiffness > 0.0 && !hand.force.isZero()) {
      next = rng.uniform(0.2, 1.5) / hand.stiffness * hand.force;
      if (next.norm() > 2e-3) next *= 2e-3 / next.norm();
    }
    // The account's own word for the stiffness is not needed where springs are all that there is.
    if (plain) {
      by_material += hand.force.dot(way) - 0.5 * stiffest * way.squaredNorm();
      ASSERT_LE(by_material, 1e-9) << seed << " at " << hand.time << "\n" << world.told();
    }
    hand.go(world.scene(), way, next);
    way = next;
    judge(hand, world, seed, taking ? "a greedy hand" : "a wandering hand");
    if (testing::Test::HasFatalFailure()) return;
  }
  softened += hand.softened;
  touched += hand.touched;
}

/// One world whose hand goes the same way again and again, each time a little better paid.
void search(std::uint64_t seed, int ticks, int& softened, int& touched) {
  Rng rng(seed);
  World world(rng);
  constexpr int length = 250;
  Led hand;
  hand.at = world.home();
  hand.go(world.scene(), Vec3::Zero(), Vec3::Zero());
  hand.given = 0.0;
  const Vec3 home = hand.at;
  const auto along = [&](Led led, const Loop& loop) {
    for (int i = 1; i <= length && !testing::Test::HasFatalFailure(); ++i) {
      const auto place = [&](int tick) { return loop.at(std::min(1.0, static_cast<double>(tick) / length), home); };
      led.go(world.scene(), place(i) - led.at, place(i + 1) - place(i));
      judge(led, world, seed, "a searching hand");
    }
    return led;
  };
  Loop best;
  double most = -infinity;
  for (int done = 0; done < ticks && !testing::Test::HasFatalFailure(); done += length) {
    Loop loop = best;
    if (most == -infinity || rng.below(10) == 0) {
      loop.centre = world.place();
      for (Vec3& wave : loop.wave) wave = test::random_point(rng, 3e-3);
    } else {
      const double size = std::exp(rng.uniform(std::log(1e-5), std::log(3e-3)));
      loop.centre += test::random_point(rng, size);
      loop.wave[rng.below(7)] += test::random_point(rng, size);
    }
    const Led after = along(hand, loop);
    const double paid = after.given - hand.given;
    if (paid > most) {
      most = paid;
      best = loop;
    }
    // What it has got it keeps: the account has paid.
    if (rng.below(3) == 0) hand = after;
  }
  softened += hand.softened;
  touched += hand.touched;
}

TEST_P(EnergyClaim, no_hand_gets_back_more_than_it_has_put_in) {
  const auto ticks = static_cast<int>(asked_for("ASPERITY_ENERGY", 1e6) / parts);
  const auto first = static_cast<std::uint64_t>(asked_for("ASPERITY_ENERGY_SEED", 17.0)) * 1000003;
  constexpr int life = 4000;
  int softened = 0;
  int touched = 0;
  for (int i = 0; i * life < ticks && !HasFatalFailure(); ++i) {
    const std::uint64_t seed = first + static_cast<std::uint64_t>(i * parts + GetParam());
    if (i % 3 == 2) {
      search(seed, life, softened, touched);
    } else {
      live(seed, life, i % 3 == 1, softened, touched);
    }
  }
  RecordProperty("softened", softened);
  // Otherwise nothing has been put to the test.
  EXPECT_GT(touched, ticks / 10);
  EXPECT_GT(softened, ticks / 2000);
  EXPECT_LT(softened, ticks / 2);
}

/// A ball whose stiffness rises along x, from 500 to 1500 N/m around its middle.
Body half_soft() {
  constexpr double radius = 0.01;
  constexpr double band = 5e-3;
  constexpr double voxel = radius / 20.0;
  SparseSource source = test::sparse_source(ball_distance(radius), test::cube(radius + band), voxel, band, band);
  for (SparseBlock& block : source.blocks) {
    block.material.resize(SparseBlock::points);
    for (int n = 0; n < static_cast<int>(SparseBlock::points); ++n) {
      const double x = voxel * (SparseBlock::side * block.at[0] + n % SparseBlock::side);
      block.material[static_cast<std::size_t>(n)].stiffness = x < 0.0 ? 500.0F : 1500.0F;
    }
  }
  const auto grid = std::make_shared<const SparseGrid>(test::must(SparseGrid::build(std::move(source))));
  return {test::implicit_instance(grid), ball_distance(radius), radius, 3e-3 * radius, "half soft"};
}

/// The most that a hand can get out of one body felt as printed by slow loops around its surface (J). What holding the
/// force gives is taken off, by twice the material's stiffness.
double most_taken(const Instance& instance, double size, std::uint64_t seed) {
  Rng rng(seed);
  const Scene scene = test::must(Scene::build({instance}, SceneSettings{}));
  constexpr int length = 20000;
  double most = -infinity;
  Loop best;
  for (int attempt = 0; attempt < 30; ++attempt) {
    Loop loop = best;
    const bool fresh = attempt < 12;
    if (fresh) {
      // Some where a body's two halves meet, some on a sheet.
      loop.centre = rng.uniform(0.85, 1.05) * size * test::random_direction(rng);
      if (attempt % 3 == 0) loop.centre.x() *= 0.05;
      if (attempt % 3 == 1) loop.centre.z() *= 0.05;
      if (attempt % 3 != 1) loop.centre *= 0.95 * size / loop.centre.norm();
    }
    const double reach = fresh ? 0.7e-3 : std::exp(rng.uniform(std::log(1e-5), std::log(1e-3)));
    if (!fresh) loop.centre += test::random_point(rng, reach);
    if (fresh) loop.wave.fill(Vec3::Zero());
    for (Vec3& wave : loop.wave) {
      if (fresh || rng.below(3) == 0) wave += test::random_point(rng, reach);
    }
    const Vec3 home = loop.centre + 2.0 * size * Vec3(loop.centre.x(), loop.centre.y(), size).normalized();
    Led hand;
    hand.at = home;
    double given = 0.0;
    hand.go(scene, Vec3::Zero(), Vec3::Zero());
    for (int i = 1; i <= length; ++i) {
      const auto place = [&](int tick) { return loop.at(std::min(1.0, static_cast<double>(tick) / length), home); };
      const Vec3 way = place(i) - hand.at;
      if (!hand.force.isZero(0.0)) given += hand.force.dot(way) - instance.material.stiffness * way.squaredNorm();
      hand.go(scene, way, place(i + 1) - place(i));
    }
    if (given <= most) continue;
    most = given;
    best = loop;
  }
  return most;
}

/// Texture of eq. 12 and friction as printed, on a flat square under the default law.
TEST(EnergyOfPrintedLaws, nor_does_texture_as_printed) {
  Instance instance = instance_of(test::flat_square());
  instance.fine = test::fine(test::fine_settings({test::grating(1e-4, 1e-3)}, Formulation::literal));
  EXPECT_GT(most_taken(instance, 0.01, 1), 1e-6);
  instance.fine = test::fine(test::fine_settings({test::grating(1e-4, 1e-3)}));
  EXPECT_LT(most_taken(instance, 0.01, 1), 1e-9);
}

TEST(EnergyOfPrintedLaws, laws_as_printed_do_not_keep_it) {
  std::map<std::string, double> taken;
  for (const std::string& name : law_names()) {
    const Law law = test::must(law_by_name(name));
    if (law.formulation() != Formulation::literal) continue;
    double& most = taken.emplace(name, -infinity).first->second;
    Rng rng(5);
    for (std::size_t kind = 0; kind <= makers().size(); ++kind) {
      Body body = kind < makers().size() ? makers()[kind](rng) : half_soft();
      body.instance.law = law;
      body.instance.material.stiffness = 1000.0;
      if (!Scene::build({body.instance}, SceneSettings{}).ok()) continue;
      most = std::max(most, most_taken(body.instance, body.size, kind));
    }
  }
  EXPECT_GE(taken.size(), 7U);
  for (const auto& [name, most] : taken) EXPECT_GT(most, 1e-6) << name;
}

INSTANTIATE_TEST_SUITE_P(Parts, EnergyClaim, testing::Range(0, parts));

}  // namespace

}  // namespace asperity::strokes
