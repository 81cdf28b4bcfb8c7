// How seldom any interval can hold the contact of a press that the noise hides.
#pragma once

#include <cstdint>
#include <vector>

#include "tap_study_answers.h"

namespace trammel {

inline constexpr double kHeldJointly = 0.93;

/// Half-widths of intervals on a smooth press that hold its own contact, on average.
struct JointHalfWidth {
  double least_um = 0;  ///< Of those that hold the contacts of smooth presses and of soft toes of
                        ///< any width in kHeldJointly (tap_length_bound.h), at least;
  double read_um = 0;   ///< as the reader has them. 0 where neither was asked for.
};

/// The error of the second kind of a test between two taps, by the lemma of Neyman and Pearson
/// (1933, Philosophical Transactions of the Royal Society A 231, 289-337).
///
/// A row's tap and that of the nearest smooth press differ, at the same instants and in the same
/// white normal noise, by d deviations in all. Leaving out the row's contact is a test of the one
/// against the other. If that happens on the smooth press in a share p of the taps, it happens on
/// the row's in at least Phi(Phi^-1(p) - d), whatever reads them: for its share on the smooth press
/// no event is rarer on the row's than that of a low ratio of their densities. Where d differs from
/// tap to tap with the sampling's phase, one limit of that ratio holds for all: with its logarithm
/// c, p is the mean of Phi(c / d + d / 2) and the share on the row's that of Phi(c / d - d / 2).
struct MissBound {
  std::vector<double> distance;  ///< d of each tap
  double left_out = 0;           ///< p: good taps of the smooth press whose interval is without the
                                 ///< row's contact, as a share of all.
  double held = 0;               ///< Intervals of these that hold the smooth press's own contact.
  double half_width_um = 0;      ///< Of these, on average.
  double apart_um = 0;           ///< Between the contacts of the two presses, on average.
  JointHalfWidth joint;          ///< Of the smooth press where most is missing.

  /// Of the row's taps: at least so many are good and miss. p counts as kMostLeftOut at most: an
  /// interval that is surer than this of a smooth press is too narrow, and excused for no more. 0
  /// where intervals on the smooth press hold its own contact in less than `least_held`, for then
  /// they are too narrow, too.
  [[nodiscard]] double LeastMissed(double least_held) const;
  /// Of the smooth press's taps: at least so many have an interval that holds the row's contact,
  /// too, where the share `held_here` of the row's have one. The same lemma, the other way round.
  [[nodiscard]] double LeastHolding(double held_here) const;
  /// By how much more the intervals on the smooth press are then wide, half of it, on average: of
  /// those that have to hold the row's contact beyond what they do now, the way there from an end
  /// a half-width away from their own. 0 where they hold it often enough.
  [[nodiscard]] double LeastWidening_um(double held_here) const;
  /// Whether that is more of the half-width on the smooth press than kMostWidening, where these
  /// intervals hold their own contact in `least_held`: noise stands in the way, not the reader.
  [[nodiscard]] bool HiddenByNoise(double least_held, double held_here) const;
  /// Whether holding all toes lengthens intervals by more than that: some have to be missed, and
  /// which ones is the reader's choice.
  [[nodiscard]] bool HiddenAmongOthers() const;
};

inline constexpr double kMostLeftOut = 0.95;
/// By which intervals on a smooth press may lengthen for toes.
inline constexpr double kMostWidening = 0.06;

/// Share of a standard normal distribution below so many deviations, and its inverse for shares
/// between 1e-9 and 1 - 1e-9.
[[nodiscard]] double NormalShare(double deviations);
[[nodiscard]] double NormalQuantile(double share);

/// Analyses the taps of smooth presses, of the nearest and of some that are farther away, where
/// what lies beyond the pull-back's cruise is as in the row; the bound that says most.
/// REQUIRES white noise; taps whose samples are not at the same instants without it are not
/// counted.
[[nodiscard]] MissBound BoundMisses(TapRow row, int taps, std::uint64_t first_seed,
                                    double least_held);

}  // namespace trammel
