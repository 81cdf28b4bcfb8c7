#include "part_alignment/procedure/align_route.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

namespace trammel::procedure {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using part_alignment::MachineBox;
using part_alignment::View;

std::string At(const Vector3d& mm) {
  return fmt::format("X {:.1f} Y {:.1f} Z {:.1f}", mm.x(), mm.y(), mm.z());
}

// Returns the least distance of a straight path from a rectangle, seen from above.
double DistanceFromAbove(const Vector2d& from, const Vector2d& to, const MachineBox& box) {
  const auto outside = [&box](const Vector2d& at) {
    const Vector2d low = (box.low_mm.head<2>() - at).cwiseMax(0);
    const Vector2d high = (at - box.high_mm.head<2>()).cwiseMax(0);
    return (low + high).norm();
  };
  // The distance to a convex set is convex along the way: bracket its minimum.
  double lo = 0;
  double hi = 1;
  constexpr int kSteps = 100;
  for (int i = 0; i < kSteps; ++i) {
    const double a = lo + (hi - lo) / 3;
    const double b = hi - (hi - lo) / 3;
    if (outside(from + a * (to - from)) < outside(from + b * (to - from))) {
      hi = b;
    } else {
      lo = a;
    }
  }
  return outside(from + (lo + hi) / 2 * (to - from));
}

// Returns the obstacle touched between two places, counted from 1.
std::optional<std::size_t> Touched(const Vector3d& from, const Vector3d& to,
                                   const RouteOptions& options) {
  const double lowest_mm = std::min(from.z(), to.z()) - options.camera_below_mm;
  for (std::size_t i = 0; i < options.obstacles.size(); ++i) {
    const MachineBox& box = options.obstacles[i];
    if (lowest_mm > box.high_mm.z()) continue;
    if (DistanceFromAbove(from.head<2>(), to.head<2>(), box) <= options.camera_radius_mm) {
      return i + 1;
    }
  }
  return std::nullopt;
}

Result<void> CheckOptions(const Vector3d& start_mm, const RouteOptions& options) {
  if (!start_mm.allFinite() || !std::isfinite(options.safe_z_mm) ||
      !(options.camera_radius_mm >= 0) || !std::isfinite(options.camera_below_mm)) {
    return Fail("the safe height, the camera's size or the spindle's place is not a number");
  }
  // No view would ever exceed a limit that is NaN.
  if (!(options.travel.low_mm.array() <= options.travel.high_mm.array()).all()) {
    return Fail(fmt::format("the travel reaches from {} to {}: give its least and then its most "
                            "coordinates",
                            At(options.travel.low_mm), At(options.travel.high_mm)),
                ErrorKind::kSafety);
  }
  if (options.safe_z_mm < options.travel.low_mm.z() ||
      options.safe_z_mm > options.travel.high_mm.z()) {
    return Fail(
        fmt::format("the safe height {:.1f} lies outside the travel, {:.1f} … {:.1f} mm",
                    options.safe_z_mm, options.travel.low_mm.z(), options.travel.high_mm.z()),
        ErrorKind::kSafety);
  }
  constexpr double kOvershoot_mm = 0.01;  // permitted excess of an axis at its limit
  if ((start_mm.array() < options.travel.low_mm.array() - kOvershoot_mm).any() ||
      (start_mm.array() > options.travel.high_mm.array() + kOvershoot_mm).any()) {
    return Fail(fmt::format("the spindle stands at X {:.6g} Y {:.6g} Z {:.6g}, outside the travel "
                            "from {} to {}: drive it back, or look at the controller's scales",
                            start_mm.x(), start_mm.y(), start_mm.z(), At(options.travel.low_mm),
                            At(options.travel.high_mm)),
                ErrorKind::kSafety);
  }
  for (const MachineBox& box : options.obstacles) {
    if (!box.low_mm.allFinite() || !box.high_mm.allFinite() ||
        (box.low_mm.array() > box.high_mm.array()).any()) {
      return Fail(
          fmt::format("an obstacle reaches from {} to {}: give its least and then its most "
                      "coordinates",
                      At(box.low_mm), At(box.high_mm)));
    }
  }
  return {};
}

Result<void> CheckView(const part_alignment::View& view, std::size_t number,
                       const RouteOptions& options) {
  constexpr double kTurned = 1e-9;
  if (!view.spindle_mm.allFinite()) {
    return Fail(fmt::format("view {} has a place that is not a number", number + 1));
  }
  if ((view.spindle_rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > kTurned) {
    return Fail(fmt::format("view {} turns the spindle; only X, Y and Z are driven: take that "
                            "picture by hand",
                            number + 1),
                ErrorKind::kSafety);
  }
  if ((view.spindle_mm.array() < options.travel.low_mm.array()).any() ||
      (view.spindle_mm.array() > options.travel.high_mm.array()).any()) {
    return Fail(
        fmt::format("view {} at {} lies outside the travel", number + 1, At(view.spindle_mm)),
        ErrorKind::kSafety);
  }
  if (view.spindle_mm.z() > options.safe_z_mm) {
    return Fail(fmt::format("view {} at {} lies above the safe height {:.1f}", number + 1,
                            At(view.spindle_mm), options.safe_z_mm),
                ErrorKind::kSafety);
  }
  return {};
}

// Permitted motion of an axis at rest: ten times its arrival tolerance.
constexpr double kStands_mm = 0.01;

Error At(std::size_t number, const Error& error, bool back) {
  return {error.kind, back ? "behind the last view: " + error.message
                           : fmt::format("view {}: {}", number + 1, error.message)};
}

// Checks that the spindle did not move: its position during the exposure is known only after the
// picture.
Result<void> CheckStood(const View& view, const ViewHooks& shop) {
  if (!shop.move_to) return {};
  const auto at_mm = TRY(shop.stands_at());
  const double off_mm = (at_mm - view.spindle_mm).norm();
  if (off_mm <= kStands_mm) return {};
  return Fail(fmt::format("the spindle moved by {:.3f} mm while the picture was taken; does "
                          "somebody else drive the machine?",
                          off_mm),
              ErrorKind::kMachine);
}

}  // namespace

Result<std::vector<Waypoint>> RouteThrough(const Vector3d& start_mm,
                                           const std::vector<part_alignment::View>& views,
                                           const RouteOptions& options) {
  TRY(CheckOptions(start_mm, options));
  std::vector<Waypoint> way;
  Vector3d at = start_mm;
  const auto go = [&](const Vector3d& to, int view) -> Result<void> {
    // The first move is up and away from the spindle's start, whatever that is.
    const bool up = to.head<2>() == at.head<2>() && to.z() >= at.z();
    if (const auto touched = up ? std::nullopt : Touched(at, to, options)) {
      return Fail(
          fmt::format("the way from {} to {} comes too near to obstacle {} (camera: radius "
                      "{:.0f} mm, {:.0f} mm below the spindle); raise the safe height or "
                      "move the view",
                      At(at), At(to), *touched, options.camera_radius_mm, options.camera_below_mm),
          ErrorKind::kSafety);
    }
    at = to;
    way.push_back({to, view});
    return {};
  };
  const auto above = [&options](const Vector3d& mm) {
    return Vector3d(mm.x(), mm.y(), options.safe_z_mm);
  };
  if (start_mm.z() < options.safe_z_mm) {
    TRY(go(above(start_mm), -1));
  }
  for (std::size_t i = 0; i < views.size(); ++i) {
    TRY(CheckView(views[i], i, options));
    const Vector3d& place = views[i].spindle_mm;
    const Vector3d across(place.x(), place.y(), std::max(at.z(), options.safe_z_mm));
    for (const auto& [to, view] : {std::pair{across, -1}, std::pair{place, static_cast<int>(i)},
                                   std::pair{above(place), -1}}) {
      TRY(go(to, view));
    }
  }
  return way;
}

Result<void> TakeView(std::size_t number, const View& view, const ViewHooks& shop,
                      const OnPicture& on_picture) {
  const auto take = [&]() -> Result<void> {
    const auto picture = TRY(shop.take_picture());
    TRY(shop.keep_picture(number, picture));
    TRY(CheckStood(view, shop));
    return on_picture(number, picture);
  };
  if (auto taken = take(); !taken) return tl::unexpected(At(number, taken.error(), false));
  return {};
}

Result<void> DriveThroughViews(const std::vector<Waypoint>& way, const std::vector<View>& views,
                               const ViewHooks& shop, const OnPicture& on_picture) {
  for (std::size_t i = 0; i < way.size(); ++i) {
    const auto next = std::find_if(way.begin() + static_cast<long>(i), way.end(),
                                   [](const Waypoint& point) { return point.view >= 0; });
    const bool back = next == way.end();
    const auto number = back ? views.size() : static_cast<std::size_t>(next->view);
    if (shop.move_to) {
      if (auto moved = shop.move_to(way[i].spindle_mm); !moved) {
        return tl::unexpected(At(number, moved.error(), back));
      }
    }
    if (way[i].view < 0) continue;
    TRY(TakeView(number, views[number], shop, on_picture));
  }
  return {};
}

}  // namespace trammel::procedure
