// Draws the noise of a load cell by frequency.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "document/plot.h"
#include "tap/report/tap_figures.h"

namespace trammel::report {
namespace {

Canvas Draw(const tap::NoiseSpectrum& spectrum, double width_px) {
  constexpr double kHeightPx = 360;
  constexpr std::size_t kMaxLabels = 6;
  std::vector<DataPoint> curve;
  std::vector<DataPoint> limit;
  for (std::size_t i = 0; i < spectrum.frequency_hz.size(); ++i) {
    limit.push_back({spectrum.frequency_hz[i], spectrum.limit_g[i]});
    curve.push_back({spectrum.frequency_hz[i], spectrum.amplitude_g[i]});
  }
  const double top_g = *std::max_element(spectrum.amplitude_g.begin(), spectrum.amplitude_g.end());
  const double limit_g = *std::max_element(spectrum.limit_g.begin(), spectrum.limit_g.end());
  const Range amplitude{0, std::max(top_g, limit_g) * 1.25 + 1e-9};
  const LegendEntry legend[] = {
      {fmt::format("{} stretch{} at {:.0f} samples/s, {:.2f} gf in all", spectrum.stretches,
                   spectrum.stretches == 1 ? "" : "es", spectrum.sample_rate_hz, spectrum.noise_g),
       LegendEntry::Mark::kLine,
       {.color = kBlue}},
      {"limit for a line", LegendEntry::Mark::kLine, {.color = kMuted, .dash_px = {5, 4}}}};
  Canvas canvas(width_px, kHeightPx);
  const double top = 8 + DrawLegend(canvas, {12, 20}, width_px - 24, legend);
  const Range frequency{0, spectrum.frequency_hz.back()};
  Plot plot(canvas, {6, top, width_px - 12, kHeightPx - top - 4},
            {"frequency (Hz)", frequency, width_px < kFigureWidthPx ? 5 : 8},
            {"amplitude (gf)", amplitude}, "Noise while nothing touches");
  plot.Line(limit, {.color = kMuted, .width_px = 1, .dash_px = {5, 4}});
  plot.Line(curve, {.color = kBlue, .width_px = 1.5});
  for (std::size_t i = 0; i < std::min(kMaxLabels, spectrum.lines.size()); ++i) {
    const tap::NoiseLine& line = spectrum.lines[i];
    plot.Dot({line.frequency_hz, line.amplitude_g}, 4, kPaper, Stroke{.color = kVermilion});
    const bool left = line.frequency_hz > 0.7 * frequency.hi;
    const std::string name = line.source == tap::NoiseSource::kUnknown ? "" : tap::Describe(line);
    canvas.Text({plot.X(line.frequency_hz) + (left ? -7 : 7), plot.Y(line.amplitude_g) - 7},
                fmt::format("{:.1f} Hz{}{}", line.frequency_hz, name.empty() ? "" : ": ", name),
                {.size_px = 11.5, .align = left ? Align::kEnd : Align::kStart});
  }
  return canvas;
}

}  // namespace

std::optional<Figure> NoiseFigure(const tap::NoiseSpectrum& spectrum) {
  if (spectrum.frequency_hz.size() < 2) return std::nullopt;
  Figure figure{"noise",
                "Amplitude of a sine at each frequency, before the collision and after the "
                "pull-back. Mains hum comes through cables and power supplies, and is seen at its "
                "alias where it is faster than half the sample rate; heaters switch in cycles of a "
                "tenth of a second.",
                Draw(spectrum, kFigureWidthPx)};
  figure.seen = fmt::format(
      "Amplitude of the cell's noise against frequency up to {:.0f} Hz; {} line{} above the limit.",
      spectrum.frequency_hz.back(), spectrum.lines.size(), spectrum.lines.size() == 1 ? "" : "s");
  figure.narrow = Draw(spectrum, kNarrowWidthPx);
  return figure;
}

}  // namespace trammel::report
