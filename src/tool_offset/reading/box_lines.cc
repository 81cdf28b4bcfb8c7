#include "tool_offset/reading/box_lines.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>

#include "base/statistics.h"
#include "geometry/linear_systems.h"
#include "tool_offset/reading/page.h"

namespace trammel::tool_offset {
namespace {

/// Profile of ink across the lines of a side: sample i is `from_mm + i * step_mm` inside the
/// outermost line.
struct Profile {
  std::vector<float> ink;
  double from_mm = 0;
  double step_mm = 1;

  [[nodiscard]] double Index(double inside_mm) const { return (inside_mm - from_mm) / step_mm; }
  /// Computes the mean ink in [centre - half, centre + half].
  [[nodiscard]] double Mean(double centre_mm, double half_mm) const {
    const int first = std::max(0, static_cast<int>(std::ceil(Index(centre_mm - half_mm))));
    const int last = std::min(static_cast<int>(ink.size()) - 1,
                              static_cast<int>(std::floor(Index(centre_mm + half_mm))));
    double sum = 0;
    for (int i = first; i <= last; ++i)
      sum += static_cast<double>(ink[static_cast<std::size_t>(i)]);
    return last < first ? 0 : sum / (last - first + 1);
  }
};

std::optional<Profile> AcrossSide(const PageView& page, const ChannelMix& mix,
                                  const SheetPlan& plan, const PageMap& map, Side side,
                                  double along_mm, double reach_mm) {
  constexpr int kRows = 5;
  constexpr double kRowStep_mm = 0.2;
  const LocalMap local = map.Near(map.OnSide(side, along_mm));
  const PagePoint inward = -Outward(side) * (IsUpright(side) ? local.u_px_mm : local.v_px_mm);
  const PagePoint along = IsUpright(side) ? local.v_px_mm : local.u_px_mm;
  const double margin_mm = reach_mm + 2 * plan.settings.line_width_mm;
  Profile profile;
  profile.step_mm = 1 / Length(inward);
  profile.from_mm = -margin_mm;
  Strip strip;
  strip.rows = kRows;
  strip.row_step = kRowStep_mm * along;
  strip.column_step = profile.step_mm * inward;
  strip.columns =
      static_cast<int>(std::ceil((plan.box_insets_mm.back() + 2 * margin_mm) / profile.step_mm));
  strip.origin = local.at + profile.from_mm * inward - (kRows - 1) / 2.0 * strip.row_step;
  std::vector<float> samples;
  if (!SampleStrip(page, mix, strip, samples)) return std::nullopt;
  const auto columns = static_cast<std::size_t>(strip.columns);
  profile.ink.assign(columns, 0);
  for (std::size_t i = 0; i < samples.size(); ++i) profile.ink[i % columns] += samples[i] / kRows;
  std::vector<float> sorted = profile.ink;
  const auto paper = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 3);
  std::nth_element(sorted.begin(), paper, sorted.end());
  const float level = *paper;
  for (float& value : profile.ink) value -= level;
  return profile;
}

/// Lines across one position of a side.
struct LinesAcross {
  double inside_mm = 0;  ///< inward shift of the outermost one from its expected place
  bool whole = true;     ///< true if all lines are present
};

/// Returns the surplus ink on a line over that a line's width beside it.
double LineInk(const Profile& profile, double at_mm, double width_mm) {
  return profile.Mean(at_mm, width_mm / 2) - (profile.Mean(at_mm - width_mm, width_mm / 4) +
                                              profile.Mean(at_mm + width_mm, width_mm / 4)) /
                                                 2;
}

/// Finds the lines; nothing if there are none.
std::optional<LinesAcross> FindLines(const Profile& profile, const SheetPlan& plan,
                                     double reach_mm) {
  constexpr double kFaintest = 0.3;  // of the box's ink on the small page
  const double width_mm = plan.settings.line_width_mm;
  double best = kFaintest;
  std::optional<double> best_mm;
  for (double shift_mm = -reach_mm; shift_mm <= reach_mm; shift_mm += profile.step_mm) {
    double score = 0;
    for (const double inset_mm : plan.box_insets_mm) {
      score += LineInk(profile, shift_mm + inset_mm, width_mm);
    }
    score /= static_cast<double>(plan.box_insets_mm.size());
    if (score <= best) continue;
    best = score;
    best_mm = shift_mm;
  }
  if (!best_mm) return std::nullopt;
  double sum_mm = 0;
  int count = 0;
  LinesAcross lines;
  for (const double inset_mm : plan.box_insets_mm) {
    lines.whole &= LineInk(profile, *best_mm + inset_mm, width_mm) > kFaintest / 2;
    const double centre = profile.Index(*best_mm + inset_mm);
    const double half = width_mm / profile.step_mm;
    const auto place = HalfInkPlace(profile.ink, centre - half, centre + half);
    if (!place) continue;
    sum_mm += profile.from_mm + place->middle * profile.step_mm - inset_mm;
    ++count;
  }
  if (count == 0) return std::nullopt;
  lines.inside_mm = sum_mm / count;
  return lines;
}

std::vector<SidePoint> FindSides(const PageView& page, const ChannelMix& mix, const SheetPlan& plan,
                                 const PageMap& map, double reach_mm, BoxFit& fit) {
  constexpr double kStep_mm = 2;
  std::vector<SidePoint> points;
  const double corner_mm = plan.box_insets_mm.back() + 2;  // lines of the other side
  for (std::size_t i = 0; i < kSides; ++i) {
    const auto side = static_cast<Side>(i);
    const double half_mm = (IsUpright(side) ? map.half_height_mm : map.half_width_mm) - corner_mm;
    int tried = 0;
    int found = 0;
    int whole = 0;
    for (double along_mm = -half_mm; along_mm <= half_mm; along_mm += kStep_mm) {
      ++tried;
      const auto profile = AcrossSide(page, mix, plan, map, side, along_mm, reach_mm);
      if (!profile) continue;
      const auto lines = FindLines(*profile, plan, reach_mm);
      if (!lines) continue;
      ++found;
      whole += lines->whole ? 1 : 0;
      const LocalMap local = map.Near(map.OnSide(side, along_mm));
      const double outward_mm = -Outward(side) * lines->inside_mm;
      points.push_back(
          {side, along_mm,
           local.ToPage(IsUpright(side) ? SheetPoint{outward_mm, 0} : SheetPoint{0, outward_mm})});
    }
    fit.support[i] = tried == 0 ? 0 : static_cast<double>(found) / tried;
    fit.whole[i] = found == 0 ? 0 : static_cast<double>(whole) / found;
  }
  return points;
}

/// Fits by least squares with Huber's weights: of an outlier only the sign counts.
Eigen::VectorXd RobustFit(const Eigen::MatrixXd& design, const Eigen::VectorXd& y) {
  constexpr double kHuber = 1.5;
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(y.size());
  Eigen::VectorXd solution;
  for (int pass = 0; pass < 6; ++pass) {
    const Eigen::VectorXd root = weight.cwiseSqrt();
    solution = geometry::SolveLeastSquares(root.asDiagonal() * design, root.cwiseProduct(y));
    const Eigen::VectorXd residual = (design * solution - y).cwiseAbs();
    std::vector<double> sorted(residual.data(), residual.data() + residual.size());
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    const double scale = std::max(1e-6, kHuber * 1.4826 * *middle);
    weight = residual.unaryExpr([&](double r) { return r <= scale ? 1.0 : scale / r; });
  }
  return solution;
}

/// Straight line on the page through a side's points, fitted robustly.
struct PageLine {
  PagePoint at;
  PagePoint along;
};

PageLine FitSide(const std::vector<SidePoint>& points, Side side, const PageMap& map) {
  const PagePoint along = IsUpright(side) ? (1 / Length(map.v_px_mm)) * map.v_px_mm
                                          : (1 / Length(map.u_px_mm)) * map.u_px_mm;
  const PagePoint across{-along.y_px, along.x_px};
  std::vector<PagePoint> used;
  for (const SidePoint& point : points) {
    if (point.side == side) used.push_back(point.place - map.middle);
  }
  const double scale = 1 / (map.half_width_mm * Length(map.u_px_mm));
  Eigen::MatrixXd design(static_cast<Eigen::Index>(used.size()), 2);
  Eigen::VectorXd y(design.rows());
  for (Eigen::Index i = 0; i < design.rows(); ++i) {
    const PagePoint d = used[static_cast<std::size_t>(i)];
    design.row(i) << 1, scale * (d.x_px * along.x_px + d.y_px * along.y_px);
    y[i] = d.x_px * across.x_px + d.y_px * across.y_px;
  }
  const Eigen::VectorXd line = RobustFit(design, y);
  return {map.middle + line[0] * across, along + (line[1] * scale) * across};
}

PagePoint Crossing(const PageLine& a, const PageLine& b) {
  const auto cross = [](PagePoint p, PagePoint q) { return p.x_px * q.y_px - p.y_px * q.x_px; };
  return a.at + (cross(b.at - a.at, b.along) / cross(a.along, b.along)) * a.along;
}

/// Fits the projection whose box has its sides on straight lines through the points.
bool FitProjection(const std::vector<SidePoint>& points, PageMap& map) {
  std::array<PageLine, kSides> line;
  for (std::size_t i = 0; i < kSides; ++i) line[i] = FitSide(points, static_cast<Side>(i), map);
  const auto fitted =
      MapOfCorners({Crossing(line[kLeft], line[kBottom]), Crossing(line[kRight], line[kBottom]),
                    Crossing(line[kRight], line[kTop]), Crossing(line[kLeft], line[kTop])},
                   2 * map.half_width_mm, 2 * map.half_height_mm);
  if (fitted) map = *fitted;
  return fitted.has_value();
}

/// True if a fit still matches the box found; false for NaN.
bool IsLike(const PageMap& map, const PageMap& start) {
  constexpr double kMax = 0.05;
  return Length(map.u_px_mm - start.u_px_mm) < kMax * Length(start.u_px_mm) &&
         Length(map.v_px_mm - start.v_px_mm) < kMax * Length(start.v_px_mm) &&
         Length(map.middle - start.middle) < kMax * start.half_width_mm * Length(start.u_px_mm);
}

/// Returns a point's distance beyond its planned position, in the outer coordinate of its side.
double Beyond_mm(const PageMap& map, const SidePoint& point) {
  const LocalMap local = map.Near(map.OnSide(point.side, point.along_mm));
  const SheetPoint beyond = local.ToSheet(point.place - local.at);
  return IsUpright(point.side) ? beyond.u_mm : beyond.v_mm;
}

void FitBending(const std::vector<SidePoint>& points, PageMap& map) {
  for (std::size_t i = 0; i < kSides; ++i) {
    const auto side = static_cast<Side>(i);
    std::vector<const SidePoint*> used;
    for (const SidePoint& point : points) {
      if (point.side == side) used.push_back(&point);
    }
    Eigen::MatrixXd design(static_cast<Eigen::Index>(used.size()), 4);
    Eigen::VectorXd y(design.rows());
    for (Eigen::Index k = 0; k < design.rows(); ++k) {
      const SidePoint& point = *used[static_cast<std::size_t>(k)];
      const double t = point.along_mm / (IsUpright(side) ? map.half_height_mm : map.half_width_mm);
      design.row(k) << 1, t, t * t, t * t * t;
      y[k] = Beyond_mm(map, point);
    }
    const Eigen::VectorXd cubic = RobustFit(design, y);
    std::copy(cubic.begin(), cubic.end(), map.bend_mm[i].begin());
  }
}

}  // namespace

