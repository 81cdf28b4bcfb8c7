#include "sim/cell/cell_dynamics.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trammel::sim {
namespace {

constexpr double kGravityMmS2 = 9806.65;

}  // namespace

double StructureMode::Advance(const DisturbanceTraits& traits, double bed_g,
                              double acceleration_mm_s2, double dt_s) {
  const double rest_g = traits.mode_share * bed_g;
  if (!begun_) {
    begun_ = true;
    force_g_ = rest_g;
    return 0;
  }
  const double goal_g = rest_g + traits.mode_mass_g * acceleration_mm_s2 / kGravityMmS2;
  const double w = 2 * std::numbers::pi * traits.mode_hz;
  const double fading = traits.mode_damping * w;
  const double swing = w * std::sqrt(1 - traits.mode_damping * traits.mode_damping);
  const double kept = std::exp(-fading * dt_s);
  const double c = std::cos(swing * dt_s);
  const double s = std::sin(swing * dt_s) / swing;
  const double off_g = force_g_ - goal_g;
  const double rate_g_s = rate_g_s_;
  force_g_ = goal_g + kept * (off_g * c + (rate_g_s + fading * off_g) * s);
  rate_g_s_ = kept * (rate_g_s * c - (fading * rate_g_s + w * w * off_g) * s);
  return force_g_ - rest_g;
}

PinkNoise::PinkNoise(double rate_hz, Random random) : random_(random) {
  constexpr double kLowestHz = 0.02;
  constexpr double kApart = 4;
  for (double corner_hz = 0.5 * rate_hz; corner_hz > kLowestHz; corner_hz /= kApart) {
    kept_.push_back(std::exp(-2 * std::numbers::pi * corner_hz / rate_hz));
    values_.push_back(random_.Normal());
  }
}

double PinkNoise::Next() {
  double sum = 0;
  for (std::size_t i = 0; i < values_.size(); ++i) {
    values_[i] = values_[i] * kept_[i] + std::sqrt(1 - kept_[i] * kept_[i]) * random_.Normal();
    sum += values_[i];
  }
  return sum / std::sqrt(static_cast<double>(values_.size()));
}

double PlasticStrand::Pull(const PressTraits& traits, double gap_mm) {
  if (gap_mm <= 0) {
    fast_ = true;
    return 0;
  }
  if (gap_mm >= traits.strand_snap_mm) fast_ = false;
  if (!fast_) return 0;
  return traits.strand_g * (1 - std::exp(-gap_mm / traits.strand_onset_mm)) *
         traits.strand_length_mm / (traits.strand_length_mm + gap_mm);
}

double Slip::Force(const DisturbanceTraits& traits, double gap_mm, double dt_s) {
  if (gap_mm < std::min(0.0, traits.slip_above_mm)) armed_ = true;
  if (armed_ && gap_mm >= traits.slip_above_mm) {
    armed_ = false;
    slips_ += 1;
  }
  gone_ += (slips_ - gone_) * (1 - std::exp(-dt_s / traits.slip_s));
  return -traits.slip_g * gone_;
}

double CellMemory::Advance(const ConverterTraits& traits, double load_g, double dt_s) {
  if (!begun_) {
    begun_ = true;
    slow_g_ = load_g;
  }
  slow_g_ += (load_g - slow_g_) * (1 - std::exp(-dt_s / traits.creep_s));
  peak_g_ = load_g > 0 ? std::max(peak_g_, load_g) : 0;
  const double kept_g = peak_g_ > 0 ? 4 * load_g * (1 - load_g / peak_g_) : 0;
  return load_g + traits.creep_share * (slow_g_ - load_g) + traits.hysteresis_share * kept_g;
}

}  // namespace trammel::sim
