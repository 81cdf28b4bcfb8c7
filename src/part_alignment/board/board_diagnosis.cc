#include "part_alignment/board/board_diagnosis.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "geometry/euler.h"
#include "part_alignment/board/board_adjust.h"
#include "part_alignment/board/board_input.h"
#include "part_alignment/board/board_start.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kInch_mm = 25.4;
constexpr double kFits = 20;  // sigmas, where stated ones are small and not all is right yet

BoardMeasurement WithPlaces(const BoardMeasurement& measurement,
                            const std::function<void(Vector3d&)>& change) {
  BoardMeasurement changed = measurement;
  for (BoardView& view : changed.views) change(view.spindle_mm);
  for (BoardTouch& touch : changed.touches) change(touch.spindle_mm);
  return changed;
}

BoardMeasurement WithTurnsBack(const BoardMeasurement& measurement) {
  BoardMeasurement changed = measurement;
  const Matrix3d first = measurement.views.front().spindle_rotation;
  for (BoardView& view : changed.views) {
    view.spindle_rotation = first * (first.transpose() * view.spindle_rotation).transpose();
  }
  return changed;
}

// Pictures keep their order, places come `by` later (or earlier).
BoardMeasurement Shifted(const BoardMeasurement& measurement, int by) {
  BoardMeasurement changed = measurement;
  changed.views.clear();
  const auto size = static_cast<int>(measurement.views.size());
  for (int i = std::max(0, -by); i < std::min(size, size - by); ++i) {
    BoardView view = measurement.views[static_cast<std::size_t>(i)];
    const BoardView& place = measurement.views[static_cast<std::size_t>(i + by)];
    view.spindle_mm = place.spindle_mm;
    view.spindle_rotation = place.spindle_rotation;
    changed.views.push_back(std::move(view));
  }
  return changed;
}

BoardMeasurement Reversed(const BoardMeasurement& measurement) {
  BoardMeasurement changed = measurement;
  const std::size_t size = measurement.views.size();
  for (std::size_t i = 0; i < size; ++i) {
    changed.views[i].spindle_mm = measurement.views[size - 1 - i].spindle_mm;
    changed.views[i].spindle_rotation = measurement.views[size - 1 - i].spindle_rotation;
  }
  return changed;
}

bool Turns(const BoardMeasurement& measurement) {
  const Matrix3d& first = measurement.views.front().spindle_rotation;
  return std::any_of(
      measurement.views.begin(), measurement.views.end(),
      [&](const BoardView& view) { return !view.spindle_rotation.isApprox(first, 1e-6); });
}

}  // namespace

std::string ColumnsInWords(const Camera& camera, const Matrix3d& machine_from_taper) {
  const Vector3d right =
      machine_from_taper * geometry::RotationFromAngles(camera.taper_from_camera.angles_rad).col(0);
  Eigen::Index axis = 0;
  right.cwiseAbs().maxCoeff(&axis);
  return fmt::format("{}{}", right[axis] < 0 ? "-" : "+", "XYZ"[axis]);
}

double RootOf(const BoardMeasurement& measurement) {
  BoardPieces pieces = PiecesOf(measurement);
  BoardNetwork& network = pieces.network;
  // What is touched tells nothing of signs and order, and would be one more thing to be wrong.
  network.touches.clear();
  network.place.reset();
  BoardStart start = StartBoard(network);
  if (start.fault != BoardStartFault::kNone) return std::numeric_limits<double>::infinity();
  UseStart(start, network);
  HeldUnknowns held(static_cast<std::size_t>(SharedUnknowns(network)), false);
  held[9] = true;
  held[kBoardTool] = true;
  if (!Turns(measurement)) held[7] = held[8] = true;
  constexpr int kIterations = 25;
  const BoardFit fit = AdjustFirst(held, kIterations, network, start.state);
  int sights = 0;
  for (const BoardNetwork::Sight& sight : network.sights) {
    sights += sight.used && network.stops[sight.view].used ? 1 : 0;
  }
  const double freedom = 2.0 * sights - 3.0 * static_cast<double>(network.marks) - 20;
  if (!(freedom > 0)) return std::numeric_limits<double>::infinity();
  return std::sqrt(fit.cost / freedom);
}

std::string WordsForMirrored(const BoardMeasurement& measurement) {
  struct Candidate {
    std::string words;
    std::function<void(Vector3d&)> change;
  };
  const std::vector<Candidate> candidates = {
      {"the sign of X", [](Vector3d& at) { at.x() = -at.x(); }},
      {"the sign of Y", [](Vector3d& at) { at.y() = -at.y(); }},
      {"the sign of Z", [](Vector3d& at) { at.z() = -at.z(); }},
      {"X and Y exchanged", [](Vector3d& at) { std::swap(at.x(), at.y()); }}};
  std::vector<std::string> possible;
  for (const Candidate& candidate : candidates) {
    const BoardMeasurement changed = WithPlaces(measurement, candidate.change);
    const BoardPieces pieces = PiecesOf(changed);
    const BoardStart start = StartBoard(pieces.network);
    if (start.fault != BoardStartFault::kNone || RootOf(changed) > kFits) continue;
    possible.push_back(
        fmt::format("{} (then the picture's columns run along {} of the machine)", candidate.words,
                    ColumnsInWords(start.state.camera, pieces.network.machine_from_spindle)));
  }
  return fmt::format("{}", fmt::join(possible, "; or "));
}

std::optional<std::string> FindTableFault(const BoardMeasurement& measurement, double root) {
  struct Candidate {
    std::string words;
    BoardMeasurement changed;
  };
  std::vector<Candidate> candidates;
  if (Turns(measurement)) {
    candidates.push_back({"the spindle's angle has the wrong sign", WithTurnsBack(measurement)});
  }
  // Z is told from the focal length by nothing.
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    for (const double factor : {kInch_mm, 1 / kInch_mm}) {
      candidates.push_back(
          {fmt::format("{} is in another unit than the other axes ({} stands where mm are meant)",
                       "XYZ"[axis], factor > 1 ? "inch" : "a 25.4th of a mm"),
           WithPlaces(measurement, [&](Vector3d& at) { at[axis] *= factor; })});
    }
  }
  for (const int by : {1, -1, 2, -2}) {
    candidates.push_back({fmt::format("the table's rows are {} place{} too {}", std::abs(by),
                                      std::abs(by) == 1 ? "" : "s", by > 0 ? "early" : "late"),
                          Shifted(measurement, by)});
  }
  candidates.push_back({"the table's rows stand in the opposite order", Reversed(measurement)});
  const Candidate* best = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const Candidate& candidate : candidates) {
    if (candidate.changed.views.size() < 8) continue;
    const double other = RootOf(candidate.changed);
    if (!(other < least)) continue;
    least = other;
    best = &candidate;
  }
  constexpr double kBetter = 4;  // times
  if (best == nullptr || least > root / kBetter || least > kFits) {
    return std::nullopt;
  }
  return fmt::format("{}: so they would fit to {:.3g} sigmas in place of {:.3g}", best->words,
                     least, root);
}

}  // namespace trammel::part_alignment
