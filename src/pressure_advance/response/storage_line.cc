#include "pressure_advance/response/storage_line.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "base/square.h"

namespace trammel::pressure_advance {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

LineCovariance::Pair LineCovariance::Block::Times(const Pair& pair) const {
  return {reading * pair.reading + both * pair.flow, both * pair.reading + flow * pair.flow};
}

LineCovariance::Block LineCovariance::Block::Inverse() const {
  const double determinant = Determinant();
  return {flow / determinant, -both / determinant, reading / determinant};
}

// Inverse of T + D W D, T tridiagonal, D diagonal, W the flow's correlation with a tridiagonal
// inverse. It is a corner of that of [T D; D -1/W]: block-tridiagonal if the readings' and the
// flow's rows alternate. The common causes follow by the matrix inversion lemma, one by one.
LineCovariance::LineCovariance(const Terms& terms) {
  const Index n = terms.own.size();
  inverse_pivot_.reserve(static_cast<std::size_t>(n));
  Block carried;
  for (Index i = 0; i < n; ++i) {
    const double before = i > 0 ? terms.correlation(i - 1) : 0;
    const double after = i + 1 < n ? terms.correlation(i) : 0;
    const double left = 1 - before * before, right = 1 - after * after;
    const double moved = (i > 0 ? terms.between(i - 1) : 0) + (i + 1 < n ? terms.between(i) : 0);
    const Block pivot{terms.own(i) + moved - carried.reading, terms.wander(i) - carried.both,
                      -1 / left - after * after / right - carried.flow};
    log_determinant_ += std::log(std::abs(pivot.Determinant())) + std::log(right);
    inverse_pivot_.push_back(pivot.Inverse());
    if (i + 1 == n) break;
    const Pair beside{-terms.between(i), after / right};
    const Block& inverse = inverse_pivot_.back();
    carried = {beside.reading * inverse.reading * beside.reading,
               beside.reading * inverse.both * beside.flow,
               beside.flow * inverse.flow * beside.flow};
    beside_.push_back(beside);
  }
  const MatrixXd solved = SolveWithoutCommon(terms.common);
  weighed_.resize(n, 0);
  for (Index cause = 0; cause < terms.common.cols(); ++cause) {
    const VectorXd common = terms.common.col(cause);
    const VectorXd weighed = solved.col(cause) - weighed_ * (weighed_.transpose() * common);
    const double more = 1 + common.dot(weighed);
    log_determinant_ += std::log(more);
    weighed_.conservativeResize(Eigen::NoChange, cause + 1);
    weighed_.col(cause) = weighed / std::sqrt(more);
  }
}

MatrixXd LineCovariance::SolveWithoutCommon(const MatrixXd& columns) const {
  const std::size_t n = inverse_pivot_.size();
  MatrixXd solved(columns.rows(), columns.cols());
  std::vector<Pair> right(n);
  for (Index column = 0; column < columns.cols(); ++column) {
    Pair before;
    for (std::size_t i = 0; i < n; ++i) {
      right[i] = {columns(static_cast<Index>(i), column), 0};
      if (i > 0) {
        right[i].reading -= beside_[i - 1].reading * before.reading;
        right[i].flow -= beside_[i - 1].flow * before.flow;
      }
      before = inverse_pivot_[i].Times(right[i]);
    }
    Pair after;
    for (std::size_t i = n; i-- > 0;) {
      if (i + 1 < n) {
        right[i].reading -= beside_[i].reading * after.reading;
        right[i].flow -= beside_[i].flow * after.flow;
      }
      after = inverse_pivot_[i].Times(right[i]);
      solved(static_cast<Index>(i), column) = after.reading;
    }
  }
  return solved;
}

MatrixXd LineCovariance::Solve(const MatrixXd& columns) const {
  return SolveWithoutCommon(columns) - weighed_ * (weighed_.transpose() * columns);
}

VectorXd LineCovariance::InverseDiagonal() const {
  const std::size_t n = inverse_pivot_.size();
  VectorXd diagonal(static_cast<Index>(n));
  Block later;
  for (std::size_t i = n; i-- > 0;) {
    Block here = inverse_pivot_[i];
    if (i + 1 < n) {
      const Block& own = inverse_pivot_[i];
      const Pair& beside = beside_[i];
      const Block next{beside.reading * later.reading * beside.reading,
                       beside.reading * later.both * beside.flow,
                       beside.flow * later.flow * beside.flow};
      const Pair reading = next.Times({own.reading, own.both});
      const Pair flow = next.Times({own.both, own.flow});
      here.reading += own.reading * reading.reading + own.both * reading.flow;
      here.both += own.both * reading.reading + own.flow * reading.flow;
      here.flow += own.both * flow.reading + own.flow * flow.flow;
    }
    later = here;
    const auto row = static_cast<Index>(i);
    diagonal(row) = here.reading - weighed_.row(row).squaredNorm();
  }
  return diagonal;
}

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
constexpr double kMinLag_s = 1e-4;

}  // namespace

Lag LagOf(const StorageVector& theta) {
  Lag lag;
  for (int k = 0; k < kLagUnknowns; ++k) kOf[k].of(lag) = theta(kOfLag + k);
  return lag;
}

