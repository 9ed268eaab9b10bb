#include "asperity/surface/relief/detail/closing_border.h"

#include <algorithm>
#include <cmath>

namespace asperity {

namespace {

// Texels around a triangle that hold the surface as it goes on; those farther out repeat the outermost.
constexpr double true_border = 3.2;

/// Whether a place beside a triangle lies across an edge where the base bends away. The relief has a crease there, and
/// its spline is truest when it goes on as the face's own.
bool beyond_convex_edge(const TriangleMesh& mesh, std::uint32_t face, int k) {
  constexpr double flat = 1e-9;
  const int edge = (k + 1) % 3;
  const std::uint32_t other = mesh.neighbour(face, edge);
  if (other == no_index) return false;
  const auto corners = mesh.corners(face);
  const auto from = static_cast<std::size_t>(edge);
  const Vec3 along = (corners[(from + 1) % 3] - corners[from]).normalized();
  return mesh.face_normal(face).cross(mesh.face_normal(other)).dot(along) > flat;
}

/// The texel (of those at most `border` beside a triangle) that is nearest to one beside it.
std::array<int, 2> nearest_within(int i, int j, double border, int texels) {
  // Steps told apart: one along i counts 1, one along j more than any number of those.
  constexpr int row = 4096;
  AtlasTexel texel;
  texel.u = static_cast<double>(i) / texels;
  texel.v = static_cast<double>(j) / texels;
  texel.right = 1;
  texel.up = row;
  const auto steps = static_cast<int>(nearest_texel_within(texel, border, texels));
  const auto up = static_cast<int>(std::lround(static_cast<double>(steps) / row));
  return {i + steps - row * up, j + up};
}

}  // namespace

ClosedBorders::ClosedBorders(const ReliefSurface& surface, const ReliefSamples& samples, const CoatMoment& moment,
                             const ClosedRelief& closed)
    : surface_(surface),
      samples_(samples),
      moment_(moment),
      texels_(closed.settings.texels),
      tolerance_(1e-5 * closed.settings.radius) {
  const AtlasTile tile = atlas_tile(closed.atlas, 0);
  for (int j = -tile.border; j <= tile.most_sum + tile.border; ++j) {
    for (int i = -tile.border; i + j <= tile.most_sum; ++i) {
      if (std::max({-i, -j, i + j - texels_}) <= static_cast<int>(true_border)) continue;
      copies_.push_back({i, j, nearest_within(i, j, true_border, texels_)});
    }
  }
  constexpr auto out_most = static_cast<int>(true_border);
  const auto add = [&](int i, int j, bool anew) {
    const std::array<bool, 3> over = {i + j > texels_, i < 0, j < 0};
    beside_.push_back({i, j, nearest_within(i, j, 0.0, texels_), over, anew});
  };
  // In rows along the edges: what was found at one texel is nearly right for the next.
  for (int out = 1; out <= out_most; ++out) {
    for (int i = -out_most; i - out - texels_ <= out_most; ++i) add(i, -out, i == -out_most);
    for (int j = 0; j - out - texels_ <= out_most; ++j) add(-out, j, j == 0);
    for (int i = 0; i <= texels_ + out; ++i) add(i, texels_ + out - i, i == 0);
  }
}

double ClosedBorders::height(const ClosedRelief& closed, const AtlasTile& tile, std::uint32_t face, int i, int j,
                             bool raised) const noexcept {
  const int nodes = samples_.cuts(face) / texels_;
  const auto before = static_cast<double>(samples_.height(face, i * nodes, j * nodes));
  return raised ? before + static_cast<double>(closed.rise[tile.at(i, j)]) : before;
}

ClosedBorders::Slopes ClosedBorders::slopes(const ClosedRelief& closed, std::uint32_t face, double u, double v,
                                            bool raised) const noexcept {
  const AtlasTile tile = atlas_tile(closed.atlas, face);
  const auto at = [&](int i, int j) { return height(closed, tile, face, i, j, raised); };
  const double x = u * texels_;
  const double y = v * texels_;
  if (texels_ < 3) {
    const double corner = at(0, 0);
    const double along_u = (at(texels_, 0) - corner);
    const double along_v = (at(0, texels_) - corner);
    return {corner + u * along_u + v * along_v, along_u, along_v};
  }
  const int i = std::clamp(static_cast<int>(std::lround(x)), 1, texels_ - 2);
  const int j = std::clamp(static_cast<int>(std::lround(y)), 1, texels_ - 1 - i);
  const double a = x - i;
  const double b = y - j;
  const double middle = at(i, j);
  const double right = at(i + 1, j);
  const double left = at(i - 1, j);
  const double up = at(i, j + 1);
  const double down = at(i, j - 1);
  const double ii = right + left - 2.0 * middle;
  const double jj = up + down - 2.0 * middle;
  const double ij = 0.5 * (ii + jj - (at(i + 1, j - 1) + at(i - 1, j + 1) - 2.0 * middle));
  const double di = 0.5 * (right - left);
  const double dj = 0.5 * (up - down);
  return {middle + a * (di + 0.5 * a * ii + b * ij) + b * (dj + 0.5 * b * jj), texels_ * (di + a * ii + b * ij),
          texels_ * (dj + a * ij + b * jj)};
}

bool ClosedBorders::follow(const ClosedRelief& closed, const Vec3& origin, const Vec3& direction, bool raised,
                           Beside& beside) const {
  constexpr int most_steps = 12;
  constexpr int most_walks = 6;
  constexpr double inside = -1e-6;
  const TriangleMesh& mesh = surface_.base().mesh();
  for (int step = 0; step < most_steps; ++step) {
    const Vec3 point = origin + beside.height * direction;
    for (int walk = 0;; ++walk) {
      if (!beside.prism.invert(point, beside.place)) return false;
      int out = 0;
      if (beside.place.barycentric().minCoeff(&out) >= inside) break;
      const std::uint32_t other = mesh.neighbour(beside.face, (out + 1) % 3);
      if (other == no_index || walk == most_walks) return false;
      const Vec3 edge = beside.prism.base_at(beside.place.u, beside.place.v);
      const Vec3 guess = barycentric_frame(mesh, other).coordinates(edge);
      beside.face = other;
      beside.prism = samples_.prism(other);
      beside.place.u = guess[1];
      beside.place.v = guess[2];
    }
    const Slopes there = slopes(closed, beside.face, beside.place.u, beside.place.v, raised);
    const ShellGradients gradients = shell_gradients(beside.prism, beside.place);
    const double rise = (gradients.height - there.u * gradients.u - there.v * gradients.v).dot(direction);
    if (!(rise > 0.1)) return false;
    const double change = (beside.place.height - there.height) / rise;
    beside.height -= change;
    if (std::abs(change) <= tolerance_) return true;
  }
  return false;
}

void ClosedBorders::fill(std::uint32_t face, ClosedRelief& closed) const {
  const TriangleMesh& mesh = surface_.base().mesh();
  const AtlasTile tile = atlas_tile(closed.atlas, face);
  std::vector<float>& heights = closed.atlas.heights;
  for (int j = 0; j <= texels_; ++j) {
    for (int i = 0; i + j <= texels_; ++i)
      heights[tile.at(i, j)] = static_cast<float>(height(closed, tile, face, i, j, true));
  }
  std::array<bool, 3> convex{};
  for (std::size_t k = 0; k < 3; ++k) convex[k] = beyond_convex_edge(mesh, face, static_cast<int>(k));
  const ReliefFrame frame = surface_.frame(face, moment_);
  Beside last;
  Beside before;  // the same of the relief as it was
  for (const BesideTexel& texel : beside_) {
    const std::size_t at = tile.at(texel.i, texel.j);
    const std::size_t nearest = tile.at(texel.nearest[0], texel.nearest[1]);
    const float rise = closed.rise[nearest];
    closed.rise[at] = rise;
    const double u = static_cast<double>(texel.i) / texels_;
    const double v = static_cast<double>(texel.j) / texels_;
    if (texel.anew) last.face = no_index;
    bool goes_on = true;
    for (std::size_t k = 0; k < 3; ++k) goes_on = goes_on && !(texel.over[k] && convex[k]);
    if (goes_on) {
      if (last.face == no_index) {
        const auto height_near = static_cast<double>(heights[nearest]);
        last = {height_near, face, {u, v, height_near}, frame.prism};
        const double lower = height_near - static_cast<double>(rise);
        before = {lower, face, {u, v, lower}, frame.prism};
      }
      const Vec3 origin = frame.prism.base_at(u, v);
      const Vec3 direction = frame.prism.direction_at(u, v);
      if (follow(closed, origin, direction, true, last) && follow(closed, origin, direction, false, before)) {
        heights[at] = static_cast<float>(last.height);
        closed.rise[at] = static_cast<float>(last.height - before.height);
        continue;
      }
      last.face = no_index;
    }
    const double share = frame.lowered ? frame.share + u * frame.share_u + v * frame.share_v : 1.0;
    heights[at] = static_cast<float>(share * surface_.coat().height(frame.coat, u, v)) + rise;
  }
  for (const Copy& one : copies_) {
    if (one.i + one.j > tile.most_sum) continue;
    heights[tile.at(one.i, one.j)] = heights[tile.at(one.from[0], one.from[1])];
    closed.rise[tile.at(one.i, one.j)] = closed.rise[tile.at(one.from[0], one.from[1])];
  }
}

}  // namespace asperity
