// The shared photos of real prints, and the lines that a person accepted on them (SOURCES.md).
#pragma once

#include <algorithm>
#include <cmath>
#include <ostream>

namespace trammel::test {

/// 21 lines from 0 s on.
inline constexpr int kPhotoLines = 21;
inline constexpr double kPhotoStep_s = 0.005;
/// Half a step between the lines: nearer than that, a person would name the same line.
inline constexpr double kHalfStep_s = 0.0025;

struct RealPhoto {
  const char* name;  ///< file name without .jpg
  double accepted_s[2];
};

inline constexpr RealPhoto kPhotos[] = {{"black45_lines4-5", {0.015, 0.020}},
                                        {"gold50_lines4-5", {0.015, 0.020}},
                                        {"gray45_lines5-6", {0.020, 0.025}},
                                        {"gray60_lines5-6", {0.020, 0.025}}};

/// Prints a photo for GoogleTest.
inline void PrintTo(const RealPhoto& photo, std::ostream* out) { *out << photo.name; }

/// Distance of an answer from the nearer accepted line, s.
[[nodiscard]] inline double FromAccepted(const RealPhoto& photo, double answer_s) {
  return std::min(std::abs(answer_s - photo.accepted_s[0]),
                  std::abs(answer_s - photo.accepted_s[1]));
}

}  // namespace trammel::test
