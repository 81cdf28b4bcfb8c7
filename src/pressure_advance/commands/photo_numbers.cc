#include "pressure_advance/commands/photo_numbers.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "machine/camera/phone_picture.h"
#include "pressure_advance/photo/photo_labels.h"
#include "pressure_advance/photo/photo_lines.h"

namespace trammel::app {
namespace {

using pressure_advance::ChevronView;
using pressure_advance::LabelReading;

// Picture as it is measured, and the chevrons in it.
struct Seen {
  Frame picture;
  ChevronView chevrons;
};

Result<Seen> Look(const std::filesystem::path& file, const PhotoPlan& plan) {
  const Frame photo = TRY(machine::ReadPhotoFile(file));
  Seen seen;
  double scale = 1;
  constexpr int kSmallest_px = 64;
  if (std::min(photo.width, photo.height) < kSmallest_px) {
    seen.chevrons.problem = fmt::format("the photo has {} x {} px", photo.width, photo.height);
    return seen;
  }
  seen.picture = vision::ShrinkToFit(photo.view(), pressure_advance::kLongestMeasured_px,
                                     pressure_advance::kMaxMeasured_px, scale);
  seen.chevrons.problem = "no corners were looked for";
  if (plan.form != PatternForm::kLines) {
    seen.chevrons = pressure_advance::ViewChevrons(seen.picture.view());
  }
  return seen;
}

LabelReading ReadLines(const Seen& seen, const std::vector<double>& given_s) {
  LabelReading reading;
  if (seen.picture.width == 0) {
    reading.problem = seen.chevrons.problem;
    return reading;
  }
  constexpr std::size_t kUsualLines = 50;  // sets the size at which they are searched
  pressure_advance::PhotoOptions options;
  options.framed = false;
  options.pressure_advance_s = given_s;
  if (given_s.empty()) options.pressure_advance_s.resize(kUsualLines);
  const auto lines = pressure_advance::FindPhotoLines(seen.picture.view(), options);
  if (lines.problem.empty()) {
    return pressure_advance::ReadLabels(seen.picture.view(), lines, given_s);
  }
  reading.problem = lines.problem;
  return reading;
}

std::string RangeText(const std::vector<double>& values_s) {
  return fmt::format("{:.4g} to {:.4g} s", values_s.front(), values_s.back());
}

// Reads the numbers beside the chevrons, else beside the lines.
LabelReading ReadSeen(const Seen& seen, const PhotoPlan& plan) {
  if (seen.chevrons.problem.empty()) {
    return pressure_advance::ReadLabels(seen.picture.view(), seen.chevrons,
                                        plan.pressure_advance_s);
  }
  // Arms of chevrons are not read as lines.
  if (plan.form != PatternForm::kCorners && seen.chevrons.found.count == 0) {
    return ReadLines(seen, plan.pressure_advance_s);
  }
  LabelReading reading;
  reading.problem = seen.chevrons.problem;
  return reading;
}

}  // namespace

Result<LabelReading> ReadPrintedNumbers(const std::filesystem::path& file, const PhotoPlan& plan) {
  return ReadSeen(TRY(Look(file, plan)), plan);
}

Result<NumberedRun> AnalyseByNumbers(const std::filesystem::path& file, const PhotoPlan& given) {
  const Seen seen = TRY(Look(file, given));
  const LabelReading reading = ReadSeen(seen, given);
  const bool corners = seen.chevrons.problem.empty();
  NumberedRun result;
  if (reading.pressure_advance_s.empty()) {
    result.problem = reading.problem;
    return result;
  }
  PhotoPlan plan = given;
  plan.pressure_advance_s = reading.pressure_advance_s;
  plan.framed = false;
  plan.form = corners ? PatternForm::kCorners : PatternForm::kLines;
  if (!plan.from) plan.from = reading.from;
  if (!plan.start) plan.start = reading.start;
  result.run =
      corners ? AnalyseCorners(file.string(), seen.chevrons, plan) : TRY(AnalysePhoto(file, plan));
  auto& notices = result.run->analysis.notices;
  notices.push_back(fmt::format(
      "the printed numbers say {} in {} steps of {:.4g} s", RangeText(plan.pressure_advance_s),
      plan.pressure_advance_s.size() - 1, plan.pressure_advance_s[1] - plan.pressure_advance_s[0]));
  notices.push_back(
      corners ? std::string("the corners' speed and acceleration are not known; --gcode tells them")
              : fmt::format("the lines' speeds are not known: {:g} and {:g} mm/s were taken; "
                            "--gcode tells them",
                            plan.segments[0].speed_mm_s, plan.segments[1].speed_mm_s));
  return result;
}

Result<std::string> ContradictingNumbers(const std::filesystem::path& file, const PhotoPlan& plan) {
  const LabelReading reading = TRY(ReadPrintedNumbers(file, plan));
  const std::vector<double>& given_s = plan.pressure_advance_s;
  if (reading.pressure_advance_s.size() != given_s.size()) return std::string();
  return fmt::format("the numbers beside the pattern say {}, and {} were given",
                     RangeText(reading.pressure_advance_s), RangeText(given_s));
}

}  // namespace trammel::app
