#include "tool_offset/sheet/sheet_code.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "base/random.h"

namespace trammel::tool_offset {
namespace {

TEST(SheetCode, EveryNumberReadsBackAndNeverFromTheWrongEnd) {
  for (std::uint32_t id = 0; id <= 0xffff; ++id) {
    CodeCells cells = EncodeSheetId(static_cast<std::uint16_t>(id));
    ASSERT_EQ(DecodeSheetId(cells), id);
    std::reverse(cells.begin(), cells.end());
    ASSERT_EQ(DecodeSheetId(cells), std::nullopt) << id;
  }
}

TEST(SheetCode, UpToThreeWrongCellsAreNoticed) {
  constexpr std::uint64_t kSeed = 12;
  Random random(kSeed);
  for (int repeat = 0; repeat < 20000; ++repeat) {
    CodeCells cells = EncodeSheetId(static_cast<std::uint16_t>(random.Below(0x10000)));
    std::set<std::uint64_t> wrong;
    const std::uint64_t count = 1 + random.Below(3);
    while (wrong.size() < count) wrong.insert(random.Below(kCodeCells));
    for (const std::uint64_t cell : wrong) cells[cell] = !cells[cell];
    ASSERT_EQ(DecodeSheetId(cells), std::nullopt) << "seed " << kSeed << ", repeat " << repeat;
  }
}

}  // namespace
}  // namespace trammel::tool_offset
