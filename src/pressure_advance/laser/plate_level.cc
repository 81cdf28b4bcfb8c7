#include "pressure_advance/laser/plate_level.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/statistics.h"
#include "geometry/robust_line.h"

namespace trammel::pressure_advance {
namespace {

/// A plate's level drifts with the bed over millimetres; frames are fractions of one.
constexpr std::size_t kTrendReach = 12;

/// Local straight-line trend of the level at frame f over its neighbours, itself included.
double Trend(const Plate& plate, std::size_t f) {
  const std::size_t lo = f > kTrendReach ? f - kTrendReach : 0;
  const std::size_t hi = std::min(plate.level.size() - 1, f + kTrendReach);
  std::vector<double> x, y, scratch;
  for (std::size_t i = lo; i <= hi; ++i) {
    if (plate.sigma[i] > 0) {
      x.push_back(static_cast<double>(i) - static_cast<double>(f));
      y.push_back(plate.level[i]);
    }
  }
  if (x.size() < 5) {
    return plate.level[f];
  }
  // Fit about the middle of the points: LMedS for who belongs, then its own least squares step.
  return geometry::FitRobustLine(x, y, scratch).at(0);
}

/// Variance of a level, from how its sides differ from one frame to the next, which a bed's twist
/// does not change; 0 where too few frames show both.
double NoiseOfSides(const Plate& plate) {
  std::vector<double> steps;
  for (std::size_t f = 1; f < plate.sides.size(); ++f) {
    const double step = plate.sides[f] - plate.sides[f - 1];
    if (std::isfinite(step)) steps.push_back(step);
  }
  if (steps.size() < 8) return 0;
  const double sigma = RobustStandardDeviation(steps);
  return sigma * sigma / 2;
}

}  // namespace

void ShrinkToTrend(double row_correlation, Plate& plate) {
  std::vector<double> trend(plate.level.size()), off, predicted;
  for (std::size_t f = 0; f < plate.level.size(); ++f) {
    trend[f] = Trend(plate, f);
    if (plate.sigma[f] > 0) {
      off.push_back(plate.level[f] - trend[f]);
      predicted.push_back(plate.sigma[f] * plate.sigma[f] * row_correlation);
    }
  }
  if (off.size() < 8) {
    return;
  }
  const double seen = RobustStandardDeviation(off);
  const double noise = std::max(Median(predicted), NoiseOfSides(plate));
  // Twice the noise in variance passes as noise: the prediction is no better than that.
  const double keep = seen * seen > 2 * noise ? 1 - noise / (seen * seen) : 0;
  for (std::size_t f = 0; f < plate.level.size(); ++f) {
    if (plate.sigma[f] > 0) {
      const double own = plate.sigma[f] * std::sqrt(row_correlation);
      plate.level[f] = trend[f] + keep * (plate.level[f] - trend[f]);
      plate.sigma[f] = own * std::max(keep, 1 / std::sqrt(2.0 * kTrendReach));
    } else {
      plate.level[f] = trend[f];
    }
  }
}

namespace {

/// Frames whose level may be held up: those with a swell, and those that stand above the straight
/// line through all levels.
std::vector<bool> Suspects(const BeadBand& band, double least_px, const Plate& plate) {
  const std::size_t frames = plate.level.size();
  std::vector<bool> suspect(frames);
  std::vector<double> x, y, off, scratch;
  for (std::size_t f = 0; f < frames; ++f) {
    if (plate.sigma[f] > 0) {
      x.push_back(static_cast<double>(f));
      y.push_back(plate.level[f]);
    }
  }
  if (x.size() < kTrendReach) return suspect;
  const geometry::RobustLine line = geometry::FitRobustLine(x, y, scratch);
  for (std::size_t i = 0; i < x.size(); ++i) off.push_back(y[i] - line.at(x[i]));
  const double most = std::max(least_px, 5 * RobustStandardDeviation(off));
  for (std::size_t f = 0; f < frames; ++f) {
    suspect[f] = band.half(f) > band.half_width ||
                 (plate.sigma[f] > 0 && plate.level[f] - line.at(static_cast<double>(f)) > most);
  }
  return suspect;
}

/// A level from the nearest frames that are not under suspicion.
struct Bridge {
  double level = 0;
  double scatter_px = 0;
  bool found = false;
};

Bridge BridgeAt(std::size_t frame, const std::vector<bool>& suspect, const Plate& plate) {
  std::vector<std::pair<std::size_t, std::size_t>> near;  // by distance
  for (std::size_t f = 0; f < suspect.size(); ++f) {
    if (!suspect[f] && plate.sigma[f] > 0) near.emplace_back(f > frame ? f - frame : frame - f, f);
  }
  Bridge bridge;
  if (near.size() < kTrendReach) return bridge;
  std::sort(near.begin(), near.end());
  near.resize(std::min(near.size(), 2 * kTrendReach));
  std::sort(near.begin(), near.end(),
            [](const auto& a, const auto& b) { return a.second < b.second; });
  std::vector<double> x, y, scratch;
  for (const auto& [distance, f] : near) {
    x.push_back(static_cast<double>(f) - static_cast<double>(frame));
    y.push_back(plate.level[f]);
  }
  const geometry::RobustLine line = geometry::FitRobustLine(x, y, scratch);
  bridge.level = line.at(0);
  bridge.scatter_px = 1.4826 * line.median_residual;
  bridge.found = true;
  return bridge;
}

}  // namespace

std::vector<bool> BridgeSwells(const BeadBand& band, double peak_px, Plate& plate) {
  const double least_px = peak_px / 6;
  const std::vector<bool> suspect = Suspects(band, least_px, plate);
  std::vector<bool> replaced(suspect.size());
  Plate bridged = plate;
  for (std::size_t f = 0; f < suspect.size(); ++f) {
    if (!suspect[f]) continue;
    const Bridge bridge = BridgeAt(f, suspect, plate);
    if (!bridge.found) continue;
    const bool unseen = plate.sigma[f] <= 0;
    if (unseen || plate.level[f] - bridge.level > std::max(least_px, 5 * bridge.scatter_px)) {
      bridged.level[f] = bridge.level;
      bridged.sigma[f] = std::max(bridge.scatter_px, 1e-3);
      replaced[f] = true;
    }
  }
  plate = bridged;
  return replaced;
}

}  // namespace trammel::pressure_advance
