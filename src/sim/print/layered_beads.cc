#include "sim/print/layered_beads.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/print/bead.h"

namespace trammel::sim {
namespace {

constexpr double kMinGapMm = 0.03;  // the nozzle cannot press a bead thinner
constexpr double kMostAsideMm = 0.4;

struct Direction {
  double x = 1;
  double y = 0;
};

Direction DirectionAt(std::span<const Position> nozzle, std::size_t i) {
  const std::size_t a = i > 0 ? i - 1 : 0;
  const std::size_t b = std::min(i + 1, nozzle.size() - 1);
  const double dx = nozzle[b].x_mm - nozzle[a].x_mm;
  const double dy = nozzle[b].y_mm - nozzle[a].y_mm;
  const double length = std::hypot(dx, dy);
  return length > 0 ? Direction{dx / length, dy / length} : Direction{};
}

}  // namespace

std::vector<PathCorner> FindCorners(std::span<const TimedMove> plan, const Stroke& stroke,
                                    double spacing_mm) {
  constexpr double kSharpest = std::numbers::pi * 2 / 3;
  constexpr double kBluntest = std::numbers::pi / 3;
  std::vector<PathCorner> corners;
  double passed_mm = 0;
  for (std::size_t i = stroke.first; i < stroke.last; ++i) {
    passed_mm += plan[i].length_mm;
    const Move& a = plan[i].move;
    const Move& b = plan[i + 1].move;
    const double ax = (a.from.x_mm - a.to.x_mm) / plan[i].length_mm;
    const double ay = (a.from.y_mm - a.to.y_mm) / plan[i].length_mm;
    const double bx = (b.to.x_mm - b.from.x_mm) / plan[i + 1].length_mm;
    const double by = (b.to.y_mm - b.from.y_mm) / plan[i + 1].length_mm;
    const double inner = std::acos(std::clamp(ax * bx + ay * by, -1.0, 1.0));
    if (inner < kBluntest || inner > kSharpest) continue;
    const double length = std::hypot(ax + bx, ay + by);
    corners.push_back({static_cast<std::size_t>(passed_mm / spacing_mm + 0.5), a.to.x_mm, a.to.y_mm,
                       (ax + bx) / length, (ay + by) / length, inner / 2});
  }
  return corners;
}

void RoundPath(std::vector<Position>& nozzle, double spacing_mm, double sigma_mm) {
  if (sigma_mm < spacing_mm / 2) return;
  const std::vector<Position> sharp = nozzle;
  const auto count = static_cast<std::ptrdiff_t>(nozzle.size());
  const auto widest = static_cast<std::ptrdiff_t>(3 * sigma_mm / spacing_mm);
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    const std::ptrdiff_t reach = std::min({widest, i, count - 1 - i});
    double sum = 0;
    double x = 0;
    double y = 0;
    for (std::ptrdiff_t k = -reach; k <= reach; ++k) {
      const double z = static_cast<double>(k) * spacing_mm / sigma_mm;
      const double weight = std::exp(-0.5 * z * z);
      const Position& at = sharp[static_cast<std::size_t>(i + k)];
      sum += weight;
      x += weight * at.x_mm;
      y += weight * at.y_mm;
    }
    nozzle[static_cast<std::size_t>(i)].x_mm = x / sum;
    nozzle[static_cast<std::size_t>(i)].y_mm = y / sum;
  }
}

void RestOn(const LaidBeads& laid, StrandPath& path) {
  constexpr double kBesideMm = 0.12;  // a groove between two beads is no hole
  const std::size_t count = path.nozzle.size();
  double last_mm = 0;
  std::size_t first = count;
  for (std::size_t i = 0; i < count; ++i) {
    const Position& at = path.nozzle[i];
    const Direction along = DirectionAt(path.nozzle, i);
    double base = 0;
    for (const double off : {-kBesideMm, 0.0, kBesideMm}) {
      base = std::max(base, laid.BaseAt(at.x_mm - off * along.y, at.y_mm + off * along.x, at.z_mm));
    }
    if (base > 0) {
      last_mm = base;
      first = std::min(first, i);
    }
    path.base_mm[i] = base > 0 ? base : last_mm;
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (first < count && i < first) path.base_mm[i] = path.base_mm[first];
    if (path.base_mm[i] <= 0) continue;
    path.gap_mm[i] = std::max(kMinGapMm, path.nozzle[i].z_mm - path.base_mm[i]);
  }
}

