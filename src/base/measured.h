// The second kind of error: an untrustworthy measurement yields a verdict instead of a number.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "base/check.h"

namespace trammel {

enum class Verdict {
  kGood,        ///< A value with its uncertainty.
  kCannotTell,  ///< The data are sound but do not determine the value.
  kRefused,     ///< The data are not fit to be measured.
};

/// "good", "cannot_tell" or "refused", as written to JSON.
[[nodiscard]] constexpr std::string_view ToString(Verdict verdict) {
  switch (verdict) {
    case Verdict::kGood:
      return "good";
    case Verdict::kCannotTell:
      return "cannot_tell";
    case Verdict::kRefused:
      return "refused";
  }
  return "refused";
}

/// "good", "cannot tell" or "refused", as people read it.
[[nodiscard]] inline std::string VerdictText(Verdict verdict) {
  return verdict == Verdict::kCannotTell ? "cannot tell" : std::string(ToString(verdict));
}

struct Interval {
  double lo = 0;
  double hi = 0;

  [[nodiscard]] bool Holds(double value) const { return value >= lo && value <= hi; }
};

/// Scalar with its uncertainty, in the unit that the owner's name states.
struct Quantity {
  double value = 0;
  double standard_uncertainty = 0;  ///< k = 1
  Interval interval95;
};

/// Return value of every estimator: a quantity exactly when the verdict is good, else the reason.
class Measured {
 public:
  /// Creates a refused measurement: nothing was measured yet.
  Measured() = default;

  [[nodiscard]] static Measured Good(const Quantity& quantity) {
    TRAMMEL_CHECK(quantity.standard_uncertainty >= 0 && quantity.interval95.lo <= quantity.value &&
                      quantity.value <= quantity.interval95.hi,
                  "value = {}, u = {}, interval = [{}, {}]", quantity.value,
                  quantity.standard_uncertainty, quantity.interval95.lo, quantity.interval95.hi);
    return Measured(Verdict::kGood, {}, quantity);
  }
  [[nodiscard]] static Measured CannotTell(std::string reason) {
    return Measured(Verdict::kCannotTell, std::move(reason), std::nullopt);
  }
  [[nodiscard]] static Measured Refused(std::string reason) {
    return Measured(Verdict::kRefused, std::move(reason), std::nullopt);
  }

  [[nodiscard]] Verdict verdict() const { return verdict_; }
  [[nodiscard]] bool good() const { return verdict_ == Verdict::kGood; }
  /// Returns the cause, with its figure, and the remedy; empty when good.
  [[nodiscard]] const std::string& reason() const { return reason_; }
  /// REQUIRES good().
  [[nodiscard]] const Quantity& quantity() const {
    TRAMMEL_CHECK(quantity_.has_value(), "verdict = {}, reason = {}", ToString(verdict_), reason_);
    return *quantity_;
  }

 private:
  Measured(Verdict verdict, std::string reason, std::optional<Quantity> quantity)
      : verdict_(verdict), reason_(std::move(reason)), quantity_(quantity) {}

  Verdict verdict_ = Verdict::kRefused;
  std::string reason_ = "nothing was measured";
  std::optional<Quantity> quantity_;
};

}  // namespace trammel
