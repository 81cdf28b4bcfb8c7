#include "tool_offset/sheet/sheet_layout.h"

#include <algorithm>
#include <cctype>
#include <limits>
#include <tuple>

#include "base/check.h"
#include "tool_offset/sheet/sheet_bed.h"

namespace trammel::tool_offset {
namespace {

// The end is the complement of the reversed start: see kSyncCells.
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

namespace {

constexpr auto kPapers = std::to_array<PaperSize>({{"A5", 148, 210},
                                                   {"A4", 210, 297},
                                                   {"letter", 215.9, 279.4},
                                                   {"A3", 297, 420},
                                                   {"A2", 420, 594}});

bool IsSame(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) ==
           std::tolower(static_cast<unsigned char>(y));
  });
}

}  // namespace

std::span<const PaperSize> PaperSizes() { return kPapers; }

std::optional<PaperSize> FindPaper(std::string_view name) {
  for (const PaperSize& paper : kPapers) {
    if (IsSame(paper.name, name)) return paper;
  }
  return std::nullopt;
}

bool FitsPaper(const PaperSize& paper, double x_mm, double y_mm) {
  const auto [short_mm, long_mm] = std::minmax(x_mm, y_mm);
  return short_mm <= paper.short_mm - 2 * kPaperMargin_mm &&
         long_mm <= paper.long_mm - 2 * kPaperMargin_mm;
}

namespace {

enum Kind : std::size_t { kX, kY, kCode, kKinds };

/// Rectangle of equal cells, each for one item.
struct Grid {
  double left_mm = 0;  ///< first cell
  double bottom_mm = 0;
  double cell_width_mm = 0;
  double cell_height_mm = 0;
  int columns = 1;
  int rows = 1;

  [[nodiscard]] double width_mm() const { return columns * cell_width_mm; }
  [[nodiscard]] double height_mm() const { return rows * cell_height_mm; }
  /// Returns the middle of a cell, along the columns' or the rows' lines first: neighbours in a
  /// list remain neighbours.
  [[nodiscard]] SheetPoint CellMiddle(std::size_t index, bool by_columns) const {
    const auto cell = static_cast<int>(index);
    const int column = by_columns ? cell / rows : cell % columns;
    const int row = by_columns ? cell % rows : cell / columns;
    return {left_mm + (column + 0.5) * cell_width_mm, bottom_mm + (row + 0.5) * cell_height_mm};
  }
};

/// Returns every arrangement of `count` equal cells in a rectangle that wastes no whole column or
/// row.
std::vector<Grid> Shapes(std::size_t count, double cell_width_mm, double cell_height_mm) {
  std::vector<Grid> shapes;
  const auto cells = static_cast<int>(count);
  for (int columns = 1; columns <= cells; ++columns) {
    const int rows = (cells + columns - 1) / columns;
    if ((columns - 1) * rows >= cells) continue;
    shapes.push_back({0, 0, cell_width_mm, cell_height_mm, columns, rows});
  }
  return shapes;
}

/// Packing of some of the blocks without gaps (each cell has its margin inside).
struct Packing {
  double width_mm = 0;
  double height_mm = 0;
  std::array<Grid, kKinds> grids;  ///< those that are not in it have cells of no size
};
using Packings = std::vector<Packing>;

Packings PackingsOf(Kind kind, std::size_t count, double cell_width_mm, double cell_height_mm) {
  Packings packings;
  for (const Grid& grid : Shapes(count, cell_width_mm, cell_height_mm)) {
    Packing& packing = packings.emplace_back(Packing{grid.width_mm(), grid.height_mm(), {}});
    packing.grids[kind] = grid;
  }
  return packings;
}

Packing Join(const Packing& first, const Packing& second, bool side_by_side) {
  Packing joined = first;
  for (std::size_t kind = 0; kind < kKinds; ++kind) {
    if (second.grids[kind].cell_width_mm == 0) continue;
    joined.grids[kind] = second.grids[kind];
    (side_by_side ? joined.grids[kind].left_mm : joined.grids[kind].bottom_mm) +=
        side_by_side ? first.width_mm : first.height_mm;
  }
  joined.width_mm =
      side_by_side ? first.width_mm + second.width_mm : std::max(first.width_mm, second.width_mm);
  joined.height_mm = side_by_side ? std::max(first.height_mm, second.height_mm)
                                  : first.height_mm + second.height_mm;
  return joined;
}

/// Drops packings that another one beats in both sizes: every criterion of the outline grows with
/// them.
Packings Smallest(Packings packings) {
  std::stable_sort(packings.begin(), packings.end(), [](const Packing& a, const Packing& b) {
    return std::tie(a.width_mm, a.height_mm) < std::tie(b.width_mm, b.height_mm);
  });
  Packings kept;
  double lowest_mm = std::numeric_limits<double>::infinity();
  for (const Packing& packing : packings) {
    if (packing.height_mm >= lowest_mm) continue;
    lowest_mm = packing.height_mm;
    kept.push_back(packing);
  }
  return kept;
}

/// `below` and `above` one over the other.
Packings Stack(const Packings& below, const Packings& above) {
  Packings all;
  for (const Packing& lower : below) {
    for (const Packing& upper : above) all.push_back(Join(lower, upper, false));
  }
  return Smallest(std::move(all));
}

Packings StackOrStandBeside(const Packings& a, const Packings& b) {
  Packings all;
  for (const Packing& first : a) {
    for (const Packing& second : b) {
      all.push_back(Join(first, second, false));
      all.push_back(Join(first, second, true));
    }
  }
  return Smallest(std::move(all));
}

Packings AllPackings(const SheetSettings& settings, std::size_t x_structures,
                     std::size_t y_structures) {
  const double gap_mm = settings.structure_gap_mm;
  const double length_mm = StructureLength_mm(settings) + gap_mm;
  const double thickness_mm = StructureThickness_mm(settings) + gap_mm;
  const Packings x = PackingsOf(kX, x_structures, length_mm, thickness_mm);
  const Packings y = PackingsOf(kY, y_structures, thickness_mm, length_mm);
  const Packings code = PackingsOf(kCode, 1, kCodeCells * kCodeCell_mm + gap_mm,
                                   kCodeLeg_mm + settings.line_width_mm + gap_mm);
  return Stack(code, StackOrStandBeside(x, y));
}

/// Returns the rank of the paper for the rotated outline, in either orientation; 0 for the
/// smallest.
int PaperClass(double width_mm, double height_mm) {
  int rank = 0;
  for (const PaperSize& paper : PaperSizes()) {
    if (paper.name == "letter") continue;  // same size as A4
    if (FitsPaper(paper, width_mm, height_mm)) break;
    ++rank;
  }
  return rank;
}

/// Costs in order of importance: outside the bed; outside the settings' paper; index of the
/// smallest paper that takes it; share of that.
using SheetCost = std::tuple<bool, bool, int, double>;
/// @param width_mm, height_mm  of the box.
SheetCost CostOfSheet(const SheetSettings& settings, double width_mm, double height_mm) {
  const std::optional<PaperSize> asked_for = FindPaper(settings.paper);
  const BedBounds bounds = SheetBounds(settings, width_mm, height_mm);
  const double x_mm = bounds.max_x_mm - bounds.min_x_mm;
  const double y_mm = bounds.max_y_mm - bounds.min_y_mm;
  const bool off_paper = asked_for && !FitsPaper(*asked_for, x_mm, y_mm);
  return {SheetReach(settings, width_mm, height_mm) > 1, off_paper, PaperClass(x_mm, y_mm),
          x_mm * y_mm};
}

std::vector<SheetPoint> CellMiddles(const Grid& grid, std::size_t count, bool by_columns) {
  std::vector<SheetPoint> middles;
  for (std::size_t i = 0; i < count; ++i) middles.push_back(grid.CellMiddle(i, by_columns));
  return middles;
}

}  // namespace