double LagSecondsAt(double lag_s, double drift, double along) {
  return std::max(kMinLag_s, lag_s * (1 + drift * along));
}

Lag Moved(const Lag& lag, int k, double& step) {
  const Unknown& unknown = kOf[k];
  Lag moved = lag;
  double& value = unknown.of(moved);
  step = value + unknown.step > unknown.hi ? -unknown.step : unknown.step;
  value += step;
  return moved;
}

void Bound(StorageVector& theta) {
  for (int k = 0; k < kLagUnknowns; ++k) {
    theta(kOfLag + k) = std::clamp(theta(kOfLag + k), kOf[k].lo, kOf[k].hi);
  }
  theta(kDrift) = std::clamp(theta(kDrift), -1.0, 1.0);
}

StoragePrior StoragePriorOf() {
  // 1 sigma
  constexpr double kTilts = 0.03, kDrifts = 0.2, kSwells = 0.02, kPowers = 0.07;
  constexpr double kPlaces_mm = 0.15;
  constexpr double kAnyExponent = 0.35, kChange = 0.3;  // their mean's, from stretch to stretch
  StoragePrior prior{StorageVector::Zero(), StorageMatrix::Zero()};
  prior.information(kTilt, kTilt) = 1 / Square(kTilts);
  prior.information(kDrift, kDrift) = 1 / Square(kDrifts);
  prior.information(kSwell, kSwell) = 1 / Square(kSwells);
  prior.information(kPower, kPower) = 1 / Square(kPowers);
  prior.information(kPlace, kPlace) = 1 / Square(kPlaces_mm);
  for (int k = 0; k < kLagUnknowns; ++k) {
    prior.mean(kOfLag + k) = kOf[k].mean;
    prior.information(kOfLag + k, kOfLag + k) = 1 / Square(kOf[k].sigma);
  }
  StorageVector mean = StorageVector::Zero();
  mean.segment(kExponent, kExponents).setConstant(1.0 / kExponents);
  prior.information += mean * mean.transpose() / Square(kAnyExponent);
  for (int k = kExponent + 1; k < kExponent + kExponents; ++k) {
    StorageVector change = StorageVector::Zero();
    change(k) = 1;
    change(k - 1) = -1;
    prior.information += change * change.transpose() / Square(kChange);
  }
  return prior;
}

namespace {

using Eigen::Index, Eigen::VectorXd;

VectorXd AsVector(const std::vector<double>& values) {
  return Eigen::Map<const VectorXd>(values.data(), static_cast<Index>(values.size()));
}

// Computes a reading's derivative over its power: laid^(1 + p) = laid + p * this, nearly. Large
// swells, which the reading rounds off, contain no information on it.
double PerPower(double laid) {
  constexpr double kMax = 1.5;
  return laid > 0 ? std::min(laid, kMax) * std::log(std::min(laid, kMax)) : 0;
}

VectorXd Read(const StorageState& state, const VectorXd& laid) {
  return laid.unaryExpr(
      [&](double area) { return ReadArea(area, state.theta(kSwell), state.theta(kPower)); });
}

VectorXd LevelOf(const StorageState& state, const VectorXd& tilt) {
  return state.theta(kLevel) * (1 + state.theta(kTilt) * tilt.array());
}

VectorXd SlopeOf(const VectorXd& mean, const std::vector<double>& position_mm) {
  VectorXd slope(mean.size());
  const auto at = [&](Index i) { return position_mm[static_cast<std::size_t>(i)]; };
  for (Index i = 0; i < mean.size(); ++i) {
    const Index lo = std::max<Index>(i - 1, 0), hi = std::min(i + 1, mean.size() - 1);
    slope(i) = (mean(hi) - mean(lo)) / (at(hi) - at(lo));
  }
  return slope;
}

LineCovariance CovarianceOf(const StorageLine& line, const StorageState& state,
                            const StorageOptions& options) {
  const VectorXd& mean = line.mean;
  const Index n = mean.size();
  LineCovariance::Terms terms{VectorXd(n), VectorXd(n - 1), VectorXd(n), VectorXd(n - 1),
                              Eigen::MatrixXd(n, 3)};
  const auto at = [&](Index i) { return line.position_mm[static_cast<std::size_t>(i)]; };
  constexpr double kForm = 1e-4;  // model error per line, squared
  for (Index i = 0; i < n; ++i) {
    terms.own(i) = state.noise * line.variance(i) * line.doubt(i) +
                   Square(options.place_mm * line.slope(i)) +
                   Square(options.swell * std::max(0.0, mean(i) - 1)) + kForm;
    if (i + 1 == n) break;
    // Filament that spreads along the line is conserved.
    const double step_mm = at(i + 1) - at(i);
    const double thin = std::min(mean(i), mean(i + 1)) / options.droplet;
    const double moved = Square(options.spread_mm2 * (mean(i + 1) - mean(i)) / step_mm) +
                         Square(options.droplet_mm * std::exp(-thin * thin));
    terms.between(i) = moved / Square(step_mm);
    terms.correlation(i) = std::exp(-step_mm / options.flow_noise_length_mm);
  }
  terms.wander = options.flow_noise * std::sqrt(state.noise) * mean;
  terms.common.col(0) = state.lag_scatter_s * line.own;
  terms.common.col(1) = state.flow_scatter * mean;
  terms.common.col(2) = state.place_scatter_mm * line.slope;
  return LineCovariance(terms);
}

}  // namespace

