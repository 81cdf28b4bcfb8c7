// The 95 % interval of the break: what any of the models leaves open.
#pragma once

#include "tap/contact/break_models.h"

namespace trammel::tap {

/// The break points that a model explains well enough, from the lowest to the highest.
class BreakInterval {
 public:
  /// @param reach  The square of the quantile: units of the variance above the least.
  BreakInterval(const PressProfile& profile, const Candidates& candidates, double reach);

  /// False where it runs into the edge of the scan.
  [[nodiscard]] bool Find(Scan scan);
  [[nodiscard]] double lo() const { return lo_; }
  [[nodiscard]] double hi() const { return hi_; }

 private:
  void Seed();
  [[nodiscard]] double Margin(const PressProfile::At& at) const;
  [[nodiscard]] double ZonesMargin(const ZonesMode& mode, double t) const;
  [[nodiscard]] bool Holds(const ZonesMode& mode) const;
  // Points of a scan, from the first to before the last.
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
  double level_ = 0;      // of the neighbours, in variances
  double quadratic_ = 0;  // of the quadratic press
  double zones_ = 0;      // of the press in two zones
  double lo_ = kNever;
  double hi_ = -kNever;
};

}  // namespace trammel::tap
