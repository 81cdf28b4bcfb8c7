#include "sim/klipper/cell_probe.h"

#include <algorithm>
#include <cmath>

namespace trammel::sim {
namespace {

constexpr double kKeptS = 30;
constexpr double kTareS = 1.0 / 15;  // Klipper's tare_time: four periods of 60 Hz

// Rounds like Klipper's times and forces.
double Rounded(double value) { return std::round(value * 1e6) / 1e6; }

}  // namespace

CellProbe::CellProbe(const LoadCellConfig& config)
    : config_(config),
      random_(Random(config.seed).Fork(1)),
      cell_(config.cell, 0, Random(config.seed).Fork(2)),
      corruptor_(config.cell, 0, Random(config.seed).Fork(3)),
      tare_counts_(
          std::llround(config.cell.converter.offset_g * config.cell.converter.counts_per_g)) {}

void CellProbe::Advance(double print_time_s, const NozzleAt& nozzle) {
  while (cell_.next_time_s() <= print_time_s) {
    CellSample sample = cell_.Next(nozzle);
    if (!corruptor_.Pass(sample)) continue;
    const double counts = static_cast<double>(sample.counts - tare_counts_);
    readings_.push_back({Rounded(sample.time_s),
                         Rounded(counts / config_.cell.converter.counts_per_g), sample.counts,
                         tare_counts_});
  }
  while (!readings_.empty() && readings_.front().time_s < print_time_s - kKeptS) {
    readings_.pop_front();
    ++forgotten_;
  }
  const std::vector<PressTruth> ended = cell_.TakePresses();
  presses_.insert(presses_.end(), ended.begin(), ended.end());
}

double CellProbe::SurfaceZ(double x_mm, double y_mm) const {
  return config_.surface_z_mm + config_.tilt_x * x_mm + config_.tilt_y * y_mm;
}

double CellProbe::NextHaltZ(const TapMotion& motion, double x_mm, double y_mm) {
  return HaltZ(config_.cell, motion, SurfaceZ(x_mm, y_mm), random_);
}

void CellProbe::Tare(double print_time_s) {
  double sum = 0;
  int samples = 0;
  for (auto reading = readings_.rbegin();
       reading != readings_.rend() && reading->time_s > print_time_s - kTareS; ++reading) {
    sum += static_cast<double>(reading->counts);
    ++samples;
  }
  if (samples > 0) tare_counts_ = std::llround(sum / samples);
  corruptor_ = SampleCorruptor(config_.cell, print_time_s, Random(random_.Bits()));
}

std::optional<PressTruth> CellProbe::EndedPress(double since_s) const {
  if (presses_.empty() || presses_.back().touch_time_s < since_s) return std::nullopt;
  return presses_.back();
}

ProbedTap CellProbe::Collect(double from_s, double until_s) {
  ProbedTap tap;
  for (const ForceReading& reading : readings_) {
    if (reading.time_s < from_s || reading.time_s > until_s) continue;
    tap.time_s.push_back(reading.time_s);
    tap.force_g.push_back(reading.force_g);
  }
  for (const PressTruth& press : presses_) {
    if (press.touch_time_s >= from_s) tap.truth = press;
  }
  presses_.clear();
  tap.latency_s = latency_s();
  return tap;
}

}  // namespace trammel::sim
