#include "part_alignment/board/board_stated.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/statistics.h"

namespace trammel::part_alignment {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

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

PlaceTold ToldOf(const BoardNetwork& network) {
  PlaceTold told;
  constexpr double kTurned_rad = 0.02;  // the index error leaves nothing of less
  double first = 0;
  bool any = false;
  for (const BoardNetwork::Stop& stop : network.stops) {
    if (!stop.used) continue;
    if (!any) first = stop.turn_rad;
    any = true;
    const double by = std::remainder(stop.turn_rad - first, 2 * std::numbers::pi);
    told.turned = told.turned || std::abs(by) > kTurned_rad;
  }
  std::vector<bool> seen(network.marks, false);
  for (const BoardNetwork::Sight& sight : network.sights) {
    if (sight.used && network.stops[sight.view].used) seen[sight.mark] = true;
  }
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

HeldUnknowns HeldOf(const BoardNetwork& network, const PlaceTold& told) {
  HeldUnknowns held(static_cast<std::size_t>(SharedUnknowns(network)), false);
  held[7] = held[8] = !told.across();
  held[9] = !told.along();
  for (Index i = kBoardScale; i < SharedUnknowns(network); ++i) {
    held[static_cast<std::size_t>(i)] = !(PriorSigma(network, i) > 0);
  }
  return held;
}

void PlaceByTold(const BoardNetwork& network, const PlaceTold& told, BoardState& state) {
  const Matrix3d& turn = network.machine_from_spindle;
  Vector3d by = Vector3d::Zero();  // in the spindle's frame
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
  // Half of the false alarms for one that is wrong, half for many that are a little.
  const double one =
      std::sqrt(ChiSquareQuantile(1 - false_alarm / 2 / static_cast<double>(tested.size()), 1));
  const int freedom = std::max(1, static_cast<int>(std::lround(redundancy)));
  const double all = ChiSquareQuantile(1 - false_alarm / 2, freedom);
  if (size(&worst) <= one && squares <= all) return std::nullopt;
  constexpr double kSame = 0.99;  // of two that check one another none stands out
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

std::string UncheckedPlace(const BoardNetwork& network, const PlaceTold& told) {
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
