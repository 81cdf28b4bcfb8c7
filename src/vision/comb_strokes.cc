#include "vision/comb_strokes.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <opencv2/core.hpp>
#include <set>
#include <utility>

#include "base/statistics.h"
#include "geometry/linear_systems.h"

namespace trammel::vision {

double LinePencil::Y_px(double place, double x_px) const {
  const double a = first[0] + place * step[0];
  const double b = first[1] + place * step[1];
  const double c = first[2] + place * step[2];
  return -(a * x_px + c) / b;
}

double LinePencil::PlaceOf(const PointPx& point) const {
  const auto at = [&](const std::array<double, 3>& line) {
    return line[0] * point.x + line[1] * point.y + line[2];
  };
  return -at(first) / at(step);
}

bool LinePencil::Sees(double first_place, double last_place, double left_px,
                      double right_px) const {
  double sign = 0;
  for (const double x : {left_px, right_px}) {
    for (const double place : {first_place, last_place}) {
      if (!(first[1] + place * step[1] < 0)) return false;
      const double y = Y_px(place, x);
      const double side = step[0] * x + step[1] * y + step[2];
      if (sign * side < 0 || side == 0) return false;
      sign = side;
    }
  }
  return true;
}

std::optional<LinePencil> FitPencil(std::span<const PencilPoint> points) {
  std::set<double> places;
  double x0 = 0, y0 = 0, size = 1;
  for (const PencilPoint& point : points) {
    places.insert(point.place);
    x0 += point.at.x / static_cast<double>(points.size());
    y0 += point.at.y / static_cast<double>(points.size());
  }
  if (places.size() < 3) return std::nullopt;
  for (const PencilPoint& point : points) {
    size = std::max({size, std::abs(point.at.x - x0), std::abs(point.at.y - y0)});
  }
  const double middle = (*places.begin() + *places.rbegin()) / 2;
  const double span = (*places.rbegin() - *places.begin()) / 2;
  // (a1 + k b1) x + a3 + k b3 + k y b2 = y, with x, y and k scaled to about -1 … 1.
  Eigen::MatrixXd a(static_cast<Eigen::Index>(points.size()), 5);
  Eigen::VectorXd b(static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double x = (points[i].at.x - x0) / size, y = (points[i].at.y - y0) / size;
    const double k = (points[i].place - middle) / span;
    a.row(static_cast<Eigen::Index>(i)) << x, 1, k * x, k, k * y;
    b(static_cast<Eigen::Index>(i)) = y;
  }
  const auto solution = geometry::SolveOfFullRank(a, b);
  if (!solution) return std::nullopt;
  const Eigen::VectorXd& c = *solution;
  // Converts to pixels: line (u, v, w) in scaled coordinates is (u, v, size w - u x0 - v y0).
  const auto unscaled = [&](double u, double v, double w) {
    return std::array<double, 3>{u, v, size * w - u * x0 - v * y0};
  };
  const std::array<double, 3> centre = unscaled(c(0), -1, c(1));
  const std::array<double, 3> per_span = unscaled(c(2), c(4), c(3));
  LinePencil pencil;
  for (std::size_t i = 0; i < 3; ++i) {
    pencil.step[i] = per_span[i] / span;
    pencil.first[i] = centre[i] - middle * pencil.step[i];
  }
  const double scale = -pencil.first[1];
  if (!(scale > 1e-9)) return std::nullopt;
  for (std::size_t i = 0; i < 3; ++i) {
    pencil.first[i] /= scale;
    pencil.step[i] /= scale;
  }
  return pencil;
}

namespace {

// Contrasting section of one strip.
struct Peak {
  double middle = 0;
  double width = 0;
  double height = 0;
};

std::vector<Peak> Peaks(const std::vector<float>& means) {
  constexpr float kBegin = 0.1F, kPeak = 0.35F;  // spreads above the surroundings
  constexpr double kNarrowest_px = 1.5;
  std::vector<Peak> peaks;
  const int n = static_cast<int>(means.size());
  for (int y = 1; y < n; ++y) {
    if (!(means[y] > kBegin) || means[y - 1] > kBegin) continue;
    const bool whole_begin = !std::isnan(means[y - 1]);
    float highest = 0;
    double weights = 0, moment = 0;
    int end = y;
    for (; end < n && means[end] > kBegin; ++end) {
      const double weight = means[end] - kBegin;
      highest = std::max(highest, means[end]);
      weights += weight;
      moment += weight * end;
    }
    const bool whole = whole_begin && end < n && !std::isnan(means[end]);
    if (whole && highest > kPeak && end - y >= kNarrowest_px) {
      peaks.push_back({moment / weights, double(end - y), highest});
    }
    y = end;
  }
  return peaks;
}

// Stroke that may continue.
struct Growing {
  Stroke stroke;
  std::vector<double> widths, heights;
  int last_strip = 0;

