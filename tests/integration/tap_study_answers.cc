#include "tap_study_answers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tap/samples/finding.h"

namespace trammel {
namespace {

constexpr std::array<PressModel, 4> kModels = {{{false, 1}, {true, 1}, {true, 2}, {true, 3}}};

}  // namespace

double TapAnswers::Coverage() const {
  return covered / std::max(1.0, static_cast<double>(error_um.size()));
}

double TapAnswers::Worst() const {
  double worst_um = 0;
  for (const double error : error_um) worst_um = std::max(worst_um, std::abs(error));
  return worst_um;
}

double TapAnswers::ShareWithin(double limit_um) const {
  const auto within = std::count_if(error_um.begin(), error_um.end(),
                                    [&](double e) { return std::abs(e) <= limit_um; });
  return static_cast<double>(within) / taps();
}

std::string TapAnswers::Reasons(std::size_t count) const {
  std::vector<std::pair<int, std::string>> sorted;
  for (const auto& [name, times] : reasons) sorted.emplace_back(times, name);
  std::sort(sorted.rbegin(), sorted.rend());
  std::string text;
  for (std::size_t i = 0; i < std::min(count, sorted.size()); ++i) {
    text += fmt::format("{}{} {:.0f} %", text.empty() ? "" : ", ", sorted[i].second,
                        100.0 * sorted[i].first / taps());
  }
  return text.empty() ? "-" : text;
}

std::string TapAnswers::WorstSeeds(std::size_t count) const {
  std::vector<std::pair<double, std::uint64_t>> outside;
  for (std::size_t i = 0; i < error_um.size(); ++i) {
    const double ratio = std::abs(error_um[i]) / half_width_um[i];
    if (!(ratio <= 1)) outside.emplace_back(ratio, seed[i]);
  }
  std::sort(outside.rbegin(), outside.rend());
  std::string text;
  for (std::size_t i = 0; i < std::min(count, outside.size()); ++i) {
    text +=
        fmt::format("{}{} x{:.1f}", text.empty() ? "" : ", ", outside[i].second, outside[i].first);
  }
  return text.empty() ? "-" : text;
}

double TapBounds::Fitted(const tap::FittedForce& force) const {
  int terms = 1;
  for (std::size_t i = 0; i < force.press_g.size(); ++i) {
    if (force.press_g[i] != 0) terms = static_cast<int>(i) + 1;
  }
  return um[static_cast<std::size_t>(std::clamp(terms, 1, 3))];
}

TapBounds BoundsOf(const TapRow& row, const sim::SimulatedTap& tap) {
  std::vector<double> heights_mm;
  for (const double time_s : tap.time_s) {
    if (time_s < tap.moves[4].start_time_s) continue;
    heights_mm.push_back(sim::StateAt(tap.moves, time_s).z_mm - tap.truth->contact_z_mm);
  }
  TapBounds bounds;
  for (std::size_t i = 0; i < kModels.size(); ++i) {
    bounds.um[i] = kUmPerMm * ContactBound(heights_mm, row.cell.disturbance.noise_g,
                                           row.cell.press.law, kModels[i]);
  }
  return bounds;
}

QuietPress QuietTap::Press() const {
  constexpr std::size_t kLeast = 6;
  if (height_mm.size() < kLeast) return {};
  const std::span<const double> force_g(tap.force_g);
  return {height_mm, force_g.subspan(first, height_mm.size()), noise_g};
}

QuietTap TakeQuietTap(TapRow row, std::uint64_t seed) {
  QuietTap quiet;
  quiet.noise_g = std::hypot(row.cell.disturbance.noise_g,
                             1 / (std::sqrt(12.0) * row.cell.converter.counts_per_g));
  row.cell.disturbance.noise_g = 0;
  quiet.tap = SimulateRow(row, seed);
  const sim::SimulatedTap& tap = quiet.tap;
  if (!tap.truth) return quiet;
  const double late_s = row.latency_known ? tap.latency_s : 0;
  const double from_s = tap.moves[4].start_time_s;
  const double until_s = tap.moves.back().start_time_s;
  for (std::size_t i = 0; i < tap.time_s.size(); ++i) {
    const double acted_s = tap.time_s[i] - late_s;
    if (acted_s < from_s || acted_s > until_s) continue;
    if (quiet.height_mm.empty()) quiet.first = i;
    quiet.height_mm.push_back(sim::StateAt(tap.moves, acted_s).z_mm - tap.truth->contact_z_mm);
  }
  return quiet;
}

void Add(const tap::TapAnalysis& analysis, double contact_z_mm, std::uint64_t seed,
         TapAnswers& answers) {
  if (analysis.verdict != Verdict::kGood) {
    ++answers.refused;
    ++answers.reasons[std::string(tap::Name(analysis.reason.code))];
    return;
  }
  answers.seed.push_back(seed);
  answers.error_um.push_back(kUmPerMm * (analysis.contact_z_mm - contact_z_mm));
  answers.half_width_um.push_back(kUmPerMm * 0.5 *
                                  (analysis.interval95_mm.hi - analysis.interval95_mm.lo));
  answers.covered +=
      analysis.interval95_mm.lo <= contact_z_mm && contact_z_mm <= analysis.interval95_mm.hi;
}

RowAnswers StudyRow(TapRow row, int taps, std::uint64_t first_seed,
                    std::span<const tap::Method> methods) {
  RowAnswers answers;
  answers.of.resize(methods.size());
  for (int i = 0; i < taps; ++i) {
    const std::uint64_t seed = first_seed + static_cast<std::uint64_t>(i);
    const sim::SimulatedTap simulated = SimulateRow(row, seed);
    const std::vector<tap::Move> moves = MovesOf(simulated);
    const double contact_z_mm = simulated.truth ? simulated.truth->contact_z_mm : std::nan("");
    TapBounds bounds;
    if (simulated.truth) bounds = BoundsOf(row, simulated);
    for (std::size_t b = 0; b < bounds.um.size(); ++b) answers.bound_um[b] += bounds.um[b] / taps;
    for (std::size_t m = 0; m < methods.size(); ++m) {
      tap::TapOptions options;
      options.method = methods[m];
      if (row.latency_known) options.latency_s = std::max(0.0, simulated.latency_s);
      tap::TapAnalyser analyser(options);
      const auto analysis = analyser.Analyse({simulated.time_s, simulated.force_g, moves});
      TapAnswers& of = answers.of[m];
      Add(analysis, contact_z_mm, seed, of);
      if (analysis.verdict == Verdict::kGood && analysis.force.fitted) {
        of.bound_um.push_back(bounds.Fitted(analysis.force));
      }
    }
  }
  return answers;
}

}  // namespace trammel
