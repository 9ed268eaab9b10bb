#pragma once
// Four prisms of a shell side by side, or four places of one. Private to surface.

#include <cstdint>
#include <cstring>

#include "asperity/core/lanes.h"
#include "asperity/surface/detail/four.h"
#include "asperity/surface/height_form.h"
#include "asperity/surface/relief/detail/slabs.h"

namespace asperity::four {

/// From a point to the shell's points at four places of one prism, at heights over its base (m). [servo]
ASPERITY_FOUR void offsets(const ShellPrism& prism, const Lanes& at_u, const Lanes& at_v, const Lanes& at_height,
                           const Vec3& from, Vectors& off) {
  Wide u;
  Wide v;
  Wide height;
  std::memcpy(&u, at_u.data(), sizeof(u));
  std::memcpy(&v, at_v.data(), sizeof(v));
  std::memcpy(&height, at_height.data(), sizeof(height));
  for (int axis = 0; axis < 3; ++axis) {
    const Wide base = prism.corner[axis] + u * prism.edge_u[axis] + v * prism.edge_v[axis];
    const Wide direction = prism.direction[axis] + u * prism.turn_u[axis] + v * prism.turn_v[axis];
    off[static_cast<std::size_t>(axis)] = base + height * direction - from[axis];
  }
}

/// ShellPrism, four times.
struct Prisms {
  Vectors corner;
  Vectors edge_u;
  Vectors edge_v;
  Vectors direction;
  Vectors turn_u;
  Vectors turn_v;
};

/// Shell::prism, four times. [build]
ASPERITY_FOUR void gather(const TriangleMesh& mesh, const Shell& shell, const std::uint32_t* const faces, Prisms& out) {
  const Vec3* const positions = mesh.positions().data();
  const Vec3f* const directions = shell.directions.data();
  const TriangleMesh::Triangle* const t[4] = {&mesh.triangles()[faces[0]], &mesh.triangles()[faces[1]],
                                              &mesh.triangles()[faces[2]], &mesh.triangles()[faces[3]]};
  for (int axis = 0; axis < 3; ++axis) {
    const auto at = [&](std::size_t k, Wide & place, Wide & direction) __attribute__((always_inline)) {
      place = Wide{positions[(*t[0])[k]][axis], positions[(*t[1])[k]][axis], positions[(*t[2])[k]][axis],
                   positions[(*t[3])[k]][axis]};
      direction = __builtin_convertvector((Floats{directions[(*t[0])[k]][axis], directions[(*t[1])[k]][axis],
                                                  directions[(*t[2])[k]][axis], directions[(*t[3])[k]][axis]}),
                                          Wide);
    };
    const auto a = static_cast<std::size_t>(axis);
    at(0, out.corner[a], out.direction[a]);
    at(1, out.edge_u[a], out.turn_u[a]);
    at(2, out.edge_v[a], out.turn_v[a]);
    out.edge_u[a] -= out.corner[a];
    out.edge_v[a] -= out.corner[a];
    out.turn_u[a] -= out.direction[a];
    out.turn_v[a] -= out.direction[a];
  }
}

/// ShellPrism::holds, four times: a bit each. [build]
ASPERITY_FOUR unsigned holds(const Prisms& prisms, double margin, double limit) {
  Vectors c0;
  Vectors c1;
  Vectors c2;
  Vectors turned;
  cross(prisms.edge_u, prisms.edge_v, c0);
  cross(prisms.edge_u, prisms.turn_v, c1);
  cross(prisms.turn_u, prisms.edge_v, turned);
  cross(prisms.turn_u, prisms.turn_v, c2);
  constexpr double share = 0.9;
  auto all = Wide{} == Wide{};
  for (int k = 0; k < 3; ++k) {
    const double u = k == 1 ? 1.0 + 2.0 * margin : -margin;
    const double v = k == 2 ? 1.0 + 2.0 * margin : -margin;
    Vectors n;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (k == 0) c1[axis] += turned[axis];
      n[axis] = prisms.direction[axis] + u * prisms.turn_u[axis] + v * prisms.turn_v[axis];
    }
    Wide zeroth;
    Wide first;
    Wide second;
    dot(n, c0, zeroth);
    dot(n, c1, first);
    dot(n, c2, second);
    magnitude(first, first);
    magnitude(second, second);
    all &= first * limit + second * limit * limit < share * zeroth;
  }
  unsigned bits = 0;
  for (unsigned i = 0; i < 4; ++i) bits |= all[i] != 0 ? 1U << i : 0U;
  return bits;
}

