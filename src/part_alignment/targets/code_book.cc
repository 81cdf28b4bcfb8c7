#include "part_alignment/targets/code_book.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>

namespace trammel::part_alignment {
namespace {

// Found by a search for large independent sets in the graph whose edges join words that could be
// confused, mirrored or not. 16 and 44 are the best found, not proven to be the maximum.
constexpr std::array<std::uint32_t, 16> kWords12{23,  37,  115, 141, 171, 217, 329,  359,
                                                 415, 467, 509, 623, 759, 981, 1463, 1531};
constexpr std::array<std::uint32_t, 44> kWords14{
    75,   103,  125,  181,  271,  289,  343,  473,  499,  547,  581,  659,  669,  753,  795,
    821,  877,  1101, 1187, 1271, 1407, 1427, 1487, 1509, 1631, 1723, 1773, 1843, 1877, 1959,
    1981, 2027, 2365, 2381, 2487, 2527, 2647, 2767, 2943, 2989, 3503, 3767, 4061, 5559};

constexpr int kMinDistance = 3;
constexpr int kMinOfEither = 3;
constexpr int kMinChanges = 4;

std::uint32_t Rotated(int bits, std::uint32_t word, int by) {
  const std::uint32_t mask = (1U << bits) - 1;
  return ((word >> by) | (word << (bits - by))) & mask;
}

bool IsFit(int bits, std::uint32_t word) {
  const int ones = std::popcount(word);
  if (ones < kMinOfEither || bits - ones < kMinOfEither) return false;
  if (std::popcount(word ^ Rotated(bits, word, 1)) < kMinChanges) return false;
  for (int by = 1; by < bits; ++by) {
    if (std::popcount(word ^ Rotated(bits, word, by)) < kMinDistance) return false;
  }
  return true;
}

/// Returns the canonical word of the mirrored ring.
std::uint32_t Mirrored(int bits, std::uint32_t word) {
  return CanonicalWord(bits, ReversedWord(bits, word));
}

/// True if `word` is the smallest of its rotations.
bool IsCanonical(int bits, std::uint32_t word) {
  for (int by = 1; by < bits; ++by) {
    if (Rotated(bits, word, by) < word) return false;
  }
  return true;
}

/// Lists the possible misreadings with up to two wrong bits or with neighbours hidden, canonical.
std::vector<std::uint32_t> Misreadings(int bits, std::uint32_t word) {
  std::vector<std::uint32_t> found;
  const auto add = [&](std::uint32_t other) { found.push_back(CanonicalWord(bits, other)); };
  for (int i = 0; i < bits; ++i) {
    add(word ^ (1U << i));
    for (int j = 0; j < i; ++j) add(word ^ (1U << i) ^ (1U << j));
    std::uint32_t hidden = 0;
    for (int k = 0; k < HiddenBits(bits); ++k) {
      hidden |= 1U << ((i + k) % bits);
      add(word | hidden);
      add(word & ~hidden);
    }
  }
  return found;
}

/// Takes each word, in ascending order, that cannot be confused with an earlier one.
std::vector<std::uint32_t> GreedyText(int bits) {
  const std::uint32_t count = 1U << bits;
  std::vector<bool> taken(count);
  std::vector<bool> barred(count);
  std::vector<std::uint32_t> words;
  for (std::uint32_t word = 0; word < count; ++word) {
    if (barred[word] || !IsCanonical(bits, word) || !IsFit(bits, word)) continue;
    const std::uint32_t mirrored = Mirrored(bits, word);
    if (mirrored == word) continue;
    const std::vector<std::uint32_t> misreadings = Misreadings(bits, word);
    if (std::any_of(misreadings.begin(), misreadings.end(),
                    [&](std::uint32_t other) { return other != word && taken[other]; })) {
      continue;
    }
    for (const std::uint32_t other : misreadings) barred[other] = true;
    barred[mirrored] = true;
    taken[word] = true;
    words.push_back(word);
  }
  return words;
}

}  // namespace

Result<CodeBook> MakeCodeBook(int bits) {
  if (bits == 12) return CodeBook{bits, {kWords12.begin(), kWords12.end()}};
  if (bits == 14) return CodeBook{bits, {kWords14.begin(), kWords14.end()}};
  if (bits == 20) return CodeBook{bits, GreedyText(bits)};
  return Fail(fmt::format("code of {} bits: must be 12, 14 or 20", bits));
}

std::uint32_t CanonicalWord(int bits, std::uint32_t word) {
  std::uint32_t smallest = word;
  for (int by = 1; by < bits; ++by) smallest = std::min(smallest, Rotated(bits, word, by));
  return smallest;
}

std::uint32_t ReversedWord(int bits, std::uint32_t word) {
  std::uint32_t reversed = 0;
  for (int k = 0; k < bits; ++k) reversed |= (word >> k & 1U) << (bits - 1 - k);
  return reversed;
}

std::optional<int> TargetNumber(const CodeBook& book, std::uint32_t word) {
  const std::uint32_t canonical = CanonicalWord(book.bits, word);
  const auto at = std::lower_bound(book.words.begin(), book.words.end(), canonical);
  if (at == book.words.end() || *at != canonical) return std::nullopt;
  return static_cast<int>(at - book.words.begin()) + 1;
}

}  // namespace trammel::part_alignment
