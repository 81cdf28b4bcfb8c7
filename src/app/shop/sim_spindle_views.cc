#include "app/shop/sim_spindle_views.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "files/json_object.h"

namespace trammel::app {
namespace {

using sim::operator*;

constexpr std::size_t kMostBytes = 100'000'000;
constexpr std::size_t kMostViews = 1000;
constexpr double kSame = 1e-5;

// The turn about the spindle's axis that takes its frame at C = 0 to this one.
std::optional<double> AngleOf(const nlohmann::json& rows, const sim::SpindleMachine& machine) {
  const sim::Turn home = sim::SpindleTurn(machine, 0);
  sim::Turn turn = home;
  if (!rows.is_null()) {
    if (!rows.is_array() || rows.size() != 3) return std::nullopt;
    for (std::size_t i = 0; i < 3; ++i) {
      if (!rows[i].is_array() || rows[i].size() != 3) return std::nullopt;
      for (std::size_t j = 0; j < 3; ++j) {
        if (!rows[i][j].is_number()) return std::nullopt;
        turn[i][j] = rows[i][j].get<double>();
      }
    }
  }
  const sim::Turn inner = sim::Back(home) * turn;
  const double c_rad = std::atan2(inner[1][0], inner[0][0]);
  const sim::Turn meant = sim::SpindleTurn(machine, c_rad);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      if (!(std::abs(meant[i][j] - turn[i][j]) <= kSame)) return std::nullopt;
    }
  }
  return c_rad;
}

}  // namespace

Result<std::vector<sim::SpindleStop>> ReadSpindleStops(const std::filesystem::path& path,
                                                       const sim::SpindleMachine& machine) {
  const auto json = TRY(files::ReadJsonFile(path, kMostBytes));
  files::JsonObject root(json, path.string());
  std::vector<sim::SpindleStop> stops;
  const nlohmann::json& views = root.List("views", 1, kMostViews);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::string key = fmt::format("views[{}]", i);
    files::JsonObject view = root.Inner(views[i], key);
    const std::vector<double> at = view.Numbers("spindle_mm", 3, 3, {-1e6, 1e6});
    const nlohmann::json* rows = view.Find("spindle_rotation");
    const auto c_rad = AngleOf(rows != nullptr ? *rows : nlohmann::json(), machine);
    TRY(view.Faults());
    if (!c_rad) {
      return Fail(
          fmt::format("{}: {}.spindle_rotation: the virtual spindle turns about its own "
                      "axis alone",
                      path.string(), key));
    }
    stops.push_back({{at[0], at[1], at[2]}, *c_rad});
  }
  TRY(root.Faults());
  return stops;
}

}  // namespace trammel::app
