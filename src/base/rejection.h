// Rule of every adjustment: how its result is checked, and how much it may reject.
#pragma once

#include <initializer_list>
#include <map>
#include <string>

namespace trammel {

/// Maximum share of outliers among the observations; a larger share contradicts the model. Routine
/// measurements have 1 to 10 % of them (Hampel et al., Robust Statistics, 1986).
inline constexpr double kMaxRejected = 0.05;

/// Part of every adjustment's answer, in its text (CheckText) and its JSON (CheckJson).
struct AdjustmentCheck {
  int observations = 0;  ///< used and rejected
  int rejected = 0;      ///< of these, as inconsistent with the others
  int redundancy = 0;    ///< equations of those used, less the unknowns
  /// Reason for a verdict other than good if more is rejected than outliers explain, with the
  /// figures and the owner of most of it; else empty.
  std::string contradiction;

  [[nodiscard]] double rejected_share() const {
    return observations > 0 ? static_cast<double>(rejected) / observations : 0;
  }
};

/// Counts the observations that an adjustment uses and rejects. Excludes those that cannot be used
/// for want of others (a target in two pictures only).
class RejectionTally {
 public:
  /// @param owners  what may be wrong as a whole, in people's words: {"picture 7.jpg", "target 3"}.
  void Add(std::initializer_list<std::string> owners, bool rejected);

  /// Accepts kMaxRejected of the observations as outliers, plus one picture, target or constraint
  /// as a whole: the one with most rejections.
  [[nodiscard]] AdjustmentCheck Check(int redundancy) const;

 private:
  struct Count {
    int observations = 0;
    int rejected = 0;
  };
  Count all_;
  std::map<std::string, Count> owners_;
};

/// "redundancy 1210; 12 of 900 observations rejected (1.3 %)"
[[nodiscard]] std::string CheckText(const AdjustmentCheck& check);

}  // namespace trammel
