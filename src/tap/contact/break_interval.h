// Computes the 95 % interval of the break over all models.
#pragma once

#include "tap/contact/break_models.h"

namespace trammel::tap {

/// Range of the break points that a model explains well enough.
class BreakInterval {
 public:
  /// @param reach  The square of the quantile: units of the variance above the least.
  BreakInterval(const PressProfile& profile, const Candidates& candidates, double reach);

  /// Finds the interval; false if it reaches the edge of the scan.
  [[nodiscard]] bool Find(Scan scan);
  [[nodiscard]] double lo() const { return lo_; }
  [[nodiscard]] double hi() const { return hi_; }

 private:
  void Seed();
  [[nodiscard]] double Margin(const PressProfile::At& at) const;
  [[nodiscard]] double ZonesMargin(const ZonesMode& mode, double t) const;
  [[nodiscard]] bool Holds(const ZonesMode& mode) const;
  // Points [first, last) of a scan.
  struct Part {
    std::size_t first;
    std::size_t last;
  };
  [[nodiscard]] Part PolynomialPart(Scan scan) const;
  [[nodiscard]] Part ZonesPart(Scan scan, const ZonesMode& mode, double from, double to) const;
  [[nodiscard]] bool Search(Scan scan, const ZonesMode* zones);
  void AddPower();
  void AddElbow();

  const PressProfile& profile_;
  const Candidates& candidates_;
  double power_penalty_ = 0;
  double zones_penalty_ = 0;
  double level_ = 0;      // neighbours' level, in variances
  double quadratic_ = 0;  // quadratic press
  double zones_ = 0;      // two-zone press
  double lo_ = kNever;
  double hi_ = -kNever;
};

}  // namespace trammel::tap