BoxFit FitBox(const PageView& page, const ChannelMix& mix, const SheetPlan& plan,
              const PageMap& start) {
  constexpr std::array<double, 3> kReach_mm{1.5, 0.6, 0.4};
  constexpr std::size_t kFewest = 4;  // points for the cubic of a side
  BoxFit fit;
  fit.map = start;
  fit.map.bend_mm = {};
  std::vector<SidePoint> points;
  for (const double reach_mm : kReach_mm) {
    points = FindSides(page, mix, plan, fit.map, reach_mm, fit);
    std::array<std::size_t, kSides> count{};
    for (const SidePoint& point : points) ++count[point.side];
    if (*std::min_element(count.begin(), count.end()) < kFewest) {
      fit.support = {};
      return fit;
    }
    fit.map.bend_mm = {};
    if (!FitProjection(points, fit.map) || !IsLike(fit.map, start)) {
      fit.support = {};
      return fit;
    }
    FitBending(points, fit.map);
  }
  double squares = 0;
  for (const SidePoint& point : points) {
    const double beyond_mm = Beyond_mm(fit.map, point);
    squares += beyond_mm * beyond_mm;
    fit.places.push_back(point);
  }
  fit.rms_mm = std::sqrt(squares / static_cast<double>(points.size()));
  return fit;
}

