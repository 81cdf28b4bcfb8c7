#include "pressure_advance/response/responding_stretch.h"

#include <algorithm>
#include <cmath>

#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

// Relative readings of one line, averaged per bin; not finite where the bin has none.
std::vector<double> Binned(const LineProfile& profile, Reading reading, const Interval& window,
                           int bins) {
  std::vector<double> sum(bins, 0.0), count(bins, 0.0), all;
  for (const ProfileSample& sample : profile.samples) {
    const Seen& seen = reading == Reading::kArea ? sample.area : sample.width;
    if (!seen.seen() || sample.gap) continue;
    all.push_back(seen.value);
    const double at = (sample.position - window.lo) / (window.hi - window.lo) * bins;
    if (!(at >= 0 && at < bins)) continue;
    sum[static_cast<std::size_t>(at)] += seen.value;
    count[static_cast<std::size_t>(at)] += 1;
  }
  const double level = all.empty() ? 0 : Median(all);
  for (std::size_t i = 0; i < sum.size(); ++i) {
    sum[i] = level > 0 && count[i] > 0 ? sum[i] / count[i] / level : std::nan("");
  }
  return sum;
}

double MedianSlope(const std::vector<double>& pa, const std::vector<std::vector<double>>& lines,
                   std::size_t bin) {
  std::vector<double> slopes;
  for (std::size_t i = 0; i < pa.size(); ++i) {
    for (std::size_t j = i + 1; j < pa.size(); ++j) {
      const double slope = (lines[j][bin] - lines[i][bin]) / (pa[j] - pa[i]);
      if (std::isfinite(slope)) slopes.push_back(slope);
    }
  }
  return slopes.empty() ? 0 : Median(slopes);
}

}  // namespace

std::optional<Interval> RespondingStretch(const std::vector<LineProfile>& profiles, Reading reading,
                                          const Interval& window, bool rising,
                                          const RespondingOptions& options) {
  std::vector<double> pa;
  std::vector<std::vector<double>> lines;
  for (const LineProfile& profile : profiles) {
    if (!profile.unusable.empty()) continue;
    pa.push_back(profile.pressure_advance_s);
    lines.push_back(Binned(profile, reading, window, options.bins));
  }
  if (pa.size() < 3) return std::nullopt;
  std::vector<double> raw(options.bins);
  for (std::size_t bin = 0; bin < raw.size(); ++bin) {
    raw[bin] = MedianSlope(pa, lines, bin) * (rising ? 1 : -1);
  }
  std::vector<double> answer(raw.size());
  for (std::size_t bin = 0; bin < raw.size(); ++bin) {
    const std::size_t before = bin == 0 ? 0 : bin - 1;
    const std::size_t after = std::min(bin + 1, raw.size() - 1);
    answer[bin] = (raw[before] + raw[bin] + raw[after]) / 3;
  }
  const auto strongest = std::max_element(answer.begin(), answer.end());
  constexpr double kStandsOut = 3;
  if (!(*strongest > kStandsOut * std::abs(Median(answer)))) return std::nullopt;
  const double least = options.threshold * *strongest;
  auto first = strongest;
  while (first != answer.begin() && *(first - 1) > least) --first;
  auto last = strongest;
  while (last + 1 != answer.end() && *(last + 1) > least) ++last;
  const double bin_length = (window.hi - window.lo) / options.bins;
  const double lo = window.lo + bin_length * static_cast<double>(first - answer.begin());
  const double hi = window.lo + bin_length * static_cast<double>(last + 1 - answer.begin());
  const double margin = options.margin * (hi - lo);
  return Interval{std::max(window.lo, lo - margin), std::min(window.hi, hi + margin)};
}

}  // namespace trammel::pressure_advance
