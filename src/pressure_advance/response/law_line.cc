#include "pressure_advance/response/law_line.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "base/square.h"

namespace trammel::pressure_advance {
namespace {

using Eigen::Index, Eigen::VectorXd;

VectorXd AsVector(const std::vector<double>& values) {
  return Eigen::Map<const VectorXd>(values.data(), static_cast<Index>(values.size()));
}

// What a reading has more of a power that is more by one: laid^(1 + p) = laid + p * this, nearly.
// Large swells, which an eye rounds off, do not tell of it.
double PerPower(double laid) {
  constexpr double kMost = 1.5;
  return laid > 0 ? std::min(laid, kMost) * std::log(std::min(laid, kMost)) : 0;
}

VectorXd Read(const LawState& state, const VectorXd& laid) {
  return laid.unaryExpr(
      [&](double area) { return ReadArea(area, state.theta(kSwell), state.theta(kPower)); });
}

VectorXd LevelOf(const LawState& state, const VectorXd& tilt) {
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

LineCovariance CovarianceOf(const LawLine& line, const LawState& state, const LawOptions& options) {
  const VectorXd& mean = line.mean;
  const Index n = mean.size();
  LineCovariance::Terms terms{VectorXd(n), VectorXd(n - 1), VectorXd(n), VectorXd(n - 1),
                              Eigen::MatrixXd(n, 3)};
  const auto at = [&](Index i) { return line.position_mm[static_cast<std::size_t>(i)]; };
  constexpr double kForm = 1e-4;  // of what a model of a line leaves out, its square
  for (Index i = 0; i < n; ++i) {
    terms.own(i) = state.noise * line.variance(i) * line.doubt(i) +
                   Square(options.place_mm * line.slope(i)) +
                   Square(options.swell * std::max(0.0, mean(i) - 1)) + kForm;
    if (i + 1 == n) break;
    // Filament that spreads along the line is nowhere lost.
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

VectorXd LawLine::Off(const LawState& state, const std::vector<double>& laid) const {
  return value - LevelOf(state, tilt).cwiseProduct(Read(state, AsVector(laid)));
}

std::optional<LawLine> LawLineOf(const LineProfile& profile, const Interval& span_mm,
                                 double length_mm) {
  constexpr std::size_t kFewest = 8;
  std::vector<double> value, variance, tilt;
  LawLine line;
  line.pressure_advance_s = profile.pressure_advance_s;
  line.heading = profile.heading;
  const std::vector<ProfileSample>& samples = profile.samples;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const ProfileSample& sample = samples[i];
    // Next to a bead that reaches out of the picture those are seen that read small.
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

std::vector<std::vector<double>> LayAll(const LagModel& model, const LawVector& theta,
                                        const std::vector<LawLine>& lines, double more_s) {
  std::vector<LagModel::Line> all;
  std::vector<std::vector<double>> places;
  places.reserve(lines.size());
  for (const LawLine& line : lines) {
    places.push_back(line.position_mm);
    for (double& at : places.back()) at += line.heading * theta(kPlace);
    all.push_back({LagSecondsAt(theta(kLagSeconds), theta(kDrift), line.along) + more_s,
                   line.pressure_advance_s, places.back()});
  }
  return model.Lay(all);
}

void Linearise(const LagModel& model, const LawState& state, std::vector<LawLine>& lines) {
  const Lag lag = LagOf(state.theta);
  const LagModel here = model.With(lag);
  const std::vector<std::vector<double>> all = LayAll(here, state.theta, lines);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    LawLine& line = lines[i];
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
      LawLine& line = lines[i];
      line.gradient.col(kOfLag + k) =
          LevelOf(state, line.tilt).cwiseProduct(Read(state, AsVector(then[i])) - line.read) / step;
    }
  }
  constexpr double kStep_mm = 0.01;
  LawVector aside = state.theta;
  aside(kPlace) += kStep_mm;
  const auto then = LayAll(here, aside, lines);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    LawLine& line = lines[i];
    line.gradient.col(kPlace) =
        LevelOf(state, line.tilt).cwiseProduct(Read(state, AsVector(then[i])) - line.read) /
        kStep_mm;
  }
  for (LawLine& line : lines) {
    line.own = line.gradient.col(kLagSeconds);
    line.gradient.col(kDrift) = line.own * state.theta(kLagSeconds) * line.along;
    line.gradient.col(kLagSeconds) *= 1 + state.theta(kDrift) * line.along;
  }
}

void Weigh(const LawState& state, const LawOptions& options, std::vector<LawLine>& lines) {
  for (LawLine& line : lines) line.covariance = CovarianceOf(line, state, options);
}

}  // namespace trammel::pressure_advance
