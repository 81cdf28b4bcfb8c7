#include "tool_offset/sheet/sheet_code.h"

#include <algorithm>
#include <array>

namespace trammel::tool_offset {
namespace {

// The end is the complement of the start read backwards: see kSyncCells.
constexpr std::array<bool, kSyncCells> kStart{true, true, false, true, false};
constexpr std::array<bool, kSyncCells> kEnd{true, false, true, false, false};

std::uint8_t Crc8(std::uint16_t number) {
  constexpr std::uint32_t kPolynomial = 0x107;
  std::uint32_t rest = std::uint32_t{number} << kCheckBits;
  for (std::size_t bit = kIdBits + kCheckBits; bit-- > kCheckBits;) {
    if ((rest >> bit & 1u) != 0) rest ^= kPolynomial << (bit - kCheckBits);
  }
  return static_cast<std::uint8_t>(rest);
}

}  // namespace

CodeCells EncodeSheetId(std::uint16_t sheet_id) {
  CodeCells cells{};
  auto next = std::copy(kStart.begin(), kStart.end(), cells.begin());
  const auto append = [&](std::uint32_t number, std::size_t bits) {
    for (std::size_t bit = bits; bit-- > 0;) *next++ = (number >> bit & 1u) != 0;
  };
  append(sheet_id, kIdBits);
  append(Crc8(sheet_id), kCheckBits);
  std::copy(kEnd.begin(), kEnd.end(), next);
  return cells;
}

std::optional<std::uint16_t> DecodeSheetId(const CodeCells& dark) {
  std::uint16_t sheet_id = 0;
  for (std::size_t i = 0; i < kIdBits; ++i) {
    sheet_id = static_cast<std::uint16_t>(sheet_id << 1 | (dark[kSyncCells + i] ? 1 : 0));
  }
  if (EncodeSheetId(sheet_id) != dark) return std::nullopt;
  return sheet_id;
}

}  // namespace trammel::tool_offset
