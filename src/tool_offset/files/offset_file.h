// Measured tool offsets, as `trammel offset analyze --result` keeps them.
#pragma once

#include <filesystem>
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
  Interval dx95_mm = {};
  Interval dy95_mm = {};
};

struct OffsetFile {
  std::vector<MeasuredOffset> good;  ///< tools whose verdict is good
  std::vector<std::string> refused;  ///< a line for each of the others, with its reason
  measurement::Outcome result = {};
};

/// A folder's result.json, or a kept result. Errors (kInput): not there, another instrument's, an
/// offset beyond 50 mm.
[[nodiscard]] Result<OffsetFile> ReadOffsetFile(const std::filesystem::path& path);

}  // namespace trammel::files
