#include "pressure_advance/timing/sweep_timing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/check.h"
#include "base/result.h"
#include "base/statistics.h"
#include "pressure_advance/timing/camera_ticks.h"
#include "pressure_advance/timing/frame_stamps.h"
#include "pressure_advance/timing/latency_fit.h"
#include "pressure_advance/timing/sweep_positions.h"

namespace trammel::pressure_advance {
namespace {

tl::unexpected<Error> Refuse(std::string reason) {
  return Fail(std::move(reason), ErrorKind::kMeasurement);
}

/// Checks for faults that would invalidate the rest.
Result<void> CheckSweep(const SweepObservation& sweep, std::size_t number) {
  constexpr std::size_t kFewest = 20;
  TRAMMEL_CHECK(!sweep.motion.empty(), "sweep {} has no motion", number);
  if (sweep.frames.size() < kFewest) {
    return Refuse(fmt::format("sweep {}: {} frames, at least {} are needed; did the camera stall?",
                              number, sweep.frames.size(), kFewest));
  }
  double last_s = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < sweep.frames.size(); ++i) {
    const FrameObservation& frame = sweep.frames[i];
    if (!std::isfinite(frame.arrival_s) || frame.arrival_s < last_s) {
      return Refuse(fmt::format("sweep {}: frame {} arrived at {} s, after one at {} s", number,
                                i + 1, frame.arrival_s, last_s));
    }
    if (frame.change && !(*frame.change >= 0 && std::isfinite(*frame.change))) {
      return Refuse(
          fmt::format("sweep {}: frame {} has a change of {}", number, i + 1, *frame.change));
    }
    last_s = frame.arrival_s;
  }
  return {};
}

ChangeTrack TrackOf(const SweepObservation& sweep, const FrameStamps& stamps) {
  ChangeTrack track;
  track.motion = sweep.motion;
  track.period_s = stamps.period_s;
  track.stamp_sigma_s = stamps.track_sigma_s;
  for (const FrameStamp& stamp : stamps.frames) track.stamp_s.push_back(stamp.stamp_s);
  for (std::size_t i = 1; i < sweep.frames.size(); ++i) {
    const auto& change = sweep.frames[i].change;
    if (!change || !stamps.frames[i].note.empty() || !stamps.frames[i - 1].note.empty()) continue;
    track.pairs.push_back({stamps.frames[i - 1].stamp_s, stamps.frames[i].stamp_s, *change, i});
  }
  return track;
}

/// True if a sweep's own transitions contradict the latency of all.
bool Disagrees(const TrackFit& track, double latency_s, double period_s) {
  constexpr double kClearly = 15;  // nats
  return track.own_gain > kClearly && std::abs(track.own_latency_s - latency_s) > 0.6 * period_s;
}

struct Agreement {
  LatencyFit fit;
  std::vector<std::size_t> used;  ///< sweeps, in order of fit.tracks
};

/// Returns the common latency; omits a few sweeps that contradict the others.
Result<Agreement> Agree(const std::vector<ChangeTrack>& tracks, const LatencySearch& search,
                        std::vector<std::string>& notices) {
  Agreement agreement;
  for (std::size_t i = 0; i < tracks.size(); ++i) agreement.used.push_back(i);
  for (;;) {
    std::vector<ChangeTrack> chosen;
    for (const std::size_t i : agreement.used) chosen.push_back(tracks[i]);
    auto fit = TRY(FitLatency(chosen, search));
    agreement.fit = std::move(fit);
    std::vector<std::size_t> agreeing;
    for (std::size_t i = 0; i < agreement.used.size(); ++i) {
      const TrackFit& track = agreement.fit.tracks[i];
      if (!Disagrees(track, agreement.fit.latency_s, chosen[i].period_s)) {
        agreeing.push_back(agreement.used[i]);
        continue;
      }
      notices.push_back(fmt::format(
          "sweep {}: its picture begins and ceases to move {:.0f} ms away from the other sweeps'",
          agreement.used[i] + 1, 1e3 * (track.own_latency_s - agreement.fit.latency_s)));
    }
    if (agreeing.size() == agreement.used.size()) return agreement;
    if (agreeing.size() * 3 < tracks.size() * 2) {
      return Refuse(fmt::format(
          "{} of {} sweeps contradict the others about when their frames were taken; {}",
          tracks.size() - agreeing.size(), tracks.size(), notices.back()));
    }
    agreement.used = std::move(agreeing);
  }
}

FrameTiming Place(const SweepObservation& sweep, const FrameStamp& stamp, const LatencyFit& fit,
                  double track_sigma_s) {
  FrameTiming frame;
  frame.note = stamp.note;
  frame.time_s = stamp.stamp_s - fit.latency_s;
  const double sigma_s = std::hypot(fit.sigma_s, stamp.sigma_s, track_sigma_s);
  const HeadState head = HeadAt(sweep.motion, frame.time_s);
  frame.position_mm = head.position_mm;
  // On a ramp, the highest speed within the uncertainty of the time.
  double speed = std::abs(head.speed_mm_s);
  for (const double away_s : {-sigma_s, sigma_s}) {
    speed = std::max(speed, std::abs(HeadAt(sweep.motion, frame.time_s + away_s).speed_mm_s));
  }
  frame.position_sigma_mm = speed * sigma_s;
  if (!frame.note.empty()) return frame;
  constexpr double kSure = 3;
  constexpr double kSteadyTolerance = 0.01;  // of the sweep's speed
  const double from_s = frame.time_s - kSure * sigma_s;
  const double to_s = frame.time_s + kSure * sigma_s;
  frame.motion = StandsWithin(sweep.motion, from_s, to_s)                 ? FrameMotion::kStanding
                 : IsSteady(sweep.motion, from_s, to_s, kSteadyTolerance) ? FrameMotion::kSteady
                                                                          : FrameMotion::kRamp;
  return frame;
}

SweepTiming PlaceSweep(const SweepObservation& sweep, const FrameStamps& stamps,
                       const LatencyFit& fit, const TrackFit* track) {
  SweepTiming timing;
  for (const FrameStamp& stamp : stamps.frames) {
    timing.frames.push_back(Place(sweep, stamp, fit, stamps.track_sigma_s));
  }
  const auto unplace = [](FrameTiming& frame, const char* note) {
    frame.motion = FrameMotion::kUnplaced;
    frame.note = note;
  };
  if (track == nullptr) {
    for (FrameTiming& frame : timing.frames) {
      unplace(frame, "the sweep contradicts the others about when its frames were taken");
    }
    return timing;
  }
  for (const std::size_t i : track->frozen) {
    unplace(timing.frames[i], "the picture repeats the one before although the head moved");
  }
  return timing;
}

/// Returns the latencies that the clocks allow.
LatencySearch SearchRange(const std::vector<FrameStamps>& stamps) {
  constexpr double kSure = 3;
  double clock_sigma_s = 0;
  for (const FrameStamps& sweep : stamps) {
    clock_sigma_s = std::max(clock_sigma_s, sweep.clock_sigma_s);
  }
  const double slack_s = kSure * clock_sigma_s + 0.002;
  return {-slack_s, kLongestLatency_s + slack_s, 1};
}

SessionTiming Refused(std::string reason, std::vector<std::string> notices) {
  SessionTiming session;
  session.latency_s = Measured::Refused(std::move(reason));
  session.notices = std::move(notices);
  return session;
}

}  // namespace

