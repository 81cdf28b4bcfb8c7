// Reads the frames' time stamps, and how late frames come.
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

/// Measures it from capture times where all frames have them, else from the gaps between arrivals.
/// @param nominal_frames_per_s  > 0; what the camera was asked for: a camera that takes fewer all
///                              the time loses none.
[[nodiscard]] Lateness MeasureLateness(const SweepObservation& sweep, double nominal_frames_per_s);

/// "frames came up to 186 ms late and 12 of 140 never came: this computer, or the camera's, is too
/// busy"; empty where that is usual for a camera.
[[nodiscard]] std::string NameBusyComputer(const Lateness& lateness);

/// What to do about it, where slower sweeps were tried already.
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
  double track_sigma_s = 0;  ///< of the sweep's stamps as a whole, against the other sweeps'
  double clock_sigma_s = 0;  ///< of the relation to the motion's clock
};

/// Stamps from capture times where all sweeps have sound ones, else from a regular clock behind the
/// arrivals. Errors (kMeasurement) carry the reason for refusing.
[[nodiscard]] Result<std::vector<FrameStamps>> StampFrames(std::span<const SweepObservation> sweeps,
                                                           double nominal_frames_per_s,
                                                           std::vector<std::string>& notices);

}  // namespace trammel::pressure_advance
