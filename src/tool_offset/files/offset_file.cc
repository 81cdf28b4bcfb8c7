#include "tool_offset/files/offset_file.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "measurement/outcome_file.h"

namespace trammel::files {
namespace {

constexpr int kMostTool = 99;
constexpr double kMost_mm = 50;

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
  auto outcome = TRY(ReadOutcome(path, measurement::Instrument::kToolOffset));
  auto offsets = OffsetsOf(outcome, path.string());
  if (offsets) offsets->result = std::move(outcome);
  return offsets;
}

}  // namespace trammel::files
