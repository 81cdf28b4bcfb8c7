#include "pressure_advance/response/law_unknowns.h"

#include <algorithm>
#include <cstddef>

#include "base/square.h"

namespace trammel::pressure_advance {
namespace {

struct Unknown {
  double& (*of)(Lag&);
  double step;
  double mean;
  double sigma;
  double lo;
  double hi;
};
template <std::size_t k>
double& Exponent(Lag& lag) {
  return lag.exponent[k];
}
constexpr double kUnknown = 1e6;  // sigma of what is not known by itself
const Unknown kOf[kLagUnknowns] = {
    {[](Lag& lag) -> double& { return lag.lag_s; }, 0.0002, 0, kUnknown, 0.0005, 1},
    {Exponent<0>, 0.01, 0.75, kUnknown, 0.15, 1.5},
    {Exponent<1>, 0.01, 0.75, kUnknown, 0.15, 1.5},
    {Exponent<2>, 0.01, 0.75, kUnknown, 0.15, 1.5},
    {Exponent<3>, 0.01, 0.75, kUnknown, 0.15, 1.5},
    {[](Lag& lag) -> double& { return lag.second; }, 0.01, 0, 0.2, 0, 0.8},
    {[](Lag& lag) -> double& { return lag.slip; }, 0.002, 0, 0.04, 0, 0.3},
    {[](Lag& lag) -> double& { return lag.loss; }, 0.05, 0.5, 0.5, 0, 1},
    {[](Lag& lag) -> double& { return lag.smooth_s; }, 0.002, 0.04, 0.01, 0.002, 0.1},
    {[](Lag& lag) -> double& { return lag.smear_mm; }, 0.02, 0.4, 0.2, 0.1, 1.5},
};
constexpr int kExponent = kOfLag + 1, kExponents = 4;
constexpr double kLeastLag_s = 1e-4;

}  // namespace

Lag LagOf(const LawVector& theta) {
  Lag lag;
  for (int k = 0; k < kLagUnknowns; ++k) kOf[k].of(lag) = theta(kOfLag + k);
  return lag;
}

double LagSecondsAt(double lag_s, double drift, double along) {
  return std::max(kLeastLag_s, lag_s * (1 + drift * along));
}

Lag Moved(const Lag& lag, int k, double& step) {
  const Unknown& unknown = kOf[k];
  Lag moved = lag;
  double& value = unknown.of(moved);
  step = value + unknown.step > unknown.hi ? -unknown.step : unknown.step;
  value += step;
  return moved;
}

void Bound(LawVector& theta) {
  for (int k = 0; k < kLagUnknowns; ++k) {
    theta(kOfLag + k) = std::clamp(theta(kOfLag + k), kOf[k].lo, kOf[k].hi);
  }
  theta(kDrift) = std::clamp(theta(kDrift), -1.0, 1.0);
}

LawPrior PriorOfLaw() {
  // 1 sigma
  constexpr double kTilts = 0.03, kDrifts = 0.2, kSwells = 0.02, kPowers = 0.07;
  constexpr double kPlaces_mm = 0.15;
  constexpr double kAnyExponent = 0.35, kChange = 0.3;  // their mean's, from stretch to stretch
  LawPrior prior{LawVector::Zero(), LawMatrix::Zero()};
  prior.information(kTilt, kTilt) = 1 / Square(kTilts);
  prior.information(kDrift, kDrift) = 1 / Square(kDrifts);
  prior.information(kSwell, kSwell) = 1 / Square(kSwells);
  prior.information(kPower, kPower) = 1 / Square(kPowers);
  prior.information(kPlace, kPlace) = 1 / Square(kPlaces_mm);
  for (int k = 0; k < kLagUnknowns; ++k) {
    prior.mean(kOfLag + k) = kOf[k].mean;
    prior.information(kOfLag + k, kOfLag + k) = 1 / Square(kOf[k].sigma);
  }
  LawVector mean = LawVector::Zero();
  mean.segment(kExponent, kExponents).setConstant(1.0 / kExponents);
  prior.information += mean * mean.transpose() / Square(kAnyExponent);
  for (int k = kExponent + 1; k < kExponent + kExponents; ++k) {
    LawVector change = LawVector::Zero();
    change(k) = 1;
    change(k - 1) = -1;
    prior.information += change * change.transpose() / Square(kChange);
  }
  return prior;
}

}  // namespace trammel::pressure_advance
