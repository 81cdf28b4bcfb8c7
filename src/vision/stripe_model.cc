// LearnStripe: what the line looks like, from the frames themselves.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "base/check.h"
#include "base/statistics.h"
#include "geometry/robust_line.h"
#include "vision/laser_line.h"
#include "vision/stripe_search.h"

namespace trammel::vision {
namespace {

/// Weights of B, G and R. A neutral light (a lamp's glint) has the same in all three: the third
/// mixture halves it, the fourth removes it; the second follows a stripe into a saturated red.
constexpr std::array<std::array<float, 3>, 4> kMixtures{
    {{0, 0, 1}, {-0.25F, -0.25F, 1}, {-0.5F, -0.5F, 1}, {0, 0.5F, 1}}};

/// Scatter of a trial that found no line to speak of; wider than any picture.
constexpr double kNoLine = 1e6;

/// How a trial model did on all frames together.
struct Trial {
  double scatter_px = kNoLine;  ///< of one row, mean over the frames
  double typical_px = kNoLine;  ///< median over the frames: one whose rows are mostly bead has none
  double found = 0;             ///< share of the rows
  double contrast = 0;
};

/// @param most_px  mean scatter beyond which the trial is given up.
Trial Try(std::span<const BgrView> frames, const StripeModel& model,
          const LaserLineOptions& options, double most_px, LaserLineWorkspace& ws,
          LaserLine& line) {
  std::vector<double> rows;
  std::vector<double> centres;
  std::vector<double> scratch;
  Trial trial;
  std::vector<double> scatter;
  double scatter_sum = 0;
  const auto count = static_cast<double>(frames.size());
  for (const BgrView& frame : frames) {
    FindRows(frame, model, options, ws, line);
    rows.clear();
    centres.clear();
    for (std::size_t y = 0; y < line.centre_px.size(); ++y) {
      // A mixture whose path runs beside the brightest place has lost the line's core.
      if (line.found(y) &&
          std::abs(line.centre_px[y] - static_cast<float>(ws.path[y])) <= 1.5F * model.sigma_px) {
        rows.push_back(static_cast<double>(y));
        centres.push_back(line.centre_px[y]);
      }
    }
    if (rows.size() < 4) {
      return trial;
    }
    scatter.push_back(kMadToSigma *
                      geometry::FitRobustLine(rows, centres, scratch).median_residual);
    scatter_sum += scatter.back();
    if (scatter_sum > most_px * count) return trial;
    trial.found += static_cast<double>(rows.size()) / frame.height;
    trial.contrast += line.contrast;
  }
  trial.found /= count;
  trial.contrast /= count;
  trial.scatter_px = Mean(scatter);
  trial.typical_px = Median(scatter);
  return trial;
}

}  // namespace

StripeModel LearnStripe(std::span<const BgrView> frames, const LaserLineOptions& options,
                        LaserLineWorkspace& workspace) {
  TRAMMEL_CHECK(!frames.empty() && frames[0].width >= kNarrowestFrame_px,
                "{} frames, the first {} px wide", frames.size(),
                frames.empty() ? 0 : frames[0].width);
  TRAMMEL_CHECK(options.max_sigma_px >= 1, "max sigma {}", options.max_sigma_px);
  LaserLine line;
  std::vector<std::pair<StripeModel, double>> trials;
  double lowest = std::numeric_limits<double>::max();
  for (const auto& mixture : kMixtures) {
    for (double sigma = 1;
         sigma <= options.max_sigma_px && sigma * kNarrowestFrame_px <= frames[0].width;
         sigma *= std::sqrt(2.0)) {
      StripeModel model{mixture[0], mixture[1], mixture[2], static_cast<float>(sigma)};
      // Beyond this neither it nor a better one after it makes it the choice.
      const Trial trial = Try(frames, model, options, options.as_good * lowest, workspace, line);
      model.contrast = static_cast<float>(trial.contrast);
      model.scatter_px = static_cast<float>(trial.typical_px);
      // A row not found is worse than a row found badly: the square outweighs what dropping the
      // worst rows would gain.
      trials.emplace_back(model, trial.scatter_px / std::max(1e-3, trial.found * trial.found));
      lowest = std::min(lowest, trials.back().second);
    }
  }
  // Among those that do about as well the simplest mixture and the narrowest line, which is the
  // least disturbed by what lies beside it.
  const auto chosen = std::find_if(trials.begin(), trials.end(), [&](const auto& trial) {
    return trial.second <= options.as_good * lowest;
  });
  return chosen->first;
}

}  // namespace trammel::vision