double PrimeDepth_mm(const SheetSettings& settings) {
  return kPrimeGap_mm + settings.pick_ups * kPrimeRow_mm;
}

double StructureLength_mm(const SheetSettings& settings) {
  return (settings.teeth - 0.5) * settings.pitch_mm + settings.leg_spacing_mm +
         settings.line_width_mm;
}

double StructureThickness_mm(const SheetSettings& settings) {
  return 2 * settings.leg_length_mm - settings.overlap_mm + settings.line_width_mm;
}

Layout ArrangeSheet(const SheetSettings& settings, std::size_t x_structures,
                    std::size_t y_structures, double border_mm) {
  const Packings packings = AllPackings(settings, x_structures, y_structures);
  TRAMMEL_CHECK(!packings.empty(), "{} X and {} Y structures", x_structures, y_structures);
  const auto cost = [&](const Packing& packing) {
    return CostOfSheet(settings, packing.width_mm + 2 * border_mm,
                       packing.height_mm + 2 * border_mm);
  };
  const Packing& best =
      *std::min_element(packings.begin(), packings.end(),
                        [&](const Packing& a, const Packing& b) { return cost(a) < cost(b); });
  return {best.width_mm, best.height_mm, CellMiddles(best.grids[kX], x_structures, true),
          CellMiddles(best.grids[kY], y_structures, false), best.grids[kCode].CellMiddle(0, true)};
}

