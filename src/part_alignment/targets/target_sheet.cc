#include "part_alignment/targets/target_sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "part_alignment/targets/code_book.h"
#include "part_alignment/targets/target.h"

namespace trammel::part_alignment {
namespace {

constexpr double kMargin_mm = 10;  ///< unprinted by printers
constexpr double kFoot_mm = 14;    ///< scale bar's foot
constexpr double kSpace_mm = 3;    ///< between squares, for crop marks
constexpr int kMaxTargets = 2000;

std::optional<std::string> FindPageProblem(const SheetRequest& r) {
  for (const double side : {r.page_width_mm, r.page_height_mm}) {
    if (!(side >= 50 && side <= 2000)) {
      return fmt::format("page of {} x {} mm: must be 50 ... 2000 mm a side", r.page_width_mm,
                         r.page_height_mm);
    }
  }
  return std::nullopt;
}

std::optional<std::string> FindRingProblem(const SheetRequest& r) {
  if (!(r.radius_mm >= 0.5 && r.radius_mm <= 60)) {
    return fmt::format("radius of {} mm: must be in 0.5 ... 60", r.radius_mm);
  }
  if (r.count < 0 || r.count > kMaxTargets || r.plain < 0 || r.plain > kMaxTargets ||
      r.count + r.plain == 0) {
    return fmt::format("{} coded targets and {} plain discs: must be 0 ... {} each, and not none",
                       r.count, r.plain, kMaxTargets);
  }
  return std::nullopt;
}

/// Lists the targets to print, with numbers and words, but without positions.
Result<std::vector<PlacedTarget>> RingTargets(const SheetRequest& request) {
  if (const auto problem = FindRingProblem(request)) return Fail(*problem);
  const CodeBook book = TRY(MakeCodeBook(request.bits));
  const int members = static_cast<int>(book.words.size());
  if (request.count > 0 && (request.first < 1 || request.first > members - request.count + 1)) {
    return Fail(fmt::format("targets {} ... {}: the code of {} bits has 1 ... {}", request.first,
                            static_cast<long>(request.first) + request.count - 1, request.bits,
                            members));
  }
  std::vector<PlacedTarget> targets(static_cast<std::size_t>(request.count + request.plain));
  for (int i = 0; i < request.count; ++i) {
    PlacedTarget& target = targets[static_cast<std::size_t>(i)];
    target.number = request.first + i;
    target.word = book.words[static_cast<std::size_t>(target.number - 1)];
  }
  return targets;
}

/// Arranges the targets in rows from the upper left, page by page.
Result<void> Place(TargetSheet& sheet) {
  const SheetRequest& request = sheet.request;
  const double pitch_x = sheet.square_mm + kSpace_mm;
  const double pitch_y = sheet.square_mm + 1.6 * sheet.label_mm + kSpace_mm;
  const double room_x = request.page_width_mm - 2 * kMargin_mm;
  const double room_y = request.page_height_mm - 2 * kMargin_mm - kFoot_mm;
  const int columns = static_cast<int>((room_x + kSpace_mm) / pitch_x);
  const int rows = static_cast<int>((room_y + kSpace_mm) / pitch_y);
  if (columns < 1 || rows < 1) {
    return Fail(
        fmt::format("radius of {} mm on a page of {} x {} mm: a target takes {:.1f} x {:.1f} mm "
                    "and the margins "
                    "{} mm; choose a larger page or a smaller radius",
                    request.radius_mm, request.page_width_mm, request.page_height_mm, pitch_x,
                    pitch_y, kMargin_mm));
  }
  const int total = static_cast<int>(sheet.targets.size());
  sheet.pages = (total + columns * rows - 1) / (columns * rows);
  for (int i = 0; i < total; ++i) {
    const int place = i % (columns * rows);
    PlacedTarget& target = sheet.targets[static_cast<std::size_t>(i)];
    target.page = i / (columns * rows);
    target.x_mm = kMargin_mm + (place % columns) * pitch_x + 0.5 * sheet.square_mm;
    target.y_mm = kMargin_mm + (place / columns) * pitch_y + 0.5 * sheet.square_mm;
  }
  constexpr double kTens = 10;
  sheet.scale_bar.length_mm = std::min(100.0, kTens * std::floor(room_x / kTens));
  sheet.scale_bar.x_mm = 0.5 * (request.page_width_mm - sheet.scale_bar.length_mm);
  sheet.scale_bar.y_mm = request.page_height_mm - kMargin_mm - 4;
  return {};
}

}  // namespace

Result<TargetSheet> PlanTargetSheet(const SheetRequest& request) {
  if (const auto problem = FindPageProblem(request)) return Fail(*problem);
  auto targets = TRY(RingTargets(request));
  TargetSheet sheet;
  sheet.request = request;
  sheet.targets = std::move(targets);
  sheet.square_mm = 2 * kQuietRadius * request.radius_mm;
  sheet.label_mm = std::clamp(0.6 * request.radius_mm, 1.8, 5.0);
  TRY(Place(sheet));
  return sheet;
}

}  // namespace trammel::part_alignment
