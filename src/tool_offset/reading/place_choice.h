// Which places of several tools, taken together, explain the ink of a sheet.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace trammel::tool_offset {

/// What a tool's lines at one place would explain, by the axis that their combs measure.
struct PlaceClaim {
  std::array<std::vector<std::uint32_t>, 2> ink;  ///< cells of ink under its lines; each once
  std::array<double, 2> missing{};  ///< cells that its lines should have inked and did not
};

/// Of one tool.
struct PlaceChoice {
  int place = -1;  ///< index of the claim; -1: nowhere
  /// By how many cells everything is explained worse with this tool anywhere else or nowhere.
  double lead = 0;
  std::array<double, 2> own{};  ///< cells that it alone explains, less those missing
  /// The tool that explains most of the ink at its place as well, of its first where it has none;
  /// -1: none.
  int beside = -1;
};

/// Chooses each tool's place so that the most ink is explained, once, with the least missing.
///
/// Since each line was drawn by one tool, ink under two tools' lines counts once: a tool moved onto
/// another's lines explains nothing new, and leaves its own lines over.
/// @param claims  of each tool, at the places where it may be, the likeliest first.
/// @returns a choice for each tool, in order: a local optimum that no change of a single tool's
///          place improves, with all others put where they are best then.
/// Cost: O((sum of the claims' cells) * (number of claims)).
[[nodiscard]] std::vector<PlaceChoice> ChoosePlaces(std::vector<std::vector<PlaceClaim>> claims);

}  // namespace trammel::tool_offset
