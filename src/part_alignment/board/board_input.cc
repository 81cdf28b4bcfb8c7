#include "part_alignment/board/board_input.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "base/statistics.h"

namespace trammel::part_alignment {
using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr double kMaxPlace_mm = 1e6;
constexpr double kMaxSigma_px = 1000;
constexpr double kAxisTolerance = 1e-5;

Result<void> CheckView(const BoardMeasurement& measurement, std::size_t index) {
  const BoardView& view = measurement.views[index];
  const std::string name = NameOf(measurement, index);
  if (!view.spindle_mm.allFinite() || view.spindle_mm.cwiseAbs().maxCoeff() > kMaxPlace_mm) {
    return Fail(
        fmt::format("{}: spindle_mm must be three numbers within ±{:g} mm", name, kMaxPlace_mm));
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
        !(seen.sigma_px > 0 && seen.sigma_px <= kMaxSigma_px)) {
      return Fail(
          fmt::format("{}: mark {} at column {}, row {}, sigma {} px: numbers must be "
                      "finite, sigma above 0 and at most {:g}",
                      name, seen.target, seen.column_px, seen.row_px, seen.sigma_px, kMaxSigma_px));
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
                       touch.spindle_mm.cwiseAbs().maxCoeff() <= kMaxPlace_mm &&
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

std::string NameOf(const BoardMeasurement& measurement, std::size_t view) {
  const std::string& picture = measurement.views[view].picture;
  return picture.empty() ? fmt::format("view {}", view + 1) : picture;
}

Result<void> Validate(const BoardMeasurement& measurement, const BoardCalibrateOptions& options) {
  const Camera& camera = measurement.camera;
  Camera frame = camera;
  frame.focal_length_mm = 1;
  if (const auto fault = FaultOf(frame)) return Fail("the camera: " + *fault);
  if (measurement.views.empty()) return Fail("there is no view");
  constexpr std::size_t kMaxViews = 2000;
  if (measurement.views.size() > kMaxViews) {
    return Fail(fmt::format("{} views; at most {}", measurement.views.size(), kMaxViews));
  }
  if (!(options.max_residual_sigma > 0 && options.max_focal_uncertainty > 0 &&
        options.max_place_mm > 0 && options.false_alarm > 0 && options.false_alarm < 1)) {
    return Fail("the options' limits must be above 0, the false alarm's probability below 1");
  }
  TRY(CheckMachine(measurement));
  std::set<std::string> marks;
  for (std::size_t i = 0; i < measurement.views.size(); ++i) {
    TRY(CheckView(measurement, i));
    for (const Observation& seen : measurement.views[i].observations) marks.insert(seen.target);
  }
  constexpr std::size_t kMaxMarks = 300;  // the adjustment is dense in them
  if (marks.size() > kMaxMarks) {
    return Fail(fmt::format("{} marks; at most {}", marks.size(), kMaxMarks));
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
    BoardNetwork::Station station;
    station.stated_mm = view.spindle_mm;
    station.turn_rad = std::atan2(turn(1, 0) - turn(0, 1), turn(0, 0) + turn(1, 1));
    if (i == 0) network.stays = 1;
    if (i > 0 && std::abs(std::remainder(station.turn_rad - before, 2 * std::numbers::pi)) > 1e-7) {
      ++network.stays;
    }
    before = station.turn_rad;
    station.stay = network.stays - 1;
    network.middle_mm += view.spindle_mm / static_cast<double>(measurement.views.size());
    network.stations.push_back(station);
    for (std::size_t k = 0; k < view.observations.size(); ++k) {
      const Observation& seen = view.observations[k];
      const auto [place, added] = index.try_emplace(seen.target, pieces.ids.size());
      if (added) pieces.ids.push_back(seen.target);
      network.observations.push_back(
          {i, place->second, {seen.column_px, seen.row_px}, seen.sigma_px});
      pieces.index_in_view.push_back(k);
    }
  }
  network.marks = pieces.ids.size();
  for (const BoardTouch& touch : measurement.touches) {
    const auto mark = index.find(touch.mark);
    if (mark == index.end()) continue;  // mark outside this subset of pictures
    network.touches.push_back({mark->second, touch.spindle_mm, touch.tool_length_mm, touch.sigma_mm,
                               touch.tool_length_mm != measurement.touches.front().tool_length_mm});
  }
  LeaveOutLonely(network);
  return pieces;
}

void LeaveOutLonely(BoardNetwork& network) {
  constexpr int kMinObservations = 3;
  bool changed = true;
  while (changed) {
    changed = false;
    std::vector<int> of_mark(network.marks, 0);
    std::vector<int> of_station(network.stations.size(), 0);
    for (const NetworkObservation& observation : network.observations) {
      if (!TakesPart(network, observation)) continue;
      ++of_mark[observation.point];
      ++of_station[observation.station];
    }
    for (NetworkObservation& observation : network.observations) {
      if (observation.used && of_mark[observation.point] < kMinObservations) {
        observation.used = false;
        changed = changed || of_mark[observation.point] > 0;
      }
    }
    for (std::size_t i = 0; i < network.stations.size(); ++i) {
      if (!network.stations[i].used || of_station[i] >= kMinMarksInView) continue;
      network.stations[i].used = false;
      changed = true;
    }
  }
}

namespace {

std::string NameOf(const BoardPieces& pieces, const StatedCheck& check) {
  const char axis = "XYZ"[check.axis];
  if (!check.touch) return fmt::format("the stated place of the camera ({})", axis);
  return fmt::format("the touch of mark {} ({})",
                     pieces.ids[pieces.network.touches[*check.touch].mark], axis);
}

}  // namespace

BoardStated TakeStated(BoardNetwork& network) {
  return {std::exchange(network.touches, {}), std::exchange(network.place, std::nullopt)};
}

void JoinStated(BoardStated stated, BoardNetwork& network) {
  network.touches = std::move(stated.touches);
  network.place = std::move(stated.place);
}

StatedPlace ToldOf(const BoardNetwork& network) {
  StatedPlace told;
  constexpr double kTurned_rad = 0.02;  // the index error leaves nothing of less
  double first = 0;
  bool any = false;
  for (const BoardNetwork::Station& station : network.stations) {
    if (!station.used) continue;
    if (!any) first = station.turn_rad;
    any = true;
    const double by = std::remainder(station.turn_rad - first, 2 * std::numbers::pi);
    told.turned = told.turned || std::abs(by) > kTurned_rad;
  }
  const std::vector<bool> seen = SeenMarks(network);
  const Matrix3d turn = network.machine_from_spindle.transpose();
  for (const BoardNetwork::Touch& touch : network.touches) {
    if (!seen[touch.mark]) continue;
    for (Index axis = 0; axis < 3; ++axis) {
      if (!std::isfinite(touch.sigma_mm[axis])) continue;
      const Vector3d along = turn.col(axis).cwiseAbs();
      told.touched_along = told.touched_along || along.z() > 0.5;
    }
    const Vector3d sigma = touch.sigma_mm;
    int across = 0;
    for (Index axis = 0; axis < 3; ++axis) {
      if (std::isfinite(sigma[axis]) && turn.col(axis).head<2>().norm() > 0.5) ++across;
    }
    told.touched_across = told.touched_across || across >= 2;
  }
  told.prior = network.place.has_value();
  return told;
}

HeldUnknowns HeldOf(const BoardNetwork& network, const StatedPlace& told) {
  HeldUnknowns held(static_cast<std::size_t>(SharedUnknowns(network)), false);
  held[7] = held[8] = !told.across();
  held[9] = !told.along();
  for (Index i = kBoardScale; i < SharedUnknowns(network); ++i) {
    held[static_cast<std::size_t>(i)] = !(PriorSigma(network, i) > 0);
  }
  return held;
}

void PlaceByStated(const BoardNetwork& network, const StatedPlace& told, BoardState& state) {
  const Matrix3d& turn = network.machine_from_spindle;
  Vector3d by = Vector3d::Zero();  // spindle frame
  Vector3d count = Vector3d::Zero();
  for (const BoardNetwork::Touch& touch : network.touches) {
    if (state.marks_mm[touch.mark].isZero()) continue;
    const Vector3d off = turn.transpose() * (PartialsOf(network, state, touch).residual_mm);
    for (Index axis = 0; axis < 3; ++axis) {
      Index machine_axis = 0;
      turn.col(axis).cwiseAbs().maxCoeff(&machine_axis);
      if (!std::isfinite(touch.sigma_mm[machine_axis])) continue;
      by[axis] -= off[axis];
      count[axis] += 1;
    }
  }
  Vector3d& place = state.camera.taper_from_camera.translation_mm;
  for (Index axis = 0; axis < 3; ++axis) {
    if (axis < 2 && told.turned) {
      by[axis] = 0;
    } else if (count[axis] > 0) {
      by[axis] /= count[axis];
    } else {
      by[axis] = network.place ? network.place->at_mm[axis] - place[axis] : 0;
    }
  }
  place += by;
  for (Vector3d& mark : state.marks_mm) mark += turn * by;
}

std::optional<std::string> StatedContradiction(const BoardPieces& pieces,
                                               const BoardPrecision& precision,
                                               double false_alarm) {
  std::vector<const StatedCheck*> tested;
  double squares = 0;
  double redundancy = 0;
  for (const StatedCheck& check : precision.stated) {
    if (check.test == 0) continue;
    tested.push_back(&check);
    squares += check.test * check.test * check.redundancy;
    redundancy += check.redundancy;
  }
  if (tested.empty()) return std::nullopt;
  const auto size = [](const StatedCheck* check) { return std::abs(check->test); };
  std::sort(tested.begin(), tested.end(),
            [&](const auto* a, const auto* b) { return size(a) > size(b); });
  const StatedCheck& worst = *tested.front();
  // Half of the false alarms for a single wrong value, half for many slightly wrong ones.
  const double one =
      std::sqrt(ChiSquareQuantile(1 - false_alarm / 2 / static_cast<double>(tested.size()), 1));
  const int freedom = std::max(1, static_cast<int>(std::lround(redundancy)));
  const double all = ChiSquareQuantile(1 - false_alarm / 2, freedom);
  if (size(&worst) <= one && squares <= all) return std::nullopt;
  constexpr double kSame = 0.99;  // two that check one another: neither stands out
  const bool alone = tested.size() < 2 || size(tested[1]) < kSame * size(&worst);
  const std::string by = fmt::format("{:.3f} mm", std::abs(worst.off_mm / worst.redundancy));
  constexpr const char* kRemedy =
      "; touch the marks anew and state for each the length of the tool that touched it";
  if (alone) {
    return fmt::format(
        "{} is {} from where the pictures and all else that is stated put it, {:.3g} "
        "times its uncertainty{}",
        NameOf(pieces, worst), by, size(&worst), kRemedy);
  }
  return fmt::format("{} and {} contradict one another by {}, {:.3g} times their uncertainty{}",
                     NameOf(pieces, worst), NameOf(pieces, *tested[1]), by, size(&worst), kRemedy);
}

std::string UncheckedPlace(const BoardNetwork& network, const StatedPlace& told) {
  if (!told.touched_along || told.prior) return {};
  const auto& touches = network.touches;
  if (std::any_of(touches.begin(), touches.end(), [](const auto& of) { return of.other_tool; })) {
    return {};
  }
  return fmt::format(
      "the length of the one tool that touched ({:g} mm) is checked by nothing: an error of it is "
      "one of the camera's place along the spindle; touch a mark with a tool of another length",
      touches.front().tool_length_mm);
}

}  // namespace trammel::part_alignment
