#include "asperity/device/replay_device.h"

namespace asperity {

Result<ReplayDevice> ReplayDevice::build(std::vector<ProbeSample> samples) {
  if (samples.empty()) {
    return bad_value("there is no sample to replay", "samples", "one sample or more");
  }
  return ReplayDevice(std::move(samples));
}

}  // namespace asperity
