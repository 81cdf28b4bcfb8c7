// Figure of a raw part's stock allowance: each side of the part separately.
#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "document/plot.h"
#include "part_alignment/mesh/facet_error.h"
#include "part_alignment/mesh/triangle_mesh.h"
#include "part_alignment/part_fit/part_fit.h"
#include "part_alignment/report/part_fit_report.h"

namespace trammel::report {
namespace {

using part_alignment::IdealSurface;
using part_alignment::MeshDistance;
using part_alignment::PartFit;
using part_alignment::PartFitInput;
using part_alignment::PointStockAllowance;
using part_alignment::SurfaceKind;

/// Edge between two triangles, in the ideal part's frame.
struct OutlineEdge {
  Eigen::Vector3d from_mm;
  Eigen::Vector3d to_mm;
  Eigen::Vector3d normal;
  Eigen::Vector3d other_normal;  ///< the opposite one at the rim of an open shell
  bool sharp = false;            ///< an edge of the part, seen wherever one of its sides is
};

// True if one of the two faces along an axis and the other against it.
bool Turns(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return ((a.array() > 0) != (b.array() > 0)).any();
}

void AddOutline(const MeshDistance& mesh, std::vector<OutlineEdge>& outline) {
  const auto count = static_cast<std::uint32_t>(mesh.mesh().triangles.size());
  for (std::uint32_t t = 0; t < count; ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t other = mesh.NeighboursOf(t)[k];
      const bool rim = other == part_alignment::kNoTriangle;
      if (!rim && other < t) continue;
      const Eigen::Vector3d normal = mesh.FaceNormal(t);
      const Eigen::Vector3d beyond = rim ? Eigen::Vector3d(-normal) : mesh.FaceNormal(other);
      const bool sharp = rim || normal.dot(beyond) < std::cos(part_alignment::kCrease_rad);
      if (!sharp && !Turns(normal, beyond)) continue;
      const auto& corners = mesh.mesh().triangles[t];
      outline.push_back({mesh.mesh().vertices_mm[corners[k]],
                         mesh.mesh().vertices_mm[corners[(k + 1) % 3]], normal, beyond, sharp});
    }
  }
}

/// Returns the sharp edges of all meshes, and those smooth ones that are outlines along one of the
/// six directions of the axes.
std::vector<OutlineEdge> OutlineOf(const part_alignment::PartFitInput& input) {
  std::vector<OutlineEdge> outline;
  std::set<const MeshDistance*> drawn;  // several surfaces may be on one mesh
  for (const part_alignment::IdealSurface& surface : input.surfaces) {
    if (surface.mesh != nullptr && drawn.insert(surface.mesh.get()).second) {
      AddOutline(*surface.mesh, outline);
    }
  }
  return outline;
}

// View from outside, with `right` to the right, unless `mirrored`; then drawn through the part, so
// that x and y never run to the left.
struct Side {
  const char* title;
  int axis;
  int sign;
  std::size_t right;
  std::size_t up;
};
constexpr std::array<Side, 6> kSides{{{"Towards +z", 2, 1, 0, 1},
                                      {"Towards −z (seen through)", 2, -1, 0, 1},
                                      {"Towards −y", 1, -1, 0, 2},
                                      {"Towards +y (seen through)", 1, 1, 0, 2},
                                      {"Towards +x", 0, 1, 1, 2},
                                      {"Towards −x (seen through)", 0, -1, 1, 2}}};

struct PlacedPoint {
  std::string id;
  Eigen::Vector3d at_mm;  // ideal part's frame
  std::size_t side = 0;   // index into kSides
  double surplus_mm = 0;
  bool told = false;  // the placement rests on it, it has the least, or material is missing
};

// Returns the outward normal at a point of the ideal part; not normalised.
Eigen::Vector3d Outward(const IdealSurface& surface, const Eigen::Vector3d& at_mm) {
  if (surface.kind == SurfaceKind::kPlane) return surface.direction;
  const Eigen::Vector3d axis = surface.direction.normalized();
  const Eigen::Vector3d from_middle = at_mm - surface.middle_mm;
  const Eigen::Vector3d radial = from_middle - from_middle.dot(axis) * axis;
  return surface.kind == SurfaceKind::kShaft ? radial : Eigen::Vector3d(-radial);
}

std::size_t SideOf(const PartFitInput& input, const PointStockAllowance& of,
                   const std::string& surface, const Eigen::Vector3d& at_mm) {
  Eigen::Vector3d outward = of.outward;
  if (outward.isZero()) {
    const auto found = std::find_if(input.surfaces.begin(), input.surfaces.end(),
                                    [&](const IdealSurface& one) { return one.id == surface; });
    if (found == input.surfaces.end()) return 0;
    outward = Outward(*found, at_mm);
  }
  std::size_t best = 0;
  for (std::size_t i = 1; i < kSides.size(); ++i) {
    const auto along = [&](const Side& side) { return side.sign * outward[side.axis]; };
    if (along(kSides[i]) > along(kSides[best])) best = i;
  }
  return best;
}

std::vector<PlacedPoint> Placed(const PartFitInput& input, const PartFit& fit) {
  constexpr double kMissing_mm = 1e-6;  // below the least by less is the optimum's own rounding
  const Eigen::Matrix3d rotation = geometry::RotationFromAngles(fit.ideal_from_measured.angles_rad);
  std::vector<PlacedPoint> placed;
  const PointStockAllowance* least = nullptr;
  if (!fit.stock_allowances.empty()) {
    least = &*std::min_element(fit.stock_allowances.begin(), fit.stock_allowances.end(),
                               [](const PointStockAllowance& a, const PointStockAllowance& b) {
                                 return a.stock_allowance_mm < b.stock_allowance_mm;
                               });
  }
  for (const PointStockAllowance& stock_allowance : fit.stock_allowances) {
    const part_alignment::MeasuredPoint& point = input.points[stock_allowance.point];
    const Eigen::Vector3d at_mm =
        rotation * (fit.scale * point.at_mm) + fit.ideal_from_measured.translation_mm;
    placed.push_back(
        {point.id, at_mm, SideOf(input, stock_allowance, point.surface, at_mm),
         stock_allowance.stock_allowance_mm - stock_allowance.wanted_mm,
         stock_allowance.binding || &stock_allowance == least ||
             stock_allowance.stock_allowance_mm < stock_allowance.min_mm - kMissing_mm});
  }
  return placed;
}

std::array<Range, 3> ExtentOf(const std::vector<PlacedPoint>& placed,
                              const std::vector<OutlineEdge>& outline) {
  std::array<Range, 3> extent;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<double> places;
    for (const PlacedPoint& point : placed) {
      places.push_back(point.at_mm[static_cast<Eigen::Index>(axis)]);
    }
    for (const OutlineEdge& edge : outline) {
      places.push_back(edge.from_mm[static_cast<Eigen::Index>(axis)]);
      places.push_back(edge.to_mm[static_cast<Eigen::Index>(axis)]);
    }
    extent[axis] = Padded(RangeOf(places), 0.1);
  }
  return extent;
}

