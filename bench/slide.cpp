#include "bench/slide.h"

#include <cmath>
#include <utility>

#include "asperity/render/step.h"

namespace asperity::bench {

std::vector<Vec3> wandering_directions(std::size_t ticks) {
  std::vector<Vec3> directions;
  directions.reserve(ticks);
  const double advance = slide_speed * tick_seconds / sphere_radius;
  Vec3 place = Vec3(0.3, 1.0, 0.2).normalized();
  Vec3 heading = place.cross(Vec3(1.0, 0.0, 0.0)).normalized();
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    const double travelled = advance * static_cast<double>(tick);
    directions.push_back(place);
    // Curvature that swings slowly keeps the slide from closing into a circle.
    const double turn = advance * (0.9 * std::sin(0.37 * travelled) + 0.6 * std::sin(1.13 * travelled));
    const Vec3 ahead = std::cos(advance) * place + std::sin(advance) * heading;
    const Vec3 onward = std::cos(advance) * heading - std::sin(advance) * place;
    place = ahead.normalized();
    heading = (std::cos(turn) * onward + std::sin(turn) * place.cross(onward)).normalized();
  }
  return directions;
}

Slide make_slide(const TriangleIndex& index, std::size_t ticks) {
  Slide slide;
  slide.direction = wandering_directions(ticks);
  slide.surface.reserve(ticks);
  for (const Vec3& place : slide.direction) {
    const FirstHit hit = index.first_hit({2.0 * sphere_radius * place, Vec3::Zero()});
    slide.surface.push_back(hit.face != no_index ? 2.0 * sphere_radius * (1.0 - hit.t) : sphere_radius);
  }
  return slide;
}

Result<Row> sliding_row(const std::string& name, std::vector<Instance> instances, std::shared_ptr<const Slide> slide,
                        const Led& led) {
  ASPERITY_TRY(Scene scene, Scene::build(std::move(instances), led.radius));
  ProxyState state;
  ProxyCache cache;
  ProbeSample probe;
  probe.pose.position = led.start * slide->direction.front();
  step(scene, state, cache, probe, Seconds(tick_seconds));
  return Row(name, [scene = std::move(scene), slide, led, state, cache, probe](std::size_t tick) mutable {
    probe.pose.position = slide->probe(led.resting ? 0 : tick, led.radius);
    return step(scene, state, cache, probe, Seconds(tick_seconds)).flags.has(TickFlag::contact);
  });
}

}  // namespace asperity::bench
