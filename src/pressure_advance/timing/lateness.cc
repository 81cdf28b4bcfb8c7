#include "pressure_advance/timing/lateness.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

// A camera's server on a quiet network was seen to vary by half of it.
constexpr double kUsuallyLate_s = 0.1;
constexpr double kUsuallyLost = 0.1;

// Of the times at which frames followed each other, those that no frame was lost in.
double SinglePeriod(const std::vector<double>& steps, double nominal_s) {
  const double short_s = Quantile(steps, 0.2);
  constexpr double kAsAsked = 0.7;
  return short_s < kAsAsked * nominal_s || short_s > nominal_s / kAsAsked ? Median(steps)
                                                                          : nominal_s;
}

}  // namespace

Lateness MeasureLateness(const SweepObservation& sweep, double nominal_frames_per_s) {
  Lateness lateness;
  lateness.frames = sweep.frames.size();
  if (sweep.frames.size() < 2) return lateness;
  const bool captured =
      std::all_of(sweep.frames.begin(), sweep.frames.end(),
                  [](const FrameObservation& frame) { return frame.captured_s.has_value(); });
  const auto taken = [&](const FrameObservation& frame) {
    return captured ? *frame.captured_s : frame.arrival_s;
  };
  std::vector<double> steps;
  std::vector<double> delays;
  for (std::size_t i = 0; i < sweep.frames.size(); ++i) {
    const FrameObservation& frame = sweep.frames[i];
    delays.push_back(frame.arrival_s - taken(frame));
    if (i > 0) steps.push_back(std::max(0.0, taken(frame) - taken(sweep.frames[i - 1])));
  }
  const double period_s = SinglePeriod(steps, 1 / nominal_frames_per_s);
  const auto [promptest, latest] = std::minmax_element(delays.begin(), delays.end());
  lateness.late_s = *latest - *promptest;
  for (const double step : steps) {
    if (captured && step > 1.5 * period_s) {
      lateness.lost += static_cast<std::size_t>(std::lround(step / period_s)) - 1;
    }
    if (!captured) lateness.late_s = std::max(lateness.late_s, step - period_s);
  }
  return lateness;
}

std::string NameBusyComputer(const Lateness& lateness) {
  const auto all = static_cast<double>(lateness.frames + lateness.lost);
  const bool late = lateness.late_s > kUsuallyLate_s;
  const bool lossy = static_cast<double>(lateness.lost) > kUsuallyLost * all;
  if (!late && !lossy) return {};
  std::string what;
  if (late) what = fmt::format("frames came up to {:.0f} ms late", 1e3 * lateness.late_s);
  if (lossy) {
    what += fmt::format("{}{} of {} {}never came", late ? " and " : "", lateness.lost, all,
                        late ? "" : "frames ");
  }
  return what + ": this computer, or the camera's, is too busy";
}

}  // namespace trammel::pressure_advance
