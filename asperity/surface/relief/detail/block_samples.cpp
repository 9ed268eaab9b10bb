// How far parts of a relief and their samples are from a point: several at once.

#include "asperity/surface/relief/detail/block_samples.h"

#include <cstring>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include "asperity/core/processor.h"
#include "asperity/surface/relief/detail/four_prisms.h"

namespace asperity {

void least_distances(const ReliefQuarters& quarters, const Vec3& p, float (&away)[ReliefQuarters::count]) noexcept {
  using four::Floats;
  const auto load = [](const float* from) {
    Floats four;
    std::memcpy(&four, from, sizeof(four));
    return four;
  };
  Floats along{};
  Floats square{};
  Floats sum{};
  for (int a = 0; a < 3; ++a) {
    const Floats off = static_cast<float>(p[a]) - load(quarters.middle[a]);
    along += off * load(quarters.normal[a]);
    square += off * off;
    sum += off < 0.0F ? -off : off;
  }
  // Of single precision, in which places are off the face's corner.
  constexpr float rounding = 1e-6F;
  const Floats slack = rounding * sum + rounding * static_cast<float>(p.cwiseAbs().sum());
  const Floats none{};
  const Floats above = (along < 0.0F ? -along : along) - load(quarters.half) - slack;
  const Floats beyond = above > 0.0F ? above : none;
  const Floats across = (1.0F - rounding) * square - along * along;
  Floats beside = across > 0.0F ? across : none;
  for (int k = 0; k < ReliefQuarters::count; ++k) beside[k] = std::sqrt(beside[k]);
  beside -= load(quarters.radius) + slack;
  beside = beside > 0.0F ? beside : none;
  const Floats squared = (1.0F - rounding) * (beyond * beyond + beside * beside);
  for (int k = 0; k < ReliefQuarters::count; ++k) away[k] = std::sqrt(squared[k]);
}

namespace {

using Eight = float __attribute__((vector_size(32)));
using EightInts = std::int32_t __attribute__((vector_size(32)));

ASPERITY_FOUR void load_eight(const float* from, Eight& out) {
  std::memcpy(&out, from, sizeof(out));
}
ASPERITY_FOUR void keep_less(Eight& least, const Eight& x) {
  least = x < least ? x : least;
}

/// `least`: of each row, all bits of those that none around is nearer than.
ASPERITY_FOUR void squares_by_eight(const BlockSamples& samples, const Vec3f& p, SampleSquares& out,
                                    EightInts (&least)[BlockSamples::across]) {
  constexpr int stride = BlockSamples::stride;
  constexpr int across = BlockSamples::across;
  for (int k = 0; k < BlockSamples::count; k += 8) {
    Eight x;
    Eight y;
    Eight z;
    load_eight(&samples.x[k], x);
    load_eight(&samples.y[k], y);
    load_eight(&samples.z[k], z);
    x -= p.x();
    y -= p.y();
    z -= p.z();
    const Eight square = x * x + y * y + z * z;
    std::memcpy(&out.of[k], &square, sizeof(square));
  }
  // Of three samples side by side along v, the least.
  Eight of_row[stride];
  for (int i = 0; i < stride; ++i) {
    load_eight(&out.of[i * stride], of_row[i]);
    for (int k = 1; k < 3; ++k) {
      Eight beside;
      load_eight(&out.of[i * stride + k], beside);
      keep_less(of_row[i], beside);
    }
  }
  Eight nearest = of_row[1];
  for (int i = 0; i < across; ++i) {
    Eight row;
    load_eight(&out.of[(i + 1) * stride + 1], row);
    Eight around = of_row[i];
    keep_less(around, of_row[i + 1]);
    keep_less(around, of_row[i + 2]);
    if (i == 0) nearest = row;
    keep_less(nearest, row);
    least[i] = row <= around;
  }
  out.nearest = nearest[0];
  for (int j = 1; j < across; ++j) out.nearest = std::min(out.nearest, nearest[j]);
}

/// What is in front of and behind a place, and beside it, tells how far a crest beside it may be at least: parabolas
/// with an end within a step fall by half the slope. `rows`: all bits of those that may be within `most`.
ASPERITY_FOUR void crests_by_eight(const SampleSquares& squares, float most, EightInts (&rows)[BlockSamples::across]) {
  constexpr int stride = BlockSamples::stride;
  constexpr float rounding = 1e-5F;
  for (int i = 0; i < BlockSamples::across; ++i) {
    const float* const row = &squares.of[(i + 1) * stride + 1];
    Eight here;
    Eight before;
    Eight after;
    Eight left;
    Eight right;
    load_eight(row, here);
    load_eight(row - stride, before);
    load_eight(row + stride, after);
    load_eight(row - 1, left);
    load_eight(row + 1, right);
    const Eight slope_u = after - before;
    const Eight slope_v = right - left;
    const Eight fall = (slope_u < 0.0F ? -slope_u : slope_u) + (slope_v < 0.0F ? -slope_v : slope_v);
    rows[i] = (1.0F - rounding) * here - (0.25F + rounding) * fall <= most;
  }
}

/// How far samples are apart at most, how high they are over the part's disk, and how far off its middle (squared).
struct Around {
  Eight lowest;
  Eight highest;
  Eight radius;
  Eight apart;
};

ASPERITY_FOUR void around_by_eight(const ReliefDisk& part, const BlockSamples& samples, Around& around) {
  constexpr int stride = BlockSamples::stride;
  const Eight none{};
  around = {none + BlockSamples::nowhere, none - BlockSamples::nowhere, none, none};
  const auto at = [&](int k, Eight(&there)[3]) __attribute__((always_inline)) {
    load_eight(&samples.x[k], there[0]);
    load_eight(&samples.y[k], there[1]);
    load_eight(&samples.z[k], there[2]);
  };
  for (int i = 0; i < stride; ++i) {
    // Both ends of the row.
    for (int from = 0; from <= stride - BlockSamples::across; ++from) {
      const int k = i * stride + from;
      Eight here[3];
      at(k, here);
      const EightInts is = here[0] < BlockSamples::far_off;
      const Eight above = part.normal[0] * here[0] + part.normal[1] * here[1] + part.normal[2] * here[2];
      const Eight off = here[0] * here[0] + here[1] * here[1] + here[2] * here[2];
      const Eight low = is != 0 ? above : around.lowest;
      const Eight high = is != 0 ? above : around.highest;
      const Eight wide = is != 0 ? off : none;
      around.lowest = low < around.lowest ? low : around.lowest;
      around.highest = high > around.highest ? high : around.highest;
      around.radius = wide > around.radius ? wide : around.radius;
      for (const int to : {k + 1, k + stride}) {
        const bool beyond = to == k + 1 ? from == 2 : i == stride - 1;
        if (beyond) continue;
        Eight there[3];
        at(to, there);
        Eight length{};
        for (int a = 0; a < 3; ++a) length += (there[a] - here[a]) * (there[a] - here[a]);
        const EightInts both = is & (there[0] < BlockSamples::far_off);
        const Eight far = both != 0 ? length : none;
        around.apart = far > around.apart ? far : around.apart;
      }
    }
  }
}

ASPERITY_FOUR void points_by_four(const ShellPrism& prism, const Lanes& u, const Lanes& v, const Lanes& heights,
                                  const Vec3& middle, Lanes (&off)[3]) {
  four::Vectors there;
  four::offsets(prism, u, v, heights, middle, there);
  for (std::size_t axis = 0; axis < 3; ++axis) std::memcpy(off[axis].data(), &there[axis], sizeof(there[axis]));
}

#if defined(__x86_64__)
[[gnu::target("avx2")]] void squares_by_avx2(const BlockSamples& samples, const Vec3f& p, SampleSquares& out) noexcept {
  EightInts least[BlockSamples::across];
  squares_by_eight(samples, p, out, least);
  for (int i = 0; i < BlockSamples::across; ++i) {
    __m256 marks;
    std::memcpy(&marks, &least[i], sizeof(marks));
    out.least[i] = static_cast<std::uint32_t>(_mm256_movemask_ps(marks));
  }
}
[[gnu::target("avx2")]] bool crests_by_avx2(const SampleSquares& squares, float most,
                                            std::uint32_t (&rows)[BlockSamples::across]) noexcept {
  EightInts within[BlockSamples::across];
  crests_by_eight(squares, most, within);
  std::uint32_t any = 0;
  for (int i = 0; i < BlockSamples::across; ++i) {
    __m256 marks;
    std::memcpy(&marks, &within[i], sizeof(marks));
    rows[i] = static_cast<std::uint32_t>(_mm256_movemask_ps(marks));
    any |= rows[i];
  }
  return any != 0;
}

[[gnu::target("avx2")]] void around_by_avx2(const ReliefDisk& part, const BlockSamples& samples,
                                            Around& around) noexcept {
  around_by_eight(part, samples, around);
}

[[gnu::target("avx2")]] void points_by_avx2(const ShellPrism& prism, const Lanes& u, const Lanes& v,
                                            const Lanes& heights, const Vec3& middle, Lanes (&off)[3]) noexcept {
  points_by_four(prism, u, v, heights, middle, off);
}
#endif

/// The bit of each that is set.
std::uint32_t bits_of(const EightInts& marks) noexcept {
  std::uint32_t bits = 0;
  for (int j = 0; j < BlockSamples::across; ++j) bits |= marks[j] != 0 ? 1U << static_cast<unsigned>(j) : 0U;
  return bits;
}

}  // namespace

void squares_from(const BlockSamples& samples, const Vec3f& p, SampleSquares& out) noexcept {
#if defined(__x86_64__)
  if (has_avx2()) return squares_by_avx2(samples, p, out);
#endif
  EightInts least[BlockSamples::across];
  squares_by_eight(samples, p, out, least);
  for (int i = 0; i < BlockSamples::across; ++i) out.least[i] = bits_of(least[i]);
}

bool beside_crests(const SampleSquares& squares, float most, std::uint32_t (&rows)[BlockSamples::across]) noexcept {
#if defined(__x86_64__)
  if (has_avx2()) return crests_by_avx2(squares, most, rows);
#endif
  EightInts within[BlockSamples::across];
  crests_by_eight(squares, most, within);
  std::uint32_t any = 0;
  for (int i = 0; i < BlockSamples::across; ++i) {
    rows[i] = bits_of(within[i]);
    any |= rows[i];
  }
  return any != 0;
}

void put_samples(const ShellPrism& prism, const Lanes& u, const Lanes& v, const Lanes& heights, const Vec3& middle,
                 int count, int at, BlockSamples& samples) noexcept {
  Lanes off[3];
  const auto put = [&] {
    for (int k = 0; k < count; ++k) {
      const auto lane = static_cast<std::size_t>(k);
      samples.x[at + k] = static_cast<float>(off[0][lane]);
      samples.y[at + k] = static_cast<float>(off[1][lane]);
      samples.z[at + k] = static_cast<float>(off[2][lane]);
    }
  };
#if defined(__x86_64__)
  if (has_avx2()) {
    points_by_avx2(prism, u, v, heights, middle, off);
    return put();
  }
#endif
  points_by_four(prism, u, v, heights, middle, off);
  put();
}

void enclose(const ReliefDisk& part, BlockSamples& samples) noexcept {
  Around all;
#if defined(__x86_64__)
  if (has_avx2()) {
    around_by_avx2(part, samples, all);
  } else {
    around_by_eight(part, samples, all);
  }
#else
  around_by_eight(part, samples, all);
#endif
  float lowest = BlockSamples::nowhere;
  float highest = -BlockSamples::nowhere;
  float radius = 0.0F;
  float apart = 0.0F;
  for (int k = 0; k < BlockSamples::across; ++k) {
    lowest = std::min(lowest, all.lowest[k]);
    highest = std::max(highest, all.highest[k]);
    radius = std::max(radius, all.radius[k]);
    apart = std::max(apart, all.apart[k]);
  }
  constexpr float rounding = 1e-5F;
  radius = std::sqrt(radius);
  samples.around = part;
  for (int a = 0; a < 3; ++a) samples.around.middle[a] += 0.5F * (lowest + highest) * part.normal[a];
  samples.around.half = 0.5F * (highest - lowest) + rounding * radius;
  samples.around.radius = (1.0F + rounding) * radius;
  samples.apart = (1.0F + rounding) * std::sqrt(apart);
}

}  // namespace asperity