const char* ToString(FrameMotion motion) {
  switch (motion) {
    case FrameMotion::kStanding:
      return "standing";
    case FrameMotion::kRamp:
      return "ramp";
    case FrameMotion::kSteady:
      return "steady";
    case FrameMotion::kUnplaced:
      return "unplaced";
  }
  return "unplaced";
}

SessionTiming MatchSweeps(std::span<const SweepObservation> sweeps, double nominal_frames_per_s) {
  TRAMMEL_CHECK(!sweeps.empty(), "{} sweeps", sweeps.size());
  std::vector<std::string> notices;
  for (std::size_t i = 0; i < sweeps.size(); ++i) {
    if (auto checked = CheckSweep(sweeps[i], i + 1); !checked) {
      return Refused(checked.error().message, notices);
    }
  }
  auto stamps = StampFrames(sweeps, nominal_frames_per_s, notices);
  if (!stamps) return Refused(stamps.error().message, notices);
  std::vector<ChangeTrack> tracks;
  for (std::size_t i = 0; i < sweeps.size(); ++i) {
    tracks.push_back(TrackOf(sweeps[i], (*stamps)[i]));
    if (tracks.back().pairs.size() < 2 * kMinStill) {
      return Refused(fmt::format("sweep {}: only {} pairs of neighbouring frames can be compared",
                                 i + 1, tracks.back().pairs.size()),
                     notices);
    }
  }
  auto agreed = Agree(tracks, SearchRange(*stamps), notices);
  if (!agreed) return Refused(agreed.error().message, notices);
  const LatencyFit& fit = agreed->fit;
  SessionTiming session;
  session.notices = std::move(notices);
  constexpr double kMaxUncertain_s = 0.02;
  if (fit.sigma_s > kMaxUncertain_s) {
    session.latency_s = Measured::CannotTell(fmt::format(
        "the moment at which frames are taken is known to {:.1f} ms only (standard uncertainty), "
        "and {:.1f} ms are wanted; sweep with slower ramps, or more lines",
        1e3 * fit.sigma_s, 1e3 * kMaxUncertain_s));
    return session;
  }
  session.latency_s =
      Measured::Good({fit.latency_s,
                      fit.sigma_s,
                      {std::min(fit.lo95_s, fit.latency_s), std::max(fit.hi95_s, fit.latency_s)}});
  for (std::size_t i = 0; i < sweeps.size(); ++i) {
    const auto used = std::find(agreed->used.begin(), agreed->used.end(), i);
    const TrackFit* track =
        used == agreed->used.end()
            ? nullptr
            : &fit.tracks[static_cast<std::size_t>(used - agreed->used.begin())];
    session.sweeps.push_back(PlaceSweep(sweeps[i], (*stamps)[i], fit, track));
  }
  return session;
}

}  // namespace trammel::pressure_advance
