#include "sim/survey/survey_part.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/random.h"

namespace trammel::sim {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

double Lift(const BlockHill& hill, double x_mm, double y_mm) {
  const double square = (Vector2d(x_mm, y_mm) - hill.at_mm).squaredNorm();
  return hill.height_mm * std::exp(-0.5 * square / (hill.width_mm * hill.width_mm));
}

}  // namespace

FreeformBlock DrawBlock(std::uint64_t seed) {
  Random random(seed);
  FreeformBlock block;
  constexpr int kHills = 7;
  for (int i = 0; i < kHills; ++i) {
    BlockHill hill;
    hill.at_mm = {random.Uniform(-0.9, 0.9) * block.half_length_mm,
                  random.Uniform(-0.9, 0.9) * block.half_width_mm};
    const bool steep = i % 2 == 0;
    hill.height_mm = steep ? random.Uniform(60, 120) : random.Uniform(20, 80);
    hill.width_mm = steep ? random.Uniform(80, 140) : random.Uniform(200, 400);
    block.hills.push_back(hill);
  }
  return block;
}

double TopAt(const FreeformBlock& block, double x_mm, double y_mm) {
  double z = 0;
  for (const BlockHill& hill : block.hills) z += Lift(hill, x_mm, y_mm);
  return z;
}

Vector3d TopPoint(const FreeformBlock& block, double x_mm, double y_mm) {
  return {x_mm, y_mm, TopAt(block, x_mm, y_mm)};
}

Vector3d TopNormal(const FreeformBlock& block, double x_mm, double y_mm) {
  Vector2d slope = Vector2d::Zero();
  for (const BlockHill& hill : block.hills) {
    slope += Lift(hill, x_mm, y_mm) / (hill.width_mm * hill.width_mm) *
             (hill.at_mm - Vector2d(x_mm, y_mm));
  }
  return Vector3d(-slope.x(), -slope.y(), 1).normalized();
}

bool IsOpenTo(const FreeformBlock& block, const Vector3d& at_mm, const Vector3d& eye_mm) {
  double highest = 0;
  for (const BlockHill& hill : block.hills) highest += std::max(0.0, hill.height_mm);
  constexpr double kStep_mm = 8;
  const Vector3d step = kStep_mm * (eye_mm - at_mm).normalized();
  const int most = static_cast<int>((eye_mm - at_mm).norm() / kStep_mm);
  Vector3d place = at_mm;
  for (int i = 0; i < most; ++i) {
    place += step;
    if (place.z() > highest && step.z() >= 0) return true;
    const bool within = std::abs(place.x()) < block.half_length_mm &&
                        std::abs(place.y()) < block.half_width_mm && place.z() > -block.depth_mm;
    if (within && place.z() < TopAt(block, place.x(), place.y())) return false;
  }
  return true;
}

using Eigen::Vector2d;
using Eigen::Vector3d;

std::vector<HandShot> WalkAround(const HandWalk& walk, std::uint64_t seed) {
  Random random(seed);
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  std::vector<HandShot> shots;
  for (int i = 0; i < walk.pictures; ++i) {
    const double azimuth = golden * i + random.Uniform(-0.15, 0.15);
    const double elevation = random.Uniform(walk.lowest_rad, walk.highest_rad);
    const Vector3d outward(std::cos(azimuth) * std::cos(elevation),
                           std::sin(azimuth) * std::cos(elevation), std::sin(elevation));
    const Vector3d aim(random.Uniform(-300, 300), random.Uniform(-200, 200), -120);
    HandShot shot;
    shot.place_mm = aim + walk.distance_mm * random.Uniform(0.9, 1.1) * outward;
    shot.ahead = (aim - shot.place_mm).normalized();
    const double roll =
        (walk.rolled && i % 2 == 1 ? 0.5 * std::numbers::pi : 0) + random.Uniform(-0.1, 0.1);
    const Vector3d level = shot.ahead.cross(Vector3d::UnitZ()).normalized();
    shot.right = Eigen::AngleAxisd(roll, shot.ahead) * level;
    shot.down = shot.ahead.cross(shot.right);
    shots.push_back(shot);
  }
  return shots;
}

