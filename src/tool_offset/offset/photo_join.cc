#include "tool_offset/offset/photo_join.h"

#include <algorithm>
#include <vector>

#include "base/check.h"
#include "tool_offset/offset/offset_estimate.h"

namespace trammel::tool_offset {

SheetResult JoinPhotos(const SheetPlan& plan, std::span<const SheetResult> photos) {
  TRAMMEL_CHECK(!photos.empty(), "no photo");
  std::vector<const std::vector<StructureReading>*> structures;
  SheetResult joined = photos.front();
  joined.pick_ups.clear();
  joined.self_tests.clear();
  joined.notices = plan.notices;
  PhotoPose& pose = joined.photo->pose;
  pose.foot = pose.aim = {};
  for (const SheetResult& photo : photos) {
    TRAMMEL_CHECK(photo.photo && photo.structures.size() == plan.structures.size(), "{} structures",
                  photo.structures.size());
    structures.push_back(&photo.structures);
    pose.as_stored = pose.as_stored && photo.photo->pose.as_stored;
    pose.centre_uncertainty_px =
        std::max(pose.centre_uncertainty_px, photo.photo->pose.centre_uncertainty_px);
    pose.focal_uncertainty = std::max(pose.focal_uncertainty, photo.photo->pose.focal_uncertainty);
    const double part = 1 / static_cast<double>(photos.size());
    pose.foot.u_mm += part * photo.photo->pose.foot.u_mm;
    pose.foot.v_mm += part * photo.photo->pose.foot.v_mm;
    pose.aim.u_mm += part * photo.photo->pose.aim.u_mm;
    pose.aim.v_mm += part * photo.photo->pose.aim.v_mm;
  }
  const SheetModel model(plan, structures, joined.photo->spread);
  EstimateOffsets(plan, model, joined);
  return joined;
}

}  // namespace trammel::tool_offset
