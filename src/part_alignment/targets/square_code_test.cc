#include "part_alignment/targets/square_code.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <string>

namespace trammel::part_alignment {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// "#" is white, rows from the top.
std::uint32_t Drawn(const std::array<const char*, 5>& rows) {
  std::uint32_t word = 0;
  for (std::size_t row = 0; row < 5; ++row) {
    for (std::size_t column = 0; column < 5; ++column) {
      if (rows[row][column] == '#') word |= 1U << (5 * row + column);
    }
  }
  return word;
}

TEST(SquareCode, DrawsTheMarkersOfTheDictionary) {
  EXPECT_EQ(SquareWord(0), Drawn({"#....", "#....", "#....", "#....", "#...."}));
  EXPECT_EQ(SquareWord(27), Drawn({"#....", "#....", "#.###", ".#..#", ".###."}));
  EXPECT_EQ(SquareWord(650), Drawn({".#..#", ".#..#", "#....", ".#..#", ".#..#"}));
  EXPECT_EQ(SquareWord(1023), Drawn({".###.", ".###.", ".###.", ".###.", ".###."}));
}

TEST(SquareCode, TurnsClockwiseAndMirrorsLeftAndRight) {
  const std::uint32_t word = Drawn({"##...", "..#..", ".....", ".....", "...#."});
  EXPECT_EQ(QuarterTurned(word), Drawn({"....#", "....#", "...#.", "#....", "....."}));
  EXPECT_EQ(MirrorImage(word), Drawn({"...##", "..#..", ".....", ".....", ".#..."}));
  EXPECT_EQ(QuarterTurned(QuarterTurned(QuarterTurned(QuarterTurned(word)))), word);
}

TEST(SquareCode, HoldsEveryUprightPair3BitsApart) {
  for (int a = 0; a < kSquareIds; ++a) {
    for (int b = 0; b < a; ++b) {
      ASSERT_GE(std::popcount(SquareWord(a) ^ SquareWord(b)), kSquareLeastDistance)
          << a << " " << b;
    }
  }
}

TEST(SquareCode, DefaultIdsDifferIn3BitsHoweverTheyAreTurnedOrMirrored) {
  const auto all = DefaultSquareIds(394);
  ASSERT_TRUE(all) << all.error().message;
  for (std::size_t i = 0; i < all->size(); ++i) {
    const std::uint32_t a = SquareWord((*all)[i]);
    // As bits that are moved, not by the functions that chose them.
    for (std::size_t k = 0; k <= i; ++k) {
      std::uint32_t b = SquareWord((*all)[k]);
      for (int way = 0; way < 8; ++way) {
        if (i != k || way > 0) {
          ASSERT_GE(std::popcount(a ^ b), 3) << (*all)[i] << " " << (*all)[k];
        }
        b = way == 3 ? MirrorImage(b) : QuarterTurned(b);
      }
    }
  }
  EXPECT_TRUE(MakeSquareBook(*all));
  EXPECT_EQ(DefaultSquareIds(3).value(), std::vector<int>({5, 6, 7}));
  for (const int n : {-1, 0, 395}) {
    const auto refused = DefaultSquareIds(n);
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message, HasSubstr("1 ... 394"));
  }
}

TEST(SquareCode, RefusesListsThatMayBeMisreadByTheNamesOfTheTwo) {
  const auto message = [](const std::vector<int>& ids) {
    const auto book = MakeSquareBook(ids);
    return book ? std::string("no error") : book.error().message;
  };
  EXPECT_EQ(message({1, 2, 5, 1020}), "no error");
  EXPECT_THAT(message({}), HasSubstr("no ids"));
  EXPECT_THAT(message({1, 1024}), HasSubstr("marker 1024"));
  EXPECT_THAT(message({-1}), HasSubstr("marker -1"));
  EXPECT_THAT(message({7, 1, 7}), HasSubstr("7 is stated twice"));
  EXPECT_THAT(message({1023}), HasSubstr("1023 looks the same"));
  int refused = 0;
  for (int a = 0; a < kSquareIds; ++a) {
    for (int b = 0; b < a; ++b) {
      if (SquareDistance(SquareWord(a), SquareWord(b)) >= kSquareLeastDistance) continue;
      ++refused;
      EXPECT_THAT(message({b, a}),
                  testing::AnyOf(HasSubstr("looks the same"), AllOf(HasSubstr(std::to_string(a)),
                                                                    HasSubstr(std::to_string(b)))));
    }
  }
  EXPECT_EQ(refused, 78);
}

TEST(SquareCode, ReadsEveryRotationAndNothingThatIsOff) {
  const SquareBook book = MakeSquareBook(DefaultSquareIds(50).value()).value();
  for (std::size_t i = 0; i < book.ids.size(); ++i) {
    std::uint32_t word = SquareWord(book.ids[i]);
    for (int turn = 0; turn < 4; ++turn) {
      const auto read = ReadSquareWord(book, word);
      ASSERT_TRUE(read);
      EXPECT_EQ(read->id, book.ids[i]);
      EXPECT_EQ(read->quarter_turns, turn);
      EXPECT_EQ(AnySquareId(word), book.ids[i]);
      for (std::uint32_t bit = 0; bit < 25; ++bit) {
        EXPECT_FALSE(ReadSquareWord(book, word ^ 1U << bit)) << book.ids[i] << " bit " << bit;
      }
      word = QuarterTurned(word);
    }
    EXPECT_FALSE(ReadSquareWord(book, MirrorImage(word)));
  }
  EXPECT_FALSE(ReadSquareWord(book, SquareWord(1000)));
  EXPECT_EQ(AnySquareId(QuarterTurned(SquareWord(1000))), 1000);
  EXPECT_FALSE(AnySquareId(0));
}

}  // namespace
}  // namespace trammel::part_alignment
