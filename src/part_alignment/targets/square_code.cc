#include "part_alignment/targets/square_code.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>

#include "base/check.h"

namespace trammel::part_alignment {
namespace {

constexpr int kTurns = 4;
constexpr int kBits = kSquareCells * kSquareCells;
constexpr std::uint32_t kAll = (1U << kBits) - 1;

/// What a row shows for the two bits that it carries, left column in the lowest bit: the second and
/// the fourth column are the bits themselves, the others check them.
constexpr std::array<std::uint32_t, 4> kRows = {0b00001, 0b11101, 0b10010, 0b01110};

bool WhiteAt(std::uint32_t word, int row, int column) {
  return (word >> (kSquareCells * row + column) & 1U) != 0;
}

/// The word whose cell (row, column) is what `from` finds for it in another.
template <typename From>
std::uint32_t Rearranged(From from) {
  std::uint32_t word = 0;
  for (int row = 0; row < kSquareCells; ++row) {
    for (int column = 0; column < kSquareCells; ++column) {
      if (from(row, column)) word |= 1U << (kSquareCells * row + column);
    }
  }
  return word;
}

/// In how few bits a marker differs from itself when it is turned.
int DistanceToItsTurns(std::uint32_t word) {
  int least = kBits;
  std::uint32_t turned = word;
  for (int turn = 1; turn < kTurns; ++turn) {
    turned = QuarterTurned(turned);
    least = std::min(least, std::popcount(word ^ turned));
  }
  return least;
}

/// What DefaultSquareIds asks of a single marker.
bool IsPlainToRead(std::uint32_t word) {
  constexpr int kLeastOfAShade = 9;
  const int white = std::popcount(word);
  return white >= kLeastOfAShade && kBits - white >= kLeastOfAShade &&
         DistanceToItsTurns(word) >= kSquareLeastDistance &&
         SquareDistance(word, MirrorImage(word)) >= kSquareLeastDistance;
}

}  // namespace

std::uint32_t SquareWord(int id) {
  TRAMMEL_CHECK(id >= 0 && id < kSquareIds, "id = {}", id);
  std::uint32_t word = 0;
  for (int row = 0; row < kSquareCells; ++row) {
    const int carried = id >> (2 * (kSquareCells - 1 - row)) & 3;
    word |= kRows[static_cast<std::size_t>(carried)] << (kSquareCells * row);
  }
  return word;
}

std::uint32_t QuarterTurned(std::uint32_t word) {
  // The left column, read upwards, becomes the upper row.
  return Rearranged(
      [word](int row, int column) { return WhiteAt(word, kSquareCells - 1 - column, row); });
}

std::uint32_t MirrorImage(std::uint32_t word) {
  return Rearranged(
      [word](int row, int column) { return WhiteAt(word, row, kSquareCells - 1 - column); });
}

int SquareDistance(std::uint32_t a, std::uint32_t b) {
  int least = kBits;
  for (int turn = 0; turn < kTurns; ++turn) {
    least = std::min(least, std::popcount((a ^ b) & kAll));
    b = QuarterTurned(b);
  }
  return least;
}

Result<SquareBook> MakeSquareBook(const std::vector<int>& ids) {
  if (ids.empty()) return Fail("no ids of markers: state those that are on the part");
  SquareBook book;
  for (const int id : ids) {
    if (id < 0 || id >= kSquareIds) {
      return Fail(
          fmt::format("marker {}: the original ArUco dictionary has 0 ... {}", id, kSquareIds - 1));
    }
    const std::uint32_t word = SquareWord(id);
    if (DistanceToItsTurns(word) == 0) {
      return Fail(
          fmt::format("marker {} looks the same after a turn, so that how it was read "
                      "cannot be told: use another",
                      id));
    }
    for (std::size_t i = 0; i < book.ids.size(); ++i) {
      if (book.ids[i] == id) return Fail(fmt::format("marker {} is stated twice", id));
      const int distance = SquareDistance(book.words[i], word);
      if (distance >= kSquareLeastDistance) continue;
      return Fail(fmt::format(
          "markers {} and {} differ in {} of 25 bits when one of them is turned, less than {}: "
          "replace one of them",
          book.ids[i], id, distance, kSquareLeastDistance));
    }
    book.ids.push_back(id);
    book.words.push_back(word);
  }
  return book;
}

Result<std::vector<int>> DefaultSquareIds(int n) {
  std::vector<int> ids;
  std::vector<std::uint32_t> words;
  for (int id = 0; id < kSquareIds; ++id) {
    const std::uint32_t word = SquareWord(id);
    const std::uint32_t mirrored = MirrorImage(word);
    const bool apart = std::all_of(words.begin(), words.end(), [&](std::uint32_t other) {
      return SquareDistance(other, word) >= kSquareLeastDistance &&
             SquareDistance(other, mirrored) >= kSquareLeastDistance;
    });
    if (!apart || !IsPlainToRead(word)) continue;
    ids.push_back(id);
    words.push_back(word);
  }
  const int most = static_cast<int>(ids.size());
  if (n < 1 || n > most) {
    return Fail(fmt::format("{} markers: there are 1 ... {} that go together", n, most));
  }
  ids.resize(static_cast<std::size_t>(n));
  return ids;
}

std::optional<SquareReading> ReadSquareWord(const SquareBook& book, std::uint32_t word) {
  for (std::size_t i = 0; i < book.words.size(); ++i) {
    std::uint32_t turned = book.words[i];
    for (int turn = 0; turn < kTurns; ++turn) {
      if (turned == word) return SquareReading{book.ids[i], turn};
      turned = QuarterTurned(turned);
    }
  }
  return std::nullopt;
}

std::optional<int> AnySquareId(std::uint32_t word) {
  for (int id = 0; id < kSquareIds; ++id) {
    if (SquareDistance(SquareWord(id), word) == 0) return id;
  }
  return std::nullopt;
}

}  // namespace trammel::part_alignment
