#include "part_alignment/files/budget_file.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "files/json_object.h"
#include "part_alignment/files/three_numbers.h"

namespace trammel::files {
namespace {

constexpr double kMost_mm = 1e6;

// A list entry that is itself a list of so many numbers.
std::vector<double> Row(JsonObject& root, const nlohmann::json& entry, const std::string& at,
                        std::size_t count) {
  std::vector<double> numbers;
  bool sound = entry.is_array() && entry.size() == count;
  for (std::size_t i = 0; sound && i < count; ++i) {
    sound = entry[i].is_number();
    if (sound) numbers.push_back(entry[i].get<double>());
  }
  if (sound) return numbers;
  root.Fault(at, fmt::format("is {}; it must be {} numbers", Show(entry), count));
  return std::vector<double>(count, 0);
}

void ReadLists(JsonObject& root, BudgetFile& file) {
  for (const nlohmann::json& entry : root.List("targets_mm", 3, 10'000)) {
    const auto at = fmt::format("targets_mm[{}]", file.scene.targets_mm.size());
    const auto mm = Row(root, entry, at, 3);
    file.scene.targets_mm.emplace_back(mm[0], mm[1], mm[2]);
  }
  if (const nlohmann::json* lengths = root.OptionalList("lengths_mm", 0, 10'000)) {
    for (const nlohmann::json& entry : *lengths) {
      const auto mm = Row(root, entry, fmt::format("lengths_mm[{}]", file.lengths.size()), 2);
      file.lengths.push_back({mm[0], mm[1]});
    }
  }
}

}  // namespace

Result<BudgetFile> ReadBudgetFile(const std::filesystem::path& path) {
  constexpr std::size_t kMostBytes = 10'000'000;
  const auto json = TRY(ReadJsonFile(path, kMostBytes));
  JsonObject root(json, path.string());
  root.Integer("format", {1, 1});
  BudgetFile file;
  part_alignment::BudgetScene& scene = file.scene;
  ReadLists(root, file);
  scene.target_sigma_mm = ReadThree(root, "target_sigma_mm", {0, kMost_mm});
  if (root.has("pose_sigma_mm"))
    scene.pose_sigma.head<3>() = ReadThree(root, "pose_sigma_mm", {0, 1e3});
  if (root.has("pose_sigma_rad"))
    scene.pose_sigma.tail<3>() = ReadThree(root, "pose_sigma_rad", {0, 1});
  if (root.has("repeats")) scene.repeats = root.Integer("repeats", {0, 1'000'000});
  scene.low_mm = ReadThree(root, "box_low_mm", {-kMost_mm, kMost_mm});
  scene.high_mm = ReadThree(root, "box_high_mm", {-kMost_mm, kMost_mm});
  scene.still_mm = scene.low_mm;
  if (root.has("still_mm")) scene.still_mm = ReadThree(root, "still_mm", {-kMost_mm, kMost_mm});
  scene.temperature_half_width_k = root.Number("temperature_half_width_k", {0, 1000}, 1.0);
  scene.expansion_per_k = root.Number("expansion_per_k", {-1e-3, 1e-3}, 11e-6);
  scene.length_error_mm = root.Number("length_error_mm", {0, 1000}, 0.05);
  scene.length_error_per_mm = root.Number("length_error_per_mm", {0, 1}, 20e-6);
  if (root.has("out_sigma_mm")) scene.out_sigma_mm = ReadThree(root, "out_sigma_mm", {0, kMost_mm});
  if (root.has("tolerance_mm")) {
    const auto limits = root.Numbers("tolerance_mm", 2, 2, {-kMost_mm, kMost_mm});
    if (!root.failed() && !(limits[0] < limits[1])) {
      root.Fault("tolerance_mm",
                 fmt::format("is [{}, {}]; it must be the lower and the upper limit", limits[0],
                             limits[1]));
    }
    if (!root.failed()) file.tolerance_mm = {limits[0], limits[1]};
  }
  TRY(root.Finish());
  return file;
}

}  // namespace trammel::files