double ReadArea(double laid, double swell, double power) {
  return laid + swell * std::max(0.0, laid - 1) + power * PerPower(laid);
}

VectorXd StorageLine::Off(const StorageState& state, const std::vector<double>& laid) const {
  return value - LevelOf(state, tilt).cwiseProduct(Read(state, AsVector(laid)));
}

std::optional<StorageLine> StorageLineOf(const LineProfile& profile, const Interval& span_mm,
                                         double length_mm) {
  constexpr std::size_t kFewest = 8;
  std::vector<double> value, variance, tilt;
  StorageLine line;
  line.pressure_advance_s = profile.pressure_advance_s;
  line.heading = profile.heading;
  const std::vector<ProfileSample>& samples = profile.samples;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const ProfileSample& sample = samples[i];
    // Next to a bead that reaches out of the picture, visible readings are biased low.
    const bool beside =
        (i > 0 && samples[i - 1].cut_off) || (i + 1 < samples.size() && samples[i + 1].cut_off);
    if (!sample.area.seen() || sample.gap || beside || sample.position < span_mm.lo ||
        sample.position > span_mm.hi) {
      continue;
    }
    line.position_mm.push_back(sample.position);
    tilt.push_back(sample.position / length_mm - 0.5);
    value.push_back(sample.area.value);
    variance.push_back(Square(sample.area.sigma));
  }
  if (!profile.unusable.empty() || value.size() < kFewest) return std::nullopt;
  line.tilt = AsVector(tilt);
  line.value = AsVector(value);
  line.variance = AsVector(variance);
  line.doubt = VectorXd::Ones(line.value.size());
  return line;
}

std::vector<std::vector<double>> LayAll(const LagModel& model, const StorageVector& theta,
                                        const std::vector<StorageLine>& lines, double more_s) {
  std::vector<LagModel::Line> all;
  std::vector<std::vector<double>> places;
  places.reserve(lines.size());
  for (const StorageLine& line : lines) {
    places.push_back(line.position_mm);
    for (double& at : places.back()) at += line.heading * theta(kPlace);
    all.push_back({LagSecondsAt(theta(kLagSeconds), theta(kDrift), line.along) + more_s,
                   line.pressure_advance_s, places.back()});
  }
  return model.Lay(all);
}

void Linearise(const LagModel& model, const StorageState& state, std::vector<StorageLine>& lines) {
  const Lag lag = LagOf(state.theta);
  const LagModel here = model.With(lag);
  const std::vector<std::vector<double>> all = LayAll(here, state.theta, lines);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    StorageLine& line = lines[i];
    const VectorXd level = LevelOf(state, line.tilt);
    const VectorXd areas = AsVector(all[i]);
    line.read = Read(state, areas);
    line.mean = level.cwiseProduct(line.read);
    line.slope = SlopeOf(line.mean, line.position_mm);
    line.gradient.resize(areas.size(), kUnknowns);
    line.gradient.col(kLevel) = line.mean / state.theta(kLevel);
    line.gradient.col(kTilt) = state.theta(kLevel) * line.tilt.cwiseProduct(line.read);
    line.gradient.col(kSwell) = level.cwiseProduct((areas.array() - 1).cwiseMax(0).matrix());
    line.gradient.col(kPower) = level.cwiseProduct(areas.unaryExpr(&PerPower));
  }
  for (int k = 0; k < kLagUnknowns; ++k) {
    double step = 0;
    const LagModel moved = here.With(Moved(lag, k, step));
    const auto then = LayAll(moved, state.theta, lines, kOfLag + k == kLagSeconds ? step : 0);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      StorageLine& line = lines[i];
      line.gradient.col(kOfLag + k) =
          LevelOf(state, line.tilt).cwiseProduct(Read(state, AsVector(then[i])) - line.read) / step;
    }
  }
  constexpr double kStep_mm = 0.01;
  StorageVector aside = state.theta;
  aside(kPlace) += kStep_mm;
  const auto then = LayAll(here, aside, lines);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    StorageLine& line = lines[i];
    line.gradient.col(kPlace) =
        LevelOf(state, line.tilt).cwiseProduct(Read(state, AsVector(then[i])) - line.read) /
        kStep_mm;
  }
  for (StorageLine& line : lines) {
    line.own = line.gradient.col(kLagSeconds);
    line.gradient.col(kDrift) = line.own * state.theta(kLagSeconds) * line.along;
    line.gradient.col(kLagSeconds) *= 1 + state.theta(kDrift) * line.along;
  }
}

void Weigh(const StorageState& state, const StorageOptions& options,
           std::vector<StorageLine>& lines) {
  for (StorageLine& line : lines) line.covariance = CovarianceOf(line, state, options);
}

}  // namespace trammel::pressure_advance
