// Results of the study, one file a scan: what is there already is not done again.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/measured.h"
#include "base/result.h"
#include "sim/print/conditions.h"

namespace trammel::app {

/// One scan of a calibration pattern, by both methods.
struct StudyScan {
  int seed = 0;  ///< of the study
  sim::Condition condition = {};
  int pattern = 0;                                   ///< which print of the condition, from 0
  double truth_s = 0;                                ///< K* of the virtual printer
  std::vector<double> pressure_advances_s = {};      ///< of the lines
  std::vector<std::optional<double>> score_px = {};  ///< the paper's, per line
  std::vector<std::optional<double>> excess_s = {};  ///< read at the acceleration, per line
  std::optional<Quantity> response = {};             ///< s; absent: its verdict was not good
  std::string reason = {};                           ///< then: why
};

/// One comparison of lines without pressure advance and lines with the value that `deviation` chose
/// in the first pattern of a condition.
struct StudyValidation {
  int seed = 0;
  sim::Condition condition = {};
  double pressure_advance_s = 0;
  double control_px = 0;     ///< mean deviation without
  double calibrated_px = 0;  ///< and with it
};

/// Names of their files within the study's folder.
[[nodiscard]] std::string ScanFileName(const sim::Condition& condition, int pattern);
[[nodiscard]] std::string ValidationFileName(const sim::Condition& condition);

[[nodiscard]] std::string FormatStudyScan(const StudyScan& scan);
[[nodiscard]] std::string FormatStudyValidation(const StudyValidation& validation);

/// The inverses (docs/formats.md). Trust nothing: types, bounds, lists of one length.
/// Errors begin with `file`.
[[nodiscard]] Result<StudyScan> ParseStudyScan(std::string_view text, const std::string& file);
[[nodiscard]] Result<StudyValidation> ParseStudyValidation(std::string_view text,
                                                           const std::string& file);

/// Reads the file of a study with this seed. Absent where there is none.
/// Errors: as the parsers; and a file of another seed, condition or pattern.
[[nodiscard]] Result<std::optional<StudyScan>> ReadStudyScan(const std::filesystem::path& folder,
                                                             int seed,
                                                             const sim::Condition& condition,
                                                             int pattern);
[[nodiscard]] Result<std::optional<StudyValidation>> ReadStudyValidation(
    const std::filesystem::path& folder, int seed, const sim::Condition& condition);

}  // namespace trammel::app
