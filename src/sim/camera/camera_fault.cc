#include "sim/camera/camera_fault.h"

#include <algorithm>

#include "base/check.h"

namespace trammel::sim {
namespace {

void Apply(const CameraFault& fault, ActiveFaults& active) {
  switch (fault.kind) {
    case CameraFaultKind::kStall:
      active.stall = true;
      break;
    case CameraFaultKind::kDropFrames:
      active.drop_fraction = std::max(active.drop_fraction, fault.fraction);
      break;
    case CameraFaultKind::kTimeJump:
      active.jump_s += fault.jump_s;
      break;
    case CameraFaultKind::kSizeChange:
      active.size = fault;
      break;
    case CameraFaultKind::kHalfJpeg:
      active.half_jpeg = true;
      break;
    case CameraFaultKind::kClose:
      active.close = true;
      break;
    case CameraFaultKind::kBlack:
      active.black = true;
      break;
    case CameraFaultKind::kLaserAbsent:
      active.laser_absent = true;
      break;
  }
}

}  // namespace

void CameraFaults::Add(const CameraFault& fault) {
  TRAMMEL_CHECK(fault.duration_s >= 0 && fault.fraction >= 0 && fault.fraction <= 1 &&
                    fault.width_px >= 16 && fault.width_px <= 1920 && fault.height_px >= 16 &&
                    fault.height_px <= 1080,
                "duration = {} s, fraction = {}, size = {} x {} px", fault.duration_s,
                fault.fraction, fault.width_px, fault.height_px);
  entries_.push_back({fault, {}});
}

ActiveFaults CameraFaults::At(std::int64_t frame, double time_s) {
  ActiveFaults active;
  for (Entry& entry : entries_) {
    const CameraFault& fault = entry.fault;
    const bool first = !entry.begun_s;
    if (first) {
      if (fault.at_frame ? frame < *fault.at_frame : time_s < fault.at_s) continue;
      entry.begun_s = fault.at_frame ? time_s : fault.at_s;
    }
    if (first || time_s < *entry.begun_s + fault.duration_s) Apply(fault, active);
  }
  return active;
}

}  // namespace trammel::sim
