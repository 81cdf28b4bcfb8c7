// The part, its targets and the camera's places from above the machine, with the correction.
#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "document/plot.h"
#include "document/scale_key.h"
#include "geometry/decompositions.h"
#include "part_alignment/correction/part_correction.h"
#include "part_alignment/report/alignment_page.h"

namespace trammel::report {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
namespace pa = part_alignment;

/// Half axes of a normal distribution's 95 % region in the plane, in standard deviations.
constexpr double kPlane95 = 2.4477;

struct Placed {
  std::string id;
  Vector2d at_mm = Vector2d::Zero();
  Vector2d turned_mm = Vector2d::Zero();  ///< by the rotation about Z, from where it were without
  double high_mm = 0;                     ///< above where a part that is not tilted would have it
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
};

/// Of a point's place in the machine; by differences, the chain being smooth.
Eigen::Matrix2d PlaneCovariance(const pa::Alignment& alignment, const Vector3d& part_mm) {
  if (alignment.covariance.rows() < 6) return Eigen::Matrix2d::Zero();
  constexpr double kStep = 1e-5;
  Eigen::Matrix<double, 2, 6> slope;
  for (int i = 0; i < 6; ++i) {
    geometry::Pose moved = alignment.machine_from_part;
    (i < 3 ? moved.translation_mm(i) : moved.angles_rad(i - 3)) += kStep;
    const Vector3d shift = pa::MachineFromPart(moved, part_mm) -
                           pa::MachineFromPart(alignment.machine_from_part, part_mm);
    slope.col(i) = shift.head<2>() / kStep;
  }
  return slope * alignment.covariance.topLeftCorner<6, 6>() * slope.transpose();
}

std::vector<Placed> PlacedOf(const AlignmentOutput& output) {
  const pa::Alignment& alignment = output.alignment;
  const geometry::Pose& pose = alignment.machine_from_part;
  const pa::OffsetCorrection offset = pa::CorrectWorkOffset(pose, output.measurement.targets);
  std::vector<Placed> placed;
  for (std::size_t i = 0; i < output.measurement.targets.size(); ++i) {
    const pa::PartTarget& target = output.measurement.targets[i];
    const Vector3d at = pa::MachineFromPart(pose, target.ideal_mm);
    Placed one{target.id, at.head<2>(), {}, 0, PlaneCovariance(alignment, target.ideal_mm)};
    one.turned_mm = at.head<2>() - (pose.translation_mm + target.ideal_mm).head<2>();
    one.high_mm = i < offset.remainder.size() ? -offset.remainder[i].error_mm.z() : 0;
    placed.push_back(std::move(one));
  }
  return placed;
}

/// Corners of the convex hull, counter-clockwise (Andrew's monotone chain).
std::vector<Vector2d> Hull(std::vector<Vector2d> points) {
  std::sort(points.begin(), points.end(), [](const Vector2d& a, const Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  std::vector<Vector2d> hull;
  const auto add = [&hull](const Vector2d& point, std::size_t least) {
    const auto turns_right = [&] {
      const Vector2d a = hull[hull.size() - 1] - hull[hull.size() - 2];
      const Vector2d b = point - hull[hull.size() - 1];
      return a.x() * b.y() - a.y() * b.x() <= 0;
    };
    while (hull.size() >= least + 2 && turns_right()) hull.pop_back();
    hull.push_back(point);
  };
  for (const Vector2d& point : points) add(point, 0);
  const std::size_t lower = hull.size();
  for (auto point = points.rbegin(); point != points.rend(); ++point) add(*point, lower - 1);
  if (hull.size() > 1) hull.pop_back();
  return hull;
}

struct Scene {
  std::vector<Placed> targets;
  Vector2d origin_mm = Vector2d::Zero();
  double turn_rad = 0;
  double size_mm = 1;  ///< of what is drawn
};

/// Ranges of equal scale for a rectangle.
std::pair<Range, Range> Ranges(const AlignmentOutput& output, const Scene& scene,
                               const RectPx& inner) {
  std::vector<double> xs{scene.origin_mm.x()};
  std::vector<double> ys{scene.origin_mm.y()};
  for (const Placed& target : scene.targets) {
    xs.push_back(target.at_mm.x());
    ys.push_back(target.at_mm.y());
  }
  for (const pa::View& view : output.measurement.views) {
    xs.push_back(view.spindle_mm.x());
    ys.push_back(view.spindle_mm.y());
  }
  constexpr double kSpare = 1.25;
  constexpr double kLeast_mm_per_px = 1e-6;
  return WithOneScale(RangeOf(xs), RangeOf(ys), inner.width, inner.height, kSpare,
                      kLeast_mm_per_px);
}

void DrawGreenArrow(Canvas& canvas, const PointPx& from, const PointPx& tip) {
  constexpr double kHeadPx = 9;
  DrawArrow(canvas, from, tip, {.color = kGreen, .width_px = 1.8}, kHeadPx);
}

void DrawPart(Canvas& canvas, const Plot& plot, const Scene& scene) {
  std::vector<Vector2d> points;
  for (const Placed& target : scene.targets) points.push_back(target.at_mm);
  std::vector<PointPx> outline;
  for (const Vector2d& corner : Hull(points)) outline.push_back(plot.At({corner.x(), corner.y()}));
  canvas.Polygon(outline, WithAlpha(kGrey, 0.18), Stroke{.color = kMuted, .width_px = 1.2});
}

/// The camera's places, each with its lines to what it saw.
void DrawViews(Canvas& canvas, const Plot& plot, const AlignmentOutput& output,
               const Scene& scene) {
  for (const pa::View& view : output.measurement.views) {
    const PointPx spindle = plot.At({view.spindle_mm.x(), view.spindle_mm.y()});
    for (const pa::Observation& seen : view.observations) {
      for (const Placed& target : scene.targets) {
        if (target.id != seen.target) continue;
        const PointPx observation[] = {spindle, plot.At({target.at_mm.x(), target.at_mm.y()})};
        canvas.Polyline(observation,
                        {.color = WithAlpha(kBlue, 0.55), .width_px = 1, .dash_px = {3, 3}});
      }
    }
    canvas.FillRect({spindle.x - 3.5, spindle.y - 3.5, 7, 7}, kBlue);
  }
}

/// The program's axes once the work offset is set.
void DrawAxes(Canvas& canvas, const Plot& plot, const Scene& scene) {
  constexpr double kLength_px = 58;
  const PointPx from = plot.At({scene.origin_mm.x(), scene.origin_mm.y()});
  for (const bool is_x : {true, false}) {
    const double angle = scene.turn_rad + (is_x ? 0 : std::acos(0.0));
    const PointPx tip{from.x + kLength_px * std::cos(angle), from.y - kLength_px * std::sin(angle)};
    DrawGreenArrow(canvas, from, tip);
    canvas.Text({tip.x + 5, tip.y - 4}, is_x ? "X" : "Y",
                {.size_px = 12, .color = kGreen, .bold = true});
  }
  canvas.Circle(from, 3.5, kGreen);
}

double Longest(const std::vector<Placed>& targets, double (*length)(const Placed&)) {
  double longest = 0;
  for (const Placed& target : targets) longest = std::max(longest, length(target));
  return longest;
}

/// The 95 % region of each target's place, so many times enlarged.
void DrawRegions(Canvas& canvas, const Plot& plot, const Scene& scene, double px_per_mm,
                 double enlarged) {
  for (const Placed& target : scene.targets) {
    const auto axes = geometry::DecomposeSymmetric(target.covariance);
    std::vector<PointPx> ring;
    constexpr int kSteps = 40;
    const PointPx middle = plot.At({target.at_mm.x(), target.at_mm.y()});
    for (int i = 0; i < kSteps; ++i) {
      const double turn = 4 * std::acos(0.0) * i / kSteps;
      const Vector2d unit(std::cos(turn), std::sin(turn));
      const Vector2d at = axes.vectors * (axes.values.cwiseMax(0).cwiseSqrt().cwiseProduct(unit)) *
                          (kPlane95 * enlarged * px_per_mm);
      ring.push_back({middle.x + at.x(), middle.y - at.y()});
    }
    canvas.Polygon(ring, WithAlpha(kVermilion, 0.15), Stroke{.color = kVermilion, .width_px = 1.4});
  }
}

void DrawTargets(Canvas& canvas, const Plot& plot, const Scene& scene, double px_per_mm,
                 double enlarged) {
  for (const Placed& target : scene.targets) {
    const PointPx at = plot.At({target.at_mm.x(), target.at_mm.y()});
    DrawGreenArrow(canvas,
                   {at.x - enlarged * target.turned_mm.x() * px_per_mm,
                    at.y + enlarged * target.turned_mm.y() * px_per_mm},
                   at);
    canvas.Circle(at, 3, kInk);
    const std::string text = fmt::format("{}: {:+.3f} mm", target.id, target.high_mm);
    const TextStyle style{.size_px = 11.5, .bold = true};
    const double width = canvas.TextWidth(text, style);
    const double x = std::clamp(at.x + 7, plot.inner().x,
                                std::max(plot.inner().x, plot.inner().right() - width - 3));
    canvas.FillRect({x - 2, at.y - 20, width + 4, 15}, WithAlpha(kPaper, 0.8));
    canvas.Text({x, at.y - 8}, text, style);
  }
}

Canvas Draw(const AlignmentOutput& output, const Scene& scene, double width_px) {
  const bool broad = width_px >= kFigureWidthPx;
  const double left = 70;
  const RectPx inner{left, broad ? 84.0 : 150.0, width_px - left - 14,
                     broad ? 420.0 : width_px - 60};
  Canvas canvas(width_px, inner.bottom() + 48);
  const auto [x, y] = Ranges(output, scene, inner);
  const double px_per_mm = inner.width / (x.hi - x.lo);
  const double region_mm = Longest(scene.targets, [](const Placed& target) {
    return kPlane95 * std::sqrt(std::max(0.0, target.covariance.trace()));
  });
  const double turn_mm =
      Longest(scene.targets, [](const Placed& target) { return target.turned_mm.norm(); });
  const auto enlargement = [px_per_mm](double length_mm, double wanted_px) {
    return length_mm > 0 ? std::max(1.0, RoundedDown(wanted_px / (length_mm * px_per_mm))) : 1.0;
  };
  const double regions = enlargement(region_mm, 34);
  const double turns = enlargement(turn_mm, 46);
  using Mark = LegendEntry::Mark;
  const LegendEntry legend[] = {
      {"spindle, and its lines of sight", Mark::kLine, {.color = kBlue, .dash_px = {3, 3}}},
      {"target, and how high a tilt lifts it", Mark::kDot, {.color = kInk}},
      {fmt::format("95 % region, {:g} times enlarged", regions),
       Mark::kPatch,
       {.color = WithAlpha(kVermilion, 0.4)}},
      {turns > 1 ? fmt::format("the work offset: axes, rotation {:g} times enlarged", turns)
                 : std::string("the work offset: axes and rotation"),
       Mark::kLine,
       {.color = kGreen, .width_px = 2}}};
  DrawLegend(canvas, {12, 20}, width_px - 24, legend);
  Plot plot = Plot::Around(canvas, inner, {"machine X (mm)", x, broad ? 7 : 4},
                           {"machine Y (mm)", y, 6}, "From above");
  canvas.Clip(inner);
  DrawPart(canvas, plot, scene);
  DrawViews(canvas, plot, output, scene);
  DrawRegions(canvas, plot, scene, px_per_mm, regions);
  DrawTargets(canvas, plot, scene, px_per_mm, turns);
  DrawAxes(canvas, plot, scene);
  canvas.Unclip();
  return canvas;
}

}  // namespace

std::optional<Figure> AlignmentPlanFigure(const AlignmentOutput& output) {
  const pa::Alignment& alignment = output.alignment;
  if (alignment.verdict != Verdict::kGood || output.measurement.targets.empty()) {
    return std::nullopt;
  }
  Scene scene;
  scene.targets = PlacedOf(output);
  scene.origin_mm = alignment.machine_from_part.translation_mm.head<2>();
  scene.turn_rad = alignment.machine_from_part.angles_rad.z();
  if (!std::all_of(scene.targets.begin(), scene.targets.end(), [](const Placed& target) {
        return target.at_mm.allFinite() && target.covariance.allFinite();
      })) {
    return std::nullopt;
  }
  Figure figure{"plan",
                "The machine from above. Grey: the part, as far as its targets tell. Green: where "
                "the work offset puts the program's axes, and at each target how far its rotation "
                "carries it. The number at a target is how much higher (+) or lower it lies than "
                "on a part without a tilt: no offset of X, Y, Z and a rotation takes that; shims "
                "do, or a control that tilts.",
                Draw(output, scene, kFigureWidthPx)};
  figure.seen = fmt::format(
      "Plan of {} targets and {} views; the part's origin at X {:.3f}, Y {:.3f} mm, turned by "
      "{:.4f} mm/m.",
      scene.targets.size(), output.measurement.views.size(), scene.origin_mm.x(),
      scene.origin_mm.y(), scene.turn_rad * 1000);
  for (const Placed& target : scene.targets) {
    figure.seen += fmt::format(" {} lies {:.3f} mm too {}.", target.id, std::abs(target.high_mm),
                               target.high_mm < 0 ? "low" : "high");
  }
  figure.narrow = Draw(output, scene, kNarrowWidthPx);
  return figure;
}

}  // namespace trammel::report
