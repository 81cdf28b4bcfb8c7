#include "vision/rung_trace.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "base/statistics.h"

namespace trammel::vision {

std::vector<double> BoxMean(const std::vector<double>& values, int half) {
  const int n = static_cast<int>(values.size());
  std::vector<double> sums(values.size() + 1, 0.0), means(values.size());
  for (int i = 0; i < n; ++i) sums[i + 1] = sums[i] + values[i];
  for (int i = 0; i < n; ++i) {
    const int a = std::max(0, i - half), b = std::min(n, i + half + 1);
    means[i] = (sums[b] - sums[a]) / (b - a);
  }
  return means;
}

std::optional<RungSection> SectionOfRung(const GrayImage& image, int x_begin, int x_end,
                                         double y_near, double pitch_px) {
  const int a = std::max(0, static_cast<int>(y_near - 0.55 * pitch_px));
  const int b = std::min(image.height - 1, static_cast<int>(y_near + 0.55 * pitch_px));
  if (b - a < 4) return std::nullopt;
  std::vector<double> profile;
  for (int y = a; y <= b; ++y) {
    double sum = 0;
    for (int x = x_begin; x < x_end; ++x) sum += image.row(y)[x];
    profile.push_back(sum / (x_end - x_begin));
  }
  const int n = static_cast<int>(profile.size());
  const auto quarter = profile.begin() + n / 4;
  const auto peak = std::max_element(quarter, profile.end() - n / 4);
  const double low = Quantile(profile, 0.15);
  const double half = (*peak + low) / 2;
  const int top = static_cast<int>(peak - profile.begin());
  int i = top, k = top;
  while (i > 0 && profile[i - 1] > half) --i;
  while (k + 1 < n && profile[k + 1] > half) ++k;
  double weights = 0, moment = 0;
  for (int y = i; y <= k; ++y) {
    weights += profile[y] - half;
    moment += (profile[y] - half) * y;
  }
  if (!(weights > 0)) return std::nullopt;
  return RungSection{a + moment / weights, k - i + 1.0, *peak - low};
}

std::vector<double> BetweenRungs(const GrayImage& image, const Curve& above, const Curve& below,
                                 double pitch_px) {
  std::vector<double> values(static_cast<std::size_t>(image.width));
  const int half = std::max(0, static_cast<int>(0.12 * pitch_px));
  for (int x = 0; x < image.width; ++x) {
    const int middle = static_cast<int>(std::lround((above(x) + below(x)) / 2));
    double sum = 0;
    for (int y = middle - half; y <= middle + half; ++y) {
      sum += image.row(std::clamp(y, 0, image.height - 1))[x];
    }
    values[x] = sum / (2 * half + 1);
  }
  return values;
}

}  // namespace trammel::vision
