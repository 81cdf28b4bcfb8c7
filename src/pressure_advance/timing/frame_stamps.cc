#include "pressure_advance/timing/frame_stamps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "base/statistics.h"
#include "pressure_advance/timing/camera_ticks.h"

namespace trammel::pressure_advance {
namespace {

// Twice the variation observed from a camera server on a quiet network.
constexpr double kUsuallyLate_s = 0.1;
constexpr double kUsuallyLost = 0.1;

// Estimates the period from the intervals between frames without a loss.
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

namespace {

constexpr double kStampSigma_s = 5e-4;  ///< per capture time: the kernel's wake-up
constexpr double kMaxBadShare = 0.1;

/// True if an interval between stamps is no multiple of the camera's period: its clock was set, or
/// it has no period.
bool BreaksRhythm(const std::vector<double>& stamps) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < stamps.size(); ++i) steps.push_back(stamps[i] - stamps[i - 1]);
  // Mean of the single steps: a median of stamps rounded to milliseconds is too coarse for gaps,
  // and biased if most frames were lost.
  const double about_s = Quantile(steps, 0.1);
  std::vector<double> single;
  for (const double step : steps) {
    if (step > 0.5 * about_s && step < 1.5 * about_s) single.push_back(step);
  }
  const double period_s = Mean(single);
  std::vector<double> away;
  for (const double step : steps) {
    away.push_back(std::abs(step - period_s * std::max(1.0, std::round(step / period_s))));
  }
  constexpr double kGrain_s = 0.003;  // stamps are cut to milliseconds
  return *std::max_element(away.begin(), away.end()) > kGrain_s + 6 * Median(away);
}

/// True if all values before some place are apart from all values behind it.
bool Steps(const std::vector<double>& values, double by) {
  for (std::size_t at = 1; at < values.size(); ++at) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(at);
    const auto [least0, most0] = std::minmax_element(values.begin(), middle);
    const auto [least1, most1] = std::minmax_element(middle, values.end());
    if (*least1 > *most0 + by || *least0 > *most1 + by) return true;
  }
  return false;
}

/// Returns why a sweep's capture times are unusable; else empty.
/// @param our_clock  they are known to be on a clock of ours, which nobody sets.
std::string CaptureFault(const SweepObservation& sweep, bool our_clock) {
  std::size_t bad = 0;
  double last_s = -std::numeric_limits<double>::infinity();
  std::vector<double> stamps;
  std::vector<double> delay;
  for (const FrameObservation& frame : sweep.frames) {
    if (!frame.captured_s || !std::isfinite(*frame.captured_s) || *frame.captured_s <= last_s) {
      ++bad;
      continue;
    }
    last_s = *frame.captured_s;
    stamps.push_back(last_s);
    delay.push_back(frame.arrival_s - last_s);
  }
  if (static_cast<double>(bad) > kMaxBadShare * static_cast<double>(sweep.frames.size())) {
    return fmt::format("{} of {} frames have no capture time or one that is not after the others'",
                       bad, sweep.frames.size());
  }
  // A clock that was set shifts all later delays, and hardly by whole periods. Delays of a busy
  // host or network are temporary, and do not affect the capture times' rhythm.
  const std::size_t window = std::max<std::size_t>(10, delay.size() / 10);
  std::vector<double> lowest;
  std::vector<double> local;
  for (std::size_t begin = 0; begin + window <= delay.size(); begin += window) {
    const std::span<const double> part(delay.data() + begin, window);
    lowest.push_back(*std::min_element(part.begin(), part.end()));
    local.push_back(Median(part) - lowest.back());
  }
  if (lowest.empty()) return "too few capture times";
  const auto [least, most] = std::minmax_element(lowest.begin(), lowest.end());
  const double allowed_s = 0.015 + 2 * Median(local);
  const bool moved = *most - *least > allowed_s;
  if (moved && (BreaksRhythm(stamps) || (!our_clock && Steps(lowest, allowed_s)))) {
    return fmt::format("the camera's clock moved by {:.0f} ms against ours during the sweep",
                       1e3 * (*most - *least));
  }
  return {};
}

/// Computes each frame's stamp delay: a server without processor time stamps frames when it fetches
/// them. Empty if the stamps show no rhythm (an exposure that varies), so that no delay is known.
std::vector<double> StampedLate(const std::vector<double>& stamps, double nominal_period_s) {
  constexpr double kUneven_s = 0.006;
  constexpr double kMaxLost = 0.5;
  const TickFit fit = FitTicks(stamps, nominal_period_s);
  const auto count = static_cast<double>(stamps.size());
  if (fit.tick.empty() || fit.unevenness_s > kUneven_s ||
      static_cast<double>(fit.lost) > kMaxLost * count) {
    return {};
  }
  const double usual_s = Median(fit.delay_s);
  const double min_s = std::max(0.01, 6 * RobustStandardDeviation(fit.delay_s));
  std::vector<double> late;
  for (const double delay : fit.delay_s) {
    late.push_back(delay - usual_s > min_s ? delay - usual_s : 0);
  }
  return late;
}

