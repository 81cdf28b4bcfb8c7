// Lays out structures, code and box on paper or bed, for a scan or for photos.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

inline constexpr int kBoxLines = 3;
/// Pitch and length of the code's legs: at 300 dpi 23 px and 47 px.
inline constexpr double kCodeCell_mm = 2;
inline constexpr double kCodeLeg_mm = 4;
/// Prime lines: gap from the box to the first row, more than most tools are off; pitch of the rows;
/// largest length of a line.
inline constexpr double kPrimeGap_mm = 5;
inline constexpr double kPrimeRow_mm = 3;
inline constexpr double kPrimeLength_mm = 40;

/// Returns the depth of the prime lines below the box.
[[nodiscard]] double PrimeDepth_mm(const SheetSettings& settings);

/// Returns the size of one structure's ink: along the axis that it measures, and across.
[[nodiscard]] double StructureLength_mm(const SheetSettings& settings);
[[nodiscard]] double StructureThickness_mm(const SheetSettings& settings);

/// Layout inside the box; the origin is the lower left corner of `width_mm` x `height_mm`.
struct Layout {
  double width_mm = 0;
  double height_mm = 0;
  std::vector<SheetPoint> x_structures;  ///< middles, in the order that was given
  std::vector<SheetPoint> y_structures;
  SheetPoint code;  ///< middle of its row
};

/// Chooses an outline that fits the bed and the paper (any, if none does): on the smallest sheet of
/// paper, turned by the tilt. Of those it takes the smallest turned outline. X structures are in
/// columns, Y structures in rows.
/// @param border_mm  around the layout on each side: box, clearance.
[[nodiscard]] Layout ArrangeSheet(const SheetSettings& settings, std::size_t x_structures,
                                  std::size_t y_structures, double border_mm);

/// Number of cells at the start and at the end of the row that are the same on every sheet. Read
/// from the wrong end all of them are wrong, so a rotated or mirrored sheet never passes.
inline constexpr std::size_t kSyncCells = 5;
inline constexpr std::size_t kIdBits = 16;
inline constexpr std::size_t kCheckBits = 8;
inline constexpr std::size_t kCodeCells = 2 * kSyncCells + kIdBits + kCheckBits;

/// Cells, true for dark, from left (low u) to right: sync, number (highest bit first), check bits
/// (CRC-8, polynomial 0x07, of the number's two bytes), sync.
using CodeCells = std::array<bool, kCodeCells>;

[[nodiscard]] CodeCells EncodeSheetId(std::uint16_t sheet_id);

/// Decodes the sheet's number; nothing if a sync cell or the check bits are wrong. The check finds
/// every error of up to three cells and all but 1 in 256 of the others.
[[nodiscard]] std::optional<std::uint16_t> DecodeSheetId(const CodeCells& dark);

/// Places the two structures of a tool and axis on opposite sides of one point. Effects that grow
/// outwards from there (lines of another height, lateral colour) then affect their difference and
/// not their mean.
///
/// The X structures form two equal blocks, the Y structures two others, around the middle like the
/// wings of a windmill; the code is in a row below. The shape of the blocks is selected as in
/// ArrangeSheet.
/// @param x, y  the structures of each axis; see ListStructures.
[[nodiscard]] Layout ArrangeForPhoto(const SheetSettings& settings, const std::vector<Structure>& x,
                                     const std::vector<Structure>& y, double border_mm);

struct PaperSize {
  std::string_view name;
  double short_mm = 0;
  double long_mm = 0;
};

/// Returns the paper sizes, smallest first.
[[nodiscard]] std::span<const PaperSize> PaperSizes();

/// Finds a paper by its name, in capitals or not. Nothing for another name.
[[nodiscard]] std::optional<PaperSize> FindPaper(std::string_view name);

/// White margin on each side of the print, for the tape and the area that a scanner misses.
inline constexpr double kPaperMargin_mm = 5;

/// True if a print with these extents along the bed's x and y fits, lying or standing.
[[nodiscard]] bool FitsPaper(const PaperSize& paper, double x_mm, double y_mm);

}  // namespace trammel::tool_offset
