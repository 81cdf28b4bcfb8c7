#include "tool_offset/reading/comb_signal.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "tool_offset/reading/leg_reader.h"

namespace trammel::tool_offset {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

/// Mean ink along the axis over the rows from low to high along the legs; paper is 0.
std::vector<double> MeanInk(const PageView& page, const ChannelMix& mix, const PageMap& map,
                            const Structure& structure, const CombSignal& signal, int count,
                            double low_mm, double high_mm) {
  constexpr double kRow_mm = 0.1;
  const bool is_x = structure.axis == Axis::kX;
  const int rows = std::max(2, static_cast<int>((high_mm - low_mm) / kRow_mm) + 1);
  std::vector<double> ink;
  std::vector<float> samples;
  for (int i = 0; i < count; ++i) {
    // The page may bend: each column is laid by itself.
    const double along_mm = signal.from_mm + i * signal.step_mm;
    const auto at = [&](double across_mm) {
      return map.ToPage(
          is_x ? SheetPoint{structure.middle.u_mm + along_mm, structure.middle.v_mm + across_mm}
               : SheetPoint{structure.middle.u_mm + across_mm, structure.middle.v_mm + along_mm});
    };
    const PagePoint start = at(low_mm);
    const Strip strip{start, (1.0 / (rows - 1)) * (at(high_mm) - start), {}, rows, 1};
    if (!SampleStrip(page, mix, strip, samples)) return {};
    double sum = 0;
    for (const float sample : samples) sum += static_cast<double>(sample);
    ink.push_back(sum / rows);
  }
  std::vector<double> sorted = ink;
  const auto paper = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 5);
  std::nth_element(sorted.begin(), paper, sorted.end());
  const double level = *paper;
  for (double& value : ink) value -= level;
  return ink;
}

/// The signal's share of a wave with fingers of pitch / harmonic, Hann-windowed over [from, to].
std::complex<double> Quadrature(const CombSignal& signal, const std::vector<double>& ink,
                                double pitch_mm, int harmonic, double planned_mm, double from_mm,
                                double to_mm) {
  std::complex<double> sum = 0;
  double weights = 0;
  for (std::size_t i = 0; i < ink.size(); ++i) {
    const double at_mm = signal.from_mm + static_cast<double>(i) * signal.step_mm;
    if (at_mm <= from_mm || at_mm >= to_mm) continue;
    const double weight = (1 - std::cos(kTurn * (at_mm - from_mm) / (to_mm - from_mm))) / 2;
    sum += weight * ink[i] * std::polar(1.0, kTurn * harmonic * (at_mm - planned_mm) / pitch_mm);
    weights += weight;
  }
  return sum / std::max(1e-12, weights);
}

void Detect(const SheetSettings& settings, std::size_t comb, CombSignal& signal) {
  CombPhase& phase = signal.comb[comb];
  const double pitch_mm = settings.pitch_mm;
  // Where a finger of this comb lies, from the structure's middle.
  const double planned_mm = pitch_mm * (-(settings.teeth - 1) / 2.0 + (comb == 0 ? -0.25 : 0.25));
  const double half_mm = settings.teeth * pitch_mm / 2;
  const double middle_mm = planned_mm + (settings.teeth - 1) / 2.0 * pitch_mm;
  for (int h = 1; h <= kHarmonics; ++h) {
    const std::complex<double> share = Quadrature(signal, phase.ink, pitch_mm, h, planned_mm,
                                                  middle_mm - half_mm, middle_mm + half_mm);
    // Two legs: a harmonic may be negative by itself.
    const double sign = std::cos(kTurn * h * settings.leg_spacing_mm / 2 / pitch_mm) < 0 ? -1 : 1;
    phase.amplitude[static_cast<std::size_t>(h - 1)] = std::abs(share);
    phase.phase_rad[static_cast<std::size_t>(h - 1)] = std::arg(sign * share);
  }
  for (int finger = 0; finger < settings.teeth; ++finger) {
    const double at_mm = planned_mm + finger * pitch_mm;
    const std::complex<double> share =
        Quadrature(signal, phase.ink, pitch_mm, 1, planned_mm, at_mm - pitch_mm, at_mm + pitch_mm);
    phase.local_mm.push_back(std::arg(share) / kTurn * pitch_mm);
  }
}

void Compare(double pitch_mm, CombSignal& signal) {
  double weights = 0;
  for (std::size_t h = 0; h < kHarmonics; ++h) {
    const double difference =
        std::remainder(signal.comb[1].phase_rad[h] - signal.comb[0].phase_rad[h], kTurn);
    const double order = static_cast<double>(h) + 1;
    signal.offset_mm[h] = difference / kTurn * pitch_mm / order;
    const double weight =
        std::pow(order * std::min(signal.comb[0].amplitude[h], signal.comb[1].amplitude[h]), 2);
    signal.combined_offset_mm += weight * signal.offset_mm[h];
    weights += weight;
  }
  signal.combined_offset_mm /= std::max(1e-12, weights);
}

}  // namespace

std::optional<CombSignal> ReadCombSignal(const PageView& page, const PageMap& map,
                                         const SheetPlan& plan, const Structure& structure,
                                         const std::array<ChannelMix, 2>& mix,
                                         const std::array<SheetPoint, 2>& shift) {
  const SheetSettings& settings = plan.settings;
  const LocalMap local = map.Near(structure.middle);
  const bool is_x = structure.axis == Axis::kX;
  const double half_mm = (settings.teeth + 1) * settings.pitch_mm / 2;
  CombSignal signal;
  signal.step_mm = 1 / Length(is_x ? local.u_px_mm : local.v_px_mm);
  signal.from_mm = -half_mm;
  const int count = static_cast<int>(2 * half_mm / signal.step_mm) + 1;
  const double inner_mm = settings.overlap_mm / 2;
  const double outer_mm = settings.leg_length_mm - inner_mm;
  const auto across = [&](std::size_t comb) { return is_x ? shift[comb].v_mm : shift[comb].u_mm; };
  const std::size_t low = structure.FromLowSide(0) ? 0 : 1;
  const std::array<double, 2> from_mm{-outer_mm + across(low), inner_mm + across(low)};
  const std::array<double, 2> to_mm{-inner_mm + across(1 - low), outer_mm + across(1 - low)};
  for (const std::size_t comb : {std::size_t{0}, std::size_t{1}}) {
    const std::size_t side = comb == low ? 0 : 1;
    signal.comb[comb].ink =
        MeanInk(page, mix[comb], map, structure, signal, count, from_mm[side] + kLegEnd_mm,
                std::max(from_mm[side] + kLegEnd_mm + 0.2, to_mm[side] - kLegEnd_mm));
    if (signal.comb[comb].ink.empty()) return std::nullopt;
    Detect(settings, comb, signal);
  }
  signal.overlap = MeanInk(page, mix[0], map, structure, signal, count, -inner_mm + kLegEnd_mm,
                           inner_mm - kLegEnd_mm);
  if (signal.overlap.empty()) return std::nullopt;
  Compare(settings.pitch_mm, signal);
  return signal;
}

}  // namespace trammel::tool_offset