  // Extrapolates the stroke to another place: straight on, from its last points.
  [[nodiscard]] double Expected(double x) const {
    const std::vector<PointPx>& p = stroke.points;
    constexpr std::size_t kReach = 8;
    if (p.size() < 4) return p.back().y;
    const PointPx& a = p[p.size() > kReach ? p.size() - 1 - kReach : 0];
    const double slope = (p.back().y - a.y) / (p.back().x - a.x);
    return p.back().y + slope * (x - p.back().x);
  }
};

// Strokes that may continue, and those that have ended.
struct Tracing {
  std::vector<Growing> growing;
  std::vector<Growing> ended;
};

// Moves strokes unseen for long to the ended ones.
void EndOld(int strip, Tracing& tracing) {
  constexpr int kLongestBreak = 4;  // strips
  const auto old = std::stable_partition(
      tracing.growing.begin(), tracing.growing.end(),
      [&](const Growing& stroke) { return strip - stroke.last_strip <= kLongestBreak; });
  std::move(old, tracing.growing.end(), std::back_inserter(tracing.ended));
  tracing.growing.erase(old, tracing.growing.end());
}

void Link(const std::vector<Peak>& peaks, int strip, double x, Tracing& tracing) {
  constexpr double kReach = 0.4;  // relative to a stroke's width
  EndOld(strip, tracing);
  std::vector<Growing>& growing = tracing.growing;
  std::vector<double> expected;
  for (const Growing& stroke : growing) expected.push_back(stroke.Expected(x));
  std::vector<bool> taken(growing.size(), false);
  std::vector<Growing> fresh;
  for (const Peak& peak : peaks) {
    std::size_t nearest = growing.size();
    double least = std::max(1.5, kReach * peak.width);
    for (std::size_t i = 0; i < growing.size(); ++i) {
      const double away = std::abs(expected[i] - peak.middle);
      if (away >= least || taken[i]) continue;
      least = away;
      nearest = i;
    }
    if (nearest == growing.size()) {
      fresh.push_back({{{{x, peak.middle}}, 0, 0}, {peak.width}, {peak.height}, strip});
      continue;
    }
    taken[nearest] = true;
    growing[nearest].stroke.points.push_back({x, peak.middle});
    growing[nearest].widths.push_back(peak.width);
    growing[nearest].heights.push_back(peak.height);
    growing[nearest].last_strip = strip;
  }
  std::move(fresh.begin(), fresh.end(), std::back_inserter(growing));
}

}  // namespace

Strips AverageStrips(const cv::Mat& contrast, const cv::Mat& seen) {
  constexpr int kStrips = 90;
  Strips strips;
  const int width = strips.width_px = std::max(2, contrast.cols / kStrips);
  strips.means.create(contrast.rows, contrast.cols / width, CV_32F);
  for (int y = 0; y < contrast.rows; ++y) {
    const float* value = contrast.ptr<float>(y);
    const std::uint8_t* is_seen = seen.ptr<std::uint8_t>(y);
    float* mean = strips.means.ptr<float>(y);
    for (int strip = 0; strip < strips.means.cols; ++strip, value += width, is_seen += width) {
      float sum = 0;
      int count = 0;
      for (int x = 0; x < width; ++x) {
        sum += is_seen[x] != 0 ? value[x] : 0.0F;
        count += is_seen[x] != 0 ? 1 : 0;
      }
      mean[strip] = 10 * count >= 7 * width ? sum / static_cast<float>(count)
                                            : std::numeric_limits<float>::quiet_NaN();
    }
  }
  return strips;
}

std::vector<Stroke> TraceStrokes(const Strips& strips, bool lighter) {
  constexpr std::size_t kFewestPoints = 6;
  Tracing tracing;
  std::vector<float> means(static_cast<std::size_t>(strips.means.rows));
  for (int strip = 0; strip < strips.means.cols; ++strip) {
    for (int y = 0; y < strips.means.rows; ++y) {
      const float mean = strips.means.at<float>(y, strip);
      means[static_cast<std::size_t>(y)] = lighter ? mean : -mean;
    }
    const double x = strip * strips.width_px + (strips.width_px - 1) / 2.0;
    Link(Peaks(means), strip, x, tracing);
  }
  std::vector<Growing>& all = tracing.ended;
  std::move(tracing.growing.begin(), tracing.growing.end(), std::back_inserter(all));
  std::vector<Stroke> strokes;
  for (Growing& grown : all) {
    if (grown.stroke.points.size() < kFewestPoints) continue;
    grown.stroke.width_px = Median(grown.widths);
    grown.stroke.height = Median(grown.heights);
    strokes.push_back(std::move(grown.stroke));
  }
  return strokes;
}

}  // namespace trammel::vision
