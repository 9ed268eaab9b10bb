// Random strokes over random pairs and triples of bodies of every provider, by a point and by balls, at 0.01 to 5 m/s:
// the proxy is never inside of anything, never held by nothing, and never gone where something should hold it.
//   ASPERITY_STROKES       how many ticks (default: a million, over all)
//   ASPERITY_STROKES_SEED  default: changes with the date; every failure tells its own

#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <iostream>
#include <map>
#include <sstream>

#include "tests/strokes/bodies.h"

namespace asperity::strokes {

namespace {

double number_in(const char* variable, double otherwise) {
  const char* text = std::getenv(variable);
  return text == nullptr ? otherwise : std::strtod(text, nullptr);
}

std::uint64_t seed_of_the_day() {
  const auto days = std::chrono::duration_cast<std::chrono::hours>(std::chrono::system_clock::now().time_since_epoch());
  return static_cast<std::uint64_t>(number_in("ASPERITY_STROKES_SEED", static_cast<double>(days.count() / 24)));
}

Vec3 random_in_ball(Rng& rng) {
  for (;;) {
    const Vec3 v = test::random_point(rng, 1.0);
    if (v.squaredNorm() <= 1.0) return v;
  }
}

Pose random_pose(Rng& rng, const Vec3& position) {
  Pose pose;
  pose.position = position;
  pose.orientation = Quat(Eigen::AngleAxisd(rng.uniform(0.0, 3.0), test::random_direction(rng)));
  return pose;
}

/// What a hand draws its strokes over, and what judges them.
class Bodies {
 public:
  /// `first`: what it begins with, in place of any.
  Bodies(Rng& rng, std::size_t count, double radius, double friction, Maker first = nullptr) : radius_(radius) {
    for (std::size_t i = 0; i < count; ++i) {
      const bool told = i == 0 && first != nullptr;
      Body body = (told ? first : makers()[rng.below(static_cast<std::uint32_t>(makers().size()))])(rng);
      Vec3 at = Vec3::Zero();
      if (i > 0) {
        // Around a place on the surfaces so far: overlapping, touching, sunk or nested.
        const Vec3 on = on_surface(rng, Vec3::Zero(), bodies_[0].size);
        at = on + rng.uniform(0.0, 1.0) * body.size * random_in_ball(rng);
        junction_ = on;
      }
      body.instance.material.static_friction = 1.2 * friction;
      body.instance.material.dynamic_friction = friction;
      bodies_.push_back(placed(std::move(body), random_pose(rng, at)));
      error_ = std::max(error_, bodies_.back().error);
    }
    if (count == 1) junction_ = on_surface(rng, Vec3::Zero(), bodies_[0].size);
    std::vector<Instance> instances;
    for (const Body& body : bodies_) instances.push_back(body.instance);
    scene_.emplace(test::must(Scene::build(std::move(instances), radius)));
  }

