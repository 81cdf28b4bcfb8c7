// What a method says of a row's taps, held against the truth and the Cramer-Rao bound.
#pragma once

#include <array>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "tap/analyse/analyse.h"
#include "tap_bound.h"
#include "tap_study_row.h"

namespace trammel {

/// Answers of one method to the taps of a row; the vectors hold one value for each good tap.
struct TapAnswers {
  std::vector<double> error_um;
  std::vector<double> half_width_um;
  std::vector<double> bound_um;  ///< of the model that each was fitted with
  std::vector<std::uint64_t> seed;
  int covered = 0;
  int refused = 0;
  std::map<std::string, int> reasons;

  [[nodiscard]] int taps() const { return static_cast<int>(error_um.size()) + refused; }
  [[nodiscard]] double RefusedShare() const { return refused / static_cast<double>(taps()); }
  [[nodiscard]] double Coverage() const;
  [[nodiscard]] double Worst() const;
  [[nodiscard]] double ShareWithin(double limit_um) const;
  /// The most frequent reasons with their shares of all taps; "-" without any.
  [[nodiscard]] std::string Reasons(std::size_t count) const;
  /// Seeds of the taps furthest outside of their intervals, the furthest first.
  [[nodiscard]] std::string WorstSeeds(std::size_t count) const;
};

/// Flat and linear, sloped and linear, sloped and curved, sloped and cubic; for white noise.
struct TapBounds {
  std::array<double, 4> um{};
  [[nodiscard]] double Fitted(const tap::FittedForce& force) const;
};

/// From all samples since the pull-back's cruise began. REQUIRES a truth.
[[nodiscard]] TapBounds BoundsOf(const TapRow& row, const sim::SimulatedTap& tap);

/// A tap without noise, and its samples in the pull-back's cruise: those from `first` on, at the
/// heights above the contact that their stamps say, less a latency that is known.
struct QuietTap {
  sim::SimulatedTap tap;
  std::size_t first = 0;
  std::vector<double> height_mm;  ///< empty without a truth
  double noise_g = 0;             ///< that was left out, with the steps of the counts

  /// Empty where the samples are too few for a press.
  [[nodiscard]] QuietPress Press() const;
};

[[nodiscard]] QuietTap TakeQuietTap(TapRow row, std::uint64_t seed);

/// Adds an analysis. Without a truth no answer is right: NaN as the contact.
void Add(const tap::TapAnalysis& analysis, double contact_z_mm, std::uint64_t seed,
         TapAnswers& answers);

struct RowAnswers {
  std::vector<TapAnswers> of;  ///< each method
  std::array<double, 4> bound_um{};
};

[[nodiscard]] RowAnswers StudyRow(TapRow row, int taps, std::uint64_t first_seed,
                                  std::span<const tap::Method> methods);

}  // namespace trammel
