#include "image/huffman_codes.h"

#include <algorithm>

namespace trammel::image {
namespace {

constexpr int kMostDcSymbol = 15;
constexpr int kMostAcSymbol = 255;

}  // namespace

bool HuffmanTree::Make(const HuffmanTable& table, int most_symbol) {
  symbols_ = table.symbols;
  std::uint32_t code = 0;
  std::uint32_t symbol = 0;
  for (std::size_t i = 0; i < table.counts.size(); ++i) {
    to_symbol_[i] = static_cast<std::int32_t>(symbol) - static_cast<std::int32_t>(code);
    code += table.counts[i];
    symbol += table.counts[i];
    end_[i] = code;
    const std::uint32_t all = std::uint32_t{2} << i;  // of nothing but ones is no code
    if ((table.counts[i] > 0 && code >= all) || symbol > symbols_.size()) return false;
    code <<= 1;
  }
  return std::all_of(symbols_.begin(), symbols_.begin() + symbol,
                     [&](int value) { return value <= most_symbol; });
}

HuffmanTree::Symbol HuffmanTree::Find(std::uint64_t bits) const {
  for (std::size_t i = 0; i < end_.size(); ++i) {
    const auto code = static_cast<std::uint32_t>(bits >> (63 - i));
    if (code >= end_[i]) continue;
    const auto at = static_cast<std::size_t>(static_cast<std::int32_t>(code) + to_symbol_[i]);
    return {symbols_[at], static_cast<int>(i) + 1};
  }
  return {};
}

BitString HuffmanTree::CodeOf(int symbol) const {
  const auto symbols = [this](std::size_t i) {  // of codes up to this length
    return static_cast<std::int32_t>(end_[i]) + to_symbol_[i];
  };
  const auto end = symbols_.begin() + symbols(end_.size() - 1);
  const auto at =
      static_cast<std::int32_t>(std::find(symbols_.begin(), end, symbol) - symbols_.begin());
  for (std::size_t i = 0; i < end_.size(); ++i) {
    if (at < symbols(i)) {
      return {static_cast<std::uint64_t>(at - to_symbol_[i]), static_cast<int>(i) + 1};
    }
  }
  return {};
}

bool BlockCodes::Make(const HuffmanTable& dc, const HuffmanTable& ac) {
  if (!dc_.Make(dc, kMostDcSymbol) || !ac_.Make(ac, kMostAcSymbol)) return false;
  const auto fill = [](auto& table, const auto& step_of) {
    for (std::size_t i = 0; i < kSize; ++i) {
      table[i] = step_of(std::uint64_t{i} << (64 - kLookedUp_bit));
    }
  };
  // A code that the looked-up bits do not hold whole is not known by them.
  fill(one_, [this](std::uint64_t bits) {
    return ac_.Find(bits).bits <= kLookedUp_bit ? SearchAc(bits) : AcStep();
  });
  fill(several_, [this](std::uint64_t bits) { return MakeSeveral(bits); });
  fill(first_, [this](std::uint64_t bits) { return MakeFirst(bits); });
  return true;
}

FirstStep BlockCodes::Dc(std::uint64_t bits) const {
  constexpr int kMostBits = 11;
  const auto [size, code_bits] = dc_.Find(bits);
  if (code_bits == 0 || size > kMostBits) return {};
  FirstStep step;
  step.bits = static_cast<std::uint8_t>(code_bits + size);
  step.left = kCoefficients - 1;
  if (size == 0) return step;
  const int number = static_cast<int>(bits << code_bits >> (64 - size));
  const bool negative = number >> (size - 1) == 0;
  step.difference = static_cast<std::int16_t>(negative ? number - (1 << size) + 1 : number);
  return step;
}

BitString BlockCodes::Flat() const {
  const BitString same = dc_.CodeOf(0);
  const BitString end = ac_.CodeOf(0);
  if (same.count == 0 || end.count == 0) return {};
  return {same.bits << end.count | end.bits, same.count + end.count};
}

AcStep BlockCodes::SearchAc(std::uint64_t bits) const {
  constexpr int kSixteenZeros = 15;
  const auto [symbol, code_bits] = ac_.Find(bits);
  if (code_bits == 0) return {};
  const int zeros = symbol >> 4;
  const int size = symbol & 15;
  if (size > 0) return {code_bits + size, zeros + 1, false};
  if (zeros == 0) return {code_bits, 1, true};
  if (zeros == kSixteenZeros) return {code_bits, 16, false};
  return {};
}

/// REQUIRES that one_ is made.
AcStep BlockCodes::MakeSeveral(std::uint64_t bits) const {
  AcStep all = one_[Index(bits)];
  if (!all.found() || all.bits() > kLookedUp_bit) return {};
  while (!all.ends() && all.count() < kCoefficients) {
    const AcStep next = one_[Index(bits << all.bits())];
    if (!next.found() || all.bits() + next.bits() > kLookedUp_bit) break;
    all = {all.bits() + next.bits(), all.count() + next.count(), next.ends()};
  }
  return all;
}

/// REQUIRES that several_ is made.
FirstStep BlockCodes::MakeFirst(std::uint64_t bits) const {
  FirstStep step = Dc(bits);
  if (step.bits > kLookedUp_bit) return {};
  const AcStep rest = several_[Index(bits << step.bits)];
  // Where the block ends with them no more codes follow; else the next look-up goes on.
  if (step.bits == 0 || !rest.found() || step.bits + rest.bits() > kLookedUp_bit) return step;
  if (rest.count() > step.left) return step;
  step.bits = static_cast<std::uint8_t>(step.bits + rest.bits());
  step.left = rest.ends() ? 0 : static_cast<std::uint8_t>(step.left - rest.count());
  return step;
}

}  // namespace trammel::image
