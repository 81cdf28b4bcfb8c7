// Files of measured points, of the ideal part, and of an uncertainty budget's scene.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "files/json_object.h"
#include "part_alignment/budget/budget.h"
#include "part_alignment/files/stl_file.h"
#include "part_alignment/part_fit/part_fit.h"

namespace trammel::files {

struct PartFile {
  std::vector<part_alignment::IdealSurface> surfaces;
  std::vector<part_alignment::ScaleBar> bars;
  std::optional<geometry::Pose> start;
  part_alignment::PartFitOptions options;
  std::vector<std::string> notices;  ///< about its meshes
};

/// Reads PART.json (docs/reference/formats.md), and the meshes that it names. Errors (kInput) name
/// file and place.
[[nodiscard]] Result<PartFile> ReadPartFile(const std::filesystem::path& path,
                                            const MeshReader& read_mesh);

/// Reads the list `scale_bars` of an object; empty if the key is absent. Errors (kInput) name the
/// place.
[[nodiscard]] Result<std::vector<part_alignment::ScaleBar>> ReadScaleBars(JsonObject& root);

/// Reads a table with the columns id, x_mm, y_mm, z_mm, sigma_mm and surface in any order, named in
/// its first line. Commas, semicolons or tabs separate the cells. Or JSON: {"format": 1, "points":
/// [{"id", "at_mm", "sigma_mm", "surface"}]}. An empty surface is a coded target or a bar's end.
/// Errors (kInput) name file and line: a missing column, a cell that is no number.
[[nodiscard]] Result<std::vector<part_alignment::MeasuredPoint>> ReadPointTable(
    const std::filesystem::path& path);
[[nodiscard]] Result<std::vector<part_alignment::MeasuredPoint>> ParsePointTable(
    std::string_view text, const std::string& file);

struct BudgetFile {
  part_alignment::BudgetScene scene;
  std::optional<std::pair<double, double>> tolerance_mm;  ///< lower and upper limit
  std::vector<part_alignment::MeasuredLength> lengths;
};

/// Reads SCENE.json (docs/reference/formats.md). Errors (kInput) name file and place.
[[nodiscard]] Result<BudgetFile> ReadBudgetFile(const std::filesystem::path& path);

}  // namespace trammel::files
