#include "app/analysis_run.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <utility>

#include "app/laser_recording.h"
#include "machine/image_file.h"
#include "pressure_advance/analyse.h"

namespace trammel::app {

using pressure_advance::LineMotion;
using pressure_advance::Method;
using pressure_advance::Segment;

namespace {

std::optional<double> ParseNumber(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) {
    return std::nullopt;
  }
  return value;
}

AnalysisRun RefusedRun(Method method, const std::string& reason) {
  AnalysisRun run;
  run.analysis.method = method;
  run.analysis.pressure_advance = Measured::Refused(reason);
  run.analysis.response.pressure_advance = run.analysis.pressure_advance;
  run.analysis.response.acceleration.pressure_advance = run.analysis.pressure_advance;
  run.analysis.response.deceleration.pressure_advance = run.analysis.pressure_advance;
  return run;
}

}  // namespace

Result<std::vector<Segment>> ParseSegments(const std::string& text) {
  std::vector<Segment> segments;
  double sum = 0;
  std::size_t begin = 0;
  while (begin <= text.size()) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string_view part = std::string_view(text).substr(begin, end - begin);
    const std::size_t colon = part.find(':');
    const auto fraction = ParseNumber(part.substr(0, std::min(colon, part.size())));
    const auto speed =
        colon == std::string_view::npos ? std::nullopt : ParseNumber(part.substr(colon + 1));
    if (!fraction || !speed || !(*fraction > 0 && *fraction < 1) ||
        !(*speed >= 0.1 && *speed <= 2000)) {
      return Fail(fmt::format(
          "--segments: '{}' is not FRACTION:SPEED with a fraction between 0 and 1 and a speed of "
          "0.1 to 2000 mm/s, as in 0.1:10,0.6:100,0.3:10",
          part));
    }
    segments.push_back({*fraction, *speed});
    sum += *fraction;
    begin = end + 1;
  }
  if (std::abs(sum - 1) > 1e-3) {
    return Fail(fmt::format("--segments: the fractions of {} sum to {:.4g}; they must sum to 1",
                            text, sum));
  }
  return segments;
}

Result<AnalysisRun> AnalyseRecording(const std::filesystem::path& folder, Method method) {
  Result<LaserMeasurement> measured = MeasureRecording(folder);
  if (!measured) {
    if (measured.error().kind == ErrorKind::kMeasurement) {
      return RefusedRun(method, measured.error().message);
    }
    return tl::unexpected(measured.error());
  }
  AnalysisRun run;
  run.analysis = pressure_advance::Analyse(std::move(measured->profiles), measured->scan.motion,
                                           std::move(measured->deviation), method);
  run.analysis.notices.insert(run.analysis.notices.begin(), measured->notices.begin(),
                              measured->notices.end());
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

report::PhotoView ViewOf(pressure_advance::PhotoMeasurement& seen) {
  report::PhotoView view;
  view.rectified = std::move(seen.rectified);
  for (std::size_t i = 0; i < seen.traces.size(); ++i) {
    const pressure_advance::TracedLine& trace = seen.traces[i];
    report::TracedLine line;
    line.pressure_advance_s = seen.profiles.at(i).pressure_advance_s;
    for (std::size_t k = 0; k < trace.x_px.size(); ++k) {
      const double half = trace.width_px[k] / 2;
      line.lower_edge.push_back({trace.x_px[k], trace.centre_px[k] + half});
      line.upper_edge.push_back({trace.x_px[k], trace.centre_px[k] - half});
    }
    view.lines.push_back(std::move(line));
  }
  return view;
}

}  // namespace

Result<AnalysisRun> AnalysePhoto(const std::filesystem::path& file, const PhotoPlan& plan,
                                 Method method) {
  const Result<Frame> picture = machine::ReadImageFile(file);
  if (!picture) return tl::unexpected(picture.error());
  pressure_advance::PhotoOptions options;
  options.pressure_advance_s = plan.pressure_advance_s;
  options.from = plan.from;
  options.start = plan.start;
  options.slow_before = plan.segments.front().fraction;
  options.slow_after = plan.segments.back().fraction;
  pressure_advance::PhotoMeasurement seen =
      pressure_advance::MeasurePhoto(picture->view(), options);
  if (!seen.refusal.empty()) {
    return RefusedRun(method, fmt::format("{}: {}", file.string(), seen.refusal));
  }
  std::vector<std::string> notices = seen.notices;
  const LineMotion motion = MotionSeen(plan, seen, notices);
  AnalysisRun run;
  run.photo = ViewOf(seen);
  run.analysis = pressure_advance::Analyse(std::move(seen.profiles), motion, {}, method);
  run.analysis.notices.insert(run.analysis.notices.begin(), notices.begin(), notices.end());
  return run;
}

}  // namespace trammel::app
