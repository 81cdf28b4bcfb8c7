#include "part_alignment/survey/orientation.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "base/statistics.h"
#include "geometry/decompositions.h"
#include "geometry/euler.h"
#include "geometry/linear_systems.h"
#include "part_alignment/survey/bundle.h"

namespace trammel::part_alignment {
using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

namespace {

// Monomials of three unknowns up to the third degree: the ten cubic ones first, then the basis of
// the quotient ring.
constexpr int kMonomials = 20;
constexpr int kBasis = 10;
constexpr std::array<std::array<int, 3>, kMonomials> kExponents = {
    {{3, 0, 0}, {2, 1, 0}, {2, 0, 1}, {1, 2, 0}, {1, 1, 1}, {1, 0, 2}, {0, 3, 0},
     {0, 2, 1}, {0, 1, 2}, {0, 0, 3}, {2, 0, 0}, {1, 1, 0}, {1, 0, 1}, {0, 2, 0},
     {0, 1, 1}, {0, 0, 2}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};

constexpr int MonomialOf(const std::array<int, 3>& exponents) {
  for (std::size_t i = 0; i < kMonomials; ++i) {
    if (kExponents[i] == exponents) return static_cast<int>(i);
  }
  return -1;
}

constexpr auto kProducts = [] {
  std::array<std::array<int, kMonomials>, kMonomials> products{};
  for (std::size_t i = 0; i < kMonomials; ++i) {
    for (std::size_t j = 0; j < kMonomials; ++j) {
      products[i][j] =
          MonomialOf({kExponents[i][0] + kExponents[j][0], kExponents[i][1] + kExponents[j][1],
                      kExponents[i][2] + kExponents[j][2]});
    }
  }
  return products;
}();

using Polynomial = Eigen::Matrix<double, kMonomials, 1>;

// Multiplies. REQUIRES a product of the third degree at most.
Polynomial Times(const Polynomial& a, const Polynomial& b) {
  Polynomial product = Polynomial::Zero();
  for (Index i = 0; i < kMonomials; ++i) {
    if (a[i] == 0) continue;
    for (Index j = 0; j < kMonomials; ++j) {
      if (b[j] == 0) continue;
      product[kProducts[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)]] += a[i] * b[j];
    }
  }
  return product;
}

using PolynomialMatrix = std::array<std::array<Polynomial, 3>, 3>;

PolynomialMatrix CombinationOf(const std::array<Matrix3d, 4>& space) {
  PolynomialMatrix essential;
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) {
      Polynomial& entry = essential[r][c];
      entry.setZero();
      for (std::size_t k = 0; k < 4; ++k) {
        entry[static_cast<Index>(16 + k)] = space[k](static_cast<Index>(r), static_cast<Index>(c));
      }
    }
  }
  return essential;
}

Polynomial DeterminantOf(const PolynomialMatrix& m) {
  Polynomial sum = Polynomial::Zero();
  for (std::size_t c = 0; c < 3; ++c) {
    const std::size_t next = (c + 1) % 3;
    const std::size_t last = (c + 2) % 3;
    sum += Times(m[0][c], Times(m[1][next], m[2][last]) - Times(m[1][last], m[2][next]));
  }
  return sum;
}

// det E = 0 and 2 E E^T E - tr(E E^T) E = 0, a row each.
Eigen::Matrix<double, 10, kMonomials> ConstraintsOn(const PolynomialMatrix& essential) {
  Eigen::Matrix<double, 10, kMonomials> rows;
  rows.row(0) = DeterminantOf(essential).transpose();
  PolynomialMatrix square;
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) {
      square[r][c].setZero();
      for (std::size_t k = 0; k < 3; ++k) {
        square[r][c] += Times(essential[r][k], essential[c][k]);
      }
    }
  }
  const Polynomial half_trace = 0.5 * (square[0][0] + square[1][1] + square[2][2]);
  for (std::size_t i = 0; i < 3; ++i) square[i][i] -= half_trace;
  Index row = 1;
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) {
      Polynomial sum = Polynomial::Zero();
      for (std::size_t k = 0; k < 3; ++k) sum += Times(square[r][k], essential[k][c]);
      rows.row(row++) = sum.transpose();
    }
  }
  return rows;
}

// Returns the matrix of multiplication by the first unknown, on the basis of the quotient ring.
Eigen::Matrix<double, kBasis, kBasis> ActionMatrix(
    const Eigen::Matrix<double, 10, kMonomials>& constraints) {
  const Eigen::Matrix<double, 10, 10> cubic =
      geometry::SolveSquare(constraints.leftCols<10>(), constraints.rightCols<kBasis>());
  Eigen::Matrix<double, kBasis, kBasis> action = Eigen::Matrix<double, kBasis, kBasis>::Zero();
  for (std::size_t i = 0; i < kBasis; ++i) {
    std::array<int, 3> exponents = kExponents[kBasis + i];
    ++exponents[0];
    const int product = MonomialOf(exponents);
    if (product < kBasis) {
      action.row(static_cast<Index>(i)) = -cubic.row(product);
    } else {
      action(static_cast<Index>(i), product - kBasis) = 1;
    }
  }
  return action;
}

