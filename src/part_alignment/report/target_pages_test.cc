#include "part_alignment/report/target_pages.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "part_alignment/targets/ring_finder.h"

namespace trammel::report {
namespace {

using part_alignment::FindTargets;
using part_alignment::PlacedTarget;
using part_alignment::PlanTargetSheet;
using part_alignment::SheetRequest;
using part_alignment::TargetSheet;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TargetSheet Plan(const SheetRequest& request) {
  auto sheet = PlanTargetSheet(request);
  EXPECT_TRUE(sheet) << sheet.error().message;
  return sheet.value_or(TargetSheet{});
}

// Cairo covers pixels in steps of 1/15 along columns: some 0.01 px of a disc's
// centre.
constexpr double kCairo_px = 0.03;

void ExpectReadBack(const SheetRequest& request, double px_per_mm) {
  const TargetSheet sheet = Plan(request);
  const auto book = part_alignment::MakeCodeBook(request.bits).value();
  part_alignment::FinderWorkspace workspace;
  for (int page = 0; page < sheet.pages; ++page) {
    const Page image = TargetPageImage(sheet, page, px_per_mm);
    const auto found = FindTargets(image.view(), book, {.plain_discs = true}, workspace);
    ASSERT_TRUE(found) << found.error().message;
    std::size_t printed = 0;
    for (const PlacedTarget& target : sheet.targets) {
      if (target.page != page) continue;
      ++printed;
      bool seen = false;
      for (const auto& candidate : found->targets) {
        // (0, 0) is the first pixel's centre, half a pixel from the page's
        // corner.
        seen = seen ||
               (candidate.number.value_or(0) == target.number &&
                std::abs(candidate.disc.column_px + 0.5 - target.x_mm * px_per_mm) < kCairo_px &&
                std::abs(candidate.disc.row_px + 0.5 - target.y_mm * px_per_mm) < kCairo_px);
      }
      EXPECT_TRUE(seen) << "target " << target.number << " at " << target.x_mm << ", "
                        << target.y_mm;
    }
    EXPECT_EQ(found->targets.size(), printed);
  }
}

TEST(TargetPages, AreReadBackWhereTheyWerePlaced) {
  ExpectReadBack({.bits = 14, .radius_mm = 5, .count = 44}, 3);
  ExpectReadBack({.bits = 12, .radius_mm = 4, .count = 16, .plain = 3, .bright = true}, 3);
  ExpectReadBack({.bits = 20, .radius_mm = 6, .first = 990, .count = 6}, 2);
}

TEST(TargetPages, ArePdfAndSvgInMillimetresAndTheSameEachTime) {
  const TargetSheet sheet = Plan({.count = 40, .page_width_mm = 100});
  const std::string pdf = TargetPagesPdf(sheet);
  EXPECT_THAT(pdf, StartsWith("%PDF-"));
  EXPECT_THAT(pdf, HasSubstr("/Count " + std::to_string(sheet.pages)));
  EXPECT_EQ(pdf, TargetPagesPdf(sheet));
  const std::string svg = TargetPageSvg(sheet, 0);
  EXPECT_THAT(svg, HasSubstr("width=\"100mm\" height=\"297mm\" viewBox=\"0 0 100 297\""));
  EXPECT_EQ(svg, TargetPageSvg(sheet, 0));
}

}  // namespace
}  // namespace trammel::report
