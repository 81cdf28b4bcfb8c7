#include "part_alignment/camera/calibration_age.h"

#include <fmt/format.h>

#include <charconv>
#include <chrono>

namespace trammel::part_alignment {
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
                                       int most_days) {
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
  if (days <= most_days) return std::nullopt;
  return fmt::format(
      "the camera was calibrated {} days ago ({}), at most {} are trusted: "
      "calibrate it again",
      days, date, most_days);
}

}  // namespace trammel::part_alignment
