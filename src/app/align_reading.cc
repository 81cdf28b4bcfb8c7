#include "app/align_reading.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/align_report.h"
#include "part_alignment/eccentricity.h"

namespace trammel::app {
namespace {

using part_alignment::FoundTargets;
using part_alignment::Measurement;
using part_alignment::Observation;
using part_alignment::PartTarget;
using part_alignment::View;

const PartTarget* TargetOf(const Measurement& measurement, const std::string& id) {
  for (const PartTarget& target : measurement.targets) {
    if (target.id == id) return &target;
  }
  return nullptr;
}

bool Seen(const View& view, const std::string& id) {
  return std::any_of(view.observations.begin(), view.observations.end(),
                     [&id](const Observation& seen) { return seen.target == id; });
}

// Why what lies there was not read; empty where nothing was seen there.
std::string Rejected(const FoundTargets& found, const Eigen::Vector2d& pixel) {
  // A ring's parts lie within three radii of its middle.
  constexpr double kRadii = 3;
  constexpr double kLeast_px = 20;
  for (const part_alignment::RejectedTarget& rejected : found.rejected) {
    const double away_px = std::hypot(rejected.column_px - pixel.x(), rejected.row_px - pixel.y());
    if (away_px > std::max(kLeast_px, kRadii * rejected.radius_px)) continue;
    return fmt::format(": what is there was rejected ({})",
                       part_alignment::ToString(rejected.reason));
  }
  return {};
}

}  // namespace

double DiscRadius(const Measurement& measurement, const part_alignment::Alignment& alignment,
                  const std::vector<FoundTargets>& found) {
  const part_alignment::Camera& camera = measurement.camera;
  std::vector<double> radii_mm;
  for (std::size_t i = 0; i < measurement.views.size() && i < found.size(); ++i) {
    const View& view = measurement.views[i];
    for (const Observation& seen : view.observations) {
      const PartTarget* target = TargetOf(measurement, seen.target);
      for (const part_alignment::FoundTarget& one : found[i].targets) {
        const bool same = one.disc.column_px == seen.column_px && one.disc.row_px == seen.row_px;
        if (target == nullptr || !same) continue;
        // Whatever the tilt, the longer half axis is foreshortened least.
        const double distance_mm =
            std::abs(part_alignment::CameraFromPart(camera, alignment.clamping, view,
                                                    alignment.machine_from_part, target->ideal_mm)
                         .z());
        radii_mm.push_back(one.disc.semi_major_px * camera.pixel_pitch_mm * distance_mm /
                           camera.focal_length_mm);
      }
    }
  }
  if (radii_mm.empty()) return 0;
  const auto middle = radii_mm.begin() + static_cast<std::ptrdiff_t>(radii_mm.size() / 2);
  std::nth_element(radii_mm.begin(), middle, radii_mm.end());
  return *middle;
}

void CorrectCentres(const TargetDisc& disc, const part_alignment::Alignment& alignment,
                    Measurement& measurement) {
  for (View& view : measurement.views) {
    for (Observation& seen : view.observations) {
      const PartTarget* target = TargetOf(measurement, seen.target);
      if (target == nullptr) continue;
      const auto off = part_alignment::Eccentricity(measurement.camera, alignment.clamping, view,
                                                    alignment.machine_from_part, target->ideal_mm,
                                                    disc.normal, disc.radius_mm);
      if (!off) continue;
      seen.column_px -= off->x();
      seen.row_px -= off->y();
    }
  }
}

std::vector<std::string> MissingTargets(const store::AlignmentInput& input,
                                        const part_alignment::Alignment& alignment,
                                        const std::vector<FoundTargets>& found) {
  std::vector<std::string> lines;
  const std::vector<View>& views = input.measurement.views;
  for (std::size_t i = 0; i < views.size() && i < found.size(); ++i) {
    for (const PartTarget& target : input.measurement.targets) {
      const auto pixel = ProjectedIn(views[i], target, input, alignment);
      if (!pixel || Seen(views[i], target.id)) continue;
      lines.push_back(fmt::format(
          "view {}: target {} should be at column {:.0f}, row {:.0f} and was not read{}", i,
          target.id, pixel->x(), pixel->y(), Rejected(found[i], *pixel)));
    }
  }
  return lines;
}

}  // namespace trammel::app
