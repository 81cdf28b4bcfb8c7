// The exact profile over the break: least squares of every polynomial press at any break point.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

#include "tap/samples/workspace.h"

namespace trammel::tap {

/// Samples to be fitted, in units that keep the arithmetic well conditioned.
struct BreakSamples {
  std::span<const double> y;       ///< Height above the first sample, 0 … 1, not falling.
  std::span<const double> force;   ///< Sign so that the press is positive; near zero on average.
  std::span<const double> weight;  ///< >= 0; empty for 1.
};

/// Two numbers that are worked on at once.
using Pair = double __attribute__((vector_size(16)));

/// Model: force = a + b (y - t) + sum over i = 1 … order of c_i d^i with d = max(0, t - y): a
/// sloped baseline, and below the break t a press that starts from zero.
///
/// The sums of squares of all orders at one break point come out of one Cholesky elimination of the
/// normal equations, because the models are nested; the normal equations come from moments that are
/// summed up once. Hence a profile over all break points costs O(samples), and no break point needs
/// to be guessed (Hudson 1966; Golub & Pereyra 1973 for the elimination of linear parameters).
class PressProfile {
 public:
  static constexpr std::size_t kOrders = 3;

  /// At one break point; orders 1 … kOrders at [0] … .
  struct At {
    double t;
    std::array<double, kOrders> sum_squares;
    /// c_1 of each order: how steeply the press starts. Negative is no press.
    std::array<double, kOrders> start_slope;
  };

  struct Coefficients {
    double a = 0;
    double b = 0;
    std::array<double, kOrders> c{};
  };

  /// Sums up moments in memory of the workspace, which must outlive the profile.
  PressProfile(const BreakSamples& samples, Workspace& workspace);

  /// False where the workspace was too small; nothing else may be called then.
  [[nodiscard]] bool Ready() const { return !prefix_.empty(); }
  /// @param t      Any break point.
  /// @param below  How many samples have y < t (or y <= t, which gives the same).
  [[nodiscard]] At Evaluate(double t, std::size_t below) const;
  [[nodiscard]] At Evaluate(double t) const { return Evaluate(t, Below(t)); }
  /// Only the first `orders` of them, for less; the others are no press.
  [[nodiscard]] At EvaluateUpTo(std::size_t orders, double t, std::size_t below) const;
  /// At samples first, first + step, …, two of them at a time.
  void EvaluateSamples(std::size_t orders, std::size_t first, std::size_t step,
                       std::span<At> at) const;
  /// The press c max(0, t - y) + k e + q e^2, e = max(0, s - y), s < t: the outer zone straight.
  /// Two of them side by side, which a processor works out at once.
  struct TwoZones {
    Pair sum_squares;         ///< With q = 0, >= 0 but for rounding,
    Pair sum_squares_curved;  ///< and with q as it comes.
    Pair outer_slope;         ///< c, with q as it comes,
    Pair added_slope;         ///< k
    Pair added_curve;         ///< and q.
  };
  /// The outer zone's column for a break at t, with the baseline taken out.
  struct OuterZone {
    double t = 0;
    double sum = 0;
    double sum_y = 0;
    double force = 0;
    double inverse = 0;
    double sum_squares = 0;
  };
  /// @param below  Samples with y < t.
  [[nodiscard]] OuterZone Outer(double t, std::size_t below) const;
  /// @param outer  One for each of the two, or the same for both.
  [[nodiscard]] TwoZones EvaluateTwoZones(const std::array<const OuterZone*, 2>& outer,
                                          const std::array<double, 2>& s) const;
  /// The same with a kink that is rounded from u to v, v < u <= t, between which the slope changes
  /// evenly: k (h^2 - e^2) / (2 (u - v)) + q e^2, h = max(0, u - y), e = max(0, v - y).
  [[nodiscard]] TwoZones EvaluateRounded(const std::array<const OuterZone*, 2>& outer,
                                         const std::array<double, 2>& u,
                                         const std::array<double, 2>& v) const;
  [[nodiscard]] Coefficients Fit(double t, std::size_t order) const;
  [[nodiscard]] std::size_t Below(double t) const {
    const std::span<const double> y = samples_.y;
    // Samples are nearly evenly spaced: the place is where it would be if they were, or next to it.
    const double guess = y.empty() ? 0 : (t - y.front()) * samples_per_y_ + 1;
    const std::size_t at = guess > 0 ? static_cast<std::size_t>(static_cast<std::ptrdiff_t>(
                                           std::min(guess, static_cast<double>(y.size()))))
                                     : 0;
    const bool placed = (at == 0 || y[at - 1] < t) && (at == y.size() || !(y[at] < t));
    return placed ? at : BelowNear(t, at);
  }
  [[nodiscard]] const BreakSamples& samples() const { return samples_; }
  /// Weighted sums over all samples: 1, y, y^2, force, force y, force^2.
  [[nodiscard]] std::array<double, 6> Totals() const;

