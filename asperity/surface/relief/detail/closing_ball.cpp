#include "asperity/surface/relief/detail/closing_ball.h"

#include <algorithm>
#include <cmath>

#include "asperity/surface/relief/view.h"

namespace asperity {

namespace {

// Of the radius: how far a ball may reach into the solid before it counts as touching elsewhere, and how far ball and
// height may still move when they are taken. Steps are Newton's: what they leave is of second order in them.
constexpr double touch_of_radius = 1e-4;
constexpr double rest_of_radius = 3e-3;
constexpr double still_of_radius = 1e-3;
// A place is settled when its ball is free to this share of the radius.
constexpr double settled_of_radius = 2e-4;
// Steps along a tangent are one over this times as long as the distance says, at most, and no longer than this share of
// the radius: by which a ball that has no rest on a ridge rolls off it.
constexpr double least_curvature = 0.04;
constexpr double roll_of_radius = 0.1;
// A way along which the height falls by less than this share of the radius is not gone.
constexpr double gain_of_radius = 2.5e-4;
constexpr double most_move_of_radius = 0.5;
// A ball that has come this far from what it is to hold has lost it.
constexpr double most_away_of_radius = 6.0;
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

int nearest_inner(int at, int most) {
  return std::clamp(at, 1, most);
}

}  // namespace

ReliefPatch::ReliefPatch(const ReliefSamples& samples, const ShellPrism& prism, std::uint32_t face_, int i_, int j_)
    : face(face_), cuts(samples.cuts(face_)) {
  i = nearest_inner(i_, cuts - 2);
  j = nearest_inner(j_, cuts - 1 - i);
  const auto place = [&](int di, int dj) { return samples.place(prism, face, i + di, j + dj); };
  point = place(0, 0);
  const Vec3 right = place(1, 0);
  const Vec3 left = place(-1, 0);
  const Vec3 up = place(0, 1);
  const Vec3 down = place(0, -1);
  along_i = 0.5 * (right - left);
  along_j = 0.5 * (up - down);
  second_ii = right + left - 2.0 * point;
  second_jj = up + down - 2.0 * point;
  second_ij = 0.5 * (second_ii + second_jj - (place(1, -1) + place(-1, 1) - 2.0 * point));
}

BallContact::BallContact(const ReliefSamples& samples, const ContactNode& node)
    : prism(samples.prism(node.face)),
      patch(samples, prism, node.face, node.i, node.j),
      alone(node.alone),
      a(node.i - patch.i),
      b(node.j - patch.j) {}

BallSolver::BallSolver(const ReliefSurface& surface, const ReliefSamples& samples, const CoatMoment& moment,
                       double radius)
    : surface_(surface), samples_(samples), moment_(moment), radius_(radius), near_(samples, radius) {}

bool BallSolver::is_free(const Vec3& centre, double share) {
  return !near_.any_within(centre, radius_ * (1.0 - share)).any();
}

bool BallSolver::at_rim(const BallContact& contact) const {
  const TriangleMesh& mesh = surface_.base().mesh();
  const double u = (contact.patch.i + contact.a) / contact.patch.cuts;
  const double v = (contact.patch.j + contact.b) / contact.patch.cuts;
  for (int k = 0; k < 3; ++k) {
    const double coordinate = k == 0 ? 1.0 - u - v : (k == 1 ? u : v);
    if (coordinate <= 1e-9 && mesh.neighbour(contact.patch.face, (k + 1) % 3) == no_index) return true;
  }
  return false;
}

void BallSolver::measure(BallContact& contact, const Vec3& centre) const {
  contact.point = contact.alone ? samples_.place(contact.prism, contact.patch.face, contact.node().i, contact.node().j)
                                : contact.patch.at(contact.a, contact.b);
  const Vec3 offset = centre - contact.point;
  contact.distance = offset.norm();
  Vec3 outward = contact.patch.normal(contact.a, contact.b);
  const double u = (contact.patch.i + contact.a) / contact.patch.cuts;
  const double v = (contact.patch.j + contact.b) / contact.patch.cuts;
  const Vec3 barycentric(1.0 - u - v, u, v);
  if (barycentric.minCoeff() <= 1e-9) {
    const Vec3 within = barycentric.cwiseMax(0.0);
    outward += pseudonormal(surface_.base().mesh(), contact.patch.face, Vec3(within / within.sum())).normalized();
  }
  if (contact.distance <= 1e-9 * radius_) {
    contact.normal = outward.normalized();
    return;
  }
  contact.normal = offset / contact.distance;
  // Beside a rim there is no inside; straight behind one there is.
  const double along = contact.normal.dot(outward);
  if (along < -0.5 || (along < 0.0 && !at_rim(contact))) {
    contact.normal = -contact.normal;
    contact.distance = -contact.distance;
  }
}

namespace {

/// One step of Newton's method towards the point of a patch nearest to `centre`, within the face.
void step_on_patch(BallContact& contact, const Vec3& centre, double& moved) {
  const ReliefPatch& patch = contact.patch;
  const Vec3 offset = patch.at(contact.a, contact.b) - centre;
  const Vec3 ti = patch.tangent_i(contact.a, contact.b);
  const Vec3 tj = patch.tangent_j(contact.a, contact.b);
  const double gi = offset.dot(ti);
  const double gj = offset.dot(tj);
  const double tii = ti.squaredNorm();
  const double tjj = tj.squaredNorm();
  const double tij = ti.dot(tj);
  double hii = tii + offset.dot(patch.second_ii);
  double hjj = tjj + offset.dot(patch.second_jj);
  double hij = tij + offset.dot(patch.second_ij);
  if (!(hii > 0.0 && hii * hjj - hij * hij > 0.02 * (tii * tjj - tij * tij))) {
    hii = tii;
    hjj = tjj;
    hij = tij;
  }
  const double det = hii * hjj - hij * hij;
  double da = (hij * gj - hjj * gi) / det;
  double db = (hij * gi - hii * gj) / det;
  constexpr double most = 2.0;
  const double size = std::max(std::abs(da), std::abs(db));
  if (size > most) {
    da *= most / size;
    db *= most / size;
  }
  // Over an edge of the face only along it.
  contact.at_edge = false;
  const double lower_a = -patch.i;
  const double lower_b = -patch.j;
  const double upper = patch.cuts - patch.i - patch.j;
  double a = contact.a + da;
  double b = contact.b + db;
  const double beyond[3] = {a + b - upper, lower_a - a, lower_b - b};
  const int worst = static_cast<int>(std::max_element(beyond, beyond + 3) - beyond);
  if (beyond[worst] >= 0.0) {
    const double along_a = worst == 1 ? 0.0 : 1.0;
    const double along_b = worst == 0 ? -1.0 : (worst == 1 ? 1.0 : 0.0);
    const double bend = along_a * along_a * hii + 2.0 * along_a * along_b * hij + along_b * along_b * hjj;
    // Onto the edge, then from there to the least along it.
    const double onto_a = worst == 1 ? lower_a - contact.a : (worst == 0 ? 0.5 * (upper - contact.a - contact.b) : 0.0);
    const double onto_b = worst == 2 ? lower_b - contact.b : (worst == 0 ? 0.5 * (upper - contact.a - contact.b) : 0.0);
    const double slope = along_a * (gi + hii * onto_a + hij * onto_b) + along_b * (gj + hij * onto_a + hjj * onto_b);
    const double along = bend > 0.0 ? std::clamp(-slope / bend, -most, most) : 0.0;
    a = contact.a + onto_a + along * along_a;
    b = contact.b + onto_b + along * along_b;
    contact.at_edge = true;
    contact.edge = (along_a * ti + along_b * tj).normalized();
    a = std::clamp(a, lower_a, patch.cuts - patch.i + 0.0);
    b = std::clamp(b, lower_b, upper - a);
  }
  moved = std::max(std::abs(a - contact.a), std::abs(b - contact.b));
  contact.a = a;
  contact.b = b;
}

}  // namespace

void BallSolver::follow(BallContact& contact, const Vec3& centre) const {
  constexpr int most_steps = 24;
  constexpr double near = 0.8;
  constexpr double still = 0.02;
  if (!contact.alone) {
    for (int step = 0; step < most_steps; ++step) {
      double moved = 0.0;
      step_on_patch(contact, centre, moved);
      if (std::max(std::abs(contact.a), std::abs(contact.b)) > near) {
        const int i = contact.patch.i + static_cast<int>(std::lround(contact.a));
        const int j = contact.patch.j + static_cast<int>(std::lround(contact.b));
        const int inner_i = nearest_inner(i, contact.patch.cuts - 2);
        const int inner_j = nearest_inner(j, contact.patch.cuts - 1 - inner_i);
        if (inner_i != contact.patch.i || inner_j != contact.patch.j) {
          contact.a += contact.patch.i - inner_i;
          contact.b += contact.patch.j - inner_j;
          contact.patch = ReliefPatch(samples_, contact.prism, contact.patch.face, inner_i, inner_j);
          continue;
        }
      }
      if (moved < still) break;
    }
  }
  measure(contact, centre);
}

double BallSolver::bend(const BallContact& contact, const Vec3& way) const {
  const double distance = std::max(0.1 * radius_, contact.distance);
  const double as_point = radius_ / distance;
  if (contact.alone) return as_point;
  const auto along = [&](const Vec3& to) {
    // The way in steps of the grid, by least squares.
    const Vec3 ti = contact.patch.tangent_i(contact.a, contact.b);
    const Vec3 tj = contact.patch.tangent_j(contact.a, contact.b);
    const double ii = ti.squaredNorm();
    const double ij = ti.dot(tj);
    const double jj = tj.squaredNorm();
    const double det = ii * jj - ij * ij;
    const double a = (jj * ti.dot(to) - ij * tj.dot(to)) / det;
    const double b = (ii * tj.dot(to) - ij * ti.dot(to)) / det;
    const Vec3 second =
        a * a * contact.patch.second_ii + 2.0 * a * b * contact.patch.second_ij + b * b * contact.patch.second_jj;
    const double size = (a * ti + b * tj).squaredNorm();
    if (!(size > 0.0)) return as_point;
    const double curvature = -second.dot(contact.normal) / size;
    return curvature <= -0.8 / distance ? -4.0 : radius_ * curvature / (1.0 + curvature * distance);
  };
  if (!contact.at_edge) return along(way);
  const double share = std::pow(way.dot(contact.edge), 2.0);
  return share * along(contact.edge) + (1.0 - share) * as_point;
}

BallSolver::Found BallSolver::add_deepest(const Vec3& centre, bool at_rest) {
  const NearSamples::Found found = near_.nearest(centre, radius_ * (1.0 - touch_of_radius));
  if (!found.any()) return Found::nothing;
  const auto apart = [](const BallContact& one, double i, double j) {
    const double di = one.patch.i + one.a - i;
    const double dj = one.patch.j + one.b - j;
    return std::max({std::abs(di), std::abs(dj), std::abs(di + dj)});
  };
  const auto known = [&](std::uint32_t face, double i, double j, double within) {
    return std::any_of(contacts_.begin(), contacts_.end(), [&](const BallContact& one) {
      return one.patch.face == face && apart(one, i, j) <= within && !(at_rest && one.alone);
    });
  };
  if (contacts_.size() == contacts_.capacity()) {
    // The one farthest off makes room.
    std::size_t farthest = 0;
    for (std::size_t k = 1; k < contacts_.size(); ++k) {
      if (contacts_[k].distance > contacts_[farthest].distance) farthest = k;
    }
    contacts_.swap_remove(farthest);
  }
  ContactNode node{found.face, found.i, found.j, false};
  if (!known(found.face, found.i, found.j, 1.5)) {
    BallContact contact(samples_, node);
    follow(contact, centre);
    if (contact.distance < radius_ * (1.0 - 0.5 * touch_of_radius) &&
        !known(found.face, contact.patch.i + contact.a, contact.patch.j + contact.b, 0.5)) {
      contacts_.push_back(contact);
      return Found::added;
    }
  }
  if (!at_rest) return Found::known;
  // The surface as the patches tell it leaves the ball free, and a node of it does not: that node itself, then.
  node.alone = true;
  for (const BallContact& one : contacts_) {
    if (one.alone && one.patch.face == node.face && apart(one, node.i, node.j) < 0.1) return Found::known;
  }
  BallContact contact(samples_, node);
  measure(contact, centre);
  contacts_.push_back(contact);
  return Found::added;
}

void BallSolver::prune() {
  for (std::size_t k = contacts_.size(); k-- > 0;) {
    bool drop = contacts_[k].distance > 1.3 * radius_;
    for (std::size_t other = 0; other < k && !drop; ++other)
      drop = (contacts_[other].point - contacts_[k].point).squaredNorm() < 1e-10 * radius_ * radius_;
    if (drop) contacts_.swap_remove(k);
  }
}

BallSolver::Move BallSolver::move_from(const Vec3& centre, const Vec3& held) const {
  HalfSpace walls[8];
  std::size_t count = 0;
  for (const BallContact& one : contacts_)
    walls[count++] = {one.normal, radius_ - one.distance + one.normal.dot(centre - held)};
  Move move;
  move.rest = nearest_in_halfspaces({walls, count}, 1e-7 * radius_);
  if (!move.rest.found) return move;
  move.known = true;
  move.by = held + move.rest.point - centre;
  const double away = move.rest.point.norm();
  if ((move.rest.count == 1 || move.rest.count == 2) && away > 0.5 * radius_) {
    // Along what the contacts leave free the distance alone is no measure: they bend, and the ball with them.
    const Vec3& first = walls[move.rest.active[0]].normal;
    Vec3 way = move.rest.count == 2 ? Vec3(first.cross(walls[move.rest.active[1]].normal))
                                    : Vec3(move.by - move.by.dot(first) * first);
    const double size = way.norm();
    if (size > 1e-12 * radius_) {
      way /= size;
      double curvature = 1.0;
      for (int k = 0; k < move.rest.count; ++k)
        curvature -= move.rest.force[k] / away * bend(contacts_[move.rest.active[k]], way);
      const double along = move.by.dot(way);
      double newton = along / std::max(curvature, least_curvature);
      bool rolls = false;
      if (curvature < least_curvature && std::abs(newton) < roll_of_radius * radius_) {
        newton = std::copysign(roll_of_radius * radius_, along);
        rolls = true;
      }
      // What there is to be gained: to second order along the way.
      const double gain = std::abs(along) * std::abs(newton) - std::min(0.0, curvature) * newton * newton;
      if (0.5 * gain < gain_of_radius * radius_ * radius_) {
        move.rest_of_way = std::sqrt(std::max(0.0, move.by.squaredNorm() - along * along));
        move.by -= along * way;
        return move;
      }
      move.rolls = rolls;
      const double on = std::clamp(newton, -roll_of_radius * radius_, roll_of_radius * radius_);
      move.by += (on - along) * way;
      // The contacts bend away under the way: the ball stays on them, to second order.
      const auto falls = [&](int k) { return 0.5 * on * on / radius_ * bend(contacts_[move.rest.active[k]], way); };
      if (move.rest.count == 1) {
        move.by -= falls(0) * first;
      } else {
        const Vec3& second = walls[move.rest.active[1]].normal;
        const double cosine = first.dot(second);
        const double one = falls(0);
        const double other = falls(1);
        move.by -= ((one - cosine * other) * first + (other - cosine * one) * second) / (1.0 - cosine * cosine);
      }
    }
  }
  const double most = most_move_of_radius * radius_;
  if (move.by.norm() > most) {
    move.by *= most / move.by.norm();
    move.rolls = true;
  }
  move.rest_of_way = move.by.norm();
  return move;
}

void BallSolver::keep(const Vec3& centre, const NearestInHalfSpaces& rest, RestingBall& ball) const {
  ball.centre = centre;
  ball.count = rest.count;
  Mat3 towards;
  for (int k = 0; k < rest.count; ++k) {
    const BallContact& one = contacts_[rest.active[k]];
    ball.node[k] = one.node();
    ball.point[k] = one.point;
    towards.col(k) = one.point - centre;
  }
  if (rest.count == 3) ball.cone = towards.inverse();
}

double BallSolver::settle(const ShellRay& ray, double lowest, const RestingBall& start, RestingBall& rest) {
  constexpr int most_steps = 32;
  contacts_.clear();
  for (int k = 0; k < start.count; ++k) contacts_.push_back(BallContact(samples_, start.node[k]));
  Vec3 centre = start.centre;
  if (contacts_.empty()) add_deepest(centre, false);
  double height = lowest;
  double share = 1.0;
  Vec3 before = Vec3::Zero();
  const double scale = ray.direction.norm();
  for (int step = 0; step < most_steps; ++step) {
    for (BallContact& one : contacts_) follow(one, centre), prune();
    const Vec3 held = ray.at(height);
    if ((centre - held).squaredNorm() > most_away_of_radius * most_away_of_radius * radius_ * radius_)
      return not_a_number;
    Move move = move_from(centre, held);
    if (!move.known) return not_a_number;
    // Between walls that bend the ball may swing to and fro; on three it has nowhere to.
    const bool swings =
        move.rest.count < 3 && move.by.dot(before) < 0.0 && move.by.squaredNorm() > 0.1 * before.squaredNorm();
    share = swings ? 0.5 * share : std::min(1.0, 1.4 * share);
    before = move.by;
    move.by *= share;
    centre += move.by;
    const Vec3 reach = centre - held;
    const double away = reach.norm();
    double rise = 0.0;
    if (!move.rolls) {
      // A ball around the place that nothing holds there comes down.
      const double along = away > 0.0 ? std::max(0.1 * scale, reach.dot(ray.direction) / away) : scale;
      rise = std::clamp((away - radius_) / along, -0.5 * radius_, 0.5 * radius_);
      rise = std::max(lowest - height, rise);
      height += rise;
    }
    const bool still = !move.rolls && move.rest_of_way <= rest_of_radius * radius_ &&
                       std::abs(rise) * scale <= still_of_radius * radius_;
    const Found found = add_deepest(centre, still);
    if (still && found != Found::added && (found == Found::nothing || is_free(centre, settled_of_radius))) {
      keep(centre, move.rest, rest);
      return height;
    }
  }
  // Out of steps: what was reached stands when it is close.
  if (std::abs((centre - ray.at(height)).norm() - radius_) > settled_of_radius * radius_ ||
      !is_free(centre, settled_of_radius))
    return not_a_number;
  rest.centre = centre;
  rest.count = 0;
  return height;
}

bool BallSolver::beyond_wall(const ShellRay& ray, double from, double to) const {
  if (!std::isfinite(to)) return true;
  const double scale = ray.direction.norm();
  if ((to - from) * scale <= 0.1 * radius_) return false;
  SurfaceCache cache;
  return surface_.view(cache, moment_)
      .first_touch({ray.at(from + 1e-3 * radius_ / scale), ray.at(to)}, Sides::both)
      .hit;
}

double BallSolver::settle_from_above(const ShellRay& ray, double lowest, RestingBall& rest) {
  constexpr int most_steps = 64;
  const double scale = ray.direction.norm();
  double level = lowest + radius_ / scale;
  for (int i = 0; i < most_steps; ++i) {
    const NearSamples::Found found = near_.nearest(ray.at(level), radius_ * (1.0 - touch_of_radius));
    if (!found.any()) {
      if (i == 0 || beyond_wall(ray, lowest, level)) break;
      // Free: what it touched last is what it comes down on.
      RestingBall start;
      start.centre = ray.at(level);
      const double settled = settle(ray, lowest, start, rest);
      return beyond_wall(ray, lowest, settled) ? not_a_number : settled;
    }
    level += std::clamp(radius_ - found.distance, 0.05 * radius_, radius_) / scale;
  }
  return not_a_number;
}

}  // namespace asperity