std::optional<double> MergedLineWidth_mm(const PageView& page, const ChannelMix& mix,
                                         const SheetPlan& plan, const PageMap& start) {
  constexpr double kReach_mm = 1.5;
  constexpr double kStep_mm = 5;
  constexpr float kInk = 0.5F;
  constexpr double kMax = 0.6;  // share of the places
  const double apart_mm = plan.box_insets_mm.back();
  std::vector<double> width_mm;
  int places = 0;
  for (std::size_t i = 0; i < kSides; ++i) {
    const auto side = static_cast<Side>(i);
    const double half_mm = (IsUpright(side) ? start.half_height_mm : start.half_width_mm) - 5;
    for (double along_mm = -half_mm; along_mm <= half_mm; along_mm += kStep_mm) {
      ++places;
      const auto profile = AcrossSide(page, mix, plan, start, side, along_mm, kReach_mm);
      if (!profile) continue;
      int longest = 0;
      int run = 0;
      for (const float ink : profile->ink) {
        run = ink > kInk ? run + 1 : 0;
        longest = std::max(longest, run);
      }
      const double bar_mm = longest * profile->step_mm;
      if (bar_mm > apart_mm) width_mm.push_back(bar_mm - apart_mm);
    }
  }
  if (static_cast<double>(width_mm.size()) < kMax * places) return std::nullopt;
  return Median(width_mm);
}

}  // namespace trammel::tool_offset
