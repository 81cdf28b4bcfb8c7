#include "tap/report/tap_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "document/interval_text.h"
#include "tap/samples/finding.h"

namespace trammel::report {
namespace {

std::string Um(double mm) { return fmt::format("{:.2f} µm", mm * kUmPerMm); }

std::string Notices(const AnalysedTap& tap, std::string_view before) {
  std::string text;
  for (const tap::Finding& notice : tap.analysis.Notices()) {
    text += fmt::format("{}{}\n", before, tap::Explain(notice));
  }
  for (const std::string& notice : tap.recording.notices) {
    text += fmt::format("{}{}\n", before, notice);
  }
  return text;
}

void AddTrend(std::vector<EnsembleRow>& rows, const char* name,
              const std::optional<tap::Trend>& trend, const char* per, double factor) {
  if (!trend) return;
  const IntervalStyle style{.unit = fmt::format("µm per {}", per),
                            .scale = factor * kUmPerMm,
                            .min_decimals = 1,
                            .signs = true};
  rows.push_back({name, fmt::format("{}, {}", WithInterval(trend->slope, style),
                                    trend->significant ? "significant" : "not significant")});
}

}  // namespace

std::string ContactText(const tap::TapAnalysis& analysis) {
  return WithInterval(analysis.contact_mm, kMillimetres);
}

std::string TapText(const AnalysedTap& tap) {
  const tap::TapAnalysis& analysis = tap.analysis;
  const bool good = analysis.verdict == Verdict::kGood;
  std::string text = fmt::format("tap               {}\n", tap.recording.name);
  if (good) {
    text += fmt::format("contact z         {}\n", ContactText(analysis));
    text += fmt::format("contact time      {:.4f} s\n", analysis.contact_time_s);
  }
  if (std::isfinite(analysis.quality)) {
    text += fmt::format("quality           {:.0f} of 100\n", analysis.quality);
  }
  if (std::isfinite(analysis.noise_g)) {
    text += fmt::format("noise             {:.2f} gf\n", analysis.noise_g);
  }
  if (tap.recording.firmware_z_mm) {
    text += fmt::format("printer's own z   {:.4f} mm", *tap.recording.firmware_z_mm);
    if (good) {
      text += fmt::format(" ({:+.4f} mm from ours)",
                          *tap.recording.firmware_z_mm - analysis.contact_mm.value);
    }
    text += '\n';
  }
  text += fmt::format("method            {}\n", tap::ToString(analysis.method));
  text += Notices(tap, "notice            ");
  text += fmt::format("verdict           {}\n", VerdictText(analysis.verdict));
  if (!good) text += fmt::format("because           {}\n", tap::Explain(analysis.reason));
  return text;
}

std::string TapLine(const AnalysedTap& tap) {
  const tap::TapAnalysis& analysis = tap.analysis;
  const std::string quality =
      std::isfinite(analysis.quality) ? fmt::format("{:3.0f}", analysis.quality) : "  –";
  if (analysis.verdict == Verdict::kGood) {
    return fmt::format("{:>42}   quality {}   {}\n{}", ContactText(analysis), quality,
                       tap.recording.name, Notices(tap, "    notice: "));
  }
  return fmt::format("{:>42}   quality {}   {}\n    because: {}\n{}", VerdictText(analysis.verdict),
                     quality, tap.recording.name,
                     tap.unread.empty() ? tap::Explain(analysis.reason) : tap.unread,
                     Notices(tap, "    notice: "));
}

std::optional<Quantity> HeightAtOnePlace(const tap::Ensemble& ensemble) {
  if (ensemble.places.size() != 1 || ensemble.places.front().taps < 2) return std::nullopt;
  return ensemble.places.front().z_mm;
}

std::vector<EnsembleRow> EnsembleRows(const tap::Ensemble& ensemble) {
  std::vector<EnsembleRow> rows = {
      {"taps", fmt::format("{}, {} good, {} used", ensemble.taps, ensemble.good, ensemble.used)}};
  if (ensemble.places.size() > 1) {
    rows.push_back({"places", fmt::format("{}; scatter is that about the mean of each",
                                          ensemble.places.size())});
  }
  if (std::isfinite(ensemble.standard_deviation_mm)) {
    rows.push_back({"range", Um(ensemble.range_mm)});
    rows.push_back({"deviation", fmt::format("{}, where the taps themselves claim {}",
                                             Um(ensemble.standard_deviation_mm),
                                             Um(ensemble.predicted_deviation_mm))});
    rows.push_back({"mean step", Um(ensemble.mean_step_mm)});
  }
  constexpr double kSecondsPerMinute = 60;
  AddTrend(rows, "drift with time", ensemble.with_time, "minute", kSecondsPerMinute);
  AddTrend(rows, "with temperature", ensemble.with_temperature, "°C", 1);
  return rows;
}

std::string EnsembleText(const tap::Ensemble& ensemble, std::span<const AnalysedTap> taps) {
  std::string text;
  if (const auto height = HeightAtOnePlace(ensemble)) {
    text += fmt::format("contact z         {}, mean of {} taps\n",
                        WithInterval(*height, kMillimetres), ensemble.used);
  }
  for (const EnsembleRow& row : EnsembleRows(ensemble)) {
    text += fmt::format("{:<18}{}\n", row.name, row.words);
  }
  for (const std::size_t outlier : ensemble.outliers) {
    if (outlier >= taps.size()) continue;
    text += fmt::format("outlier           {} at {:.4f} mm\n", taps[outlier].recording.name,
                        taps[outlier].analysis.contact_mm.value);
  }
  return text;
}

}  // namespace trammel::report
