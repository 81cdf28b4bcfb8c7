// The models of the press that the break is found with, and the break where each explains the
// samples best.
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

/// From where, of the quadratic press's break, the press in two zones is looked for.
inline constexpr double kZonesFrom = 0.7;

/// Of the kinks that are tried: sharp, and rounded over a fifth of the outer zone up to all of it.
inline constexpr std::array<double, 6> kRoundings = {0, 0.2, 0.4, 0.6, 0.8, 1};

/// The best kinks for one break.
struct Kinks {
  std::array<double, kRoundings.size()> s{};  ///< Of each rounding,
  std::size_t best = 0;                       ///< and which of these explains the samples best.
};

/// A local minimum of the press in two zones along the break: a wide zone and a narrow one may both
/// explain the samples, and what lies between them not.
struct ZonesMode {
  Minimum least;
  Kinks kinks;  ///< At its break.
};

/// What the press in two zones costs beyond its sum of squares.
struct ZonesPrice {
  double curve = 0;     ///< A curve of the inner zone,
  double far = 0;       ///< a break so far beyond that of the quadratic press, per its depth,
  double smooth_t = 0;  ///< which is this.
  double stiff = 0;  ///< So much less for an outer zone that is hardly softer than the inner one.

  [[nodiscard]] double Far(double t) const { return far * std::max(0.0, t / smooth_t - 1); }
  [[nodiscard]] double Cost(const TwoZonePress& press) const;
  /// Of the best one with its break at t.
  /// @param near  Kinks for a break close by.
  [[nodiscard]] double Cost(const PressProfile& profile, double t, const Kinks& near) const;
  /// What an interval allows the press beyond others: it looks the more like a smooth one, the
  /// stiffer its outer zone.
  [[nodiscard]] double Allowance(const TwoZonePress& press) const;
  /// By how much that one costs less than is allowed; negative where it costs more. Where it costs
  /// less, the margin may be that of a worse one.
  [[nodiscard]] double Margin(const PressProfile& profile, double t, const Kinks& near,
                              double allowed) const;
};

/// The models' answers.
struct Candidates {
  std::array<Minimum, kModels> model;
  PowerPress power;
  std::array<ZonesMode, kZonesStarts.size()> modes;  ///< Of the press in two zones, by its start.
  TwoZonePress zones;  ///< At the break of the best mode, with a sharp kink.
  ZonesPrice price;
  double noise_variance = 0;  ///< Of a sample about the model that fits best; 0 without a press.
  double variance = 0;        ///< The same as it acts on means.
  double least = kNever;      ///< The sum of squares of the model that fits best.
  double freedom = 0;         ///< Samples less unknowns of the quadratic press.
  /// The samples ask for a start that no cubic press has: a toe, a thread, plastic. It is not known
  /// whether toe or press ends the contact, and the quadratic press's answer stays in question.
  bool flat_start = false;
  /// Besides, the cubic press explains them better than the other smooth ones: noise seldom does
  /// that, nor does a round tip.
  bool toe = false;
  /// The cubic press explains the samples better than the quadratic one. Noise seldom does that,
  /// and a soft zone may end farther out than on a press that does not bend.
  bool bends = false;

  [[nodiscard]] double Cost(std::size_t m) const { return model[m].sum_squares / variance; }
  /// Slope of the outer zone over the inner one's where two zones explain the samples much better
  /// than any smooth press; else 1.
  [[nodiscard]] double OuterRatio() const;
  /// Whether a break is near enough to the quadratic press's for its neighbours.
  [[nodiscard]] bool Near(double t) const;
};

/// @param scan       Of the profile.
/// @param inflation   By which correlation of the noise raises the variance of means; >= 1.
[[nodiscard]] Candidates FindCandidates(const PressProfile& profile, Scan scan, double inflation);

}  // namespace trammel::tap