// Sets equal px per mm on both axes, unless one of them would have next to no room.
void MakeAlike(const RectPx& room, Range& right, Range& up) {
  constexpr double kMaxStretched = 3;
  const double ratio =
      (right.hi - right.lo) / room.width / ((up.hi - up.lo) / room.height);  // mm per px
  if (ratio > kMaxStretched || ratio < 1 / kMaxStretched) return;
  Range& narrower = ratio > 1 ? up : right;
  narrower = Padded(narrower, (std::max(ratio, 1 / ratio) - 1) / 2);
}

bool Overlap(const RectPx& a, const RectPx& b) {
  return a.x < b.right() && b.x < a.right() && a.y < b.bottom() && b.y < a.bottom();
}

// Draws a name beside its point where no other name is; omits it if there is no such place.
void DrawName(Canvas& canvas, const RectPx& inside, const PointPx& at, const std::string& name,
              std::vector<RectPx>& taken) {
  constexpr double kAside = 8;
  constexpr double kApart = 13;  // vertical distance of the name's middle from the point
  constexpr TextStyle kStyle{.size_px = 11};
  const double width = canvas.TextWidth(name, kStyle) + 4;
  constexpr double kHeight = 14;
  for (const auto& [right, below] : {std::pair{true, false}, std::pair{false, false},
                                     std::pair{true, true}, std::pair{false, true}}) {
    const RectPx box{right ? at.x + kAside : at.x - kAside - width,
                     at.y + (below ? kApart : -kApart) - kHeight / 2, width, kHeight};
    const bool fits = box.x >= inside.x && box.right() <= inside.right() && box.y >= inside.y &&
                      box.bottom() <= inside.bottom();
    if (!fits || std::any_of(taken.begin(), taken.end(),
                             [&](const RectPx& other) { return Overlap(box, other); })) {
      continue;
    }
    canvas.FillRect(box, WithAlpha(kPaper, 0.85));
    canvas.Text({box.x + 2, box.bottom() - 3}, name, kStyle);
    taken.push_back(box);
    return;
  }
}

