#include "part_alignment/survey/relative_orientation.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/statistics.h"
#include "geometry/decompositions.h"
#include "geometry/linear_systems.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

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

// REQUIRES a product of the third degree at most.
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

// Multiplication by the first unknown, on the basis of the quotient ring.
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

// How many points lie before both cameras.
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
    front->median_error = error;
    const bool known = std::any_of(best.begin(), best.end(),
                                   [&](const auto& other) { return Alike(other, *front); });
    if (!known) best.push_back(*front);
  }
  return best;
}

}  // namespace trammel::part_alignment
