#include "pressure_advance/commands/analysis_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/statistics.h"
#include "machine/camera/phone_picture.h"
#include "pressure_advance/commands/laser_recording.h"
#include "pressure_advance/response/analyse.h"
#include "pressure_advance/timing/lateness.h"

namespace trammel::app {

using pressure_advance::LineMotion;

namespace {

AnalysisRun RefusedRun(const std::string& reason) {
  AnalysisRun run;
  run.analysis.pressure_advance = Measured::Refused(reason);
  run.analysis.response.pressure_advance = run.analysis.pressure_advance;
  run.analysis.response.acceleration.pressure_advance = run.analysis.pressure_advance;
  run.analysis.response.deceleration.pressure_advance = run.analysis.pressure_advance;
  return run;
}

std::string BusyComputer(const pressure_advance::ScanLine& line) {
  return pressure_advance::NameBusyComputer(
      {line.late_s, line.frame_positions_mm.size(), line.lost_frames});
}

Measured WithReason(const Measured& measured, std::string reason) {
  return measured.verdict() == Verdict::kRefused ? Measured::Refused(std::move(reason))
                                                 : Measured::CannotTell(std::move(reason));
}

}  // namespace

void BlameBusyComputer(const pressure_advance::Scan& scan, pressure_advance::Analysis& analysis) {
  std::size_t in_question = 0, busy_lines = 0;
  std::string worst;
  std::size_t most_lost = 0;
  const bool some_unused =
      !std::ranges::all_of(analysis.lines, &pressure_advance::LineResult::used);
  for (std::size_t i = 0; i < analysis.lines.size(); ++i) {
    auto& line = analysis.lines[i];
    if (some_unused && line.used) continue;
    ++in_question;
    const std::string busy = BusyComputer(scan.lines.at(i));
    if (busy.empty()) continue;
    ++busy_lines;
    if (!line.used) line.reason = fmt::format("{} ({})", busy, line.reason);
    if (worst.empty() || scan.lines[i].lost_frames > most_lost) {
      worst = busy;
      most_lost = scan.lines[i].lost_frames;
    }
  }
  Measured& answer = analysis.pressure_advance;
  if (answer.good() || 2 * busy_lines < in_question || busy_lines == 0) return;
  answer = WithReason(answer, fmt::format("{} ({}): {}", worst, answer.reason(),
                                          pressure_advance::kBusyComputerRemedy));
}

Result<AnalysisRun> AnalyseRecording(const std::filesystem::path& folder) {
  Result<LaserMeasurement> measured = MeasureRecording(folder);
  if (!measured) {
    if (measured.error().kind == ErrorKind::kMeasurement) {
      return RefusedRun(measured.error().message);
    }
    return tl::unexpected(measured.error());
  }
  AnalysisRun run;
  run.analysis = pressure_advance::Analyse(std::move(measured->profiles), measured->scan.motion,
                                           std::move(measured->deviation));
  run.analysis.notices.insert(run.analysis.notices.begin(), measured->notices.begin(),
                              measured->notices.end());
  BlameBusyComputer(measured->scan, run.analysis);
  run.analysis.scale = HeightScaleOf(measured->scan);
  run.scan = std::move(measured->view);
  return run;
}

namespace {

// A photo shows where the speed changes: nearer the truth than the plan's fractions, because part
// of each line lies under the frame.
LineMotion MotionSeen(const PhotoPlan& plan, const pressure_advance::PhotoMeasurement& seen,
                      std::vector<std::string>& notices) {
  LineMotion motion;
  motion.segments = plan.segments;
  if (!seen.segments || plan.segments.size() != 3) return motion;
  const double begin = seen.segments->fast_begin;
  const double end = seen.segments->fast_end;
  const double planned_end = plan.segments[0].fraction + plan.segments[1].fraction;
  constexpr double kFarFromPlan = 0.05;
  if (std::abs(begin - plan.segments[0].fraction) > kFarFromPlan ||
      std::abs(end - planned_end) > kFarFromPlan) {
    notices.push_back(fmt::format(
        "the lines change speed at {:.2f} and {:.2f} of their length, the segments say {:.2f} and "
        "{:.2f}: what was seen is used",
        begin, end, plan.segments[0].fraction, planned_end));
  }
  motion.segments[0].fraction = begin;
  motion.segments[1].fraction = end - begin;
  motion.segments[2].fraction = 1 - end;
  return motion;
}

}  // namespace

Result<AnalysisRun> AnalysePhoto(const std::filesystem::path& file, const PhotoPlan& plan) {
  const Frame picture = TRY(machine::ReadPhotoFile(file));
  pressure_advance::PhotoOptions options;
  options.pressure_advance_s = plan.pressure_advance_s;
  options.from = plan.from;
  options.start = plan.start;
  options.corner_mark = plan.corner_mark;
  options.slow_before = plan.segments.front().fraction;
  options.slow_after = plan.segments.back().fraction;
  pressure_advance::PhotoMeasurement seen = pressure_advance::MeasurePhoto(picture.view(), options);
  if (!seen.refusal.empty()) {
    return RefusedRun(fmt::format("{}: {}", file.string(), seen.refusal));
  }
  std::vector<std::string> notices = seen.notices;
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
  run.analysis = pressure_advance::Analyse(std::move(seen.profiles), motion, {}, response);
  run.analysis.printed_by = plan.printed_by;
  run.analysis.notices.insert(run.analysis.notices.begin(), notices.begin(), notices.end());
  return run;
}

}  // namespace trammel::app
