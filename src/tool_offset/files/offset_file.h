// Measured tool offsets, as `trammel offset analyze` writes them with --json and --result.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/measured.h"
#include "base/result.h"
#include "measurement/outcome.h"

namespace trammel::files {

struct MeasuredOffset {
  int tool = 0;
  double dx_mm = 0;  ///< where its line lands minus where the reference tool's would
  double dy_mm = 0;
  std::optional<Interval> dx95_mm = {};  ///< absent where the file does not say
  std::optional<Interval> dy95_mm = {};
};

struct OffsetFile {
  std::vector<MeasuredOffset> good;  ///< tools whose verdict is good
  std::vector<std::string> refused;  ///< a line for each of the others, with its reason
  std::optional<measurement::Outcome> result = {};  ///< absent: what --json printed
};

/// A folder's result.json, a kept result, or the output of --json. Errors (kInput): not there, not
/// JSON, a tool twice, an offset beyond 50 mm.
[[nodiscard]] Result<OffsetFile> ReadOffsetFile(const std::filesystem::path& path);

}  // namespace trammel::files
