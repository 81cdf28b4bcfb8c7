#include "part_alignment/targets/target_sheet.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "part_alignment/targets/code_book.h"

namespace trammel::part_alignment {
namespace {

using ::testing::HasSubstr;

TEST(TargetSheet, KeepsTargetsApartAndOnThePage) {
  for (const double radius_mm : {1.0, 5.0, 20.0}) {
    const auto sheet = PlanTargetSheet(
        {.bits = 20, .radius_mm = radius_mm, .first = 100, .count = 90, .plain = 5});
    ASSERT_TRUE(sheet) << sheet.error().message;
    ASSERT_EQ(sheet->targets.size(), 95U);
    EXPECT_EQ(sheet->targets.back().page, sheet->pages - 1);
    for (const PlacedTarget& a : sheet->targets) {
      EXPECT_GE(a.x_mm - sheet->square_mm / 2, 9.9);
      EXPECT_LE(a.x_mm + sheet->square_mm / 2, 200.1);
      EXPECT_GE(a.y_mm - sheet->square_mm / 2, 9.9);
      EXPECT_LT(a.y_mm + sheet->square_mm / 2 + sheet->label_mm, sheet->scale_bar.y_mm);
      for (const PlacedTarget& b : sheet->targets) {
        if (&a == &b || a.page != b.page) continue;
        EXPECT_GE(std::max(std::abs(a.x_mm - b.x_mm), std::abs(a.y_mm - b.y_mm)), sheet->square_mm);
      }
    }
  }
}

TEST(TargetSheet, CarriesTheWordsOfTheCodeBook) {
  const auto sheet = PlanTargetSheet({.bits = 14, .first = 3, .count = 4, .plain = 1});
  ASSERT_TRUE(sheet);
  const CodeBook book = MakeCodeBook(14).value();
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(sheet->targets[static_cast<std::size_t>(i)].number, 3 + i);
    EXPECT_EQ(TargetNumber(book, sheet->targets[static_cast<std::size_t>(i)].word), 3 + i);
  }
  EXPECT_EQ(sheet->targets[4].number, 0);
  EXPECT_EQ(sheet->scale_bar.length_mm, 100);
}

TEST(TargetSheet, NamesWhatItCannotPlan) {
  const auto message = [](const SheetRequest& request) {
    const auto sheet = PlanTargetSheet(request);
    return sheet ? std::string("no error") : sheet.error().message;
  };
  EXPECT_THAT(message({.bits = 13}), HasSubstr("13 bits"));
  EXPECT_THAT(message({.radius_mm = std::nan("")}), HasSubstr("radius of nan mm"));
  EXPECT_THAT(message({.radius_mm = 50}), HasSubstr("larger page"));
  EXPECT_THAT(message({.bits = 12, .count = 17}), HasSubstr("1 ... 16"));
  EXPECT_THAT(message({.first = 0}), HasSubstr("1 ... 44"));
  EXPECT_THAT(message({.first = 2147483647, .count = 2}), HasSubstr("1 ... 44"));
  EXPECT_THAT(message({.count = 0}), HasSubstr("not none"));
  EXPECT_THAT(message({.page_width_mm = 1e9}), HasSubstr("50 ... 2000"));
}

}  // namespace
}  // namespace trammel::part_alignment
