#include "response_bound.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <cstddef>

#include "base/square.h"

namespace trammel::test {
namespace {

constexpr int kUnknowns = 2 + kNuisances;
constexpr double kKnown = 1e12;      // information on what is known
constexpr double kSplit = 0.65;      // of the fast stretch
constexpr double kRounding = 0.002;  // what a reading errs by at least, relative

struct Unknown {
  double LawPoint::*field;
  double step;
  double sigma;  // half the range of laws: 0.3 to 1, 0 to 30 %, 0 to 10 %, +-40 %, 0 to 1
};

constexpr Unknown kLag{&LawPoint::k_star_s, 0.0005, 0};
constexpr Unknown kOthers[kNuisances] = {{&LawPoint::exponent, 0.05, 0.35},
                                         {&LawPoint::second_share, 0.05, 0.15},
                                         {&LawPoint::slip, 0.01, 0.05},
                                         {&LawPoint::drift, 0.05, 0.4},
                                         {&LawPoint::lost_gaps, 0.5, 0.5}};

std::vector<std::size_t> ReadingsOf(const ExtruderWorld& world, Part part) {
  const double split_mm = (world.first_share + kSplit * world.fast_share) * world.length_mm;
  const std::vector<double> positions_mm = ReadingPositions_mm(world);
  std::vector<std::size_t> readings;
  for (std::size_t i = 0; i < positions_mm.size(); ++i) {
    const bool first = positions_mm[i] < split_mm;
    if (part == Part::kWhole || first == (part == Part::kAcceleration)) readings.push_back(i);
  }
  return readings;
}

Eigen::VectorXd MeanOf(const ExtruderWorld& world, const LawPoint& law, std::size_t line,
                       double lag_more_s, const std::vector<std::size_t>& readings) {
  ExtruderWorld printer = law.In(world);
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(readings.size()));
  for (const bool lost : {false, true}) {
    const double share = lost ? law.lost_gaps : 1 - law.lost_gaps;
    if (share == 0) continue;
    printer.gaps_are_lost = lost;
    const std::vector<double> areas =
        LaidAreas(printer, LineLag_s(printer, line, lag_more_s), world.pressure_advance_s[line]);
    for (std::size_t i = 0; i < readings.size(); ++i) {
      mean(static_cast<Eigen::Index>(i)) += share * areas[readings[i]];
    }
  }
  return mean;
}

// Laws at the edge of their range are looked at from inside.
void Ends(const LawPoint& law, const Unknown& unknown, LawPoint& lo, LawPoint& hi) {
  lo = hi = law;
  const double at = law.*unknown.field;
  lo.*unknown.field = at - unknown.step;
  hi.*unknown.field = at + unknown.step;
  if (unknown.field == &LawPoint::exponent && at + unknown.step > 1) hi = law;
  const bool from_zero = unknown.field == &LawPoint::second_share ||
                         unknown.field == &LawPoint::slip || unknown.field == &LawPoint::lost_gaps;
  if (from_zero && at - unknown.step < 0) lo = law;
  if (unknown.field == &LawPoint::lost_gaps && at + unknown.step > 1) hi = law;
}

LineModel ModelLine(const ExtruderWorld& world, const LawPoint& law, std::size_t line,
                    const std::vector<std::size_t>& readings) {
  LineModel model;
  model.mean = MeanOf(world, law, line, 0, readings);
  model.gradient.resize(model.mean.size(), kUnknowns);
  model.gradient.col(0) = model.mean;
  const auto slope = [&](const Unknown& unknown) {
    LawPoint lo, hi;
    Ends(law, unknown, lo, hi);
    return ((MeanOf(world, hi, line, 0, readings) - MeanOf(world, lo, line, 0, readings)) /
            (hi.*unknown.field - lo.*unknown.field))
        .eval();
  };
  model.gradient.col(1) = slope(kLag);
  for (int k = 0; k < kNuisances; ++k) model.gradient.col(2 + k) = slope(kOthers[k]);
  const Eigen::VectorXd own = (MeanOf(world, law, line, kLag.step, readings) -
                               MeanOf(world, law, line, -kLag.step, readings)) /
                              (2 * kLag.step);
  Eigen::MatrixXd covariance = Square(world.lag_scatter_s) * own * own.transpose() +
                               Square(world.flow_scatter) * model.mean * model.mean.transpose();
  for (Eigen::Index i = 0; i < model.mean.size(); ++i) {
    for (Eigen::Index j = 0; j < model.mean.size(); ++j) {
      const auto apart = static_cast<double>(readings[static_cast<std::size_t>(i)]) -
                         static_cast<double>(readings[static_cast<std::size_t>(j)]);
      covariance(i, j) +=
          Square(world.flow_noise) * model.mean(i) * model.mean(j) *
          std::exp(-std::abs(apart) * world.reading_mm / world.flow_noise_length_mm);
    }
    covariance(i, i) += Square(world.reading_noise) + Square(kRounding);
  }
  model.root = covariance.llt().matrixL();
  return model;
}

Eigen::MatrixXd Whitened(const LineModel& line, const Eigen::MatrixXd& columns) {
  return line.root.triangularView<Eigen::Lower>().solve(columns);
}

}  // namespace

