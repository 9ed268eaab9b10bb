#include "asperity/render/field_effects.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace asperity {

namespace {

/// Whether the effect is made of the probe's velocity: a resistance, which must not turn into a drive.
bool resists(FieldEffectKind kind) noexcept {
  return kind == FieldEffectKind::viscosity || kind == FieldEffectKind::pao ||
         kind == FieldEffectKind::viscosity_scalars;
}

/// The gradient's direction; zero where the field is flat to rounding, whose direction would be noise.
Vec3 direction_of(const ScalarField& field, const Vec3& gradient) noexcept {
  constexpr double rounding = 1e-12;
  const double slope = gradient.norm();
  const double size = std::max(std::abs(field.lowest()), std::abs(field.highest()));
  return slope * field.narrowest_cell() > rounding * size ? Vec3(gradient / slope) : Vec3(Vec3::Zero());
}

/// Force in the object frame, before it is cut. `fixed`: Iwata's direction.
Vec3 uncut_force(const FieldEffect& effect, const FieldJet& jet, const Vec3& velocity, const Vec3& fixed) noexcept {
  const TransferFunction& transfer = effect.transfer;
  const double off = jet.value - effect.value;
  switch (effect.kind) {
    case FieldEffectKind::viscosity: return -transfer(jet.value) * velocity;
    case FieldEffectKind::gradient: return transfer(jet.value) * jet.gradient;
    case FieldEffectKind::iwata: return transfer(jet.value) * fixed;
    case FieldEffectKind::pao: {
      const Vec3 along = direction_of(*effect.field, jet.gradient);
      // As printed, eq. 4 multiplies two vectors: read component by component, it depends on the axes and can drive.
      if (effect.formulation == Formulation::literal) return -transfer(jet.value) * velocity.cwiseProduct(along);
      return -transfer(jet.value) * velocity.dot(along) * along;
    }
    case FieldEffectKind::gravity_scalars: {
      const double towards = off > 0.0 ? -1.0 : (off < 0.0 ? 1.0 : 0.0);
      return transfer(std::abs(off)) * towards * direction_of(*effect.field, jet.gradient);
    }
    case FieldEffectKind::viscosity_scalars: return -transfer(std::abs(off)) * velocity;
  }
  return Vec3::Zero();
}

}  // namespace

Result<TransferFunction> TransferFunction::build(std::vector<Point> points) {
  if (points.empty()) return bad_value("has no point", "transfer", "one point [value, answer] or more");
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto place = [i] { return fmt::format("transfer[{}]", i); };
    if (!std::isfinite(points[i].value) || !std::isfinite(points[i].answer))
      return bad_value(fmt::format("is ({}, {})", points[i].value, points[i].answer), place(), "two finite numbers");
    if (i > 0 && !(points[i].value > points[i - 1].value))
      return bad_value(fmt::format("has the value {} after {}", points[i].value, points[i - 1].value), place(),
                       "values that increase from point to point");
  }
  TransferFunction function;
  function.points_ = std::move(points);
  return function;
}

double TransferFunction::operator()(double value) const noexcept {
  if (points_.empty() || std::isnan(value)) return 0.0;
  const auto above = std::upper_bound(points_.begin(), points_.end(), value,
                                      [](double wanted, const Point& point) { return wanted < point.value; });
  if (above == points_.begin()) return points_.front().answer;
  if (above == points_.end()) return points_.back().answer;
  const Point& low = *(above - 1);
  const double share = (value - low.value) / (above->value - low.value);
  return (1.0 - share) * low.answer + share * above->answer;
}

std::span<const std::string> field_effect_names() {
  return all_names<FieldEffectKind>();
}

Status validate(const FieldEffect& effect) {
  if (effect.field == nullptr) return bad_value("is missing", "field", "a scalar field");
  if (static_cast<std::size_t>(effect.kind) >= field_effect_names().size())
    return bad_value(fmt::format("is {}", static_cast<int>(effect.kind)), "kind", name_list<FieldEffectKind>());
  if (effect.transfer.points().empty())
    return bad_value("has no point", "transfer", "one point [value, answer] or more");
  for (std::size_t i = 0; i < effect.transfer.points().size(); ++i) {
    const double answer = effect.transfer.points()[i].answer;
    if (resists(effect.kind) && answer < 0.0)
      return bad_value(fmt::format("answers {}, which would drive the hand", answer), fmt::format("transfer[{}]", i),
                       "a viscosity of 0 or more (N·s/m)");
  }
  const double length = effect.direction.norm();
  if (!effect.direction.allFinite() || std::abs(length - 1.0) > 1e-6)
    return bad_value(fmt::format("has the length {}", length), "direction", "a unit vector");
  if (!std::isfinite(effect.value)) return bad_value(fmt::format("is {}", effect.value), "value", "a finite number");
  if (!(effect.largest_force > 0.0) || !std::isfinite(effect.largest_force))
    return bad_value(fmt::format("is {}", effect.largest_force), "largest_force", "a force above 0 (N)");
  if (effect.formulation == Formulation::literal && effect.kind != FieldEffectKind::pao)
    return bad_value("is literal", "formulation", "\"consistent\"; only pao has a literal form");
  const Pose& pose = effect.world_from_object;
  if (!pose.position.allFinite() || !pose.orientation.coeffs().allFinite() ||
      std::abs(pose.orientation.norm() - 1.0) > 1e-6)
    return bad_value("is no rigid placement", "world_from_object", "a finite position and a unit quaternion");
  return success();
}

Vec3 field_effect_force(const FieldEffect& effect, int level, const Vec3& position, const Vec3& velocity,
                        CellPolynomial& cache) noexcept {
  const Pose& pose = effect.world_from_object;
  const Vec3 p = pose.apply_inverse(position);
  FieldJet jet;
  if (!p.allFinite() || !effect.field->contains(p) || !effect.field->sample(level, p, cache, jet)) return Vec3::Zero();
  const Vec3 force = uncut_force(effect, jet, pose.rotate_inverse(velocity), pose.rotate_inverse(effect.direction));
  const double size = force.norm();
  if (!std::isfinite(size)) return Vec3::Zero();
  return pose.rotate(size > effect.largest_force ? Vec3(force * (effect.largest_force / size)) : force);
}

}  // namespace asperity
