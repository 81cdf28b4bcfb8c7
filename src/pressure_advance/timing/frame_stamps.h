// Reads the frames' time stamps and their lateness.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "pressure_advance/timing/sweep_timing.h"

namespace trammel::pressure_advance {

struct Lateness {
  double late_s = 0;  ///< delay of the latest frame beyond the promptest one's
  std::size_t frames = 0;
  std::size_t lost = 0;  ///< frames that the camera should have taken between them
};

/// Measures lateness from capture times if all frames have them, else from the gaps between
/// arrivals.
/// @param nominal_frames_per_s  > 0; the requested rate: a camera with a constantly lower rate
///                              loses no frames.
[[nodiscard]] Lateness MeasureLateness(const SweepObservation& sweep, double nominal_frames_per_s);

/// "frames came up to 186 ms late and 12 of 140 never came: this computer, or the camera's, is too
/// busy"; empty where that is usual for a camera.
[[nodiscard]] std::string NameBusyComputer(const Lateness& lateness);

/// Remedy if slower sweeps were tried already.
inline constexpr const char* kBusyComputerRemedy =
    "end other work on it and scan again, or set a lower [scan] speed";

struct FrameStamp {
  double stamp_s = 0;
  double sigma_s = 0;  ///< against the other stamps of the sweep
  std::string note;    ///< not empty: the stamp cannot be used, and why
};

struct FrameStamps {
  std::vector<FrameStamp> frames;
  double period_s = 0;
  double track_sigma_s = 0;  ///< common to the sweep's stamps, relative to other sweeps
  double clock_sigma_s = 0;  ///< of the relation to the motion's clock
};

/// Computes stamps from capture times if all sweeps have sound ones, else from a regular clock
/// fitted to the arrivals. Errors (kMeasurement) contain the reason.
[[nodiscard]] Result<std::vector<FrameStamps>> StampFrames(std::span<const SweepObservation> sweeps,
                                                           double nominal_frames_per_s,
                                                           std::vector<std::string>& notices);

}  // namespace trammel::pressure_advance