/// Box, four times.
struct Boxes {
  Vectors lower;
  Vectors upper;

  Boxes() {
    lower.fill(Wide{} + infinity);
    upper.fill(Wide{} - infinity);
  }
  ASPERITY_FOUR void include(const Vectors& point) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      keep_smaller(lower[axis], point[axis]);
      keep_larger(upper[axis], point[axis]);
    }
  }
};

/// box_around, four times. [build]
ASPERITY_FOUR void box_around(const Prisms& prisms, const Wide& lowest, const Wide& highest, Boxes& box) {
  for (int k = 0; k < 3; ++k) {
    Vectors low;
    Vectors high;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Wide base = prisms.corner[axis];
      Wide direction = prisms.direction[axis];
      if (k == 1) base += prisms.edge_u[axis], direction += prisms.turn_u[axis];
      if (k == 2) base += prisms.edge_v[axis], direction += prisms.turn_v[axis];
      low[axis] = base + lowest * direction;
      high[axis] = base + highest * direction;
    }
    box.include(low);
    box.include(high);
  }
}

/// HeightForm, four times.
struct Forms {
  Wide height;
  Wide u;
  Wide v;
  Wide error;
};

/// The box around what bound_over makes of all of a face, four times. [build]
ASPERITY_FOUR void box_around(const Prisms& prisms, const Forms& form, const FacePart& whole, Boxes& box) {
  Vectors direction;
  Vectors middle;
  Vectors along_u;
  Vectors along_v;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    direction[axis] =
        prisms.direction[axis] + whole.middle.x() * prisms.turn_u[axis] + whole.middle.y() * prisms.turn_v[axis];
    middle[axis] = prisms.corner[axis] + whole.middle.x() * prisms.edge_u[axis] +
                   whole.middle.y() * prisms.edge_v[axis] + form.height * direction[axis];
    along_u[axis] = prisms.edge_u[axis] + form.u * direction[axis] + form.height * prisms.turn_u[axis];
    along_v[axis] = prisms.edge_v[axis] + form.v * direction[axis] + form.height * prisms.turn_v[axis];
  }
  Wide spread{};
  Wide turn{};
  for (int k = 0; k < 3; ++k) {
    const Vec2 off = whole.corner[static_cast<std::size_t>(k)] - whole.middle;
    Vectors corner;
    Vectors lean;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      corner[axis] = middle[axis] + off.x() * along_u[axis] + off.y() * along_v[axis];
      lean[axis] = off.x() * prisms.turn_u[axis] + off.y() * prisms.turn_v[axis];
    }
    box.include(corner);
    Wide across;
    magnitude(form.u * off.x() + form.v * off.y(), across);
    keep_larger(spread, across);
    Wide squared;
    dot(lean, lean, squared);
    keep_larger(turn, squared);
  }
  square_root(turn, turn);
  Wide length;
  dot(direction, direction, length);
  square_root(length, length);
  Vectors size;
  for (std::size_t axis = 0; axis < 3; ++axis) magnitude(middle[axis], size[axis]);
  const Wide error = spread * turn + form.error * (length + turn) + 4e-16 * (size[0] + (size[1] + size[2]));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.lower[axis] -= error;
    box.upper[axis] += error;
  }
}

}  // namespace asperity::four
