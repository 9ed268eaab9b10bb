// What the relief over each face is enclosed in: the room that its prism has, ranges, boxes, and which of them meet.

#include <algorithm>
#include <atomic>
#include <cmath>

#include "asperity/core/parallel_for.h"
#include "asperity/core/processor.h"
#include "asperity/surface/relief/detail/bounds.h"
#include "asperity/surface/relief/detail/carried.h"
#include "asperity/surface/relief/detail/enclosed.h"
#include "asperity/surface/relief/detail/four_prisms.h"

namespace asperity {

namespace {

// As many as make starting a thread pay where a face takes a tenth of a microsecond; and where it takes some.
constexpr std::size_t cheap_faces_a_share = 2048;
constexpr std::size_t dear_faces_a_share = 256;

/// Outwards by more than a float rounds.
float outwards(double value, double sign) noexcept {
  return static_cast<float>(value + sign * 1e-6 * std::abs(value) + sign * 1e-30);
}

/// Which of four prisms are known to hold all heights within `limit`, a bit each.
using HoldsFour = unsigned (*)(const TriangleMesh& mesh, const Shell& shell, const std::uint32_t (&faces)[4],
                               double margin, double limit);

[[gnu::always_inline]] inline unsigned holds_four(const TriangleMesh& mesh, const Shell& shell,
                                                  const std::uint32_t (&faces)[4], double margin, double limit) {
  four::Prisms prisms;
  four::gather(mesh, shell, faces, prisms);
  return four::holds(prisms, margin, limit);
}
unsigned holds_four_plain(const TriangleMesh& mesh, const Shell& shell, const std::uint32_t (&faces)[4], double margin,
                          double limit) {
  return holds_four(mesh, shell, faces, margin, limit);
}
#if defined(__x86_64__)
__attribute__((target("avx2"))) unsigned holds_four_avx2(const TriangleMesh& mesh, const Shell& shell,
                                                         const std::uint32_t (&faces)[4], double margin, double limit) {
  return holds_four(mesh, shell, faces, margin, limit);
}
#endif

HoldsFour best_holds_four() noexcept {
#if defined(__x86_64__)
  if (has_avx2()) return holds_four_avx2;
#endif
  return holds_four_plain;
}

}  // namespace

/// Encloses faces whose heights are the coat's own and known, four at a time.
class ReliefSurface::EnclosedByFour {
 public:
  explicit EnclosedByFour(ReliefSurface& relief)
      : mesh_(relief.base_.mesh()),
        shell_(relief.shell_),
        heights_(relief.carried_->heights.data()),
        levels_(static_cast<std::size_t>(relief.coat_.levels()) + 1),
        whole_(FacePart::triangle(whole_triangle[0], whole_triangle[1], whole_triangle[2])),
        ranges_(relief.ranges_) {}

  /// Writes their ranges and boxes.
  void run(const std::uint32_t (&faces)[4], Box* const (&boxes)[4]) const {
#if defined(__x86_64__)
    if (has_avx2()) return run_avx2(faces, boxes);
#endif
    enclose(faces, boxes);
  }
  /// Asks the memory for what a face needs.
  void fetch(std::uint32_t face) const {
    __builtin_prefetch(&mesh_.triangles()[face]);
    for (std::size_t level = 0; level < levels_; ++level) __builtin_prefetch(heights_ + face * levels_ + level);
  }

 private:
#if defined(__x86_64__)
  __attribute__((target("avx2"))) void run_avx2(const std::uint32_t (&faces)[4], Box* const (&boxes)[4]) const {
    enclose(faces, boxes);
  }
#endif

  [[gnu::always_inline]] inline void enclose(const std::uint32_t (&faces)[4], Box* const (&boxes)[4]) const {
    four::Prisms prisms;
    four::gather(mesh_, shell_, faces, prisms);
    four::Boxes all;
    four::Wide lowest = four::Wide{} + infinity;
    four::Wide highest = four::Wide{} - infinity;
    for (std::size_t level = 0; level < levels_; ++level) {
      const CarriedHeight* height[4];
      for (std::size_t i = 0; i < 4; ++i) height[i] = heights_ + faces[i] * levels_ + level;
      const four::Wide low = {height[0]->range.lowest, height[1]->range.lowest, height[2]->range.lowest,
                              height[3]->range.lowest};
      const four::Wide high = {height[0]->range.highest, height[1]->range.highest, height[2]->range.highest,
                               height[3]->range.highest};
      four::Forms form;
      form.height =
          four::Wide{height[0]->form.height, height[1]->form.height, height[2]->form.height, height[3]->form.height};
      form.u = four::Wide{height[0]->form.u, height[1]->form.u, height[2]->form.u, height[3]->form.u};
      form.v = four::Wide{height[0]->form.v, height[1]->form.v, height[2]->form.v, height[3]->form.v};
      form.error =
          four::Wide{height[0]->form.error, height[1]->form.error, height[2]->form.error, height[3]->form.error};
      four::keep_smaller(lowest, low);
      four::keep_larger(highest, high);
      // Two ways to enclose it: what both hold.
      four::Boxes slab;
      four::Boxes around;
      four::box_around(prisms, low, high, slab);
      four::box_around(prisms, form, whole_, around);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        four::keep_larger(around.lower[axis], slab.lower[axis]);
        four::keep_smaller(around.upper[axis], slab.upper[axis]);
      }
      all.include(around.lower);
      all.include(around.upper);
    }
    for (std::size_t i = 0; i < 4; ++i) {
      ranges_[faces[i]] = {outwards(lowest[i], -1.0), outwards(highest[i], 1.0)};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        boxes[i]->lower[static_cast<Eigen::Index>(axis)] = all.lower[axis][i];
        boxes[i]->upper[static_cast<Eigen::Index>(axis)] = all.upper[axis][i];
      }
    }
  }

  const TriangleMesh& mesh_;
  const Shell& shell_;
  const CarriedHeight* heights_;
  std::size_t levels_;
  FacePart whole_;
  UnsetVector<FaceRange>& ranges_;
};