const char* ToString(Nuisance nuisance) {
  constexpr const char* kNames[kNuisances] = {"exponent", "second stage", "slip", "drift",
                                              "lost gaps"};
  return kNames[static_cast<int>(nuisance)];
}

ExtruderWorld LawPoint::In(ExtruderWorld world) const {
  world.k_star_s = k_star_s;
  world.law = PowerLaw(exponent);
  world.second_share = second_share;
  world.slip = slip;
  world.lag_drift = drift;
  return world;
}

PatternModel ModelOf(const ExtruderWorld& world, const LawPoint& law, Part part) {
  PatternModel model;
  const std::vector<std::size_t> readings = ReadingsOf(world, part);
  for (std::size_t i = 0; i < world.pressure_advance_s.size(); ++i) {
    model.lines.push_back(ModelLine(world, law, i, readings));
  }
  model.truth_s = TruePressureAdvance(law.In(world));
  model.truth_gradient = Eigen::VectorXd::Zero(kUnknowns);
  const auto slope = [&](const Unknown& unknown) {
    LawPoint lo, hi;
    Ends(law, unknown, lo, hi);
    return (TruePressureAdvance(hi.In(world)) - TruePressureAdvance(lo.In(world))) /
           (hi.*unknown.field - lo.*unknown.field);
  };
  model.truth_gradient(1) = slope(kLag);
  for (int k = 0; k < kNuisances; ++k) model.truth_gradient(2 + k) = slope(kOthers[k]);
  return model;
}

Eigen::MatrixXd PriorOf(const std::vector<Nuisance>& learnt) {
  Eigen::VectorXd prior = Eigen::VectorXd::Constant(kUnknowns, kKnown);
  prior(0) = prior(1) = 0;
  for (const Nuisance nuisance : learnt) {
    const auto k = static_cast<int>(nuisance);
    prior(2 + k) = 1 / Square(kOthers[k].sigma);
  }
  return prior.asDiagonal();
}

double BoundOf(const PatternModel& model, const std::vector<Nuisance>& learnt) {
  Eigen::MatrixXd information = PriorOf(learnt);
  for (const LineModel& line : model.lines) {
    const Eigen::MatrixXd white = Whitened(line, line.gradient);
    information += white.transpose() * white;
  }
  return std::sqrt(model.truth_gradient.dot(information.ldlt().solve(model.truth_gradient)));
}

double ApartOf(const PatternModel& from, const PatternModel& to,
               const std::vector<Nuisance>& learnt) {
  Eigen::MatrixXd information = PriorOf(learnt);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(information.rows());
  double squares = 0;
  for (std::size_t i = 0; i < from.lines.size(); ++i) {
    const Eigen::MatrixXd white = Whitened(from.lines[i], from.lines[i].gradient);
    const Eigen::VectorXd apart = Whitened(from.lines[i], to.lines[i].mean - from.lines[i].mean);
    information += white.transpose() * white;
    right += white.transpose() * apart;
    squares += apart.squaredNorm();
  }
  return std::sqrt(std::max(0.0, squares - right.dot(information.ldlt().solve(right))));
}

}  // namespace trammel::test