/// Marks the frames that were stamped late. Error: there are too many of them.
Result<void> MarkStampedLate(const SweepObservation& sweep, std::size_t number,
                             double nominal_period_s, FrameStamps& stamps) {
  constexpr std::size_t kFewest = 20;
  std::vector<double> sound;
  std::vector<std::size_t> index;
  for (std::size_t i = 0; i < stamps.frames.size(); ++i) {
    if (!stamps.frames[i].note.empty()) continue;
    sound.push_back(*sweep.frames[i].captured_s);
    index.push_back(i);
  }
  if (sound.size() < kFewest) return {};
  const std::vector<double> late = StampedLate(sound, nominal_period_s);
  std::size_t many = 0;
  for (std::size_t k = 0; k < late.size(); ++k) {
    if (late[k] == 0) continue;
    ++many;
    stamps.frames[index[k]].note = fmt::format(
        "it was stamped {:.0f} ms late: the camera's computer is too busy", 1e3 * late[k]);
  }
  constexpr double kMaxLate = 0.2;
  if (static_cast<double>(many) <= kMaxLate * static_cast<double>(sound.size())) return {};
  return Fail(
      fmt::format("sweep {}: {} of {} frames were stamped up to {:.0f} ms late: the "
                  "camera's computer is too busy",
                  number, many, sound.size(), 1e3 * *std::max_element(late.begin(), late.end())),
      ErrorKind::kMeasurement);
}

/// Returns the tenth-lowest delay and its standard error: near the minimum, but not dependent on
/// one frame.
std::pair<double, double> LowDelay(const std::vector<double>& delay) {
  constexpr double kQuantile = 0.1;
  constexpr double kMinSigma_s = 2e-4;
  const double inverse_density = (Quantile(delay, 0.2) - Quantile(delay, 0.02)) / 0.18;
  const double count = 0.5 * static_cast<double>(delay.size());
  return {Quantile(delay, kQuantile),
          std::max(kMinSigma_s, inverse_density * std::sqrt(kQuantile * (1 - kQuantile) / count))};
}

FrameStamps FromCaptureTimes(const SweepObservation& sweep) {
  FrameStamps stamps;
  std::vector<double> delay;
  std::vector<double> step;
  double last_s = -std::numeric_limits<double>::infinity();
  for (const FrameObservation& frame : sweep.frames) {
    if (!frame.captured_s || !(*frame.captured_s > last_s)) continue;
    if (std::isfinite(last_s)) step.push_back(*frame.captured_s - last_s);
    last_s = *frame.captured_s;
    delay.push_back(frame.arrival_s - last_s);
  }
  stamps.period_s = Median(step);
  const auto [low_s, low_sigma_s] = LowDelay(delay);
  double offset_s = low_s + sweep.arrival_offset.offset_s;
  stamps.track_sigma_s = low_sigma_s;
  stamps.clock_sigma_s = sweep.arrival_offset.standard_uncertainty_s;
  if (sweep.captured_offset) {  // measured for this sweep, it errs by itself
    offset_s = sweep.captured_offset->offset_s;
    stamps.clock_sigma_s = sweep.captured_offset->standard_uncertainty_s;
    stamps.track_sigma_s = std::hypot(kStampSigma_s, stamps.clock_sigma_s);
  }
  last_s = -std::numeric_limits<double>::infinity();
  for (const FrameObservation& frame : sweep.frames) {
    FrameStamp stamp;
    stamp.sigma_s = kStampSigma_s;
    if (frame.captured_s && *frame.captured_s > last_s) {
      stamp.stamp_s = *frame.captured_s + offset_s;
      last_s = *frame.captured_s;
    } else {
      stamp.stamp_s = frame.arrival_s - low_s + offset_s;
      stamp.note = "its capture time is missing or not after the one before";
    }
    stamps.frames.push_back(std::move(stamp));
  }
  return stamps;
}

std::vector<long> SequenceTicks(const SweepObservation& sweep) {
  std::vector<long> tick;
  for (const FrameObservation& frame : sweep.frames) {
    constexpr std::uint64_t kMaxSpan = 1'000'000;
    if (!frame.sequence) return {};
    const std::uint64_t since = *frame.sequence - sweep.frames.front().sequence.value();
    if (since > kMaxSpan || (!tick.empty() && static_cast<long>(since) <= tick.back())) return {};
    tick.push_back(static_cast<long>(since));
  }
  return tick;
}

