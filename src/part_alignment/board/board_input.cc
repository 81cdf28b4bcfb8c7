#include "part_alignment/board/board_input.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <set>

namespace trammel::part_alignment {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kMostPlace_mm = 1e6;
constexpr double kMostSigma_px = 1000;
constexpr double kAxisTolerance = 1e-5;

std::string NameOf(const BoardView& view, std::size_t index) {
  return view.picture.empty() ? fmt::format("view {}", index + 1) : view.picture;
}

Result<void> CheckView(const BoardMeasurement& measurement, std::size_t index) {
  const BoardView& view = measurement.views[index];
  const std::string name = NameOf(view, index);
  if (!view.spindle_mm.allFinite() || view.spindle_mm.cwiseAbs().maxCoeff() > kMostPlace_mm) {
    return Fail(
        fmt::format("{}: spindle_mm must be three numbers within ±{:g} mm", name, kMostPlace_mm));
  }
  const Matrix3d& r = view.spindle_rotation;
  if (!r.allFinite() || !((r.transpose() * r).isApprox(Matrix3d::Identity(), 1e-6)) ||
      r.determinant() < 0) {
    return Fail(fmt::format("{}: spindle_rotation is no rotation", name));
  }
  const Vector3d first = measurement.views.front().spindle_rotation.col(2);
  if ((r.col(2) - first).norm() > kAxisTolerance) {
    return Fail(fmt::format(
        "{}: the spindle's axis points elsewhere than in the first view, by {:.3g} rad: the camera "
        "is calibrated with the spindle turned about its own axis alone",
        name, (r.col(2) - first).norm()));
  }
  if (!view.discs.empty() && view.discs.size() != view.observations.size()) {
    return Fail(fmt::format("{}: {} discs of {} observations; all of them or none", name,
                            view.discs.size(), view.observations.size()));
  }
  std::set<std::string> ids;
  for (const Observation& seen : view.observations) {
    if (!std::isfinite(seen.column_px) || !std::isfinite(seen.row_px) ||
        !(seen.sigma_px > 0 && seen.sigma_px <= kMostSigma_px)) {
      return Fail(fmt::format(
          "{}: mark {} at column {}, row {}, sigma {} px: numbers must be "
          "finite, sigma above 0 and at most {:g}",
          name, seen.target, seen.column_px, seen.row_px, seen.sigma_px, kMostSigma_px));
    }
    if (!ids.insert(seen.target).second) {
      return Fail(fmt::format("{}: mark {} is seen twice; leave one out", name, seen.target));
    }
  }
  return {};
}

Result<void> CheckMachine(const BoardMeasurement& measurement) {
  struct Bound {
    const char* name;
    double value;
    double most;
  };
  const BoardMachineErrors& machine = measurement.machine;
  const Bound bounds[] = {{"the machine's scale", machine.scale, 0.01},
                          {"its squareness_rad", machine.squareness_rad, 0.01},
                          {"its lean_rad", machine.lean_rad, 0.1},
                          {"its index_rad", machine.index_rad, 0.1},
                          {"tool_length_sigma_mm", measurement.tool_length_sigma_mm, 10},
                          {"disc_radius_mm", measurement.disc_radius_mm, 1000},
                          {"lens_focal_length_mm", measurement.lens_focal_length_mm, 10'000}};
  for (const Bound& bound : bounds) {
    if (bound.value >= 0 && bound.value <= bound.most) continue;
    return Fail(
        fmt::format("{} is {}; it must be in 0 … {:g}", bound.name, bound.value, bound.most));
  }
  if (!(machine.repeatability_mm > 0 && machine.repeatability_mm <= 1)) {
    return Fail(fmt::format("its repeatability_mm is {}; it must be above 0 and at most 1",
                            machine.repeatability_mm));
  }
  return {};
}

Result<void> CheckTouches(const BoardMeasurement& measurement) {
  std::set<std::string> known;
  for (const BoardView& view : measurement.views) {
    for (const Observation& seen : view.observations) known.insert(seen.target);
  }
  for (const BoardTouch& touch : measurement.touches) {
    if (!known.contains(touch.mark)) {
      return Fail(fmt::format("mark {} was touched, but no picture shows it", touch.mark));
    }
    const bool sound = touch.spindle_mm.allFinite() && std::isfinite(touch.tool_length_mm) &&
                       std::abs(touch.tool_length_mm) <= 10'000 &&
                       touch.spindle_mm.cwiseAbs().maxCoeff() <= kMostPlace_mm &&
                       (touch.sigma_mm.array() > 0).all();
    if (!sound) {
      return Fail(
          fmt::format("the touch of mark {} has a place, a tool length or a sigma that "
                      "cannot be (mm, sigma above 0)",
                      touch.mark));
    }
  }
  return {};
}

}  // namespace

Result<void> Validate(const BoardMeasurement& measurement, const BoardCalibrateOptions& options) {
  const Camera& camera = measurement.camera;
  Camera frame = camera;
  frame.focal_length_mm = 1;
  if (const auto fault = FaultOf(frame)) return Fail("the camera: " + *fault);
  if (measurement.views.empty()) return Fail("there is no view");
  constexpr std::size_t kMostViews = 2000;
  if (measurement.views.size() > kMostViews) {
    return Fail(fmt::format("{} views; at most {}", measurement.views.size(), kMostViews));
  }
  if (!(options.most_residual_sigma > 0 && options.most_focal_uncertainty > 0 &&
        options.most_place_mm > 0 && options.false_alarm > 0 && options.false_alarm < 1)) {
    return Fail("the options' limits must be above 0, the false alarm's probability below 1");
  }
  TRY(CheckMachine(measurement));
  std::set<std::string> marks;
  for (std::size_t i = 0; i < measurement.views.size(); ++i) {
    TRY(CheckView(measurement, i));
    for (const Observation& seen : measurement.views[i].observations) marks.insert(seen.target);
  }
  constexpr std::size_t kMostMarks = 300;  // the adjustment is dense in them
  if (marks.size() > kMostMarks) {
    return Fail(fmt::format("{} marks; at most {}", marks.size(), kMostMarks));
  }
  TRY(CheckTouches(measurement));
  if (measurement.place &&
      !(measurement.place->at_mm.allFinite() && (measurement.place->sigma_mm.array() > 0).all() &&
        measurement.place->sigma_mm.allFinite())) {
    return Fail("the camera's place must be three numbers, each with a sigma above 0");
  }
  return {};
}

BoardPieces PiecesOf(const BoardMeasurement& measurement) {
  BoardPieces pieces;
  BoardNetwork& network = pieces.network;
  network.frame = measurement.camera;
  network.machine = measurement.machine;
  network.tool_length_sigma_mm = measurement.tool_length_sigma_mm;
  network.place = measurement.place;
  network.machine_from_spindle = measurement.views.front().spindle_rotation;
  std::map<std::string, std::size_t> index;
  double before = 0;
  for (std::size_t i = 0; i < measurement.views.size(); ++i) {
    const BoardView& view = measurement.views[i];
    const Matrix3d turn = network.machine_from_spindle.transpose() * view.spindle_rotation;
    BoardNetwork::Stop stop;
    stop.stated_mm = view.spindle_mm;
    stop.turn_rad = std::atan2(turn(1, 0) - turn(0, 1), turn(0, 0) + turn(1, 1));
    if (i == 0) network.stays = 1;
    if (i > 0 && std::abs(std::remainder(stop.turn_rad - before, 2 * std::numbers::pi)) > 1e-7) {
      ++network.stays;
    }
    before = stop.turn_rad;
    stop.stay = network.stays - 1;
    network.middle_mm += view.spindle_mm / static_cast<double>(measurement.views.size());
    network.stops.push_back(stop);
    for (std::size_t k = 0; k < view.observations.size(); ++k) {
      const Observation& seen = view.observations[k];
      const auto [place, added] = index.try_emplace(seen.target, pieces.ids.size());
      if (added) pieces.ids.push_back(seen.target);
      network.sights.push_back({i, place->second, {seen.column_px, seen.row_px}, seen.sigma_px});
      pieces.observation_of_sight.push_back(k);
    }
  }
  network.marks = pieces.ids.size();
  for (const BoardTouch& touch : measurement.touches) {
    const auto mark = index.find(touch.mark);
    if (mark == index.end()) continue;  // of a part of the pictures alone
    network.touches.push_back({mark->second, touch.spindle_mm, touch.tool_length_mm, touch.sigma_mm,
                               touch.tool_length_mm != measurement.touches.front().tool_length_mm});
  }
  LeaveOutLonely(network);
  return pieces;
}

void LeaveOutLonely(BoardNetwork& network) {
  constexpr int kLeastSights = 3;
  bool changed = true;
  while (changed) {
    changed = false;
    std::vector<int> of_mark(network.marks, 0);
    std::vector<int> of_stop(network.stops.size(), 0);
    for (const BoardNetwork::Sight& sight : network.sights) {
      if (!sight.used || !network.stops[sight.view].used) continue;
      ++of_mark[sight.mark];
      ++of_stop[sight.view];
    }
    for (BoardNetwork::Sight& sight : network.sights) {
      if (sight.used && of_mark[sight.mark] < kLeastSights) {
        sight.used = false;
        changed = changed || of_mark[sight.mark] > 0;
      }
    }
    for (std::size_t i = 0; i < network.stops.size(); ++i) {
      if (!network.stops[i].used || of_stop[i] >= kLeastMarksInView) continue;
      network.stops[i].used = false;
      changed = true;
    }
  }
}

}  // namespace trammel::part_alignment