// Draws edges that face this side, each only if it is longer than a pixel.
void DrawOutline(Canvas& canvas, const Plot& plot, const std::vector<OutlineEdge>& outline,
                 const Side& side) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const auto facing = [&](const Eigen::Vector3d& normal) {
    return side.sign * normal[side.axis] > 0;
  };
  const auto at = [&](const Eigen::Vector3d& mm) {
    const PointPx px = plot.At(
        {mm[static_cast<Eigen::Index>(side.right)], mm[static_cast<Eigen::Index>(side.up)]});
    return PointPx{std::round(2 * px.x) / 2, std::round(2 * px.y) / 2};
  };
  std::set<std::array<double, 4>> drawn;
  std::vector<PointPx> lines;
  for (const OutlineEdge& edge : outline) {
    const bool one = facing(edge.normal);
    const bool other = facing(edge.other_normal);
    if (!(edge.sharp ? one || other : one != other)) continue;
    PointPx from = at(edge.from_mm);
    PointPx to = at(edge.to_mm);
    if (std::tie(to.x, to.y) < std::tie(from.x, from.y)) std::swap(from, to);
    if (from.x == to.x && from.y == to.y) continue;
    if (!drawn.insert({from.x, from.y, to.x, to.y}).second) continue;
    lines.insert(lines.end(), {from, to, {kNan, kNan}});
  }
  canvas.Polyline(lines, {.color = kMuted, .width_px = 1});
}

// Selects points that dots of this radius do not overlap; of several, the one with the least stock.
std::vector<const PlacedPoint*> ToDraw(const std::vector<PlacedPoint>& placed, std::size_t side,
                                       const Plot& plot, const Side& axes, double radius) {
  constexpr std::size_t kAllOf = 150;
  std::vector<const PlacedPoint*> all;
  for (const PlacedPoint& point : placed) {
    if (point.side == side) all.push_back(&point);
  }
  if (all.size() <= kAllOf) return all;
  std::map<std::pair<int, int>, const PlacedPoint*> cells;
  std::vector<const PlacedPoint*> drawn;
  for (const PlacedPoint* point : all) {
    if (point->told) {
      drawn.push_back(point);
      continue;
    }
    const PointPx at = plot.At({point->at_mm[static_cast<Eigen::Index>(axes.right)],
                                point->at_mm[static_cast<Eigen::Index>(axes.up)]});
    const PlacedPoint*& kept =
        cells[{static_cast<int>(at.x / (2 * radius)), static_cast<int>(at.y / (2 * radius))}];
    if (kept == nullptr || point->surplus_mm < kept->surplus_mm) kept = point;
  }
  for (const auto& [cell, point] : cells) drawn.push_back(point);
  return drawn;
}