std::array<RelativeOrientation, 4> DecomposeEssential(const Matrix3d& essential) {
  geometry::SingularValues of = geometry::DecomposeSingular(essential);
  Matrix3d u = of.u;
  Matrix3d v = of.v;
  if (u.determinant() < 0) u = -u;
  if (v.determinant() < 0) v = -v;
  Matrix3d quarter;
  quarter << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  std::array<RelativeOrientation, 4> all;
  for (std::size_t i = 0; i < 4; ++i) {
    all[i].rotation = u * (i < 2 ? quarter : Matrix3d(quarter.transpose())) * v.transpose();
    const Vector3d translation = (i % 2 == 0 ? 1.0 : -1.0) * u.col(2);
    all[i].place = -all[i].rotation.transpose() * translation;
  }
  return all;
}

// Counts the points in front of both cameras.
int InFront(const RelativeOrientation& pair, std::span<const Vector3d> first,
            std::span<const Vector3d> second) {
  int count = 0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    const Vector3d other = pair.rotation.transpose() * second[i];
    // depth1 · first - depth2 · other = place, least squares.
    const double cosine = first[i].dot(other);
    const double across = 1 - cosine * cosine;
    const double depth1 = first[i].dot(pair.place) - cosine * other.dot(pair.place);
    const double depth2 = cosine * first[i].dot(pair.place) - other.dot(pair.place);
    if (across > 0 && depth1 > 0 && depth2 > 0) ++count;
  }
  return count;
}

double MedianError(const Matrix3d& essential, std::span<const Vector3d> first,
                   std::span<const Vector3d> second, std::vector<double>& scratch) {
  scratch.clear();
  for (std::size_t i = 0; i < first.size(); ++i) {
    const Vector3d line2 = essential * first[i];
    const Vector3d line1 = essential.transpose() * second[i];
    const double slope2 = line2.squaredNorm() + line1.squaredNorm();
    scratch.push_back(std::abs(second[i].dot(line2)) / std::sqrt(std::max(slope2, 1e-300)));
  }
  return Median(scratch);
}

bool Alike(const RelativeOrientation& a, const RelativeOrientation& b) {
  constexpr double kAlike = 0.035;  // 2 degrees
  const double turn = Eigen::AngleAxisd(a.rotation.transpose() * b.rotation).angle();
  return turn < kAlike && (a.place - b.place).norm() < kAlike;
}

}  // namespace

std::vector<Matrix3d> FivePointEssentials(std::span<const Vector3d, 5> first,
                                          std::span<const Vector3d, 5> second) {
  Eigen::Matrix<double, 9, 5> equations;
  for (std::size_t i = 0; i < 5; ++i) {
    const Matrix3d outer = second[i] * first[i].transpose();
    equations.col(static_cast<Index>(i)) = outer.reshaped();
  }
  const Eigen::Matrix<double, 9, 9> q = geometry::OrthogonalCompletion(equations);
  std::array<Matrix3d, 4> space;
  for (std::size_t k = 0; k < 4; ++k) {
    space[k] = q.col(static_cast<Index>(5 + k)).reshaped(3, 3);
  }
  const auto action = ActionMatrix(ConstraintsOn(CombinationOf(space)));
  std::vector<Matrix3d> essentials;
  if (!action.allFinite()) return essentials;
  const geometry::GeneralEigen of = geometry::DecomposeGeneral(action);
  for (Index i = 0; i < kBasis; ++i) {
    if (of.values[i].imag() != 0) continue;
    const Eigen::Matrix<double, kBasis, 1> basis = of.vectors.col(i).real();
    if (basis[kBasis - 1] == 0) continue;
    const Vector3d xyz = basis.segment<3>(6) / basis[kBasis - 1];
    const Matrix3d essential =
        xyz.x() * space[0] + xyz.y() * space[1] + xyz.z() * space[2] + space[3];
    if (essential.allFinite()) essentials.push_back(essential.normalized());
  }
  return essentials;
}

