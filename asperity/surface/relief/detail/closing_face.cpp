#include "asperity/surface/relief/detail/closing_face.h"

#include <algorithm>
#include <cmath>

namespace asperity {

namespace {

// Of the radius. A place counts as touched where the ball on it is free but for this.
constexpr double touched_of_radius = 2e-4;
// A contact may pull a resting ball this much away from the place it holds: rounding, and the bend of the surface.
constexpr double least_share = -1e-3;
// Below this rise what holds a place lowest nearby holds it lowest: no ball is under another there.
constexpr double shallow_of_radius = 0.25;
// How much a ball may come into another one's contact and still be called free of it.
constexpr double blocked_of_radius = 1e-3;

// Between bounds this far apart the height is taken in their middle.
constexpr double bounded_of_radius = 7e-4;
constexpr int coarsest_stride = 8;

constexpr double nowhere = std::numeric_limits<double>::quiet_NaN();

}  // namespace

FaceCloser::FaceCloser(const ReliefSurface& surface, const ReliefSamples& samples, const CoatMoment& moment,
                       double radius, double tolerance)
    : surface_(surface),
      samples_(samples),
      moment_(moment),
      radius_(radius),
      tolerance_(tolerance),
      solver_(surface, samples, moment, radius) {}

std::uint32_t FaceCloser::add(const RestingBall& ball) {
  balls_.push_back(ball);
  return static_cast<std::uint32_t>(balls_.size() - 1);
}

double FaceCloser::entered(const RestingBall& ball, const Texel& texel) const {
  const Vec3 from = texel.ray.origin - ball.centre;
  const double along = from.dot(texel.ray.direction);
  const double square = texel.scale * texel.scale;
  const double root = along * along - square * (from.squaredNorm() - radius_ * radius_);
  if (root < 0.0) return nowhere;
  const double height = (-along - std::sqrt(root)) / square;
  return height < texel.lowest - 3.0 * touched_of_radius * radius_ / texel.scale ? nowhere : height;
}

bool FaceCloser::holds_lowest(const RestingBall& ball, const Vec3& place) const {
  return ball.count == 3 && (ball.cone * (place - ball.centre)).minCoeff() >= least_share;
}

bool FaceCloser::at_rim(const Texel& texel) const {
  const TriangleMesh& mesh = surface_.base().mesh();
  const auto rim = [&](int edge) { return mesh.neighbour(face_, edge) == no_index; };
  return (texel.i + texel.j == texels_ && rim(1)) || (texel.i == 0 && rim(2)) || (texel.j == 0 && rim(0));
}

FaceCloser::Texel FaceCloser::texel_at(int i, int j) const {
  Texel texel;
  texel.i = i;
  texel.j = j;
  const double u = static_cast<double>(i) / texels_;
  const double v = static_cast<double>(j) / texels_;
  texel.ray = {prism_.base_at(u, v), prism_.direction_at(u, v)};
  texel.scale = texel.ray.direction.norm();
  texel.lowest = static_cast<double>(samples_.height(face_, i * nodes_a_texel_, j * nodes_a_texel_));
  return texel;
}

RestingBall FaceCloser::own_ball(const Texel& texel) const {
  const int i = texel.i * nodes_a_texel_;
  const int j = texel.j * nodes_a_texel_;
  const ReliefPatch patch(samples_, prism_, face_, i, j);
  RestingBall ball;
  ball.centre = texel.ray.at(texel.lowest) + radius_ * patch.normal(i - patch.i, j - patch.j);
  ball.count = 1;
  ball.node[0] = {face_, i, j, false};
  return ball;
}

void FaceCloser::add_normals(std::uint32_t face, const double (&share)[3], Normals& normals) const {
  const TriangleMesh& mesh = surface_.base().mesh();
  const TriangleMesh::Triangle& corners = mesh.triangles()[face_];
  double there[3] = {0.0, 0.0, 0.0};
  for (std::size_t k = 0; k < 3; ++k) {
    if (share[k] > 0.0) there[mesh.corner_of(face, corners[k])] = share[k];
  }
  const ReliefPoint spot = surface_.point(surface_.frame(face, moment_), there[1], there[2]);
  const auto add = [&](const Vec3& normal) {
    if (normals.directions.size() < normals.directions.capacity()) normals.directions.push_back(normal);
  };
  add(spot.front);
  const Vec3 inwards[3] = {-spot.along_u - spot.along_v, spot.along_u, spot.along_v};
  const Vec3 edges[3] = {spot.along_v - spot.along_u, spot.along_v, spot.along_u};
  for (std::size_t k = 0; k < 3; ++k) {
    if (there[k] != 0.0 || mesh.neighbour(face, static_cast<int>((k + 1) % 3)) != no_index) continue;
    const Vec3 along = edges[k].normalized();
    add((inwards[k].dot(along) * along - inwards[k]).normalized());
    normals.at_rim = true;
  }
}

FaceCloser::Normals FaceCloser::normals_around(const Texel& texel) const {
  const TriangleMesh& mesh = surface_.base().mesh();
  const double share[3] = {static_cast<double>(texels_ - texel.i - texel.j) / texels_,
                           static_cast<double>(texel.i) / texels_, static_cast<double>(texel.j) / texels_};
  Normals normals;
  add_normals(face_, share, normals);
  for (std::size_t k = 0; k < 3; ++k) {
    if (share[k] == 1.0) {
      for (const std::uint32_t other : mesh.faces_of_vertex(mesh.triangles()[face_][k])) {
        if (other != face_) add_normals(other, share, normals);
      }
    } else if (share[k] == 0.0 && std::max(share[(k + 1) % 3], share[(k + 2) % 3]) < 1.0) {
      const std::uint32_t other = mesh.neighbour(face_, static_cast<int>((k + 1) % 3));
      if (other != no_index) add_normals(other, share, normals);
    }
  }
  return normals;
}

bool FaceCloser::rests_on_crease(const Texel& texel, Vec3& centre) {
  const Normals normals = normals_around(texel);
  // Beside a rim little may be free, and rims are few.
  const int steps = normals.at_rim ? 16 : 2;
  // Nearer to the face's own normal they say nothing else.
  constexpr double apart = 0.985;
  const std::size_t starts = normals.at_rim ? normals.directions.size() : 1;
  const Vec3 place = texel.ray.at(texel.lowest);
  const auto rests = [&](const Vec3& normal) {
    centre = place + radius_ * normal;
    return solver_.is_free(centre, touched_of_radius);
  };
  if (rests(normals.directions[0])) return true;
  for (std::size_t one = 0; one < starts; ++one) {
    for (std::size_t other = one + 1; other < normals.directions.size(); ++other) {
      if (!normals.at_rim && normals.directions[one].dot(normals.directions[other]) > apart) continue;
      for (int step = 1; step <= steps; ++step) {
        const double share = static_cast<double>(step) / steps;
        const Vec3 between = (1.0 - share) * normals.directions[one] + share * normals.directions[other];
        if (between.norm() > 0.1 && rests(between.normalized())) return true;
      }
    }
  }
  return false;
}

bool FaceCloser::blocks(const RestingBall& ball, const Vec3& centre) const {
  const double within = radius_ * (1.0 - blocked_of_radius);
  for (int k = 0; k < ball.count; ++k) {
    if ((ball.point[k] - centre).squaredNorm() < within * within) return true;
  }
  return false;
}

bool FaceCloser::bound(const Texel& texel, int di, int dj) {
  const Known& one = known(texel.i - di, texel.j - dj);
  const Known& other = known(texel.i + di, texel.j + dj);
  if (!std::isfinite(one.lower) || !std::isfinite(other.lower)) return false;
  Known& here = known(texel.i, texel.j);
  // Two points that no free ball holds: between them none comes farther down than an arc of the radius through both.
  const double u = static_cast<double>(di) / texels_;
  const double v = static_cast<double>(dj) / texels_;
  const Vec3 turn = u * prism_.turn_u + v * prism_.turn_v;
  const Vec3 half = u * prism_.edge_u + v * prism_.edge_v + one.lower * turn;
  const double difference = other.lower - one.lower;
  const Vec3 chord = half + (0.5 * difference) * texel.ray.direction;
  const double square = chord.squaredNorm();
  here.lower = texel.lowest;
  if (square < radius_ * radius_) {
    // Along the ray, which stands on the chord at this angle.
    const double lean = chord.dot(texel.ray.direction) / (std::sqrt(square) * texel.scale);
    const double cosine = std::sqrt(std::max(0.0, 1.0 - lean * lean));
    const double middle = std::sqrt(radius_ * radius_ - square);
    const double dip = std::sqrt(square + middle * middle * cosine * cosine) - middle * cosine +
                       0.5 * std::abs(difference) * turn.norm();
    here.lower = std::max(texel.lowest, 0.5 * (one.lower + other.lower) - dip / texel.scale);
  }
  // Any free ball is a bound from above.
  here.upper = infinity;
  // Those over the ends, and over the other corners of the two triangles of which they make an edge.
  std::uint32_t balls[4] = {one.ball, other.ball, no_index, no_index};
  const int across_i = di == 0 ? 2 * dj : (dj == 0 ? di : di);
  const int across_j = di == 0 ? -dj : (dj == 0 ? -2 * di : di);
  const auto ball_at = [&](int i, int j) { return i >= 0 && j >= 0 && i + j <= texels_ ? known(i, j).ball : no_index; };
  balls[2] = ball_at(texel.i + across_i, texel.j + across_j);
  balls[3] = ball_at(texel.i - across_i, texel.j - across_j);
  for (const std::uint32_t ball : balls) {
    if (ball == no_index) continue;
    const double height = entered(balls_[ball], texel);
    if (height < here.upper) {
      here.upper = height;
      here.ball = ball;
    }
  }
  if (here.ball == no_index || !std::isfinite(here.upper)) return false;
  here.upper = std::max(here.upper, here.lower);
  const double apart = (here.upper - here.lower) * texel.scale;
  if (apart > 2.0 * bounded_of_radius * radius_) return false;
  return true;
}

void FaceCloser::settle_texel(const Texel& texel, const Known* before) {
  Known& here = known(texel.i, texel.j);
  const double shallow = texel.lowest + shallow_of_radius * radius_ / texel.scale;
  RestingBall own = own_ball(texel);
  const bool on_edge = texel.i == 0 || texel.j == 0 || texel.i + texel.j == texels_;
  if (Vec3 centre; on_edge && rests_on_crease(texel, centre)) {
    own.centre = centre;
    here = {texel.lowest, texel.lowest, add(own)};
    return;
  }
  if (before != nullptr && before->ball != no_index) {
    const RestingBall& ball = balls_[before->ball];
    const double height = entered(ball, texel);
    if (std::isfinite(height) && holds_lowest(ball, texel.ray.at(height)) &&
        (height <= shallow || blocks(ball, own.centre))) {
      here.lower = here.upper = std::max(height, texel.lowest);
      here.ball = before->ball;
      return;
    }
    own.count = blocks(ball, own.centre) ? -1 : 0;
  }
  const bool blocked = own.count < 0;
  own.count = 0;
  if (!blocked && solver_.is_free(own.centre, touched_of_radius)) {
    here = {texel.lowest, texel.lowest, add(own)};
    return;
  }
  here = settle(texel, before, own);
  // A ball that is known to be free and holds the place lower says more than a rest that was found.
  if (before != nullptr && before->ball != no_index) {
    const double height = entered(balls_[before->ball], texel);
    if (std::isfinite(height) && height < here.upper && height <= shallow) {
      here.lower = here.upper = std::max(texel.lowest, height);
      here.ball = before->ball;
    }
  }
  if (!std::isfinite(here.lower)) unsettled_.push_back({texel.i, texel.j});
}

FaceCloser::Known FaceCloser::settle(const Texel& texel, const Known* before, const RestingBall& own) {
  RestingBall rest;
  const auto settled = [&](double height) { return Known{height, height, add(rest)}; };
  Known best{nowhere, nowhere, no_index};
  const Vec3 place = texel.ray.at(texel.lowest);
  if (before != nullptr && before->ball != no_index && (balls_[before->ball].centre - place).norm() < 2.0 * radius_) {
    const RestingBall start = balls_[before->ball];
    const double height = solver_.settle(texel.ray, texel.lowest, start, rest);
    const double rise = (height - texel.lowest) * texel.scale;
    const double step = std::abs(height - before->upper) * texel.scale;
    // On from texel to texel a ball stays on its side of the surface.
    if (rise <= shallow_of_radius * radius_ || step <= 0.1 * radius_) return settled(height);
    if (!solver_.beyond_wall(texel.ray, texel.lowest, height)) best = settled(height);
  }
  const double height = solver_.settle(texel.ray, texel.lowest, own, rest);
  if (!solver_.beyond_wall(texel.ray, texel.lowest, height) && !(height >= best.upper)) best = settled(height);
  if ((best.upper - texel.lowest) * texel.scale <= shallow_of_radius * radius_) return best;
  const double above = solver_.settle_from_above(texel.ray, texel.lowest, rest);
  if (std::isfinite(above) && !(above >= best.upper)) best = settled(above);
  return best;
}

void FaceCloser::close_texels(int stride, bool coarsest) {
  const Known* last = nullptr;
  Known lowest;
  for (int i = 0; i <= texels_; i += stride) {
    for (int j = 0; i + j <= texels_; j += stride) {
      const bool odd_i = i / stride % 2 != 0;
      const bool odd_j = j / stride % 2 != 0;
      if (!coarsest && !odd_i && !odd_j) continue;
      const Texel texel = texel_at(i, j);
      const int di = odd_i ? stride : 0;
      const int dj = odd_j ? (odd_i ? -stride : stride) : 0;
      const Known* start = last;
      if (!coarsest) {
        const bool between = i + std::abs(di) + j + dj <= texels_ && i + di + j + dj <= texels_;
        // Beside a rim a ball may hold what lies between from below the line through both.
        if (between && !at_rim(texel) && bound(texel, di, dj)) continue;
        // From the ball that comes lowest of those around, where bounds were asked for.
        lowest = known(i, j);
        start = lowest.ball != no_index ? &lowest : &known(i - di, j - dj);
      }
      settle_texel(texel, start);
      if (std::isfinite(known(i, j).lower)) last = &known(i, j);
    }
  }
}

void FaceCloser::relax(bool forward) {
  // Ends of the lines of the grid through a texel that were visited before it.
  constexpr std::array<std::array<int, 2>, 3> visited = {{{-1, 0}, {0, -1}, {-1, 1}}};
  const int sign = forward ? 1 : -1;
  for (int a = 0; a <= texels_; ++a) {
    const int i = forward ? a : texels_ - a;
    for (int b = 0; b <= texels_ - i; ++b) {
      const int j = forward ? b : texels_ - i - b;
      Known& here = known(i, j);
      if (!std::isfinite(here.lower)) continue;
      const Texel texel = texel_at(i, j);
      if (here.upper <= texel.lowest) continue;
      for (const auto& [di, dj] : visited) {
        const int x = i + sign * di;
        const int y = j + sign * dj;
        if (x < 0 || y < 0 || x + y > texels_) continue;
        const std::uint32_t ball = known(x, y).ball;
        if (ball == no_index || ball == here.ball) continue;
        const double height = entered(balls_[ball], texel);
        if (!(height < here.upper)) continue;
        here.upper = std::max(height, texel.lowest);
        here.lower = std::min(here.lower, here.upper);
        here.ball = ball;
      }
    }
  }
}

ClosedFace FaceCloser::write(ClosedRelief& closed, const AtlasTile& tile) {
  ClosedFace report;
  for (int i = 0; i <= texels_; ++i) {
    for (int j = 0; i + j <= texels_; ++j) {
      ++report.texels;
      const Known& here = known(i, j);
      if (!std::isfinite(here.lower)) continue;
      const auto lowest = static_cast<double>(samples_.height(face_, i * nodes_a_texel_, j * nodes_a_texel_));
      const double rise = height_of(here, lowest) - lowest;
      closed.rise[tile.at(i, j)] = static_cast<float>(rise);
      if (rise <= tolerance_) continue;
      ++report.changed;
      report.largest_rise = std::max(report.largest_rise, rise);
    }
  }
  report.unsettled = static_cast<std::uint32_t>(unsettled_.size());
  return report;
}

ClosedFace FaceCloser::close(std::uint32_t face, ClosedRelief& closed) {
  texels_ = closed.settings.texels;
  const AtlasTile tile = atlas_tile(closed.atlas, face);
  face_ = face;
  nodes_a_texel_ = samples_.cuts(face) / texels_;
  prism_ = samples_.prism(face);
  balls_.clear();
  unsettled_.clear();
  known_.assign(static_cast<std::size_t>((texels_ + 1) * (texels_ + 2) / 2), Known{});
  int stride = 1;
  while (stride < coarsest_stride && texels_ % (2 * stride) == 0) stride *= 2;
  close_texels(stride, true);
  while (stride > 1) {
    stride /= 2;
    close_texels(stride, false);
  }
  relax(true);
  relax(false);
  const ClosedFace report = write(closed, tile);
  if (!unsettled_.empty()) mend(closed, tile);
  return report;
}

void FaceCloser::mend(ClosedRelief& closed, const AtlasTile& tile) const {
  const auto open = [&](int i, int j) {
    return std::find(unsettled_.begin(), unsettled_.end(), std::array<int, 2>{i, j}) != unsettled_.end();
  };
  std::vector<float> mean;
  for (const auto& [i, j] : unsettled_) {
    double sum = 0.0;
    int count = 0;
    for (int x = std::max(0, i - 2); x <= i + 2; ++x) {
      for (int y = std::max(0, j - 2); y <= j + 2 && x + y <= texels_; ++y) {
        if (open(x, y)) continue;
        sum += static_cast<double>(closed.rise[tile.at(x, y)]);
        ++count;
      }
    }
    mean.push_back(count > 0 ? static_cast<float>(sum / count) : 0.0F);
  }
  for (std::size_t k = 0; k < mean.size(); ++k) closed.rise[tile.at(unsettled_[k][0], unsettled_[k][1])] = mean[k];
}

}  // namespace asperity
