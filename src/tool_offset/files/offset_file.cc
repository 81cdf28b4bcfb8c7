#include "tool_offset/files/offset_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "files/json_object.h"
#include "measurement/outcome_file.h"

namespace trammel::files {
namespace {

constexpr std::size_t kMostBytes = 64'000'000;  // with every finger of every structure
constexpr int kMostTool = 99;
constexpr double kMost_mm = 50;

/// For people alone: one that does not hold the value, or is no interval, counts as not given.
std::optional<Interval> Interval95(JsonObject& tool, const char* axis, double value_mm) {
  const nlohmann::json* all = tool.Find("interval95_mm");
  if (all == nullptr || !all->is_object() || !all->contains(axis)) return std::nullopt;
  const nlohmann::json& pair = all->at(axis);
  if (!pair.is_array() || pair.size() != 2 || !pair[0].is_number() || !pair[1].is_number()) {
    return std::nullopt;
  }
  const Interval interval{pair[0].get<double>(), pair[1].get<double>()};
  if (!(interval.lo <= value_mm && value_mm <= interval.hi)) return std::nullopt;
  return interval;
}

void ReadTool(JsonObject& tool, OffsetFile& offsets) {
  const int number = tool.Integer("tool", {0, kMostTool});
  const std::string verdict = tool.Choice("verdict", {"good", "cannot_tell", "refused"});
  if (verdict != "good") {
    const nlohmann::json* reason = tool.Find("reason");
    offsets.refused.push_back(fmt::format(
        "tool {}: {}: {}", number, verdict,
        reason != nullptr && reason->is_string() ? reason->get<std::string>() : "no reason given"));
    return;
  }
  const NumberRange range{-kMost_mm, kMost_mm};
  const double dx_mm = tool.Number("dx_mm", range);
  const double dy_mm = tool.Number("dy_mm", range);
  const bool twice = std::any_of(offsets.good.begin(), offsets.good.end(),
                                 [number](const MeasuredOffset& m) { return m.tool == number; });
  if (twice) tool.Fault("tool", fmt::format("{} stands there twice", number));
  offsets.good.push_back(
      {number, dx_mm, dy_mm, Interval95(tool, "dx", dx_mm), Interval95(tool, "dy", dy_mm)});
}

/// The tools of a kept result: tool_N_dx beside tool_N_dy.
Result<OffsetFile> OffsetsOf(const measurement::Outcome& outcome, const std::string& file) {
  OffsetFile offsets;
  for (int number = 0; number <= kMostTool; ++number) {
    const measurement::Answer* const dx = outcome.Find(fmt::format("tool_{}_dx", number));
    const measurement::Answer* const dy = outcome.Find(fmt::format("tool_{}_dy", number));
    if (dx == nullptr && dy == nullptr) continue;
    if (dx == nullptr || dy == nullptr) {
      return Fail(fmt::format("{}: tool_{} has one of dx and dy alone", file, number));
    }
    const Measured& worse = dx->value.verdict() < dy->value.verdict() ? dy->value : dx->value;
    if (!worse.good()) {
      offsets.refused.push_back(
          fmt::format("tool {}: {}: {}", number, ToString(worse.verdict()), worse.reason()));
      continue;
    }
    const Quantity& x = dx->value.quantity();
    const Quantity& y = dy->value.quantity();
    if (dx->unit != "mm" || dy->unit != "mm" || std::abs(x.value) > kMost_mm ||
        std::abs(y.value) > kMost_mm) {
      return Fail(fmt::format("{}: tool_{}: {} {}, {} {} must be in mm, within +-{}", file, number,
                              x.value, dx->unit, y.value, dy->unit, kMost_mm));
    }
    offsets.good.push_back({number, x.value, y.value, x.interval95, y.interval95});
  }
  if (!offsets.good.empty() || !offsets.refused.empty()) return offsets;
  return Fail(file + ": holds no offsets of tools");
}

}  // namespace

Result<OffsetFile> ReadOffsetFile(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) return ReadOffsetFile(path / kResultFile);
  const auto json = ReadJsonFile(path, kMostBytes);
  if (!json) return tl::unexpected(json.error());
  JsonObject root(*json, path.string());
  if (root.has("instrument")) {
    const auto outcome = ReadOutcome(path, measurement::Instrument::kToolOffset);
    if (!outcome) return tl::unexpected(outcome.error());
    auto offsets = OffsetsOf(*outcome, path.string());
    if (offsets) offsets->result = *outcome;
    return offsets;
  }
  if (root.has("format")) (void)root.Integer("format", {1, 1});
  constexpr std::size_t kMostTools = 100;
  const nlohmann::json& tools = root.List("tools", 1, kMostTools);
  if (auto read = root.Faults(); !read) return tl::unexpected(read.error());
  OffsetFile offsets;
  for (std::size_t i = 0; i < tools.size(); ++i) {
    JsonObject tool = root.Inner(tools[i], fmt::format("tools[{}]", i));
    ReadTool(tool, offsets);
    if (auto read = tool.Faults(); !read) return tl::unexpected(read.error());
  }
  return offsets;
}

}  // namespace trammel::files
