// Code books, sheets of their targets, and why a target was not read.
#include "part_alignment/targets/target_sheet.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "part_alignment/targets/code_book.h"
#include "part_alignment/targets/target.h"
#include "support/matchers.h"

namespace trammel::part_alignment {
namespace {

using ::testing::HasSubstr;

/// Rotations by a way of the test's own: through a string of bits.
std::set<std::uint32_t> Rotations(int bits, std::uint32_t word) {
  std::set<std::uint32_t> all;
  for (int start = 0; start < bits; ++start) {
    std::uint32_t rotated = 0;
    for (int k = 0; k < bits; ++k) {
      if (word >> ((start + k) % bits) & 1U) rotated |= 1U << k;
    }
    all.insert(rotated);
  }
  return all;
}

CodeBook Book(int bits) {
  const Result<CodeBook> book = MakeCodeBook(bits);
  EXPECT_TRUE(book) << book.error().message;
  return book.value_or(CodeBook{});
}

class Books : public testing::TestWithParam<int> {};

TEST_P(Books, HoldAtLeastAsManyMembersAsPromised) {
  const std::map<int, std::size_t> promised{{12, 16}, {14, 44}, {20, 1022}};
  EXPECT_EQ(Book(GetParam()).words.size(), promised.at(GetParam()));
}

TEST_P(Books, DifferByAtLeast3BitsInEveryRotation) {
  const CodeBook book = Book(GetParam());
  for (std::size_t i = 0; i < book.words.size(); ++i) {
    const std::set<std::uint32_t> rotations = Rotations(book.bits, book.words[i]);
    for (std::size_t j = 0; j < i; ++j) {
      for (const std::uint32_t rotated : rotations) {
        ASSERT_GE(std::popcount(rotated ^ book.words[j]), 3)
            << "targets " << i + 1 << " and " << j + 1;
      }
    }
  }
}

TEST_P(Books, WithAQuarterHiddenBlackOrWhiteAreNoOtherMember) {
  const CodeBook book = Book(GetParam());
  for (std::size_t i = 0; i < book.words.size(); ++i) {
    for (int start = 0; start < book.bits; ++start) {
      std::uint32_t hidden = 0;
      for (int k = 0; k < HiddenBits(book.bits); ++k) {
        hidden |= 1U << ((start + k) % book.bits);
        for (const std::uint32_t seen : {book.words[i] | hidden, book.words[i] & ~hidden}) {
          const auto number = TargetNumber(book, seen);
          ASSERT_TRUE(!number || *number == static_cast<int>(i) + 1)
              << "target " << i + 1 << " with " << k + 1 << " bits hidden";
        }
      }
    }
  }
}

TEST_P(Books, InAMirrorAreNoMemberInAnyRotation) {
  const CodeBook book = Book(GetParam());
  for (const std::uint32_t word : book.words) {
    std::uint32_t mirrored = 0;
    for (int k = 0; k < book.bits; ++k) {
      if (word >> k & 1U) mirrored |= 1U << (book.bits - 1 - k);
    }
    for (const std::uint32_t rotated : Rotations(book.bits, mirrored)) {
      ASSERT_EQ(TargetNumber(book, rotated), std::nullopt) << word;
    }
  }
}

TEST_P(Books, ReadEveryMemberInEveryRotationAndNothingWithAWrongBit) {
  const CodeBook book = Book(GetParam());
  for (std::size_t i = 0; i < book.words.size(); ++i) {
    for (const std::uint32_t rotated : Rotations(book.bits, book.words[i])) {
      ASSERT_EQ(TargetNumber(book, rotated), static_cast<int>(i) + 1);
    }
    for (int bit = 0; bit < book.bits; ++bit) {
      ASSERT_EQ(TargetNumber(book, book.words[i] ^ (1U << bit)), std::nullopt);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Bits, Books, testing::Values(12, 14, 20));

TEST(CodeBook, RefusesOtherNumbersOfBitsByName) {
  for (const int bits : {-1, 0, 13, 32}) {
    EXPECT_THAT(MakeCodeBook(bits), FailsWith(std::to_string(bits)));
  }
}

TEST(TargetSheet, KeepsTargetsApartAndOnThePage) {
  for (const double radius_mm : {1.0, 5.0, 20.0}) {
    const auto sheet = Must(PlanTargetSheet(
        {.bits = 20, .radius_mm = radius_mm, .first = 100, .count = 90, .plain = 5}));
    ASSERT_EQ(sheet.targets.size(), 95U);
    EXPECT_EQ(sheet.targets.back().page, sheet.pages - 1);
    for (const PlacedTarget& a : sheet.targets) {
      EXPECT_GE(a.x_mm - sheet.square_mm / 2, 9.9);
      EXPECT_LE(a.x_mm + sheet.square_mm / 2, 200.1);
      EXPECT_GE(a.y_mm - sheet.square_mm / 2, 9.9);
      EXPECT_LT(a.y_mm + sheet.square_mm / 2 + sheet.label_mm, sheet.scale_bar.y_mm);
      for (const PlacedTarget& b : sheet.targets) {
        if (&a == &b || a.page != b.page) continue;
        EXPECT_GE(std::max(std::abs(a.x_mm - b.x_mm), std::abs(a.y_mm - b.y_mm)), sheet.square_mm);
      }
    }
  }
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
