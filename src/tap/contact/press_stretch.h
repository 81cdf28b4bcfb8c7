// Samples of the pull-back's cruise, for the fit.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "tap/contact/press_profile.h"
#include "tap/samples/corruption.h"
#include "tap/samples/motion.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

/// Minimum number of samples for a fit of the break: five below, four above and some to choose
/// between.
inline constexpr std::size_t kMinInCruise = 14;

/// Samples of the cruise, and values computed from them.
struct PressStretch {
  std::span<double> time_s;
  std::span<double> y;
  std::span<double> force;
  std::span<double> weight;  // used once `weighted`
  std::span<double> residual;
  std::span<double> scratch;
  bool weighted = false;
  double z0_mm = 0;    // height of y = 0
  double span_mm = 0;  // y = 0 to y = 1
  double mean_g = 0;
  double sign = 1;  // press force sign

  [[nodiscard]] std::array<std::span<double>*, 6> Arrays() {
    return {&time_s, &y, &force, &weight, &residual, &scratch};
  }
  [[nodiscard]] double Z(double t) const { return z0_mm + span_mm * t; }
  [[nodiscard]] BreakSamples Samples() const {
    return {y, force, weighted ? std::span<const double>(weight) : std::span<const double>()};
  }
};

/// Selects the samples whose force acted during the cruise; false if there are too few.
[[nodiscard]] bool SelectCruise(const CleanTap& clean, const TapMotion& motion, double latency_s,
                                Workspace& workspace, PressStretch& stretch);

/// Removes the first `count` samples: y starts from 0 again.
void TrimStart(std::size_t count, PressStretch& stretch);

/// Shortens a baseline that is much longer than the press. More of it hardly improves the break (by
/// 4 % of its scatter from five presses on), and unrelated drift disturbs it.
void CropBaseline(PressStretch& stretch, Workspace& workspace);

}  // namespace trammel::tap
