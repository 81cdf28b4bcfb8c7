// Models of the press, and the break at which each explains the samples best.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "tap/contact/break_search.h"
#include "tap/contact/power_press.h"
#include "tap/contact/press_profile.h"
#include "tap/contact/two_zone_press.h"

namespace trammel::tap {

enum Model : std::size_t { kLinear, kQuadratic, kCubic, kPower, kTwoZones, kModels };

/// Start of the search for the press in two zones, in parts of the quadratic press's break.
inline constexpr double kZonesFrom = 0.7;

/// Roundings of the kinks to try: sharp, and over a fifth of the outer zone up to all of it.
inline constexpr std::array<double, 6> kRoundings = {0, 0.2, 0.4, 0.6, 0.8, 1};

/// Best kinks for one break.
struct Kinks {
  std::array<double, kRoundings.size()> s{};  ///< one per rounding,
  std::size_t best = 0;                       ///< and which of these explains the samples best.
};

/// Local minimum of the press in two zones along the break. A wide zone and a narrow one may both
/// explain the samples, and the zones between them not.
struct ZonesMode {
  Minimum least;
  Kinks kinks;  ///< at its break
};

/// Costs of the press in two zones beyond its sum of squares.
struct ZonesPrice {
  double curve = 0;     ///< A curve of the inner zone,
  double far = 0;       ///< a break so far beyond that of the quadratic press, per its depth,
  double smooth_t = 0;  ///< quadratic press's break
  double stiff = 0;  ///< So much less for an outer zone that is hardly softer than the inner one.

  [[nodiscard]] double Far(double t) const { return far * std::max(0.0, t / smooth_t - 1); }
  [[nodiscard]] double Cost(const TwoZonePress& press) const;
  /// Returns the cost of the best one with its break at t.
  /// @param near  Kinks for a break close by.
  [[nodiscard]] double Cost(const PressProfile& profile, double t, const Kinks& near) const;
  /// Returns the interval's allowance for the press beyond others: the stiffer its outer zone, the
  /// more it resembles a smooth one.
  [[nodiscard]] double Allowance(const TwoZonePress& press) const;
  /// Returns the allowed cost less its cost; negative if it costs more. If it costs less, the
  /// margin may be that of a worse one.
  [[nodiscard]] double Margin(const PressProfile& profile, double t, const Kinks& near,
                              double allowed) const;
};

/// Results of the models.
struct Candidates {
  std::array<Minimum, kModels> model;
  PowerPress power;
  std::array<ZonesMode, kZonesStarts.size()> modes;  ///< two-zone press, by its start
  TwoZonePress zones;                                ///< at the break of the best mode, sharp kink
  ZonesPrice price;
  double noise_variance = 0;  ///< per sample about the best model; 0 without a press
  double variance = 0;        ///< The same as it acts on means.
  double least = kNever;      ///< The sum of squares of the model that fits best.
  double freedom = 0;         ///< Samples less unknowns of the quadratic press.
  /// True if the samples need a start that no cubic press has: a toe, a thread, plastic. It is
  /// unknown whether toe or press ends the contact, so the quadratic press's break is uncertain.
  bool flat_start = false;
  /// True if, in addition, the cubic press explains them better than the other smooth ones: noise
  /// or a round tip seldom causes that.
  bool toe = false;
  /// True if the cubic press explains the samples better than the quadratic one. Noise seldom
  /// causes that, and a soft zone may end farther out than on a press that does not bend.
  bool bends = false;

  [[nodiscard]] double Cost(std::size_t m) const { return model[m].sum_squares / variance; }
  /// Returns the ratio of the outer zone's slope to the inner one's if two zones explain the
  /// samples much better than any smooth press; else 1.
  [[nodiscard]] double OuterRatio() const;
  /// True if a break is near enough to the quadratic press's for its neighbours.
  [[nodiscard]] bool Near(double t) const;
};

/// @param scan       Of the profile.
/// @param inflation   By which correlation of the noise raises the variance of means; >= 1.
[[nodiscard]] Candidates FindCandidates(const PressProfile& profile, Scan scan, double inflation);

}  // namespace trammel::tap
