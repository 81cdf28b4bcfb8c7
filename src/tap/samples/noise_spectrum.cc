#include "tap/samples/noise_spectrum.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <optional>

#include "base/statistics.h"
#include "tap/samples/finding.h"
#include "tap/samples/motion.h"

namespace trammel::tap {
namespace {

constexpr std::size_t kFrequencies = 512;
constexpr std::size_t kMinSamples = 32;
constexpr std::size_t kMaxSpectrumSamples = 1024;
constexpr std::size_t kMaxStretches = 200;
constexpr std::size_t kMaxLines = 12;
/// Resolution of a Hann window, in bins of 1 / duration: it does not separate nearer lines.
constexpr double kHannResolution = 2;

struct Stretch {
  std::vector<double> time_s;
  std::vector<double> force_g;

  [[nodiscard]] double Duration() const { return time_s.back() - time_s.front(); }
};

/// Collects samples between the two times, if they are enough. Unsorted ones only cost a line.
void Collect(const TapView& tap, double from_s, double to_s, std::vector<Stretch>& stretches) {
  Stretch stretch;
  const std::size_t count = std::min(tap.time_s.size(), tap.force_g.size());
  for (std::size_t i = 0; i < count && stretch.time_s.size() < kMaxSpectrumSamples; ++i) {
    const double time = tap.time_s[i];
    if (!(time >= from_s && time <= to_s) || !std::isfinite(tap.force_g[i])) continue;
    if (!stretch.time_s.empty() && time <= stretch.time_s.back()) continue;
    stretch.time_s.push_back(time);
    stretch.force_g.push_back(tap.force_g[i]);
  }
  if (stretch.time_s.size() >= kMinSamples && stretches.size() < kMaxStretches) {
    stretches.push_back(std::move(stretch));
  }
}

/// Collects the stretches of a tap without contact.
void CollectFlat(const TapView& tap, std::vector<Stretch>& stretches) {
  constexpr double kBeforeHalt_s = 0.1;
  constexpr double kDeepestPress_mm = 0.2;
  constexpr double kFlatShare = 0.2;  // of the pull-back: a later break is refused anyway
  TapMotion motion;
  if (FindMotion(tap.moves, motion).code != FindingCode::kNone || tap.time_s.empty()) return;
  if (motion.has_approach) {
    const double press_s = std::max(kBeforeHalt_s, kDeepestPress_mm / motion.approach_speed_mm_s);
    Collect(tap, motion.approach_start_s, motion.approach_end_s - press_s, stretches);
  }
  const double cruise_s = motion.cruise_end_s - motion.cruise_start_s;
  Collect(tap, motion.cruise_end_s - kFlatShare * cruise_s, std::numeric_limits<double>::max(),
          stretches);
}

void TakeLine(Stretch& stretch) {
  const double middle_s = Mean(stretch.time_s);
  const double middle_g = Mean(stretch.force_g);
  double tt = 0;
  double tf = 0;
  for (std::size_t i = 0; i < stretch.time_s.size(); ++i) {
    stretch.time_s[i] -= middle_s;
    tt += stretch.time_s[i] * stretch.time_s[i];
    tf += stretch.time_s[i] * (stretch.force_g[i] - middle_g);
  }
  for (std::size_t i = 0; i < stretch.time_s.size(); ++i) {
    stretch.force_g[i] -= middle_g + tf / tt * stretch.time_s[i];
  }
}

/// Adds the stretch's squared amplitudes, weighted by its samples.
void AddSpectrum(const Stretch& stretch, double step_hz, std::vector<double>& squares) {
  using Complex = std::complex<double>;
  std::vector<Complex> sums(squares.size());
  double weights = 0;
  for (std::size_t i = 0; i < stretch.time_s.size(); ++i) {
    const double phase = stretch.time_s[i] / stretch.Duration();  // -0.5 … 0.5 about its middle
    const double weight = 0.5 + 0.5 * std::cos(2 * std::numbers::pi * std::clamp(phase, -0.5, 0.5));
    const Complex turn = std::polar(1.0, -2 * std::numbers::pi * step_hz * stretch.time_s[i]);
    Complex now = turn;
    weights += weight;
    for (Complex& sum : sums) {
      sum += weight * stretch.force_g[i] * now;
      now *= turn;
    }
  }
  for (std::size_t k = 0; k < squares.size(); ++k) {
    const double amplitude = 2 * std::abs(sums[k]) / weights;
    squares[k] += static_cast<double>(stretch.time_s.size()) * amplitude * amplitude;
  }
}

/// Returns the median of the neighbourhood: lines, which are narrow, do not raise it.
double FloorSquare(const std::vector<double>& squares, std::size_t at) {
  constexpr std::size_t kReach = kFrequencies / 10;
  const std::size_t first = at > kReach ? at - kReach : 0;
  const std::size_t end = std::min(squares.size(), at + kReach + 1);
  return Median(std::span(squares).subspan(first, end - first));
}

/// Returns the ratio to its median that a mean of `count` exponential values exceeds in one of
/// `one_in` cases (Wilson & Hilferty 1931).
double RareOverMedian(double count, double deviations) {
  const double ninth = 1 / (9 * count);
  const double rare = 1 - ninth + deviations * std::sqrt(ninth);
  const double median = 1 - ninth;
  return std::pow(rare / median, 3);
}

struct Source {
  NoiseSource source;
  double fundamental_hz;
  int max_harmonics;
};
constexpr Source kSources[] = {{NoiseSource::kMains50Hz, 50, 10},
                               {NoiseSource::kMains60Hz, 60, 10},
                               {NoiseSource::kHeater10Hz, 10, 4}};

/// Returns the apparent frequency after sampling.
double Alias(double frequency_hz, double rate_hz) {
  return std::abs(frequency_hz - std::round(frequency_hz / rate_hz) * rate_hz);
}

/// True if a line matches a source within half a resolution, and the mains' own wandering.
bool Fits(const NoiseLine& line, double true_hz, const NoiseSpectrum& spectrum) {
  constexpr double kWandering = 0.003;
  const double off = std::abs(Alias(true_hz, spectrum.sample_rate_hz) - line.frequency_hz);
  return off <= 0.5 * spectrum.resolution_hz + kWandering * true_hz;
}

bool HasLine(const NoiseSpectrum& spectrum, double true_hz) {
  return std::any_of(spectrum.lines.begin(), spectrum.lines.end(),
                     [&](const NoiseLine& line) { return Fits(line, true_hz, spectrum); });
}

/// Names a line. A high harmonic alone is ambiguous: the first or second must be present too, and a
/// source with its first is preferred to one with only its second.
void NameLine(NoiseLine& line, const NoiseSpectrum& spectrum) {
  constexpr int kWithoutFundamental = 100;
  int best = std::numeric_limits<int>::max();
  for (const Source& source : kSources) {
    const bool first = HasLine(spectrum, source.fundamental_hz);
    const bool second =
        source.source != NoiseSource::kHeater10Hz && HasLine(spectrum, 2 * source.fundamental_hz);
    if (!first && !second) continue;
    for (int harmonic = 1; harmonic <= source.max_harmonics; ++harmonic) {
      const double true_hz = harmonic * source.fundamental_hz;
      const int rank = harmonic + (first ? 0 : kWithoutFundamental);
      if (rank >= best || !Fits(line, true_hz, spectrum)) continue;
      best = rank;
      line.source = source.source;
      line.harmonic = harmonic;
      line.true_frequency_hz = true_hz;
    }
  }
}

void FindLines(NoiseSpectrum& spectrum) {
  std::vector<double> squares;
  for (const double amplitude : spectrum.amplitude_g) squares.push_back(amplitude * amplitude);
  // Maximum side lobe of a Hann window, as a share of a line's amplitude.
  constexpr double kSideLobe = 0.03;
  for (std::size_t k = 1; k + 1 < squares.size(); ++k) {
    const bool peak = squares[k] >= squares[k - 1] && squares[k] > squares[k + 1];
    const bool readable = spectrum.frequency_hz[k] >= spectrum.resolution_hz;
    if (!peak || !readable || spectrum.amplitude_g[k] < spectrum.limit_g[k]) continue;
    const double bend = squares[k - 1] - 2 * squares[k] + squares[k + 1];
    const double shift = bend < 0 ? 0.5 * (squares[k - 1] - squares[k + 1]) / bend : 0;
    const double step = spectrum.frequency_hz[1] - spectrum.frequency_hz[0];
    spectrum.lines.push_back({spectrum.frequency_hz[k] + shift * step, std::sqrt(squares[k]),
                              NoiseSource::kUnknown, 0, spectrum.frequency_hz[k] + shift * step});
  }
  std::stable_sort(
      spectrum.lines.begin(), spectrum.lines.end(),
      [](const NoiseLine& a, const NoiseLine& b) { return a.amplitude_g > b.amplitude_g; });
  std::vector<NoiseLine> kept;
  for (const NoiseLine& line : spectrum.lines) {
    const bool shadow = std::any_of(kept.begin(), kept.end(), [&](const NoiseLine& other) {
      const double away = std::abs(other.frequency_hz - line.frequency_hz);
      return away < spectrum.resolution_hz || (away < 5 * spectrum.resolution_hz &&
                                               line.amplitude_g < kSideLobe * other.amplitude_g);
    });
    if (!shadow && kept.size() < kMaxLines) kept.push_back(line);
  }
  spectrum.lines = std::move(kept);
  for (NoiseLine& line : spectrum.lines) NameLine(line, spectrum);
}

/// Returns the samples per second of a typical stretch.
double RateOf(const std::vector<Stretch>& stretches) {
  std::vector<double> steps;
  for (const Stretch& stretch : stretches) {
    for (std::size_t i = 1; i < stretch.time_s.size(); ++i) {
      steps.push_back(stretch.time_s[i] - stretch.time_s[i - 1]);
    }
  }
  return 1 / Median(steps);
}

}  // namespace

NoiseSpectrum FindNoise(std::span<const TapView> taps) {
  // One false line in a thousand spectra of some 250 independent frequencies each.
  constexpr double kRareDeviations = 4.46;
  std::vector<Stretch> stretches;
  for (const TapView& tap : taps) CollectFlat(tap, stretches);
  NoiseSpectrum spectrum;
  spectrum.stretches = stretches.size();
  if (stretches.empty()) return spectrum;
  spectrum.sample_rate_hz = RateOf(stretches);
  const double step_hz = spectrum.sample_rate_hz / 2 / static_cast<double>(kFrequencies);
  std::vector<double> squares(kFrequencies);
  double samples = 0;
  double longest_s = 0;
  std::vector<double> rest;
  for (Stretch& stretch : stretches) {
    TakeLine(stretch);
    AddSpectrum(stretch, step_hz, squares);
    samples += static_cast<double>(stretch.time_s.size());
    longest_s = std::max(longest_s, stretch.Duration());
    rest.insert(rest.end(), stretch.force_g.begin(), stretch.force_g.end());
  }
  for (double& square : squares) square /= samples;
  spectrum.resolution_hz = kHannResolution / longest_s;
  spectrum.noise_g = StandardDeviation(rest);
  const double over_floor = RareOverMedian(static_cast<double>(stretches.size()), kRareDeviations);
  for (std::size_t k = 0; k < kFrequencies; ++k) {
    spectrum.frequency_hz.push_back(step_hz * static_cast<double>(k + 1));
    spectrum.amplitude_g.push_back(std::sqrt(squares[k]));
    spectrum.limit_g.push_back(std::sqrt(over_floor * FloorSquare(squares, k)));
  }
  FindLines(spectrum);
  return spectrum;
}

std::string Describe(const NoiseLine& line) {
  const auto named = [&](const char* source) {
    std::string text(source);
    if (line.harmonic > 1) text += fmt::format(", harmonic {}", line.harmonic);
    if (std::abs(line.true_frequency_hz - line.frequency_hz) > 0.1 * line.true_frequency_hz) {
      text += fmt::format(" (alias of {:.0f} Hz)", line.true_frequency_hz);
    }
    return text;
  };
  switch (line.source) {
    case NoiseSource::kMains50Hz:
      return named("mains 50 Hz");
    case NoiseSource::kMains60Hz:
      return named("mains 60 Hz");
    case NoiseSource::kHeater10Hz:
      return named("heater switching 10 Hz");
    case NoiseSource::kUnknown:
      return "unknown";
  }
  return "unknown";
}

}  // namespace trammel::tap
