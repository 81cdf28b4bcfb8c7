// Ties the frames of sweeps to the motion: where along its line each frame was taken.
//
// Assumptions, each of them checked against the data, and a contradiction refused with its figures:
//  1. The camera takes a frame for a time that is the same in all sweeps of one call before its
//  time
//     stamp (or, without stamps, before its earliest possible arrival): the latency. It is positive
//     and below kLongestLatency_s.
//  2. Within a sweep, stamps of one camera run at the rate of the motion's clock.
//  3. Without stamps the camera takes frames at a constant rate; delivery only delays them and
//  keeps
//     their order.
//  4. The picture changes more from frame to frame while the head moves than while it stands, and
//     the more the further it moved, up to a saturation.
//  5. Each sweep's frames begin before its motion and end after it, with kMinStill frames of a
//     standing head at either end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/measured.h"

namespace trammel::pressure_advance {

/// Stretch of constant acceleration. Moves are in order of time and do not overlap; between and
/// around them the head is at rest.
struct LineMove {
  double start_s = 0;             ///< motion's clock
  double duration_s = 0;          ///< > 0
  double start_mm = 0;            ///< position along the printed line, from its printed start
  double start_speed_mm_s = 0;    ///< signed: negative against the print direction
  double acceleration_mm_s2 = 0;  ///< signed
};

/// Returns a sweep from rest to rest as three moves: `speed_mm_s` (> 0) along a signed distance.
/// REQUIRES acceleration > 0 and a distance of at least one full ramp up and down.
[[nodiscard]] std::vector<LineMove> TrapezoidSweep(double start_s, double start_mm, double end_mm,
                                                   double speed_mm_s, double acceleration_mm_s2);

/// Offset from one clock to the motion's, to be added.
struct ClockOffset {
  double offset_s = 0;
  double standard_uncertainty_s = 0;  ///< >= 0
};

/// Frame as delivered by the camera.
struct FrameObservation {
  double arrival_s = 0;              ///< arrival clock, not decreasing
  std::optional<double> captured_s;  ///< camera's clock
  std::optional<std::uint64_t> sequence;
  std::optional<double> change;  ///< >= 0, against the frame before; absent for the first frame,
                                 ///< for a damaged one and the one after it
};

/// Sweep over one line.
struct SweepObservation {
  std::vector<FrameObservation> frames;  ///< in order of arrival
  std::vector<LineMove> motion;
  ClockOffset arrival_offset;  ///< as measured near this sweep
  /// Absent: taken from arrivals, which are never early.
  std::optional<ClockOffset> captured_offset;
};

/// The longest latency: of camera and, without capture times, delivery.
inline constexpr double kLongestLatency_s = 0.25;
/// Frames of a standing head that are wanted at either end of a sweep.
inline constexpr std::size_t kMinStill = 5;

enum class FrameMotion {
  kStanding,  ///< the head stands, or might within the uncertainty of the time
  kRamp,      ///< it speeds up or slows down, or might
  kSteady,    ///< certainly within the stretch of constant speed: the only frames to score
  kUnplaced,  ///< its time is too uncertain (see FrameTiming::note)
};

[[nodiscard]] const char* ToString(FrameMotion motion);

struct FrameTiming {
  double time_s = 0;             ///< capture time, motion's clock
  double position_mm = 0;        ///< along the printed line, from its printed start
  double position_sigma_mm = 0;  ///< standard uncertainty (k = 1), the common latency included
  FrameMotion motion = FrameMotion::kUnplaced;
  std::string note;  ///< why it is unplaced, or other irregularity; else empty
};

struct SweepTiming {
  std::vector<FrameTiming> frames;  ///< one per frame observed
};

struct SessionTiming {
  Measured latency_s;  ///< good: positions exist; its value is the latency of assumption 1
  std::vector<SweepTiming> sweeps;   ///< empty unless latency_s is good
  std::vector<std::string> notices;  ///< for the user; not faults
};

/// Finds the latency from the moments at which the picture begins and ceases to change in all
/// sweeps together, and from it every frame's position.
/// @param sweeps  1 … of one session: one camera connection, so that the latency is common to them.
///                More sweeps, or slower ramps, make the latency more certain.
/// @param nominal_frames_per_s  [1, 1000]: what the camera was asked for; halved and doubled rates
///                              are recognised
/// @returns latency_s refused where an assumption is contradicted, cannot_tell where it is not
///          determined to 20 ms.
/// Accuracy: sweep_timing_test prints position errors beside the stated uncertainties.
[[nodiscard]] SessionTiming MatchSweeps(std::span<const SweepObservation> sweeps,
                                        double nominal_frames_per_s = 30);

}  // namespace trammel::pressure_advance