UnsetVector<double> ReliefSurface::fitting_shares() const {
  const TriangleMesh& mesh = base_.mesh();
  const Stitching& stitching = coat_.settings().stitching;
  const std::size_t faces = mesh.triangles().size();
  UnsetVector<double> share(faces);
  const double margin = !bands_.empty() && stitching.folds != FoldMode::keep ? 2.0 * stitching.rho : 0.0;
  const double most = 2.0 * coat_.amplitude_bound() + 1e-12;
  const auto share_of = [&](std::uint32_t face) {
    const ShellInterval room = shell_.prism(mesh, face).injective(margin, most);
    if (room.upper > room.lower && room.upper >= coat_.highest() && room.lower <= coat_.lowest()) return 1.0;
    const HeightRange heights = range(frame(face), whole_triangle);
    double fits = 1.0;
    if (room.upper > 0.0 && heights.highest > room.upper) fits = room.upper / heights.highest;
    if (room.lower < 0.0 && heights.lowest < room.lower) fits = std::min(fits, room.lower / heights.lowest);
    return room.upper > room.lower ? fits : 0.0;
  };
  const HoldsFour holds = best_holds_four();
  parallel_for((faces + 3) / 4, {.grain = cheap_faces_a_share / 4}, [&](std::size_t group) {
    std::uint32_t four[4];
    for (std::size_t i = 0; i < 4; ++i) four[i] = static_cast<std::uint32_t>(std::min(4 * group + i, faces - 1));
    // Nearly every prism has room for all that the coat holds anywhere.
    const unsigned hold = holds(mesh, shell_, four, margin, coat_.amplitude_bound());
    for (unsigned i = 0; i < 4; ++i) share[four[i]] = (hold >> i & 1U) != 0 ? 1.0 : share_of(four[i]);
  });
  return share;
}

bool ReliefSurface::on_its_own(std::uint32_t face) const noexcept {
  const TriangleMesh::Triangle& t = base_.mesh().triangles()[face];
  const bool joins = coat_.settings().stitching.folds != FoldMode::keep;
  for (const std::uint32_t vertex : t) {
    if (!bands_.empty() && (joins || coat_.seam_at(vertex))) return false;
    if (!shares_.empty() && shares_[vertex] != 1.0F) return false;
  }
  return true;
}

HeightRange ReliefSurface::enclose_face(std::uint32_t face, Box& box) const noexcept {
  const FacePart whole = FacePart::triangle(whole_triangle[0], whole_triangle[1], whole_triangle[2]);
  const ShellPrism prism = shell_.prism(base_.mesh(), face);
  if (any_height()) {
    const HeightRange all{std::min(0.0, coat_.lowest()) - fold_depth_, std::max(0.0, coat_.highest()) + fold_depth_};
    box = box_around({prism, all});
    return all;
  }
  HeightRange all{infinity, -infinity};
  box = {};
  for (int level = 0; level <= coat_.levels(); ++level) {
    const ReliefFrame frame = this->frame(face, {static_cast<double>(level), 0.0});
    const HeightRange heights = range(frame, whole_triangle);
    all = {std::min(all.lowest, heights.lowest), std::max(all.highest, heights.highest)};
    // Two ways to enclose it: what both hold.
    const Box slab = box_around({prism, heights});
    const ReliefBound bound = bound_over(prism, form(frame, whole), whole);
    Box around;
    for (const Vec3& corner : bound.corner) around.include(corner);
    around = around.grown(bound.error);
    around.lower = around.lower.cwiseMax(slab.lower);
    around.upper = around.upper.cwiseMin(slab.upper);
    box.include(around.lower);
    box.include(around.upper);
  }
  return all;
}

