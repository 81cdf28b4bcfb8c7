#include "part_alignment/procedure/align_missing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "part_alignment/pose/solution.h"
#include "part_alignment/targets/reject_words.h"

namespace trammel::procedure {
namespace {

using part_alignment::FoundTargets;
using part_alignment::Observation;
using part_alignment::PartTarget;
using part_alignment::View;

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
    return fmt::format(": what is there was rejected, because {}",
                       part_alignment::WordsFor(rejected.reason));
  }
  return {};
}

}  // namespace

std::vector<std::string> MissingTargets(const MeasureOutcome& outcome,
                                        const part_alignment::Alignment& alignment) {
  std::vector<std::string> lines;
  if (alignment.verdict != Verdict::kGood) return lines;
  const part_alignment::Measurement& measurement = outcome.measurement;
  const std::vector<View>& views = measurement.views;
  for (std::size_t i = 0; i < views.size() && i < outcome.found.size(); ++i) {
    for (const PartTarget& target : measurement.targets) {
      if (Seen(views[i], target.id)) continue;
      const auto pixel = part_alignment::ImageOf(measurement, alignment, views[i], target);
      if (!pixel) continue;
      lines.push_back(fmt::format(
          "view {}: target {} should be at column {:.0f}, row {:.0f} and was not read{}", i + 1,
          target.id, pixel->x(), pixel->y(), Rejected(outcome.found[i], *pixel)));
    }
  }
  return lines;
}

}  // namespace trammel::procedure
