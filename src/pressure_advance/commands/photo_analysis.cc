#include "pressure_advance/commands/photo_analysis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "base/statistics.h"
#include "machine/camera/phone_picture.h"
#include "pressure_advance/photo/other_patterns.h"
#include "pressure_advance/photo/photo_labels.h"
#include "pressure_advance/photo/photo_lines.h"
#include "pressure_advance/response/response.h"

namespace trammel::app {

using pressure_advance::ChevronView;
using pressure_advance::LineMotion;

LineMotion MotionSeen(const PhotoPlan& plan, const pressure_advance::PhotoMeasurement& seen,
                      std::vector<std::string>& notices) {
  LineMotion motion;
  motion.segments = plan.segments;
  motion.length_mm = plan.length_mm;
  motion.acceleration_mm_s2 = plan.acceleration_mm_s2;
  if (!seen.segments || plan.segments.size() != 3) return motion;
  double begin = seen.segments->fast_begin, end = seen.segments->fast_end;
  const double planned_begin = plan.segments[0].fraction;
  const double planned_end = planned_begin + plan.segments[1].fraction;
  // A late start moves both towards the start, and ramps of a known length are no part of that.
  if (motion.length_mm) {
    begin = std::min(begin, planned_begin);
    end = std::min(end, planned_end);
  }
  constexpr double kFarFromPlan = 0.05;
  if (std::abs(seen.segments->fast_begin - planned_begin) > kFarFromPlan ||
      std::abs(seen.segments->fast_end - planned_end) > kFarFromPlan) {
    notices.push_back(fmt::format(
        "the lines change speed at {:.2f} and {:.2f} of their length in the photo, and at {:.2f} "
        "and {:.2f} by the segments: {:.2f} and {:.2f} are used",
        seen.segments->fast_begin, seen.segments->fast_end, planned_begin, planned_end, begin,
        end));
  }
  motion.segments[0].fraction = begin;
  motion.segments[1].fraction = end - begin;
  motion.segments[2].fraction = 1 - end;
  return motion;
}

namespace {

// Keeps a refused photo, reduced, for the report.
// @param outline  px of the photo
report::RefusedPhoto Kept(const Frame& photo, std::vector<vision::PointPx> outline) {
  constexpr int kLongest_px = 1600;
  for (vision::PointPx& p : outline) p = {p.x / photo.width, p.y / photo.height};
  double scale = 1;
  return {vision::ShrinkToFit(photo.view(), kLongest_px, double{kLongest_px} * kLongest_px, scale),
          std::move(outline)};
}

// Returns the outline of the corners, px of the photo; empty: none are seen.
std::vector<vision::PointPx> OutlineOf(const pressure_advance::ChevronView& view) {
  std::vector<vision::PointPx> outline;
  if (view.found.count == 0 || view.photo_width_px == 0) return outline;
  constexpr double arm = 5.9;  // spacings: the longest of the patterns in use
  const double last = view.found.count - 1;
  for (const vision::PointPx& p : {vision::PointPx{0, 0},
                                   {-arm, arm},
                                   {last - arm, arm},
                                   {last, 0},
                                   {last - arm, -arm},
                                   {-arm, -arm}}) {
    outline.push_back(view.found.photo_from_plane(p));
  }
  return outline;
}

// Does the same for lines.
std::vector<vision::PointPx> OutlineOf(const pressure_advance::PhotoLines& lines) {
  if (!lines.problem.empty()) return {};
  return {lines.corners.begin(), lines.corners.end()};
}

// Measures corners by the plan's values.
AnalysisRun MeasureCorners(const std::string& file, const ChevronView& view,
                           const PhotoPlan& plan) {
  if (!view.problem.empty()) return RefusedRun(fmt::format("{}: {}", file, view.problem));
  const std::vector<double>& values_s = plan.pressure_advance_s;
  const auto count = static_cast<std::size_t>(view.found.count);
  if (count != values_s.size()) {
    return RefusedRun(fmt::format(
        "{}: {} corners are seen, and {} values were printed: photograph the whole pattern, or "
        "give the values that it has",
        file, count, values_s.size()));
  }
  const double spacing_mm = plan.spacing_mm.value_or(pressure_advance::SpacingOf_mm(view));
  const auto readings =
      pressure_advance::ReadChevrons(view, pressure_advance::kCornerWindow_mm / spacing_mm);
  std::vector<pressure_advance::CornerSurplus> corners;
  for (std::size_t i = 0; i < count; ++i) {
    const pressure_advance::ChevronReading& reading = readings[i];
    corners.push_back({values_s[i], reading.surplus * spacing_mm, reading.sigma * spacing_mm,
                       reading.wider, reading.unusable});
  }
  corners.back().unusable = "the last corner touches the frame";
  AnalysisRun run;
  run.analysis = pressure_advance::FitCorners(corners, plan.motion);
  run.analysis.printed_by = plan.printed_by;
  run.photo = PictureOf(view, values_s);
  return run;
}

std::string RangeText(const std::vector<double>& values_s) {
  return fmt::format("{:.4g} to {:.4g} s", values_s.front(), values_s.back());
}

// Takes the printed numbers into a plan without values, or compares them with its values.
// @returns why the plan cannot be used; empty: it can
std::string TakeNumbers(const pressure_advance::LabelReading& reading, bool corners,
                        PhotoPlan& plan, std::vector<std::string>& notices) {
  const std::vector<double>& read_s = reading.pressure_advance_s;
  if (!plan.pressure_advance_s.empty()) {
    if (read_s.size() != plan.pressure_advance_s.size()) return {};
    return fmt::format(
        "the numbers beside the pattern say {}, and {} were given: is it the photo of this print?",
        RangeText(read_s), RangeText(plan.pressure_advance_s));
  }
  if (read_s.empty()) {
    return fmt::format(
        "the printed numbers cannot be read: {}. No plan of the print is known. Give the file that "
        "printed it (--gcode FILE; --plan FILE for a pattern of pa pattern), or the values "
        "(--pattern NAME --pa START:END:STEP)",
        reading.problem);
  }
  plan.pressure_advance_s = read_s;
  if (!plan.from) plan.from = reading.from;
  if (!plan.start) plan.start = reading.start;
  notices.push_back(fmt::format("the printed numbers say {} in {} steps of {:.4g} s",
                                RangeText(read_s), read_s.size() - 1, read_s[1] - read_s[0]));
  notices.push_back(
      corners ? std::string("the corners' speed and acceleration are not known: the file that "
                            "printed them has both (--gcode)")
              : fmt::format("the lines' speeds are not known: {:g} and {:g} mm/s were taken; "
                            "the file that printed them has them (--gcode)",
                            plan.segments[0].speed_mm_s, plan.segments[1].speed_mm_s));
  return {};
}

// True if the numbers beside so many candidates are to be read: for a plan without values, or to
// compare.
bool WantsNumbers(const PhotoPlan& plan, std::size_t candidates) {
  return plan.pressure_advance_s.empty() || plan.pressure_advance_s.size() == candidates;
}

}  // namespace

AnalysisRun AnalyseCorners(const Frame& picture, const std::string& file, const ChevronView& view,
                           PhotoPlan plan) {
  std::vector<std::string> notices;
  std::string fault;
  bool mirrored = false;
  const bool numbered = plan.pressure_advance_s.empty();
  if (view.problem.empty() && WantsNumbers(plan, static_cast<std::size_t>(view.found.count))) {
    const auto reading = ReadLabels(picture.view(), view, plan.pressure_advance_s);
    mirrored = reading.mirrored;
    fault = TakeNumbers(reading, true, plan, notices);
  }
  AnalysisRun run = fault.empty() ? MeasureCorners(file, view, plan)
                                  : RefusedRun(fmt::format("{}: {}", file, fault));
  run.mirrored = mirrored;
  if (!run.photo) run.refused = Kept(picture, OutlineOf(view));
  if (numbered) run.printed_s = plan.pressure_advance_s;
  run.analysis.notices.insert(run.analysis.notices.end(), notices.begin(), notices.end());
  return run;
}

namespace {

pressure_advance::PhotoOptions OptionsOf(const PhotoPlan& plan) {
  pressure_advance::PhotoOptions options;
  options.pressure_advance_s = plan.pressure_advance_s;
  options.from = plan.from;
  options.start = plan.start;
  options.corner_mark = plan.corner_mark;
  options.framed = plan.framed;
  options.length_pitches = plan.length_pitches;
  options.slow_before = plan.segments.front().fraction;
  options.slow_after = plan.segments.back().fraction;
  return options;
}

// True if the labels show the plan's values, or look like them.
bool ShowsValues(const pressure_advance::LabelReading& reading) {
  return reading.problem.empty() && reading.pressure_advance_s.empty();
}

std::string CountText(std::size_t count, bool corners) {
  return fmt::format("{} {}", count, corners ? "corners" : "lines");
}

// Pattern that is measured of those in a picture.
struct Choice {
  std::string problem;  // why none is; empty: there is one
  bool other = false;   // the other one, not the one found first
};

// Looks for a second pattern in the picture. Printed numbers that only one of both shares with the
// plan tell which is meant.
// @param seen  a ChevronView or PhotoLines
template <class Seen>
Choice Choose(const Frame& picture, const Seen& seen, std::size_t count,
              const std::vector<double>& given_s) {
  constexpr bool kCorners = std::is_same_v<Seen, ChevronView>;
  const BgrView view = picture.view();
  const auto other = pressure_advance::FindOtherPattern(view, OutlineOf(seen));
  if (!other) return {};
  const bool corners = other->chevrons.has_value();
  if (!given_s.empty()) {
    const auto here = ReadLabels(view, seen, given_s);
    const auto there =
        corners ? ReadLabels(view, pressure_advance::ViewChevrons(view, *other->chevrons), given_s)
                : ReadLabels(view, other->lines, given_s);
    if (ShowsValues(here) && !there.pressure_advance_s.empty()) return {};
    if (ShowsValues(there) && !here.pressure_advance_s.empty()) return {"", true};
  }
  return {fmt::format(
      "two patterns are in the picture, one of {} and one of {}: photograph one "
      "alone, or cut the picture down to it{}",
      CountText(count, kCorners), CountText(other->count(), corners),
      kCorners && corners ? "; give a batch's file to measure all of its patterns (--gcode FILE)"
                          : "")};
}

// Returns the problem, and before it the other kind where that is seen: arms of corners that are
// hardly seen are lines, too.
std::string OfOtherKind(pressure_advance::PhotoSearch& photo, PatternForm expected,
                        const std::string& problem) {
  const std::size_t count = CountOfOtherKind(photo, expected);
  if (count == 0) return problem;
  const bool lines = expected == PatternForm::kLines;
  return fmt::format(
      "{} are seen, and {} are expected: is it the photo of this print? If it is, {}",
      CountText(count, lines), lines ? "lines" : "corners", problem);
}

// Refuses a photo, and keeps it for the report.
AnalysisRun Refused(const Frame& picture, const std::string& file, const std::string& reason,
                    std::vector<vision::PointPx> outline) {
  AnalysisRun run = RefusedRun(fmt::format("{}: {}", file, reason));
  run.refused = Kept(picture, std::move(outline));
  return run;
}

// Lines in a photo, named by the plan or by their numbers.
struct NamedLines {
  pressure_advance::PhotoMeasurement seen;
  std::vector<vision::PointPx> outline;  // px of the picture; empty: none are seen
  bool other = false;                    // another pattern of the picture is meant
};

// Measures lines that are named by the plan or by their numbers.
NamedLines MeasureNumbered(pressure_advance::PhotoSearch& photo, PhotoPlan& plan,
                           std::vector<std::string>& notices) {
  const Frame& picture = photo.picture();
  NamedLines named;
  pressure_advance::PhotoOptions options = OptionsOf(plan);
  if (options.pressure_advance_s.empty()) {
    options.pressure_advance_s.resize(pressure_advance::kUsualLines);
  }
  named.seen.refusal = CheckPhotoInput(photo.photo_width_px(), photo.photo_height_px(), options);
  if (!named.seen.refusal.empty()) return named;
  pressure_advance::PhotoLines lines = FindPhotoLines(photo, options);
  named.outline = OutlineOf(lines);
  if (lines.problem.empty()) {
    const std::size_t count = lines.line_pattern.rungs.size();
    if (plan.pressure_advance_s.size() < count &&
        pressure_advance::InTwoGroups(lines.line_pattern)) {
      named.seen.refusal = fmt::format(
          "{} lines in two groups are in the picture, as of two patterns: photograph one alone, or "
          "cut the picture down to it",
          count);
      return named;
    }
    // A frame of its own tells a pattern from whatever else has edges side by side.
    Choice choice = plan.framed ? Choice{} : Choose(picture, lines, count, plan.pressure_advance_s);
    named.other = choice.other;
    named.seen.refusal = std::move(choice.problem);
    if (named.other || !named.seen.refusal.empty()) return named;
    if (WantsNumbers(plan, pressure_advance::PlacesOf(lines.line_pattern))) {
      named.seen.refusal = TakeNumbers(ReadLabels(picture.view(), lines, plan.pressure_advance_s),
                                       false, plan, notices);
      if (!named.seen.refusal.empty()) return named;
    }
  }
  if (!lines.problem.empty() && plan.form == PatternForm::kLines) {
    lines.problem = OfOtherKind(photo, PatternForm::kLines, lines.problem);
  }
  named.seen = MeasurePhotoLines(std::move(lines), OptionsOf(plan));
  return named;
}

// Returns what to print instead if many lines of the plan can be empty to their end: filament held
// back where the head slows down lasts for pressure advance times the speed change. Else empty.
std::string WithoutEnds(const PhotoPlan& plan) {
  if (!plan.length_mm || plan.pressure_advance_s.empty() || plan.segments.size() < 3) return {};
  const double last_mm = plan.segments.back().fraction * *plan.length_mm;
  const double change_mm_s = plan.segments[1].speed_mm_s - plan.segments.back().speed_mm_s;
  const double highest_s = std::ranges::max(plan.pressure_advance_s);
  constexpr double kMany =
      3;  // assumed: half of the lines, where the right value is low in the range
  const double empty_s = last_mm / change_mm_s;
  if (!(change_mm_s > 0) || highest_s < kMany * empty_s) return {};
  return fmt::format(
      ". The values reach {:.3g} s: {:.2g} s above the right one, a line is empty to its end. If "
      "many are, print values of at most {:.2g} s",
      highest_s, empty_s, 2 * empty_s);
}

AnalysisRun AnalysePicture(pressure_advance::PhotoSearch& photo, const std::string& file,
                           const PhotoPlan& given);

// Analyses a picture without one of its patterns.
AnalysisRun AnalyseRest(const Frame& picture, const std::vector<vision::PointPx>& outline,
                        const std::string& file, const PhotoPlan& plan) {
  pressure_advance::PhotoSearch rest(pressure_advance::WithoutPattern(picture.view(), outline));
  return AnalysePicture(rest, file, plan);
}

AnalysisRun AnalysePicture(pressure_advance::PhotoSearch& photo, const std::string& file,
                           const PhotoPlan& given) {
  const Frame& picture = photo.picture();
  constexpr int kNarrowest_px = 16;  // once reduced: combs are searched in no less
  if (std::min(picture.width, picture.height) < kNarrowest_px) {
    return Refused(picture, file,
                   fmt::format("the photo has {} x {} px: too narrow", photo.photo_width_px(),
                               photo.photo_height_px()),
                   {});
  }
  if (given.form != PatternForm::kLines) {
    const auto view = pressure_advance::ViewChevrons(photo);
    Choice choice;
    if (view.problem.empty()) {
      const auto count = static_cast<std::size_t>(view.found.count);
      choice = Choose(picture, view, count, given.pressure_advance_s);
    }
    if (!choice.problem.empty()) return Refused(picture, file, choice.problem, OutlineOf(view));
    if (choice.other) return AnalyseRest(picture, OutlineOf(view), file, given);
    constexpr int kSmallest_px = 100;
    if (given.form == PatternForm::kCorners && view.found.count == 0 &&
        std::min(picture.width, picture.height) >= kSmallest_px) {
      return Refused(picture, file, OfOtherKind(photo, PatternForm::kCorners, view.problem), {});
    }
    // Arms of chevrons are not read as lines.
    if (given.form == PatternForm::kCorners || view.found.count > 0) {
      return AnalyseCorners(picture, file, view, given);
    }
  }
  PhotoPlan plan = given;
  const bool numbered = plan.pressure_advance_s.empty();
  if (numbered) plan.framed = false;
  std::vector<std::string> notices;
  auto [seen, outline, other] = MeasureNumbered(photo, plan, notices);
  if (other) return AnalyseRest(photo.picture(), outline, file, given);
  if (!seen.refusal.empty()) {
    AnalysisRun run = Refused(picture, file, seen.refusal + WithoutEnds(plan), std::move(outline));
    if (numbered) run.printed_s = plan.pressure_advance_s;
    return run;
  }
  notices.insert(notices.end(), seen.notices.begin(), seen.notices.end());
  if (!plan.from && !seen.marked && seen.first_line != pressure_advance::PhotoSide::kBottom) {
    notices.push_back(fmt::format("the first line lies at the {} of the photo, as the lines say",
                                  ToString(seen.first_line)));
  }
  const LineMotion motion = MotionSeen(plan, seen, notices);
  AnalysisRun run;
  run.photo = std::move(seen.view);
  pressure_advance::ResponseOptions response;
  response.printed_middle_s = Mean(plan.pressure_advance_s);
  response.picture_sigma = pressure_advance::PictureSigma(seen.blur);
  if (plan.length_mm) {
    // Lines without a bar start late by up to a tenth of their length, and end with a blob. Of
    // virtual photos of 80 mm lines, seeds 300000 to 300499.
    response.transitions.start_margin_mm = 8;
    response.transitions.end_margin = 0.05;
    response.transitions.margin_of_response = 0.6;
  }
  run.analysis = pressure_advance::Analyse(std::move(seen.profiles), motion, {}, response);
  run.analysis.printed_by = plan.printed_by;
  run.analysis.notices.insert(run.analysis.notices.begin(), notices.begin(), notices.end());
  if (numbered) run.printed_s = plan.pressure_advance_s;
  return run;
}

}  // namespace

Result<OpenPhoto> ReadPhotoForSearch(const std::filesystem::path& file) {
  return OpenPhoto{file, pressure_advance::PhotoSearch(TRY(machine::ReadPhotoFile(file)))};
}

Result<AnalysisRun> AnalysePhoto(const std::filesystem::path& file, const PhotoPlan& plan) {
  OpenPhoto photo = TRY(ReadPhotoForSearch(file));
  return AnalysePhoto(photo, plan);
}

AnalysisRun AnalysePhoto(OpenPhoto& photo, const PhotoPlan& plan) {
  if (plan.to_and_fro) {
    return RefusedRun(fmt::format(
        "{}: the lines of this pattern were printed to and fro, which is not read; print them all "
        "in one direction",
        photo.file.filename().string()));
  }
  return AnalysePicture(photo.search, photo.file.filename().string(), plan);
}

}  // namespace trammel::app
