// The exact profile over the break: least squares of every polynomial press at any break point.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

#include "tap/contact/moments.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

/// Samples to be fitted, in units that keep the arithmetic well conditioned.
struct BreakSamples {
  std::span<const double> y;       ///< Height above the first sample, 0 … 1, not falling.
  std::span<const double> force;   ///< Sign so that the press is positive; near zero on average.
  std::span<const double> weight;  ///< >= 0; empty for 1.
};

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

  /// The baseline alone, without a press.
  struct Baseline {
    double mean_y = 0;
    double inverse_count = 0;
    double inverse_spread = 0;  ///< Of 1 / sum (y - mean)^2.
    double mean_force = 0;
    double slope = 0;
    double sum_squares = 0;  ///< About it.
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
  /// Only the first `orders` of them; the others are no press.
  [[nodiscard]] At EvaluateUpTo(std::size_t orders, double t, std::size_t below) const;
  [[nodiscard]] Coefficients Fit(double t, std::size_t order) const;
  [[nodiscard]] std::size_t Below(double t) const {
    // Samples are nearly evenly spaced: the place is where it would be if they were, or next to it.
    const double guess = t * samples_per_y_ + place_of_0_;
    return BelowFrom(guess > 0 ? std::min(guess, count_) : 0, t);
  }
  /// Of two.
  [[nodiscard]] std::array<std::size_t, 2> Below(const Pair& t) const {
    const Pair guess = t * samples_per_y_ + place_of_0_;
    const Pair from_0 = guess > 0 ? guess : Pair{0, 0};
    const Pair within = from_0 < count_ ? from_0 : Pair{count_, count_};
    return {BelowFrom(within[0], t[0]), BelowFrom(within[1], t[1])};
  }
  /// Over the first samples, so many.
  [[nodiscard]] const Moments& Sums(std::size_t below) const { return prefix_[below]; }
  [[nodiscard]] const Baseline& baseline() const { return baseline_; }
  [[nodiscard]] const BreakSamples& samples() const { return samples_; }
  /// Weighted sums over all samples: 1, y, y^2, force, force y, force^2.
  [[nodiscard]] std::array<double, 6> Totals() const;

  static constexpr std::size_t kBytesPerSample = sizeof(Moments);

 private:
  // @param guess  0 … samples.
  [[nodiscard]] std::size_t BelowFrom(double guess, double t) const {
    const std::span<const double> y = samples_.y;
    const auto at = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(guess));
    const bool placed = (at == 0 || y[at - 1] < t) && (at == y.size() || !(y[at] < t));
    return placed ? at : BelowNear(t, at);
  }
  [[nodiscard]] std::size_t BelowNear(double t, std::size_t at) const;

  // The normal equations of the press at a break point, with the baseline projected out (1 and
  // y - mean span it, whatever the break point), eliminated.
  struct Elimination {
    std::array<double, kOrders> sum_d{};   // of d^i
    std::array<double, kOrders> sum_dy{};  // of d^i (y - mean)
    double l12 = 0;
    double l13 = 0;
    double l23 = 0;
    std::array<double, kOrders> solved{};  // right-hand side over pivot
    std::array<double, kOrders> gained{};  // by which each column lowers the sum of squares
  };
  [[nodiscard]] Elimination Eliminate(double t, std::size_t below) const;

  BreakSamples samples_;
  std::span<Moments> prefix_;
  double count_ = 0;          // of samples,
  double samples_per_y_ = 0;  // on average,
  double place_of_0_ = 0;     // and how many of them would lie below y = 0
  double force_squares_ = 0;
  Baseline baseline_;
};

}  // namespace trammel::tap