std::vector<Strand> FillCorners(std::span<const PathCorner> corners, const StrandPath& path,
                                double radius_mm, const LaidBeads& laid,
                                std::span<double> area_mm2) {
  constexpr double kFromMm = 1.2;     // of each arm
  constexpr double kMostShare = 0.2;  // of their filament
  std::vector<Strand> fillets;
  if (radius_mm <= 0) return fillets;
  for (const PathCorner& corner : corners) {
    const std::size_t node = std::min(corner.node, path.nozzle.size() - 1);
    const Position& middle = path.nozzle[node];
    const double spacing = node > 0 ? std::hypot(middle.x_mm - path.nozzle[node - 1].x_mm,
                                                 middle.y_mm - path.nozzle[node - 1].y_mm)
                                    : 0;
    if (spacing <= 0) continue;
    const auto reach = static_cast<std::size_t>(kFromMm / spacing);
    if (node < reach || node + reach >= area_mm2.size()) continue;
    const double gap = path.gap_mm[node];
    const std::span<double> arms = area_mm2.subspan(node - reach, 2 * reach + 1);
    double volume = 0;
    for (const double area : arms) volume += area * spacing;
    if (*std::min_element(arms.begin(), arms.end()) <= 0) continue;
    const double half_width = 0.5 * (volume / (static_cast<double>(arms.size()) * spacing * gap) +
                                     gap * (1 - std::numbers::pi / 4));
    const double tangent = std::tan(corner.half_angle_rad);
    // The sliver between two edges and their arc of radius r has the area of a triangle that cuts
    // off the inner angle at this depth: r^2 (cot a - (pi / 2 - a)) = depth^2 tan a.
    const double sliver = 1 / tangent - (std::numbers::pi / 2 - corner.half_angle_rad);
    const double depth = radius_mm * std::sqrt(sliver / tangent);
    const double half_length = depth * tangent - depth / 2;
    const double share = depth * depth * tangent * gap / volume;
    const double x = corner.x_mm + corner.inside_x * half_width / std::sin(corner.half_angle_rad);
    const double y = corner.y_mm + corner.inside_y * half_width / std::sin(corner.half_angle_rad);
    const LaidPiece inside{x, y, middle.z_mm, -corner.inside_y, corner.inside_x, 0};
    const FreeRoom room = laid.RoomBeside(inside);
    if (half_length <= 0 || share > kMostShare || std::min(room.left_mm, room.right_mm) < depth) {
      continue;
    }
    for (double& area : arms) area *= 1 - share;
    const BeadSample half{x + corner.inside_x * depth / 2,
                          y + corner.inside_y * depth / 2,
                          volume * share / (2 * half_length),
                          depth,
                          gap,
                          path.base_mm[node]};
    Strand fillet;
    for (const double end : {-half_length, half_length}) {
      fillet.samples.push_back(half);
      fillet.samples.back().x_mm -= end * corner.inside_y;
      fillet.samples.back().y_mm += end * corner.inside_x;
    }
    fillets.push_back(std::move(fillet));
  }
  return fillets;
}

std::vector<LaidPiece> PushAside(const LaidBeads& laid, const StrandPath& path, Strand& strand) {
  std::vector<LaidPiece> pieces;
  pieces.reserve(strand.samples.size());
  for (std::size_t i = 0; i < strand.samples.size(); ++i) {
    BeadSample& sample = strand.samples[i];
    const Direction along = DirectionAt(path.nozzle, i);
    LaidPiece piece{sample.x_mm, sample.y_mm, path.nozzle[i].z_mm, along.x, along.y, 0};
    if (sample.height_mm > 0) {
      const double half = 0.5 * sample.area_mm2 / sample.height_mm;
      piece.half_mm = half;
      const FreeRoom room = laid.RoomBeside(piece);
      double aside = 0;  // to the left
      if (room.left_mm + room.right_mm < 2 * half) {
        aside = (room.left_mm - room.right_mm) / 2;
      } else if (room.left_mm < half) {
        aside = room.left_mm - half;
      } else if (room.right_mm < half) {
        aside = half - room.right_mm;
      }
      aside = std::clamp(aside, -kMostAsideMm, kMostAsideMm);
      sample.x_mm -= aside * along.y;
      sample.y_mm += aside * along.x;
      piece.x_mm = sample.x_mm;
      piece.y_mm = sample.y_mm;
    }
    pieces.push_back(piece);
  }
  return pieces;
}

}  // namespace trammel::sim