std::optional<Vector2d> SeenAt(const HandLens& lens, const HandShot& shot, const Vector3d& at_mm,
                               double margin_px) {
  const Vector3d ray = at_mm - shot.place_mm;
  const double depth = ray.dot(shot.ahead);
  constexpr double kWidest = 1.2;  // tan 50 degrees
  if (depth <= 0) return std::nullopt;
  const double a = ray.dot(shot.right) / depth;
  const double b = ray.dot(shot.down) / depth;
  const double q = a * a + b * b;
  if (q > kWidest * kWidest) return std::nullopt;
  const double radial = 1 + q * (lens.k1 + q * lens.k2);
  const Vector2d distorted(a * radial + lens.p2 * (q + 2 * a * a) + 2 * lens.p1 * a * b,
                           b * radial + lens.p1 * (q + 2 * b * b) + 2 * lens.p2 * a * b);
  const Vector2d seen = Vector2d((lens.width_px - 1) / 2.0 + lens.column_off_px,
                                 (lens.height_px - 1) / 2.0 + lens.row_off_px) +
                        lens.focal_px * distorted;
  if (seen.x() < margin_px || seen.x() > lens.width_px - 1 - margin_px || seen.y() < margin_px ||
      seen.y() > lens.height_px - 1 - margin_px) {
    return std::nullopt;
  }
  return seen;
}

std::optional<DiscImage> DiscSeenAt(const HandLens& lens, const HandShot& shot,
                                    const Vector3d& at_mm, const Vector3d& normal, double radius_mm,
                                    double margin_px) {
  const auto centre = SeenAt(lens, shot, at_mm, margin_px);
  if (!centre) return std::nullopt;
  constexpr int kCorners = 64;
  const Vector3d one = radius_mm * normal.unitOrthogonal();
  const Vector3d other = normal.cross(one);
  // Moments of the triangles from the centre's image to the outline's pieces.
  double area = 0;
  Vector2d first = Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
  Vector2d corner;
  for (int i = 0; i <= kCorners; ++i) {
    const double turn = 2 * std::numbers::pi * i / kCorners;
    const auto seen =
        SeenAt(lens, shot, at_mm + std::cos(turn) * one + std::sin(turn) * other, margin_px);
    if (!seen) return std::nullopt;
    const Vector2d next = *seen - *centre;
    if (i > 0) {
      const double piece = 0.5 * (corner.x() * next.y() - corner.y() * next.x());
      const Vector2d sum = corner + next;
      area += piece;
      first += piece / 3 * sum;
      second += piece / 12 *
                (sum * sum.transpose() + corner * corner.transpose() + next * next.transpose());
    }
    corner = next;
  }
  const Vector2d middle = first / area;
  const Eigen::Matrix2d moments = second / area - middle * middle.transpose();
  DiscImage image;
  image.centre_px = *centre + middle;
  const double half_trace = 0.5 * moments.trace();
  const double half_difference = 0.5 * (moments(0, 0) - moments(1, 1));
  const double spread = std::hypot(half_difference, moments(0, 1));
  image.major_px = 2 * std::sqrt(half_trace + spread);
  image.minor_px = 2 * std::sqrt(std::max(0.0, half_trace - spread));
  image.angle_rad = 0.5 * std::atan2(moments(0, 1), half_difference);
  return image;
}

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double kRim_mm = 15;  // between a mark and an edge of the block

/// Places marks on a block, none within another's clearance.
class Placer {
 public:
  Placer(const SurveyPartTraits& traits, Random& random, SurveyPart& part)
      : traits_(traits), random_(random), part_(part) {}

  bool Add(const Vector3d& at_mm, const Vector3d& normal, int code, double room_mm) {
    for (const SurveyMark& mark : part_.marks) {
      const double apart = mark.code > 0 || code > 0 ? std::max(room_mm, 25.0) : room_mm;
      if ((mark.at_mm - at_mm).norm() < apart) return false;
    }
    const double radius = code > 0 ? traits_.coded_radius_mm : traits_.plain_radius_mm;
    part_.marks.push_back({code, at_mm, normal, radius});
    return true;
  }

  bool AddOnTop(const Vector2d& at, int code, double room_mm) {
    if (std::abs(at.x()) > part_.block.half_length_mm - kRim_mm ||
        std::abs(at.y()) > part_.block.half_width_mm - kRim_mm) {
      return false;
    }
    return Add(TopPoint(part_.block, at.x(), at.y()), TopNormal(part_.block, at.x(), at.y()), code,
               room_mm);
  }

  // Top for `face` 0 and 1, the four sides for 2 … 5.
  void AddAnywhere(int face, int code, double room_mm) {
    const FreeformBlock& block = part_.block;
    for (;;) {
      const double u = random_.Uniform(-0.97, 0.97);
      const double v = random_.Uniform(-0.97, 0.97);
      const double z = 0.5 * block.depth_mm * (v - 1);
      const double sign = face % 2 == 0 ? 1 : -1;
      bool added = false;
      if (face < 2) {
        added = AddOnTop({block.half_length_mm * u, block.half_width_mm * v}, code, room_mm);
      } else if (face < 4) {
        added = Add({block.half_length_mm * u, sign * block.half_width_mm, z}, {0, sign, 0}, code,
                    room_mm);
      } else {
        added = Add({sign * block.half_length_mm, block.half_width_mm * u, z}, {sign, 0, 0}, code,
                    room_mm);
      }
      if (added) return;
    }
  }

