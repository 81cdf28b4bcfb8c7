#include "tool_offset/sheet/photo_layout.h"

#include <algorithm>
#include <array>
#include <optional>

#include "base/check.h"
#include "tool_offset/sheet/sheet_code.h"

namespace trammel::tool_offset {
namespace {

using Pair = std::array<std::size_t, 2>;

/// Whether one is the other drawn the other way.
bool BelongTogether(const Structure& a, const Structure& b) {
  if (a.purpose != b.purpose || a.combs[0].direction == b.combs[0].direction) return false;
  if (a.purpose == Purpose::kPickUp || a.purpose == Purpose::kSelfTest) return false;
  const auto tools = [](const Structure& s) {
    return std::minmax(s.combs[0].tool, s.combs[1].tool);
  };
  return tools(a) == tools(b);
}

/// Structures for opposite places; those without a partner are set against each other, and the last
/// of an odd number against itself.
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
    // In turn, so that not all + structures stand on one side.
    pairs.push_back(pairs.size() % 2 == 0 ? Pair{i, k} : Pair{k, i});
  }
  for (std::size_t i = 0; i < single.size(); i += 2) {
    pairs.push_back({single[i], single[std::min(i + 1, single.size() - 1)]});
  }
  return pairs;
}

/// A block of equal cells.
struct Block {
  Grid grid;
  [[nodiscard]] double width_mm() const { return grid.columns * grid.cell_width_mm; }
  [[nodiscard]] double height_mm() const { return grid.rows * grid.cell_height_mm; }
};

std::vector<Block> Shapes(std::size_t count, double cell_width_mm, double cell_height_mm) {
  std::vector<Block> shapes;
  const auto cells = static_cast<int>(count);
  for (int columns = 1; columns <= cells; ++columns) {
    const int rows = (cells + columns - 1) / columns;
    if ((columns - 1) * rows >= cells) continue;
    shapes.push_back({{0, 0, cell_width_mm, cell_height_mm, columns, rows}});
  }
  return shapes;
}

/// Sets each pair into the block's cells, counted along its lines first, and opposite ones.
/// @param block  its place, in a frame whose origin the opposite cells are mirrored about.
void Place(const std::vector<Pair>& pairs, const Block& block, bool by_columns, SheetPoint origin,
           std::vector<SheetPoint>& middles) {
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto index = static_cast<int>(i);
    const Grid& grid = block.grid;
    const SheetPoint at = by_columns ? grid.CellMiddle(index / grid.rows, index % grid.rows)
                                     : grid.CellMiddle(index % grid.columns, index / grid.columns);
    middles[pairs[i][1]] = {origin.u_mm - at.u_mm, origin.v_mm - at.v_mm};
    middles[pairs[i][0]] = {origin.u_mm + at.u_mm, origin.v_mm + at.v_mm};
  }
}

}  // namespace

PhotoLayout ArrangeForPhoto(const SheetSettings& settings, const std::vector<Structure>& x,
                            const std::vector<Structure>& y, double border_mm) {
  const double gap_mm = settings.structure_gap_mm;
  const double length_mm = StructureLength_mm(settings) + gap_mm;
  const double thickness_mm = StructureThickness_mm(settings) + gap_mm;
  const double code_width_mm = kCodeCells * kCodeCell_mm + gap_mm;
  const double code_height_mm = kCodeLeg_mm + settings.line_width_mm + gap_mm;
  const std::vector<Pair> x_pairs = PairUp(x);
  const std::vector<Pair> y_pairs = PairUp(y);
  std::optional<SheetCost> least;
  Block x_block;
  Block y_block;
  for (const Block& of_x : Shapes(x_pairs.size(), length_mm, thickness_mm)) {
    for (const Block& of_y : Shapes(y_pairs.size(), thickness_mm, length_mm)) {
      // Of blocks in opposite corners one that is longer both ways would reach over its twin.
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
  PhotoLayout layout;
  const double wings_mm = x_block.width_mm() + y_block.width_mm();
  const double high_mm = x_block.height_mm() + y_block.height_mm();
  layout.width_mm = std::max(wings_mm, code_width_mm);
  layout.height_mm = high_mm + code_height_mm;
  layout.code = {code_width_mm / 2, code_height_mm / 2};
  const SheetPoint middle{layout.width_mm / 2, code_height_mm + high_mm / 2};
  // X at the upper left and lower right, Y at the upper right and lower left.
  x_block.grid.left_mm = -wings_mm / 2;
  x_block.grid.bottom_mm = high_mm / 2 - x_block.height_mm();
  y_block.grid.left_mm = wings_mm / 2 - y_block.width_mm();
  y_block.grid.bottom_mm = high_mm / 2 - y_block.height_mm();
  layout.x_structures.resize(x.size());
  layout.y_structures.resize(y.size());
  Place(x_pairs, x_block, true, middle, layout.x_structures);
  Place(y_pairs, y_block, false, middle, layout.y_structures);
  return layout;
}

}  // namespace trammel::tool_offset
