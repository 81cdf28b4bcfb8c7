// Computes the exact profile over the break: least squares of every polynomial press at any break
// point.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

#include "tap/contact/moments.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

/// Samples for a fit, in units that keep the arithmetic well conditioned.
struct BreakSamples {
  std::span<const double> y;       ///< Height above the first sample, 0 … 1, not falling.
  std::span<const double> force;   ///< Sign so that the press is positive; near zero on average.
  std::span<const double> weight;  ///< >= 0; empty for 1.
};

/// Model: force = a + b (y - t) + sum over i = 1 … order of c_i d^i with d = max(0, t - y): a
/// sloped baseline, and below the break t a press that starts from zero.
///
/// One Cholesky elimination of the normal equations yields the sums of squares of all orders at a
/// break point, because the models are nested. The normal equations follow from moments that are
/// summed up once. Hence a profile over all break points costs O(samples), and no break point needs
/// to be guessed (Hudson 1966; Golub & Pereyra 1973 for the elimination of linear parameters).
class PressProfile {
 public:
  static constexpr std::size_t kOrders = 3;

  /// Results at one break point; orders 1 … kOrders at [0] … .
  struct At {
    double t;
    std::array<double, kOrders> sum_squares;
    /// c_1 of each order: initial slope of the press. Negative is no press.
    std::array<double, kOrders> start_slope;
  };

  /// Baseline without a press.
  struct Baseline {
    double mean_y = 0;
    double inverse_count = 0;
    double inverse_spread = 0;  ///< 1 / sum (y - mean)^2
    double mean_force = 0;
    double slope = 0;
    double sum_squares = 0;  ///< About it.
  };

  struct Coefficients {
    double a = 0;
    double b = 0;
    std::array<double, kOrders> c{};
  };

  /// Computes moments in memory of the workspace, which must outlive the profile.
  PressProfile(const BreakSamples& samples, Workspace& workspace);

  /// False if the workspace was too small; then call nothing else.
  [[nodiscard]] bool Ready() const { return !prefix_.empty(); }
  /// @param t      Any break point.
  /// @param below  How many samples have y < t (or y <= t, which gives the same).
  [[nodiscard]] At Evaluate(double t, std::size_t below) const;
  [[nodiscard]] At Evaluate(double t) const { return Evaluate(t, Below(t)); }
  [[nodiscard]] Coefficients Fit(double t, std::size_t order) const;
  [[nodiscard]] std::size_t Below(double t) const;
  /// Returns the moments of the first `below` samples.
  [[nodiscard]] const Moments& Sums(std::size_t below) const { return prefix_[below]; }
  [[nodiscard]] const Baseline& baseline() const { return baseline_; }
  [[nodiscard]] const BreakSamples& samples() const { return samples_; }
  /// Computes the weighted sums over all samples: 1, y, y^2, force, force y, force^2.
  [[nodiscard]] std::array<double, 6> Totals() const;

  static constexpr std::size_t kBytesPerSample = sizeof(Moments);

 private:
  // Normal equations of the press at a break point, eliminated, with the baseline projected out (1
  // and y - mean span it, whatever the break point).
  struct Elimination {
    std::array<double, kOrders> sum_d{};   // sums of d^i
    std::array<double, kOrders> sum_dy{};  // sums of d^i (y - mean)
    double l12 = 0;
    double l13 = 0;
    double l23 = 0;
    std::array<double, kOrders> solved{};  // right-hand side over pivot
    std::array<double, kOrders> gained{};  // reduction of the sum of squares per column
  };
  [[nodiscard]] Elimination Eliminate(double t, std::size_t below) const;

  BreakSamples samples_;
  std::span<Moments> prefix_;
  double force_squares_ = 0;
  Baseline baseline_;
};

}  // namespace trammel::tap
