#include "app/analysis_run.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <utility>

#include "app/laser_recording.h"
#include "pressure_advance/analyse.h"

namespace trammel::app {

using pressure_advance::Analysis;
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

}  // namespace trammel::app
