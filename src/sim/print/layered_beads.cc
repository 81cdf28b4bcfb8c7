#include "sim/print/layered_beads.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trammel::sim {
namespace {

constexpr double kMinGapMm = 0.03;  // the nozzle cannot press a bead thinner

struct Direction {
  double x = 1;
  double y = 0;
};

// Returns the direction over `reach` nodes on either side.
Direction DirectionAt(std::span<const Position> nozzle, std::size_t i, std::size_t reach = 1) {
  const std::size_t a = i > reach ? i - reach : 0;
  const std::size_t b = std::min(i + reach, nozzle.size() - 1);
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

void CarryOn(std::span<double> area_mm2, std::span<const double> full_mm2, double spacing_mm) {
  // By eye, from a photo of a real print: with too little advance the second arm is thick for 3 mm.
  constexpr double kTakenShare = 0.5;
  constexpr double kLengthMm = 2;
  const double left_share = std::min(1.0, spacing_mm / kLengthMm);
  double carried = 0;  // mm^2 times spacings
  for (std::size_t i = 0; i < area_mm2.size(); ++i) {
    const bool last = i + 1 == area_mm2.size();
    const double length = i == 0 || last ? 0.5 : 1.0;
    const double taken = length * kTakenShare * std::max(0.0, area_mm2[i] - full_mm2[i]);
    const double left = last ? carried + taken : left_share * carried;
    area_mm2[i] += (left - taken) / length;
    carried += taken - left;
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
  constexpr double kWiderThanSliver = 1.7;
  constexpr double kFreeMm = 0.5;  // in a slot between two walls no melt gathers
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
    const double mean = volume / (static_cast<double>(arms.size()) * spacing);
    // The inner edge of a starved bead is nearer to its path; a surplus goes to the outer side.
    const double half_width =
        0.5 * (std::min(mean, area_mm2[node]) / gap + gap * (1 - std::numbers::pi / 4));
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
    if (half_length <= 0 || share > kMostShare || std::min(room.left_mm, room.right_mm) < kFreeMm) {
      continue;
    }
    for (double& area : arms) area *= 1 - share;
    // Wider than the sliver, below the arms' round flanks: there is no groove between them.
    const double width = kWiderThanSliver * depth;
    const double centre = depth - width / 2;
    const BeadSample half{x + corner.inside_x * centre,
                          y + corner.inside_y * centre,
                          volume * share / (2 * half_length),
                          width,
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

namespace {

// Smooths values along the path by a Gaussian; the ends count as continued.
void SmoothAlong(std::vector<double>& values, double sigma_nodes) {
  const auto reach = static_cast<std::ptrdiff_t>(3 * sigma_nodes);
  std::vector<double> weights;
  for (std::ptrdiff_t k = 0; k <= reach; ++k) {
    const double z = static_cast<double>(k) / sigma_nodes;
    weights.push_back(std::exp(-0.5 * z * z));
  }
  const std::vector<double> before = values;
  const auto last = static_cast<std::ptrdiff_t>(values.size()) - 1;
  for (std::ptrdiff_t i = 0; i <= last; ++i) {
    double sum = 0;
    double total = 0;
    for (std::ptrdiff_t k = -reach; k <= reach; ++k) {
      const double weight = weights[static_cast<std::size_t>(std::abs(k))];
      sum += weight;
      total +=
          weight * before[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(i + k, 0, last))];
    }
    values[static_cast<std::size_t>(i)] = total / sum;
  }
}

// Returns how much of a gap to a neighbour closes: a melt wets what it touches and is drawn to it.
// A wide gap tears open and remains. By eye, from a photo of a real print: holes begin 5 ms above
// the right advance, and are twice as wide 5 ms later.
double ClosedGap(double gap_mm) {
  constexpr double kWetMm = 0.03;
  constexpr double kTornMm = 0.12;
  if (gap_mm >= kTornMm) return 0;  // also infinite ones
  return gap_mm * std::min(1.0, (kTornMm - gap_mm) / (kTornMm - kWetMm));
}

// Returns how far a piece of this half-width moves to the left.
double AsideOf(const FreeRoom& room, double half_mm) {
  constexpr double kMostMm = 0.5;
  double aside = 0;
  if (room.left_mm + room.right_mm < 2 * half_mm) {
    aside = (room.left_mm - room.right_mm) / 2;
  } else if (room.left_mm < half_mm) {
    aside = room.left_mm - half_mm;
  } else if (room.right_mm < half_mm) {
    aside = half_mm - room.right_mm;
  } else {
    // Drawn from both sides it remains in the middle.
    aside = ClosedGap(room.left_mm - half_mm) - ClosedGap(room.right_mm - half_mm);
  }
  return std::clamp(aside, -kMostMm, kMostMm);
}

// Returns each node's length along the path.
std::vector<double> LengthsOf(std::span<const Position> nodes) {
  std::vector<double> lengths;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const Position& a = nodes[i > 0 ? i - 1 : 0];
    const Position& b = nodes[std::min(i + 1, nodes.size() - 1)];
    lengths.push_back(std::hypot(b.x_mm - a.x_mm, b.y_mm - a.y_mm));
  }
  return lengths;
}

}  // namespace

PushedStrand PushAside(const LaidBeads& laid, const StrandPath& path,
                       std::span<const double> area_mm2, double spacing_mm,
                       const BeadOptions& options) {
  constexpr double kSmoothMm = 0.2;  // a melt has no sharper bend
  constexpr int kRounds = 3;         // a longer path is thinner, and moves less
  const std::size_t count = area_mm2.size();
  PushedStrand pushed;
  std::vector<FreeRoom> rooms;
  std::vector<BeadShape> shapes(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Direction along = DirectionAt(path.nozzle, i, 3);
    shapes[i] = ShapeOf(area_mm2[i], path.gap_mm[i], options);
    const double half = shapes[i].height_mm > 0 ? 0.5 * area_mm2[i] / shapes[i].height_mm : 0;
    pushed.pieces.push_back(
        {path.nozzle[i].x_mm, path.nozzle[i].y_mm, path.nozzle[i].z_mm, along.x, along.y, half});
    rooms.push_back(laid.RoomBeside(pushed.pieces.back()));
  }
  const std::vector<double> lengths = LengthsOf(path.nozzle);
  std::vector<double> area(area_mm2.begin(), area_mm2.end());
  std::vector<Position> nodes = path.nozzle;
  std::vector<double> aside(count);
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t i = 0; i < count; ++i) {
      aside[i] = AsideOf(rooms[i], pushed.pieces[i].half_mm);
    }
    if (std::all_of(aside.begin(), aside.end(), [](double a) { return a == 0; })) break;
    SmoothAlong(aside, kSmoothMm / spacing_mm);
    for (std::size_t i = 0; i < count; ++i) {
      nodes[i].x_mm = path.nozzle[i].x_mm - aside[i] * pushed.pieces[i].along_y;
      nodes[i].y_mm = path.nozzle[i].y_mm + aside[i] * pushed.pieces[i].along_x;
    }
    std::vector<double> stretch = LengthsOf(nodes);
    for (std::size_t i = 0; i < count; ++i) stretch[i] /= std::max(lengths[i], 1e-6);
    SmoothAlong(stretch, 0.5 * kSmoothMm / spacing_mm);
    for (std::size_t i = 0; i < count; ++i) {
      area[i] = area_mm2[i] / std::max(stretch[i], 0.5);
      shapes[i] = ShapeOf(area[i], path.gap_mm[i], options);
      pushed.pieces[i].half_mm = shapes[i].height_mm > 0 ? 0.5 * area[i] / shapes[i].height_mm : 0;
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    pushed.pieces[i].x_mm = nodes[i].x_mm;
    pushed.pieces[i].y_mm = nodes[i].y_mm;
    pushed.strand.samples.push_back({nodes[i].x_mm, nodes[i].y_mm, area[i], shapes[i].width_mm,
                                     shapes[i].height_mm, path.base_mm[i]});
  }
  return pushed;
}

}  // namespace trammel::sim
