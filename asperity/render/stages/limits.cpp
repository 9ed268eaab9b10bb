#include "asperity/render/stages/limits.h"

#include <algorithm>

namespace asperity {

void pay_for_change(double now, PotentialMemory& memory, EnergyTank& tank) noexcept {
  const double held = memory.potential.value_or(0.0);
  const double gain = memory.share * now - held;
  if (gain <= 0.0) {
    tank.fill(-gain);
    return;
  }
  const double paid = tank.pay(gain);
  if (paid >= gain) return;
  memory.share = now > 0.0 ? std::clamp((std::max(0.0, held) + paid) / now, 0.0, 1.0) : 0.0;
}

double carried_share(const Vec3& force, const Vec3& surface_motion, EnergyTank& tank) noexcept {
  const double given = force.dot(surface_motion);
  if (given <= 0.0) return 1.0;
  return tank.pay(given) / given;
}

}  // namespace asperity
