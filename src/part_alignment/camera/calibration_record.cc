#include "part_alignment/camera/calibration_record.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <limits>

#include "base/check.h"
#include "geometry/decompositions.h"
#include "geometry/linear_systems.h"

namespace trammel::part_alignment {
using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

std::optional<std::chrono::sys_days> ParseDate(std::string_view text) {
  constexpr std::string_view kShape = "0000-00-00";
  if (text.size() != kShape.size() || text[4] != '-' || text[7] != '-') return std::nullopt;
  const auto number = [&text](std::size_t begin, std::size_t count) {
    int value = -1;
    const char* const first = text.data() + begin;
    const auto read = std::from_chars(first, first + count, value);
    return read.ec == std::errc{} && read.ptr == first + count ? value : -1;
  };
  const int year = number(0, 4);
  const int month = number(5, 2);
  const int day = number(8, 2);
  if (year < 0 || month < 0 || day < 0) return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year(year),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  if (!date.ok()) return std::nullopt;
  return std::chrono::sys_days(date);
}

}  // namespace

std::optional<std::string> NoticeOfAge(std::string_view date, std::string_view today,
                                       int max_days) {
  const auto then = ParseDate(date);
  const auto now = ParseDate(today);
  if (!then || !now) {
    return fmt::format("the calibration's date \"{}\" is no date: its age is not known",
                       date.substr(0, 40));
  }
  const auto days = (*now - *then).count();
  if (days < 0) {
    return fmt::format(
        "the camera was calibrated on {}, which is after today "
        "({}): check the date",
        date, today);
  }
  if (days <= max_days) return std::nullopt;
  return fmt::format(
      "the camera was calibrated {} days ago ({}), at most {} are trusted: "
      "calibrate it again",
      days, date, max_days);
}

SensorUncertainty UncertaintyOverSensor(const Camera& camera, const CameraCovariance& covariance,
                                        double distance_mm, int columns, int rows) {
  TRAMMEL_CHECK(columns >= 2 && rows >= 2 && distance_mm > 0, "{} x {}, {} mm", columns, rows,
                distance_mm);
  SensorUncertainty uncertainty{columns, rows, distance_mm, {}};
  const geometry::Pose& pose = camera.taper_from_camera;
  const Eigen::Matrix3d rotation = geometry::RotationFromAngles(pose.angles_rad);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const Vector2d pixel((camera.width_px - 1.0) * column / (columns - 1),
                           (camera.height_px - 1.0) * row / (rows - 1));
      double sigma_px = std::numeric_limits<double>::quiet_NaN();
      if (const auto observation = LineOfSight(camera, pixel)) {
        const Vector3d camera_mm = *observation * (distance_mm / std::abs(observation->z()));
        const auto projected = ProjectFromTaper(camera, rotation * camera_mm + pose.translation_mm);
        if (projected) {
          const Matrix2d of_pixel =
              geometry::PropagateCovariance(projected->by_parameter, covariance);
          sigma_px = std::sqrt(std::max(0.0, geometry::SymmetricEigenvalues(of_pixel)[1]));
        }
      }
      uncertainty.sigma_px.push_back(sigma_px);
    }
  }
  return uncertainty;
}

}  // namespace trammel::part_alignment