ReliefSurface::Enclosed ReliefSurface::enclose() {
  const std::size_t count = base_.mesh().triangles().size();
  ranges_ = UnsetVector<FaceRange>(count);
  const EnclosedByFour by_four(*this);
  const bool known = !any_height() && !carried_->heights.empty();
  Enclosed enclosed;
  // Kept where they are dear.
  const bool cheap = known && bands_.empty() && shares_.empty();
  if (!cheap) enclosed.boxes = UnsetVector<Box>(count);
  const auto over = [&](std::span<const std::uint32_t> faces, std::span<const std::uint32_t> next,
                        std::span<Box> boxes) {
    if (known) {
      for (const std::uint32_t face : next) by_four.fetch(face);
    }
    for (std::size_t first = 0; first < faces.size(); first += 4) {
      std::uint32_t numbers[4];
      Box* places[4];
      for (std::size_t i = 0; i < 4; ++i) {
        const std::size_t at = std::min(first + i, faces.size() - 1);
        numbers[i] = faces[at];
        places[i] = &boxes[at];
      }
      if (known && std::all_of(numbers, numbers + 4, [&](std::uint32_t face) { return on_its_own(face); })) {
        by_four.run(numbers, places);
        continue;
      }
      for (std::size_t i = first; i < std::min(first + 4, faces.size()); ++i) {
        const HeightRange heights = enclose_face(faces[i], boxes[i]);
        ranges_[faces[i]] = {outwards(heights.lowest, -1.0), outwards(heights.highest, 1.0)};
      }
    }
    if (cheap) return;
    for (std::size_t i = 0; i < faces.size(); ++i) enclosed.boxes[faces[i]] = boxes[i];
  };
  boxes_ = base_.index().enclosed(over, cheap ? cheap_faces_a_share : dear_faces_a_share);
  return enclosed;
}

/// Which faces of a relief meet others in space.
class ReliefSurface::Overlaps {
 public:
  Overlaps(ReliefSurface& relief, const Enclosed& enclosed)
      : relief_(relief),
        enclosed_(enclosed),
        mesh_(relief.base_.mesh()),
        vertices_(mesh_.positions().size()),
        size_(static_cast<float>(1.01 * (mesh_.bounds().extent().sum() + 3.0 * relief.reach_))) {
    const Vec3 centre = mesh_.bounds().centre();
    parallel_for(vertices_.size(), {.grain = cheap_faces_a_share}, [&](std::size_t i) {
      const Vec3f place = (mesh_.positions()[i] - centre).cast<float>();
      const Vec3f& direction = relief_.shell_.directions[i];
      vertices_[i] =
          RoundedVertex{place.x(), place.y(), place.z(), 0.0F, direction.x(), direction.y(), direction.z(), 0.0F};
    });
  }

  /// Marks those of some faces that meet the relief over another one.
  void mark(std::uint32_t face, std::span<const std::uint32_t> others) {
#if defined(__x86_64__)
    if (has_avx2()) return mark_avx2(face, others);
#endif
    mark_any(face, others);
  }
  [[nodiscard]] std::uint32_t pairs() const noexcept {
    return pairs_;
  }

 private:
#if defined(__x86_64__)
  __attribute__((target("avx2"))) void mark_avx2(std::uint32_t face, std::span<const std::uint32_t> others) {
    mark_any(face, others);
  }
#endif
  [[gnu::always_inline]] inline void mark_any(std::uint32_t face, std::span<const std::uint32_t> others) {
    RoundedSlab one;
    round(face, one);
    for (const std::uint32_t other : others) {
      RoundedSlab slab;
      round(other, slab);
      if (!surely_apart(one, slab, size_)) look_closely(face, other);
    }
  }
  [[gnu::always_inline]] inline void round(std::uint32_t face, RoundedSlab& slab) const {
    const FaceRange& range = relief_.ranges_[face];
    round_slab(vertices_.data(), mesh_.triangles()[face], range.lowest, range.highest, slab);
  }

  [[gnu::noinline]] void look_closely(std::uint32_t face, std::uint32_t other) {
    if (slabs_apart({relief_.shell_.prism(mesh_, face), relief_.range(face)},
                    {relief_.shell_.prism(mesh_, other), relief_.range(other)}) ||
        !box_of(face).overlaps(box_of(other)))
      return;
    pairs_.fetch_add(1, std::memory_order_relaxed);
    for (const std::uint32_t one : {face, other})
      std::atomic_ref<std::uint8_t>(relief_.overlapped_[one]).store(1, std::memory_order_relaxed);
  }
  [[nodiscard]] Box box_of(std::uint32_t face) const {
    if (!enclosed_.boxes.empty()) return enclosed_.boxes[face];
    Box box;
    static_cast<void>(relief_.enclose_face(face, box));
    return box;
  }

  ReliefSurface& relief_;
  const Enclosed& enclosed_;
  const TriangleMesh& mesh_;
  UnsetVector<RoundedVertex> vertices_;
  float size_;
  std::atomic<std::uint32_t> pairs_{0};
};

void ReliefSurface::find_overlaps(const Enclosed& enclosed) {
  overlapped_.assign(base_.mesh().triangles().size(), 0);
  Overlaps overlaps(*this, enclosed);
  base_.index().for_each_meeting(
      boxes_, [&](std::uint32_t face, std::span<const std::uint32_t> others) { overlaps.mark(face, others); });
  report_.overlapping_pairs = overlaps.pairs();
  if (overlaps.pairs() == 0) overlapped_ = {};
}

}  // namespace asperity