std::vector<RelativeOrientation> OrientPair(std::span<const Vector3d> first,
                                            std::span<const Vector3d> second, std::size_t most,
                                            Random& random) {
  constexpr int kDraws = 40;
  std::vector<std::pair<double, Matrix3d>> found;
  std::vector<double> scratch;
  if (first.size() < 6) return {};
  for (int draw = 0; draw < kDraws; ++draw) {
    std::array<Vector3d, 5> five1;
    std::array<Vector3d, 5> five2;
    std::vector<std::size_t> order(first.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    for (std::size_t i = 0; i < 5; ++i) {
      std::swap(order[i], order[i + random.Below(order.size() - i)]);
      five1[i] = first[order[i]];
      five2[i] = second[order[i]];
    }
    for (const Matrix3d& essential : FivePointEssentials(five1, five2)) {
      found.emplace_back(MedianError(essential, first, second, scratch), essential);
    }
  }
  std::sort(found.begin(), found.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<RelativeOrientation> best;
  for (const auto& [error, essential] : found) {
    if (best.size() >= most) break;
    auto four = DecomposeEssential(essential);
    const auto front =
        std::max_element(four.begin(), four.end(), [&](const auto& a, const auto& b) {
          return InFront(a, first, second) < InFront(b, first, second);
        });
    const bool known = std::any_of(best.begin(), best.end(),
                                   [&](const auto& other) { return Alike(other, *front); });
    if (!known) best.push_back(*front);
  }
  return best;
}

namespace {

std::vector<double> QuarticRoots(const std::array<double, 5>& rising) {
  Eigen::Matrix4d companion = Eigen::Matrix4d::Zero();
  companion.bottomLeftCorner<3, 3>().setIdentity();
  for (std::size_t i = 0; i < 4; ++i) {
    companion(static_cast<Index>(i), 3) = -rising[i] / rising[4];
  }
  std::vector<double> roots;
  if (!companion.allFinite()) return roots;
  const Eigen::VectorXcd values = geometry::DecomposeGeneral(companion).values;
  constexpr double kReal = 1e-4;  // double roots part by the root of rounding and noise
  for (const auto& value : values) {
    if (std::abs(value.imag()) < kReal * (1 + std::abs(value.real())))
      roots.push_back(value.real());
  }
  return roots;
}

// Returns a right-handed frame on three points.
Matrix3d FrameOn(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  Matrix3d frame;
  frame.col(0) = (b - a).normalized();
  frame.col(2) = (b - a).cross(c - a).normalized();
  frame.col(1) = frame.col(2).cross(frame.col(0));
  return frame;
}

std::size_t CountAgreeing(const Network& network, const Station& station,
                          std::span<const std::size_t> observations, double tolerance_px,
                          double& total) {
  std::size_t agreeing = 0;
  total = 0;
  for (const std::size_t i : observations) {
    const NetworkObservation& observation = network.observations[i];
    const auto projection =
        ProjectLens(network.lens, station.FromObject(network.points[observation.point].at));
    const double error = projection ? (projection->pixel - observation.pixel).norm() : INFINITY;
    if (error < tolerance_px) ++agreeing;
    total += std::min(error, tolerance_px);
  }
  return agreeing;
}

std::vector<std::size_t> Placed(const Network& network, std::span<const std::size_t> observations) {
  std::vector<std::size_t> placed;
  std::copy_if(
      observations.begin(), observations.end(), std::back_inserter(placed), [&](std::size_t i) {
        return network.observations[i].used && network.points[network.observations[i].point].placed;
      });
  return placed;
}

// Returns the bundle's model with one station, and the points that it sees.
Network StationAlone(const Network& network, const std::vector<std::size_t>& observations,
                     const Station& start) {
  Network alone;
  alone.lens = network.lens;
  alone.stations = {start};
  alone.stations[0].placed = true;
  for (const std::size_t i : observations) {
    const NetworkObservation& observation = network.observations[i];
    alone.observations.push_back(
        {0, alone.points.size(), observation.pixel, observation.sigma_px, true});
    alone.points.push_back(network.points[observation.point]);
  }
  return alone;
}

}  // namespace

std::vector<Station> ThreePointStations(std::span<const Vector3d, 3> object,
                                        std::span<const Vector3d, 3> lines) {
  const double a2 = (object[1] - object[2]).squaredNorm();
  const double b2 = (object[0] - object[2]).squaredNorm();
  const double c2 = (object[0] - object[1]).squaredNorm();
  const double cos_a = lines[1].dot(lines[2]);
  const double cos_b = lines[0].dot(lines[2]);
  const double cos_c = lines[0].dot(lines[1]);
  const double d = (a2 - c2) / b2;
  const double s = (a2 + c2) / b2;
  const std::array<double, 5> quartic = {
      (1 + d) * (1 + d) - 4 * a2 / b2 * cos_c * cos_c,
      4 * (-d * (1 + d) * cos_b + 2 * a2 / b2 * cos_c * cos_c * cos_b - (1 - s) * cos_a * cos_c),
      2 * (d * d - 1 + 2 * d * d * cos_b * cos_b + 2 * (b2 - c2) / b2 * cos_a * cos_a -
           4 * s * cos_a * cos_b * cos_c + 2 * (b2 - a2) / b2 * cos_c * cos_c),
      4 * (d * (1 - d) * cos_b - (1 - s) * cos_a * cos_c + 2 * c2 / b2 * cos_a * cos_a * cos_b),
      (d - 1) * (d - 1) - 4 * c2 / b2 * cos_a * cos_a};
  std::vector<Station> stations;
  for (const double v : QuarticRoots(quartic)) {
    const double u = ((d - 1) * v * v - 2 * d * cos_b * v + 1 + d) / (2 * (cos_c - v * cos_a));
    const double near2 = b2 / (1 + v * v - 2 * v * cos_b);
    if (!(v > 0 && u > 0 && near2 > 0) || !std::isfinite(u)) continue;
    const double near = std::sqrt(near2);
    const Vector3d first = near * lines[0];
    const Matrix3d camera = FrameOn(first, u * near * lines[1], v * near * lines[2]);
    Station station;
    station.rotation = camera * FrameOn(object[0], object[1], object[2]).transpose();
    station.place = object[0] - station.rotation.transpose() * first;
    station.placed = true;
    if (station.rotation.allFinite() && station.place.allFinite()) stations.push_back(station);
  }
  return stations;
}

std::optional<StationFit> FitStation(const Network& network,
                                     std::span<const std::size_t> observations,
                                     const Station& start, double loss_sigma, bool free_focal) {
  const std::vector<std::size_t> placed = Placed(network, observations);
  const std::size_t unknowns = free_focal ? 7 : 6;
  if (2 * placed.size() <= unknowns) return std::nullopt;
  Network alone = StationAlone(network, placed, start);
  for (const NetworkObservation& observation : alone.observations) {
    if (!Misclosure(alone, observation)) return std::nullopt;
  }
  BundleOptions options;
  options.free = free_focal ? kFocalFree : FreeLens{};
  options.loss_sigma = loss_sigma;
  options.bars = false;
  options.max_iterations = 40;
  options.fixed_points = true;
  StationFit fit;
  fit.cost = AdjustBundle(options, alone).cost;
  fit.station = alone.stations[0];
  fit.focal_px = alone.lens[kFocal];
  fit.observations = placed.size();
  if (free_focal) {
    const double weight = Reduce(NormalOf(alone, options).equations, 0).matrix(0, 0);
    if (!(weight > 0)) return std::nullopt;
    fit.focal_sigma_px = 1 / std::sqrt(weight);
  }
  return fit;
}

std::optional<Resection> Resect(const Network& network, std::span<const std::size_t> observations,
                                double tolerance_px, Random& random) {
  const std::vector<std::size_t> placed = Placed(network, observations);
  if (placed.size() < 4) return std::nullopt;
  std::vector<std::optional<Vector3d>> lines;
  for (const std::size_t i : placed) {
    lines.push_back(ObservationLine(network.lens, network.observations[i].pixel));
  }
  constexpr int kDraws = 60;
  Resection best;
  best.observations = placed.size();
  double best_total = INFINITY;
  for (int draw = 0; draw < kDraws; ++draw) {
    std::array<std::size_t, 3> three{};
    for (std::size_t& k : three) k = random.Below(placed.size());
    if (three[0] == three[1] || three[0] == three[2] || three[1] == three[2]) continue;
    std::array<Vector3d, 3> object;
    std::array<Vector3d, 3> seen;
    bool whole = true;
    for (std::size_t k = 0; k < 3; ++k) {
      whole = whole && lines[three[k]].has_value();
      if (!whole) break;
      seen[k] = *lines[three[k]];
      object[k] = network.points[network.observations[placed[three[k]]].point].at;
    }
    if (!whole) continue;
    for (const Station& station : ThreePointStations(object, seen)) {
      double total = 0;
      const std::size_t agreeing = CountAgreeing(network, station, placed, tolerance_px, total);
      if (total < best_total) {
        best_total = total;
        best.agreeing = agreeing;
        best.station = station;
      }
    }
  }
  if (best.agreeing < 4) return std::nullopt;
  std::vector<std::size_t> agreed;
  for (const std::size_t i : placed) {
    double total = 0;
    if (CountAgreeing(network, best.station, std::span(&i, 1), tolerance_px, total) == 1)
      agreed.push_back(i);
  }
  constexpr double kWidth = 0.2;  // relative to the tolerance
  const double sigma_px = network.observations[placed[0]].sigma_px;
  const auto fit =
      FitStation(network, agreed, best.station, kWidth * tolerance_px / sigma_px, false);
  if (!fit) return std::nullopt;
  best.station = fit->station;
  best.station.placed = true;
  double total = 0;
  best.agreeing = CountAgreeing(network, best.station, placed, tolerance_px, total);
  return best;
}

}  // namespace trammel::part_alignment
