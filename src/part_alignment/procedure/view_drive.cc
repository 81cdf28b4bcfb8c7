#include "part_alignment/procedure/view_drive.h"

#include <fmt/format.h>

#include <algorithm>

namespace trammel::procedure {
namespace {

using part_alignment::View;

// What an axis at rest may wander; ten times what it has to arrive within.
constexpr double kStands_mm = 0.01;

Error At(std::size_t number, const Error& error, bool back) {
  return {error.kind, back ? "behind the last view: " + error.message
                           : fmt::format("view {}: {}", number + 1, error.message)};
}

// Only behind the picture is it known where the spindle was while the light came in.
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