 private:
  const SurveyPartTraits& traits_;
  Random& random_;
  SurveyPart& part_;
};

Vector2d AnywhereOnTop(const FreeformBlock& block, Random& random) {
  return {random.Uniform(-0.9, 0.9) * block.half_length_mm,
          random.Uniform(-0.9, 0.9) * block.half_width_mm};
}

int AddGrid(const SurveyPartTraits& traits, Random& random, Placer& placer) {
  const double turn = random.Uniform(0, std::numbers::pi);
  const Vector2d along = traits.grid_pitch_mm * Vector2d(std::cos(turn), std::sin(turn));
  const Vector2d across(-along.y(), along.x());
  const Vector2d middle(random.Uniform(-500, 500), random.Uniform(-150, 150));
  int added = 0;
  for (int i = 0; i < traits.grid_columns; ++i) {
    for (int j = 0; j < traits.grid_rows; ++j) {
      const double column = i - 0.5 * (traits.grid_columns - 1);
      const double row = j - 0.5 * (traits.grid_rows - 1);
      if (placer.AddOnTop(middle + column * along + row * across, 0, 12)) ++added;
    }
  }
  return added;
}

// Adds points of the top on the plane of two cameras and a top point.
int AddRow(const SurveyPartTraits& traits, const std::vector<HandShot>& shots,
           const FreeformBlock& block, Random& random, Placer& placer) {
  const std::size_t one = random.Below(shots.size());
  const std::size_t other = (one + 1 + random.Below(shots.size() - 1)) % shots.size();
  const Vector2d start = AnywhereOnTop(block, random);
  const Vector3d from = TopPoint(block, start.x(), start.y());
  const Vector3d plane =
      (shots[one].place_mm - from).cross(shots[other].place_mm - from).normalized();
  Vector2d at = start;
  int added = 0;
  for (int i = 0; i < traits.in_row; ++i) {
    if (placer.AddOnTop(at, 0, 12)) ++added;
    const Vector3d along = plane.cross(TopNormal(block, at.x(), at.y())).normalized();
    at += traits.row_pitch_mm * along.head<2>();
    for (int round = 0; round < 10; ++round) {  // back into the plane
      const Vector3d normal = TopNormal(block, at.x(), at.y());
      const Vector3d aside = normal.cross(plane.cross(normal)).normalized();
      const double off = plane.dot(TopPoint(block, at.x(), at.y()) - from);
      at -= off / plane.dot(aside) * aside.head<2>();
    }
  }
  return added;
}

int AddPair(const SurveyPartTraits& traits, const FreeformBlock& block, Random& random,
            Placer& placer) {
  const Vector2d at = AnywhereOnTop(block, random);
  const double turn = random.Uniform(0, 2 * std::numbers::pi);
  const double apart = random.Uniform(traits.nearest_pair_mm, traits.widest_pair_mm);
  if (!placer.AddOnTop(at, 0, 20)) return 0;
  const Vector2d step = apart * Vector2d(std::cos(turn), std::sin(turn));
  return placer.AddOnTop(at + step, 0, 0.9 * traits.nearest_pair_mm) ? 2 : 1;
}

void AddBar(int from, const Vector3d& start, const Vector3d& along, double radius_mm,
            Random& random, SurveyPart& part) {
  part.marks.push_back({from, start, Vector3d::UnitZ(), radius_mm});
  part.marks.push_back({from + 1, start + along, Vector3d::UnitZ(), radius_mm});
  SurveyBar bar{from, from + 1, 0, 0.01};
  bar.length_mm = along.norm() + bar.sigma_mm * random.Normal();
  part.bars.push_back(bar);
}

double Way(const FreeformBlock& block, const Vector3d& lamp, const Vector3d& optics,
           const Vector2d& at) {
  const Vector3d place = TopPoint(block, at.x(), at.y());
  return (place - lamp).norm() + (place - optics).norm();
}