  [[nodiscard]] const Scene& scene() const { return *scene_; }
  [[nodiscard]] const Vec3& junction() const { return junction_; }
  [[nodiscard]] double error() const { return error_; }
  /// How far the tip at `p` is outside of all of them (m).
  [[nodiscard]] double clearance(const Vec3& p) const {
    double least = infinity;
    for (const Body& body : bodies_) least = std::min(least, body.distance(p));
    return least - radius_;
  }
  /// Whether the clearance around `p` is known: near the rim of a sheet it is not.
  [[nodiscard]] bool known(const Vec3& p) const {
    constexpr double deepest = 3e-3;
    return std::all_of(bodies_.begin(), bodies_.end(), [&](const Body& body) {
      const Vec3 local = body.instance.world_from_object.apply_inverse(p);
      return local.head<2>().cwiseAbs().maxCoeff() < body.rim - radius_ - deepest;
    });
  }
  /// A place where the clearance is `depth` below 0, on the way from anywhere around `centre`.
  [[nodiscard]] Vec3 at_clearance(Rng& rng, const Vec3& centre, double around, double wanted) const {
    const Vec3 start = centre + around * random_in_ball(rng);
    Vec3 p = start;
    for (int i = 0; i < 12; ++i) {
      const double missing = wanted - clearance(p);
      if (std::abs(missing) < 1e-5) break;
      p += missing * slope(p);
    }
    return p;
  }
  [[nodiscard]] Vec3 on_surface(Rng& rng, const Vec3& centre, double around) const {
    return at_clearance(rng, centre, around, 0.0);
  }
  /// Where a hand at `probe` goes next: nowhere on the way very deep, for there what is nearest says little.
  [[nodiscard]] Vec3 target(Rng& rng, const Vec3& probe) const {
    constexpr double deepest = 2e-3;
    for (int attempt = 0; attempt < 100; ++attempt) {
      const Vec3 target = at_clearance(rng, junction_, 4e-3, rng.uniform(-deepest, 0.5e-3));
      bool shallow = true;
      for (int i = 1; i <= 8 && shallow; ++i)
        shallow = clearance(probe + 0.125 * i * (target - probe)) > -1.2 * deepest;
      if (shallow) return target;
    }
    return probe + 1e-4 * random_in_ball(rng);
  }
  /// Where a tip that starts at `from` comes to when it is led towards `goal` in small strides past nothing.
  [[nodiscard]] Vec3 led(Vec3 from, const Vec3& goal, double stride = 50e-6, double enough = infinity,
                         double slope_asked = 1e-3) const {
    double left = (from - goal).norm();
    enough = left - enough;
    const double least = std::min(1e-7, 0.1 * stride);
    for (int i = 0; i < 400 && stride > least; ++i) {
      Vec3 next = from + std::min(1.0, stride / left) * (goal - from);
      bool clear = false;
      for (int push = 0; push < 30 && !clear; ++push) {
        clear = true;
        for (const Body& body : bodies_) {
          const double inside = radius_ - body.distance(next);
          if (inside <= 1e-8) continue;
          clear = false;
          next += inside * slope(body, next);
        }
      }
      const double now = (next - goal).norm();
      if (clear && now < left - slope_asked * stride) {
        from = next;
        left = now;
      } else {
        stride *= 0.5;
      }
      if (left < std::max(1e-7, enough)) break;
    }
    return from;
  }
  /// Whether friction may hold a tip at `p`: between several bodies it may, on one of them within its cone.
  [[nodiscard]] bool may_stick(const Vec3& p, const Vec3& goal, double coefficient) const {
    constexpr double touching = 50e-6;
    const Body* only = nullptr;
    for (const Body& body : bodies_) {
      if (body.distance(p) - radius_ > touching) continue;
      if (only != nullptr) return true;
      only = &body;
    }
    if (only == nullptr) return false;
    const auto& sheets = only->sheets;
    if (!sheets.empty() &&
        std::all_of(sheets.begin(), sheets.end(), [&](const Distance& d) { return d(p) - radius_ <= touching; }))
      return true;
    const Vec3 normal = slope(*only, p);
    const double push = (p - goal).dot(normal);
    return (p - goal - push * normal).norm() <= 1.5 * coefficient * push;
  }
  /// Of each body.
  [[nodiscard]] std::string clearances(const Vec3& p) const {
    std::ostringstream text;
    for (const Body& body : bodies_) text << " " << body.distance(p) - radius_;
    return text.str();
  }
  [[nodiscard]] std::string told() const {
    std::string text;
    for (const Body& body : bodies_) text += body.name + " ";
    return text;
  }

 private:
  template <class F>
  static Vec3 slope_of(const F& f, const Vec3& p) {
    Vec3 g;
    for (int k = 0; k < 3; ++k) g[k] = f(p + 1e-7 * Vec3::Unit(k)) - f(p - 1e-7 * Vec3::Unit(k));
    const double length = g.norm();
    return length > 0.0 ? Vec3(g / length) : Vec3::UnitZ();
  }
  [[nodiscard]] Vec3 slope(const Vec3& p) const {
    return slope_of([&](const Vec3& q) { return clearance(q); }, p);
  }
  static Vec3 slope(const Body& body, const Vec3& p) { return slope_of(body.distance, p); }