  static constexpr std::size_t kBytesPerSample = 11 * sizeof(double);

 private:
  [[nodiscard]] std::size_t BelowNear(double t, std::size_t at) const;

  struct Moments {
    // Without values to begin with: thousands of them are written anew for every tap.
    std::array<double, 7> y;      // sum of weight y^i
    std::array<double, 4> force;  // sum of weight force y^i
  };
  // The normal equations of the press at a break point, with the baseline projected out (1 and
  // y - mean span it, whatever the break point), eliminated. Real is a number or a Pair.
  template <class Real>
  struct Elimination {
    std::array<Real, kOrders> sum_d{};   // of d^i
    std::array<Real, kOrders> sum_dy{};  // of d^i (y - mean)
    Real l12{};
    Real l13{};
    Real l23{};
    std::array<Real, kOrders> solved{};  // right-hand side over pivot
    std::array<Real, kOrders> gained{};  // by which each column lowers the sum of squares
  };
  template <class Real>
  struct Evaluation {
    std::array<Real, kOrders> sum_squares{};
    std::array<Real, kOrders> start_slope{};
  };
  // d and g are sums over the samples below t, of (t - y)^i and of these times the force.
  template <std::size_t kUpTo, class Real>
  [[nodiscard]] Elimination<Real> Eliminate(const Real& t, const std::array<Real, 2 * kUpTo + 1>& d,
                                            const std::array<Real, kUpTo + 1>& g) const;
  template <std::size_t kUpTo, class Real>
  [[nodiscard]] Evaluation<Real> EvaluateSums(const Real& t,
                                              const std::array<Real, 2 * kUpTo + 1>& d,
                                              const std::array<Real, kUpTo + 1>& g) const;
  template <std::size_t kUpTo>
  [[nodiscard]] At EvaluateOrders(double t, std::size_t below) const;
  template <std::size_t kUpTo>
  void EvaluatePairs(std::size_t first, std::size_t step, std::span<At> at) const;

  // The two columns of an inner zone: their sums, those times y - mean, their products with the
  // outer zone's column, with the force and with each other.
  struct InnerZone {
    std::array<Pair, 2> sum;
    std::array<Pair, 2> sum_y;
    std::array<Pair, 2> by_outer;
    std::array<Pair, 2> force;
    Pair p11, p12, p22;
  };
  [[nodiscard]] TwoZones SolveZones(const std::array<const OuterZone*, 2>& outer,
                                    const InnerZone& inner) const;

  BreakSamples samples_;
  std::span<Moments> prefix_;
  double samples_per_y_ = 0;  // on average
  double force_squares_ = 0;
  double mean_y_ = 0;
  double inverse_count_ = 0;
  double inverse_spread_ = 0;  // of 1 / sum (y - mean)^2
  double mean_force_ = 0;
  double slope_ = 0;        // of the baseline alone
  double sum_squares_ = 0;  // about the baseline alone
};

}  // namespace trammel::tap
