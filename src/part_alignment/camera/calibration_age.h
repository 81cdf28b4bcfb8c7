// Whether a calibration is too old to be trusted without a word.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace trammel::part_alignment {

/// A camera that was dropped, heated or refocused since does not say so; a year
/// is what measuring instruments are commonly recalibrated after.
inline constexpr int kMostCalibrationAgeDays = 365;

/// What to say where `date` lies more than `most_days` before `today`, lies
/// behind it, or is no date; absent where all is well. Dates are YYYY-MM-DD.
[[nodiscard]] std::optional<std::string> NoticeOfAge(std::string_view date, std::string_view today,
                                                     int most_days = kMostCalibrationAgeDays);

}  // namespace trammel::part_alignment