  std::vector<Body> bodies_;
  std::optional<Scene> scene_;
  Vec3 junction_ = Vec3::Zero();
  double radius_ = 0.0;
  double error_ = 0.0;
};

struct Tally {
  std::uint64_t ticks = 0;
  std::uint64_t touching = 0;
  std::uint64_t through = 0;
  std::uint64_t lost = 0;
  std::uint64_t stuck = 0;
  std::uint64_t asked = 0;  ///< of the oracle that leads a tip
};

/// What is felt along one stroke, judged tick by tick.
class Judge {
 public:
  Judge(const Bodies& bodies, double friction, Tally& tally) : bodies_(bodies), friction_(friction), tally_(tally) {}
  /// What was wrong first, or nothing.
  [[nodiscard]] const std::string& wrong() const { return wrong_; }

  void judge(Rng& rng, const Vec3& probe, const ForceSample& sample) {
    if (!bodies_.known(probe) || !bodies_.known(sample.proxy)) {
      held_since_.reset();
      return;
    }
    const double force = sample.wrench.force.norm();
    const double inside = -bodies_.clearance(sample.proxy);
    if (inside > tolerance_) {
      ++tally_.through;
      tell("through", inside, probe, sample);
    }
    const double depth = -bodies_.clearance(probe);
    // A force that would give back more than the hand has put in is rendered weaker, and says so: its spring is judged.
    const bool weaker = sample.flags.has(TickFlag::energy_limited);
    const double held = weaker ? test::stiffness * (sample.proxy - probe).norm() : force;
    if (held < test::stiffness * (depth - tolerance_) - 1e-9) {
      ++tally_.lost;
      tell("lost", depth - held / test::stiffness, probe, sample);
    }
    // It may be on its way for a few ticks, and says so.
    constexpr int most_open = 5;
    open_ = sample.flags.has(TickFlag::work_left) ? open_ + 1 : 0;
    if (within(force, std::max(0.0, depth)) || (open_ > 0 && open_ <= most_open)) {
      held_since_.reset();
      return;
    }
    // What has been judged once is judged again where it changes, and now and then.
    if (!held_since_ && std::abs(force - judged_) < 0.1 * judged_ && rng.below(16) != 0) return;
    judged_ = force;
    ++tally_.asked;
    // A barrier may be passed a little late.
    constexpr double late = 30e-6;
    const double left = least_left(sample.proxy, probe, force);
    if (within(force, left)) {
      held_since_.reset();
    } else if (!held_since_) {
      held_since_ = probe;
    } else if ((probe - *held_since_).norm() > late) {
      ++tally_.stuck;
      tell("stuck", force / test::stiffness - left, probe, sample);
    }
  }

 private:
  /// Whether a proxy that cannot come nearer than `left` (m) may press with as much.
  [[nodiscard]] bool within(double force, double left) const {
    const double most = 1.5 * std::sqrt(1.0 + 1.44 * friction_ * friction_);
    return force <= test::stiffness * (most * left + 4.0 * tolerance_);
  }
  /// How far from the probe a tip that is led there by small strides stays, or may stay (m). The dearest is asked last.
  [[nodiscard]] double least_left(const Vec3& proxy, const Vec3& probe, double force) const {
    const double held = (proxy - probe).norm();
    if (friction_ > 0.0 && bodies_.may_stick(proxy, probe, 1.2 * friction_)) return held;
    const double left = (bodies_.led(proxy, probe) - probe).norm();
    if (within(force, left)) return left;
    // Over the brink of a face no step leads nearer at first.
    constexpr double off_brink = 30e-6;
    const double near = (bodies_.led(proxy, probe, 0.2e-6, off_brink, 0.05) - probe).norm();
    return near > held - off_brink ? held : left;
  }
  void tell(const char* what, double size, const Vec3& probe, const ForceSample& sample) {
    if (!wrong_.empty()) return;
    std::ostringstream text;
    text << what << " by " << size << " at tick " << tally_.ticks << ", probe " << probe.transpose() << ", proxy "
         << sample.proxy.transpose() << ", force " << sample.wrench.force.transpose() << ", converged "
         << !unfinished(sample.flags) << ", proxy outside by" << bodies_.clearances(sample.proxy);
    wrong_ = text.str();
  }

