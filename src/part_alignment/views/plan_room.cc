#include "part_alignment/views/plan_room.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace trammel::part_alignment {
namespace {

using Eigen::Vector3d;

Vector3d Corner(const MachineBox& box, int i) {
  return {(i & 1) != 0 ? box.high_mm.x() : box.low_mm.x(),
          (i & 2) != 0 ? box.high_mm.y() : box.low_mm.y(),
          (i & 4) != 0 ? box.high_mm.z() : box.low_mm.z()};
}

}  // namespace

double ToolLength(const Camera& camera, double stated_mm) {
  constexpr double kLens_mm = 30;
  return stated_mm > 0 ? stated_mm
                       : std::abs(camera.taper_from_camera.translation_mm.z()) + kLens_mm;
}

bool WithinTravel(const ViewPlanOptions& options, const Vector3d& spindle_mm) {
  return ((spindle_mm - options.travel.low_mm).array() >= 0).all() &&
         ((options.travel.high_mm - spindle_mm).array() >= 0).all();
}

bool ClearOfObstacles(const ViewPlanOptions& options, double tool_length_mm,
                      const Vector3d& spindle_mm, const Eigen::Matrix3d& spindle_rotation) {
  return std::all_of(
      options.obstacles.begin(), options.obstacles.end(), [&](const MachineBox& obstacle) {
        Vector3d low = Vector3d::Constant(std::numeric_limits<double>::infinity());
        Vector3d high = -low;
        for (int i = 0; i < 8; ++i) {
          const Vector3d corner = spindle_rotation.transpose() * (Corner(obstacle, i) - spindle_mm);
          low = low.cwiseMin(corner);
          high = high.cwiseMax(corner);
        }
        const double beside_mm =
            std::hypot(std::max({low.x(), -high.x(), 0.0}), std::max({low.y(), -high.y(), 0.0}));
        return high.z() <= -tool_length_mm - options.clearance_mm ||
               beside_mm >= options.tool_radius_mm + options.clearance_mm;
      });
}

double SafeHeight(const ViewPlanOptions& options, double tool_length_mm, const Vector3d& axis) {
  double highest = -std::numeric_limits<double>::infinity();
  for (const MachineBox& obstacle : options.obstacles) {
    for (int i = 0; i < 8; ++i) {
      highest = std::max(highest, axis.dot(Corner(obstacle, i)));
    }
  }
  return highest + tool_length_mm + options.clearance_mm;
}

bool FillWay(const ViewPlanOptions& options, double tool_length_mm, ViewPlan& plan) {
  const Vector3d axis = plan.views.front().spindle_rotation.col(2);
  double height = SafeHeight(options, tool_length_mm, axis);
  for (const PlannedView& view : plan.views) {
    height = std::max(height, axis.dot(view.spindle_mm));
  }
  for (std::size_t i = 0; i < plan.views.size(); ++i) {
    const Vector3d& place_mm = plan.views[i].spindle_mm;
    const Vector3d above_mm = place_mm + (height - axis.dot(place_mm)) * axis;
    if (!WithinTravel(options, above_mm)) {
      plan.reason = fmt::format(
          "to pass part and fixture by {:.0f} mm the spindle must go to X {:.1f} Y {:.1f} Z "
          "{:.1f}, "
          "which lies outside the travel: give a shorter working distance, less clearance or a "
          "lower fixture",
          options.clearance_mm, above_mm.x(), above_mm.y(), above_mm.z());
      plan.way_mm.clear();
      plan.view_at.clear();
      return false;
    }
    plan.way_mm.insert(plan.way_mm.end(), {above_mm, place_mm, above_mm});
    plan.view_at.insert(plan.view_at.end(), {-1, static_cast<int>(i), -1});
  }
  return true;
}

}  // namespace trammel::part_alignment