namespace {

using Pair = std::array<std::size_t, 2>;

/// True if one is the reverse of the other.
bool BelongTogether(const Structure& a, const Structure& b) {
  if (a.purpose != b.purpose || a.combs[0].direction == b.combs[0].direction) return false;
  if (a.purpose == Purpose::kPickUp || a.purpose == Purpose::kSelfTest) return false;
  const auto tools = [](const Structure& s) {
    return std::minmax(s.combs[0].tool, s.combs[1].tool);
  };
  return tools(a) == tools(b);
}

/// Pairs structures for opposite places. Those without a partner are paired with each other, and
/// the last of an odd number with itself.
std::vector<Pair> PairUp(const std::vector<Structure>& structures) {
  std::vector<Pair> pairs;
  std::vector<bool> placed(structures.size(), false);
  std::vector<std::size_t> single;
  for (std::size_t i = 0; i < structures.size(); ++i) {
    if (placed[i]) continue;
    placed[i] = true;
    std::size_t k = i + 1;
    while (k < structures.size() && (placed[k] || !BelongTogether(structures[i], structures[k]))) {
      ++k;
    }
    if (k == structures.size()) {
      single.push_back(i);
      continue;
    }
    placed[k] = true;
    // Alternates, so that the + structures are not all on one side.
    pairs.push_back(pairs.size() % 2 == 0 ? Pair{i, k} : Pair{k, i});
  }
  for (std::size_t i = 0; i < single.size(); i += 2) {
    pairs.push_back({single[i], single[std::min(i + 1, single.size() - 1)]});
  }
  return pairs;
}

/// Places each pair into the grid's cells, along its lines first, and the opposite ones.
/// @param grid  its place, in a frame whose origin is the centre of the mirrored cells.
void Place(const std::vector<Pair>& pairs, const Grid& grid, bool by_columns, SheetPoint origin,
           std::vector<SheetPoint>& middles) {
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const SheetPoint at = grid.CellMiddle(i, by_columns);
    middles[pairs[i][1]] = {origin.u_mm - at.u_mm, origin.v_mm - at.v_mm};
    middles[pairs[i][0]] = {origin.u_mm + at.u_mm, origin.v_mm + at.v_mm};
  }
}

}  // namespace

Layout ArrangeForPhoto(const SheetSettings& settings, const std::vector<Structure>& x,
                       const std::vector<Structure>& y, double border_mm) {
  const double gap_mm = settings.structure_gap_mm;
  const double length_mm = StructureLength_mm(settings) + gap_mm;
  const double thickness_mm = StructureThickness_mm(settings) + gap_mm;
  const double code_width_mm = kCodeCells * kCodeCell_mm + gap_mm;
  const double code_height_mm = kCodeLeg_mm + settings.line_width_mm + gap_mm;
  const std::vector<Pair> x_pairs = PairUp(x);
  const std::vector<Pair> y_pairs = PairUp(y);
  std::optional<SheetCost> least;
  Grid x_block;
  Grid y_block;
  for (const Grid& of_x : Shapes(x_pairs.size(), length_mm, thickness_mm)) {
    for (const Grid& of_y : Shapes(y_pairs.size(), thickness_mm, length_mm)) {
      // For blocks in opposite corners, one that is longer both ways would overlap its twin.
      const bool x_wider = of_x.width_mm() > of_y.width_mm();
      const bool x_higher = of_x.height_mm() > of_y.height_mm();
      if (x_wider == x_higher && of_x.width_mm() != of_y.width_mm() &&
          of_x.height_mm() != of_y.height_mm()) {
        continue;
      }
      const double width_mm = std::max(of_x.width_mm() + of_y.width_mm(), code_width_mm);
      const double height_mm = of_x.height_mm() + of_y.height_mm() + code_height_mm;
      const SheetCost cost =
          CostOfSheet(settings, width_mm + 2 * border_mm, height_mm + 2 * border_mm);
      if (least && !(cost < *least)) continue;
      least = cost;
      x_block = of_x;
      y_block = of_y;
    }
  }
  TRAMMEL_CHECK(least.has_value(), "{} X and {} Y structures", x.size(), y.size());
  Layout layout;
  const double wings_mm = x_block.width_mm() + y_block.width_mm();
  const double high_mm = x_block.height_mm() + y_block.height_mm();
  layout.width_mm = std::max(wings_mm, code_width_mm);
  layout.height_mm = high_mm + code_height_mm;
  layout.code = {code_width_mm / 2, code_height_mm / 2};
  const SheetPoint middle{layout.width_mm / 2, code_height_mm + high_mm / 2};
  // X at the upper left and lower right, Y at the upper right and lower left.
  x_block.left_mm = -wings_mm / 2;
  x_block.bottom_mm = high_mm / 2 - x_block.height_mm();
  y_block.left_mm = wings_mm / 2 - y_block.width_mm();
  y_block.bottom_mm = high_mm / 2 - y_block.height_mm();
  layout.x_structures.resize(x.size());
  layout.y_structures.resize(y.size());
  Place(x_pairs, x_block, true, middle, layout.x_structures);
  Place(y_pairs, y_block, false, middle, layout.y_structures);
  return layout;
}

}  // namespace trammel::tool_offset