// Finds a stationary light path (Fermat) by Newton's method with differences.
std::optional<Vector2d> Stationary(const FreeformBlock& block, const Vector3d& lamp,
                                   const Vector3d& optics, Vector2d at) {
  constexpr double kStep_mm = 0.5;
  const Vector2d x(kStep_mm, 0);
  const Vector2d y(0, kStep_mm);
  const auto way = [&](const Vector2d& place) { return Way(block, lamp, optics, place); };
  for (int round = 0; round < 15; ++round) {
    const double here = way(at);
    const double right = way(at + x);
    const double left = way(at - x);
    const double up = way(at + y);
    const double down = way(at - y);
    const Vector2d slope((right - left) / (2 * kStep_mm), (up - down) / (2 * kStep_mm));
    const double square = kStep_mm * kStep_mm;
    const double mixed =
        (way(at + x + y) - way(at + x - y) - way(at - x + y) + way(at - x - y)) / (4 * square);
    Eigen::Matrix2d bend;
    bend << (right - 2 * here + left) / square, mixed, mixed, (up - 2 * here + down) / square;
    if (std::abs(bend.determinant()) < 1e-12) return std::nullopt;
    const Vector2d by = bend.inverse() * slope;
    if (by.norm() > 400) return std::nullopt;
    at -= by;
    if (std::abs(at.x()) > block.half_length_mm || std::abs(at.y()) > block.half_width_mm) {
      return std::nullopt;
    }
    constexpr double kStill_mm = 1e-3;
    if (by.norm() < kStill_mm) return at;
  }
  return std::nullopt;
}

}  // namespace

SurveyPart DrawSurveyPart(const SurveyPartTraits& traits, const std::vector<HandShot>& shots,
                          std::uint64_t seed) {
  Random random = Random(seed).Fork(1);
  SurveyPart part;
  part.block = DrawBlock(seed);
  Placer placer(traits, random, part);
  for (int i = 0; i < traits.coded; ++i) placer.AddAnywhere(i % 6, i + 1, 60);
  const double radius = traits.coded_radius_mm;
  AddBar(901, {-700, -850, -300}, {1000, 12, 3}, radius, random, part);
  AddBar(903, {1250, -450, -300}, {20, 1000, -4}, radius, random, part);
  int plain = AddGrid(traits, random, placer);
  for (int i = 0; i < traits.rows; ++i) plain += AddRow(traits, shots, part.block, random, placer);
  for (int i = 0; i < traits.pairs; ++i) plain += AddPair(traits, part.block, random, placer);
  for (; plain < traits.plain; ++plain) placer.AddAnywhere(plain % 6, 0, 12);
  for (int i = 0; i < traits.screws; ++i) {
    const Vector2d at = AnywhereOnTop(part.block, random);
    SurveyScrew screw;
    screw.radius_mm = random.Uniform(2, 5);
    screw.normal = TopNormal(part.block, at.x(), at.y());
    screw.centre_mm = TopPoint(part.block, at.x(), at.y()) - 0.3 * screw.radius_mm * screw.normal;
    part.screws.push_back(screw);
  }
  for (int i = 0; i < traits.lamps; ++i) {
    part.lamps_mm.emplace_back(random.Uniform(-2500, 2500), random.Uniform(-2500, 2500),
                               random.Uniform(1800, 3500));
  }
  return part;
}

std::vector<Vector3d> GlintsOf(const FreeformBlock& block, const Vector3d& lamp_mm,
                               const Vector3d& eye_mm) {
  constexpr int kColumns = 9;
  constexpr int kRows = 6;
  constexpr double kSame_mm = 2;
  std::vector<Vector3d> glints;
  for (int i = 0; i < kColumns * kRows; ++i) {
    const Vector2d start(
        (2.0 * (i % kColumns) / (kColumns - 1) - 1) * 0.95 * block.half_length_mm,
        (2.0 * static_cast<int>(i / kColumns) / (kRows - 1) - 1) * 0.95 * block.half_width_mm);
    const auto at = Stationary(block, lamp_mm, eye_mm, start);
    if (!at) continue;
    const Vector3d glint = TopPoint(block, at->x(), at->y());
    const bool known = std::any_of(glints.begin(), glints.end(), [&](const Vector3d& other) {
      return (other - glint).norm() < kSame_mm;
    });
    if (!known && IsOpenTo(block, glint, eye_mm) && IsOpenTo(block, glint, lamp_mm)) {
      glints.push_back(glint);
    }
  }
  return glints;
}

Vector3d GlintOf(const SurveyScrew& screw, const Vector3d& lamp_mm, const Vector3d& eye_mm) {
  Vector3d normal = screw.normal;
  for (int round = 0; round < 20; ++round) {
    const Vector3d at = screw.centre_mm + screw.radius_mm * normal;
    normal = ((lamp_mm - at).normalized() + (eye_mm - at).normalized()).normalized();
  }
  return screw.centre_mm + screw.radius_mm * normal;
}

}  // namespace trammel::sim
