#include "part_alignment/targets/code_book.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <map>
#include <set>

namespace trammel::part_alignment {
namespace {

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

TEST_P(Books, StartAtOnePlaceOfTheRing) {
  const CodeBook book = Book(GetParam());
  for (const std::uint32_t word : book.words) {
    const std::set<std::uint32_t> rotations = Rotations(book.bits, word);
    ASSERT_EQ(rotations.size(), static_cast<std::size_t>(book.bits)) << word;
    EXPECT_EQ(*rotations.begin(), word) << "members are the smallest of their rotations";
    for (const std::uint32_t rotated : rotations) {
      if (rotated != word) {
        EXPECT_GE(std::popcount(rotated ^ word), 4) << word;
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
    const Result<CodeBook> book = MakeCodeBook(bits);
    ASSERT_FALSE(book);
    EXPECT_THAT(book.error().message, testing::HasSubstr(std::to_string(bits)));
  }
}

}  // namespace
}  // namespace trammel::part_alignment