void DrawSide(Canvas& canvas, const RectPx& room, const std::vector<PlacedPoint>& placed,
              const std::vector<OutlineEdge>& outline, std::size_t number,
              const std::array<Range, 3>& extent, const Range& colours) {
  constexpr std::array<const char*, 3> kLabels{"x (mm)", "y (mm)", "z (mm)"};
  const Side& side = kSides[number];
  Range right = extent[side.right];
  Range up = extent[side.up];
  MakeAlike(room, right, up);
  Plot plot = Plot::Around(canvas, room,
                           {kLabels[side.right], right, canvas.width_px() < kFigureWidthPx ? 3 : 5},
                           {kLabels[side.up], up, 4}, side.title);
  const auto at = [&](const PlacedPoint& point) {
    return DataPoint{point.at_mm[static_cast<Eigen::Index>(side.right)],
                     point.at_mm[static_cast<Eigen::Index>(side.up)]};
  };
  const auto count = std::count_if(placed.begin(), placed.end(),
                                   [&](const PlacedPoint& point) { return point.side == number; });
  // Small enough that as many in an even spread do not touch.
  const double radius =
      std::clamp(0.3 * std::sqrt(room.width * room.height / static_cast<double>(count)), 2.0, 4.5);
  DrawOutline(canvas, plot, outline, side);
  std::vector<RectPx> taken;
  const std::vector<const PlacedPoint*> drawn = ToDraw(placed, number, plot, side, radius);
  for (const bool told : {false, true}) {  // never hidden: what the placement rests on
    for (const PlacedPoint* one : drawn) {
      const PlacedPoint& point = *one;
      if (point.told != told) continue;
      const Stroke edge{.color = told ? kVermilion : kInk, .width_px = told ? 2.5 : 0.6};
      plot.Dot(at(point), told ? radius + 1 : radius,
               MapColor((point.surplus_mm - colours.lo) / (colours.hi - colours.lo)), edge);
      constexpr std::size_t kCrowd = 600;
      if (!told && drawn.size() > kCrowd) continue;
      const PointPx dot = plot.At(at(point));
      taken.push_back({dot.x - radius, dot.y - radius, 2 * radius, 2 * radius});
    }
  }
  for (const PlacedPoint& point : placed) {
    if (point.side == number && point.told) {
      DrawName(canvas, room, plot.At(at(point)), point.id, taken);
    }
  }
}

/// Returns the sides that points face, in their order.
std::vector<std::size_t> SidesOf(const std::vector<PlacedPoint>& placed) {
  std::vector<std::size_t> sides;
  for (std::size_t side = 0; side < kSides.size(); ++side) {
    if (std::any_of(placed.begin(), placed.end(),
                    [side](const PlacedPoint& point) { return point.side == side; })) {
      sides.push_back(side);
    }
  }
  return sides;
}

/// Draws sides in two columns, or in one if there is no room.
Canvas Draw(const std::vector<PlacedPoint>& placed, const std::vector<OutlineEdge>& outline,
            double width_px) {
  constexpr double kLeftPx = 62;
  constexpr double kRowPx = 268;
  constexpr double kTopPx = 26;
  constexpr double kBelowPx = 48;
  const bool broad = width_px >= kFigureWidthPx;
  const double bar_px = broad ? 110 : 86;
  std::vector<double> surplus_mm;
  for (const PlacedPoint& point : placed) surplus_mm.push_back(point.surplus_mm);
  const std::vector<std::size_t> sides = SidesOf(placed);
  const std::array<Range, 3> extent = ExtentOf(placed, outline);
  const Range colours = RangeOf(surplus_mm);
  const std::size_t columns = sides.size() > 1 && broad ? 2 : 1;
  const std::size_t rows = (sides.size() + columns - 1) / columns;
  const double height = kRowPx * static_cast<double>(std::max<std::size_t>(rows, 1));
  Canvas canvas(width_px, height);
  const double column_px = (width_px - bar_px - 12) / static_cast<double>(columns);
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const RectPx room{column_px * static_cast<double>(i % columns) + kLeftPx,
                      kRowPx * static_cast<double>(i / columns) + kTopPx, column_px - kLeftPx - 10,
                      kRowPx - kTopPx - kBelowPx};
    DrawSide(canvas, room, placed, outline, sides[i], extent, colours);
  }
  DrawColorBar(canvas, {width_px - bar_px + 12, kTopPx, 18, height - kTopPx - kBelowPx}, colours,
               "stock allowance less wanted (mm)");
  return canvas;
}

}  // namespace

Figure StockAllowanceFigure(const PartFitInput& input, const PartFit& fit) {
  const std::vector<PlacedPoint> placed = Placed(input, fit);
  const std::vector<OutlineEdge> outline = OutlineOf(input);
  return {
      "stock-allowance",
      "Each point of the raw part on the side that its surface faces. Ringed in orange and named: "
      "the points that the placement rests on, the one with the least, or where material is "
      "missing. Of points in one place the one with the least is drawn; grey: the edges and the "
      "outline of the CAD part.",
      Draw(placed, outline, kFigureWidthPx),
      2,
      fmt::format(
          "{} points of the raw part by side, coloured by stock allowance less what is wanted; "
          "least {:.3f} mm.",
          placed.size(), fit.min_mm),
      Draw(placed, outline, kNarrowWidthPx)};
}

}  // namespace trammel::report