  const Bodies& bodies_;
  double friction_;
  Tally& tally_;
  double tolerance_ = 5e-6 + bodies_.error();
  double judged_ = 0.0;
  int open_ = 0;  ///< ticks in a row whose budget was spent
  std::optional<Vec3> held_since_;
  std::string wrong_;
};

/// One stroke of many; answers what was wrong first, or nothing.
std::string stroke(Rng& rng, const Bodies& bodies, double friction, Tally& tally) {
  ProxyState state;
  ProxyCache cache(bodies.scene());
  Vec3 probe = bodies.at_clearance(rng, bodies.junction(), 4e-3, 1e-3);
  if (bodies.clearance(probe) < 0.5e-3) return {};
  test::touch(bodies.scene(), state, probe);
  Judge judge(bodies, friction, tally);
  for (int leg = 0; leg < 12 && judge.wrong().empty(); ++leg) {
    const double speed = std::exp(rng.uniform(std::log(0.01), std::log(5.0)));
    const Vec3 target = bodies.target(rng, probe);
    const double length = (target - probe).norm();
    const int ticks = std::min(200, static_cast<int>(std::ceil(length / (speed * 1e-3))));
    const Vec3 start = probe;
    for (int i = 1; i <= ticks; ++i) {
      const Vec3 next = start + std::min(1.0, i * speed * 1e-3 / length) * (target - start);
      ProbeSample told = test::probe_at(next);
      told.twist.linear = (next - probe) / 1e-3;
      probe = next;
      const ForceSample sample = step(bodies.scene(), state, cache, told, test::tick);
      ++tally.ticks;
      if (sample.wrench.force.norm() > 0.0) ++tally.touching;
      judge.judge(rng, probe, sample);
    }
  }
  return judge.wrong();
}

/// Ten strokes over one scene, all drawn from the two numbers. What was wrong, told. `first`: what the scene begins
/// with, touched by a point.
std::vector<std::string> strokes_over(std::uint64_t seed, std::uint64_t scene, Tally& tally,
                                      std::map<std::string, int>& kinds, Maker first = nullptr) {
  Rng rng(seed * 1000003 + scene);
  const double radius = rng.uniform(0.0, 1.0) < 0.4 || first != nullptr ? 0.0 : rng.uniform(0.2e-3, 3e-3);
  const double friction = rng.uniform(0.0, 1.0) < 0.6 ? 0.0 : rng.uniform(0.05, 0.6);
  const std::size_t count = first != nullptr ? 1 + rng.below(2) : 1 + (rng.below(8) + 6) / 7 + rng.below(2);
  const Bodies bodies(rng, count, radius, friction, first);
  std::vector<std::string> told;
  for (int i = 0; i < 10; ++i) {
    const std::uint64_t before = tally.ticks;
    const std::string wrong = stroke(rng, bodies, friction, tally);
    if (wrong.empty()) continue;
    kinds[wrong.substr(0, wrong.find(' ')) + (radius > 0.0 ? " ball" : " point") +
          (friction > 0.0 ? " with friction: " : ": ") + bodies.told()] += 1;
    std::ostringstream text;
    text << "seed " << seed << ", scene " << scene << " (" << bodies.told() << "radius " << radius << ", friction "
         << friction << "), stroke " << i << " from tick " << before << ": " << wrong;
    told.push_back(text.str());
  }
  return told;
}

/// One of `parts` shares of the ticks.
void never_through_never_stuck_never_lost(std::uint64_t part, std::uint64_t parts, Maker first = nullptr) {
  const double wanted = number_in("ASPERITY_STROKES", 1e6) / static_cast<double>(parts);
  ASSERT_GE(wanted, 1.0) << "ASPERITY_STROKES takes a number of ticks";
  const std::uint64_t seed = seed_of_the_day();
  testing::Test::RecordProperty("seed", std::to_string(seed));
  Tally tally;
  int told = 0;
  std::map<std::string, int> kinds;
  for (std::uint64_t scene = part; static_cast<double>(tally.ticks) < wanted; scene += parts) {
    for (const std::string& wrong : strokes_over(seed, scene, tally, kinds, first)) {
      if (++told <= 20) ADD_FAILURE() << wrong;
    }
  }
  for (const auto& [kind, count] : kinds) std::cout << count << " " << kind << "\n";
  std::cout << "seed " << seed << ": " << tally.ticks << " ticks, " << tally.touching << " touching, " << tally.through
            << " through, " << tally.lost << " lost, " << tally.stuck << " stuck, " << tally.asked << " asked\n";
  EXPECT_GT(tally.touching, tally.ticks / 4) << "too little was touched to prove anything";
}

class Strokes : public testing::TestWithParam<std::uint64_t> {};

constexpr std::uint64_t most_parts = 16;
TEST_P(Strokes, AProxyIsNeverThroughNeverStuckNeverLost) {
  never_through_never_stuck_never_lost(GetParam(), most_parts);
}
// On one relief that crosses itself, alone and beside another body.
TEST_P(Strokes, NorBetweenFolds) {
  constexpr std::uint64_t shares = 8;
  never_through_never_stuck_never_lost(GetParam(), shares * most_parts, folds);
}
INSTANTIATE_TEST_SUITE_P(Parts, Strokes, testing::Range(std::uint64_t{0}, most_parts));

/// Strokes that failed once: nothing is wrong with them now. What was touched and asked.
Tally strokes_again(std::uint64_t seed, std::uint64_t scene, Maker first = nullptr) {
  Tally tally;
  std::map<std::string, int> kinds;
  for (const std::string& wrong : strokes_over(seed, scene, tally, kinds, first)) ADD_FAILURE() << wrong;
  return tally;
}

// Along the crease of an isosurface and a wall towards a relief: what stands 0.9 mm ahead was taken for what it
// touches, and two ticks of work led nowhere.
TEST(StrokesThatOnceFailed, along_a_crease_towards_a_third_surface) {
  EXPECT_GT(strokes_again(20782, 72).asked, 50U);
}

// A slip under friction that would have ended farther from the probe was put back, in every tick anew.
TEST(StrokesThatOnceFailed, a_slip_that_only_a_part_of_leads_nearer) {
  EXPECT_GT(strokes_again(102, 86).touching, 3000U);
}

// Along a surface that bends away from its chord, what the chord met was nowhere near, and it did not go on.
TEST(StrokesThatOnceFailed, a_way_that_bends_away_from_what_its_chord_meets) {
  EXPECT_GT(strokes_again(20783, 132, folds).asked, 50U);
}

// Two reliefs: a tenth of a skin before one of them it was put a skin off the other, and so behind the first.
TEST(StrokesThatOnceFailed, lifted_off_one_surface_it_stays_before_the_next) {
  EXPECT_GT(strokes_again(20783, 137, folds).touching, 3000U);
}

// A walk over an isosurface that was cut short told the normal of the place before, and friction held by that.
TEST(StrokesThatOnceFailed, friction_on_an_isosurface_holds_by_the_normal_where_it_stands) {
  EXPECT_GT(strokes_again(0, 19).asked, 50U);
}

// A long slip under friction kept to what its first two steps had aimed at, and came to rest outside of the cone where
// the surface had turned: all but the push was cut off.
TEST(StrokesThatOnceFailed, a_long_slip_comes_to_rest_on_the_cone) {
  EXPECT_GT(strokes_again(1, 134, folds).touching, 3000U);
}

// Beside the corner of a polyhedron a look found nothing for a moment, and a ball that was no nearer than twelve moves
// before was let go to the probe.
TEST(StrokesThatOnceFailed, a_ball_that_comes_no_nearer_is_not_let_go) {
  EXPECT_GT(strokes_again(31128, 11).touching, 3000U);
}

}  // namespace

}  // namespace asperity::strokes
