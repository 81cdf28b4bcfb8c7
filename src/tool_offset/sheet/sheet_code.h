// The row of cells that carries the sheet's number: what it says, and how it is told from noise.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace trammel::tool_offset {

/// Cells at the start and at the end of the row that are the same on every sheet. Read from the
/// wrong end all of them are wrong, so that a sheet that is turned round or mirrored never passes.
inline constexpr std::size_t kSyncCells = 5;
inline constexpr std::size_t kIdBits = 16;
inline constexpr std::size_t kCheckBits = 8;
inline constexpr std::size_t kCodeCells = 2 * kSyncCells + kIdBits + kCheckBits;

/// True for dark, from left (low u) to right: sync, number (highest bit first), check bits (CRC-8,
/// polynomial 0x07, of the number's two bytes), sync.
using CodeCells = std::array<bool, kCodeCells>;

[[nodiscard]] CodeCells EncodeSheetId(std::uint16_t sheet_id);

/// The number that the cells carry; nothing where a sync cell or the check bits are wrong. The
/// check finds every error of up to three cells and all but 1 in 256 of the others.
[[nodiscard]] std::optional<std::uint16_t> DecodeSheetId(const CodeCells& dark);

}  // namespace trammel::tool_offset