Result<void> CheckTicks(const TickFit& fit, std::size_t number) {
  const auto refuse = [&](std::string what) {
    return Fail(
        fmt::format("sweep {}: {}. Have the camera's server send capture times (ustreamer's "
                    "?extra_headers=1), or set a fixed exposure and frame rate",
                    number, what),
        ErrorKind::kMeasurement);
  };
  if (fit.tick.empty()) return refuse("its frames came so unevenly that they show no frame rate");
  const double count = static_cast<double>(fit.tick.size());
  constexpr double kMaxLost = 0.2;
  if (static_cast<double>(fit.lost) > kMaxLost * count) {
    return refuse(fmt::format("{} frames came and {} did not", fit.tick.size(), fit.lost));
  }
  const double allowed_s = 0.006 + 0.6 * fit.typical_delay_s;
  if (fit.unevenness_s > allowed_s) {
    return refuse(
        fmt::format("without capture times the camera's rate must be constant, and the "
                    "earliest arrivals stray by {:.0f} ms from {:.2f} frames/s",
                    1e3 * fit.unevenness_s, 1 / fit.period_s));
  }
  const auto uncertain = std::count(fit.certain.begin(), fit.certain.end(), false);
  constexpr double kMaxUncertain = 0.4;
  if (static_cast<double>(uncertain) > kMaxUncertain * count) {
    return refuse(fmt::format("frames were lost, and for {} of {} it cannot be told which they are",
                              uncertain, fit.tick.size()));
  }
  return {};
}

FrameStamps FromTicks(const SweepObservation& sweep, const TickFit& fit) {
  FrameStamps stamps;
  stamps.period_s = fit.period_s;
  stamps.clock_sigma_s = sweep.arrival_offset.standard_uncertainty_s;
  stamps.track_sigma_s = std::hypot(fit.origin_sigma_s, stamps.clock_sigma_s);
  const double middle = 0.5 * static_cast<double>(fit.tick.front() + fit.tick.back());
  for (std::size_t i = 0; i < fit.tick.size(); ++i) {
    FrameStamp stamp;
    stamp.stamp_s = fit.At(fit.tick[i]) + sweep.arrival_offset.offset_s;
    stamp.sigma_s = std::abs(static_cast<double>(fit.tick[i]) - middle) * fit.period_sigma_s;
    if (!fit.certain[i]) {
      stamp.note = "a frame was lost near it, and it cannot be told which of several this one is";
    }
    stamps.frames.push_back(std::move(stamp));
  }
  return stamps;
}

Result<std::vector<FrameStamps>> StampByTicks(std::span<const SweepObservation> sweeps,
                                              double nominal_period_s) {
  std::vector<std::vector<double>> arrivals;
  std::vector<TickFit> counted;
  for (const SweepObservation& sweep : sweeps) {
    arrivals.emplace_back();
    for (const FrameObservation& frame : sweep.frames) arrivals.back().push_back(frame.arrival_s);
    if (auto tick = SequenceTicks(sweep); !tick.empty()) {
      counted.push_back(FitKnownTicks(arrivals.back(), std::move(tick)));
    }
  }
  const std::vector<TickFit> fits =
      counted.size() == sweeps.size() ? counted : FitSessionTicks(arrivals, nominal_period_s);
  std::vector<FrameStamps> stamps;
  for (std::size_t i = 0; i < sweeps.size(); ++i) {
    TRY(CheckTicks(fits[i], i + 1));
    stamps.push_back(FromTicks(sweeps[i], fits[i]));
  }
  return stamps;
}

}  // namespace

Result<std::vector<FrameStamps>> StampFrames(std::span<const SweepObservation> sweeps,
                                             double nominal_frames_per_s,
                                             std::vector<std::string>& notices) {
  const double nominal_period_s = 1 / nominal_frames_per_s;
  const bool any = std::any_of(sweeps.begin(), sweeps.end(), [](const SweepObservation& sweep) {
    return std::any_of(sweep.frames.begin(), sweep.frames.end(),
                       [](const FrameObservation& frame) { return frame.captured_s.has_value(); });
  });
  if (!any) return StampByTicks(sweeps, nominal_period_s);
  for (std::size_t i = 0; i < sweeps.size(); ++i) {
    if (const std::string fault = CaptureFault(sweeps[i], sweeps[i].captured_offset.has_value());
        !fault.empty()) {
      notices.push_back(fmt::format("sweep {}: {}; all sweeps are timed by their arrivals instead",
                                    i + 1, fault));
      auto stamps = StampByTicks(sweeps, nominal_period_s);
      if (stamps) return stamps;
      return Fail(notices.back() + "; " + stamps.error().message, stamps.error().kind);
    }
  }
  std::vector<FrameStamps> stamps;
  for (std::size_t i = 0; i < sweeps.size(); ++i) {
    stamps.push_back(FromCaptureTimes(sweeps[i]));
    TRY(MarkStampedLate(sweeps[i], i + 1, nominal_period_s, stamps.back()));
  }
  return stamps;
}

}  // namespace trammel::pressure_advance
