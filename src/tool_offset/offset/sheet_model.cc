#include "tool_offset/offset/sheet_model.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/statistics.h"
#include "geometry/decompositions.h"

namespace trammel::tool_offset {
namespace {

/// Probability below which a contradiction is not by chance and widens the intervals.
constexpr double kContradiction = 0.01;
/// Probability limit for controls drawn + and -. It changes the results, and no known effect makes
/// the method's bias depend on a leg's drawing direction: chance must be excluded.
constexpr double kBiasByDirection = 0.001;
/// Tool number of an assumption, about which no finger scatters.
constexpr int kAssumed = -1;

/// Pooled scatter of a tool's fingers.
struct ToolScatter {
  double squares_mm2 = 0;
  double freedom = 0;
  [[nodiscard]] double variance_mm2() const { return squares_mm2 / std::max(1e-9, freedom); }
};

/// A readable structure as one equation.
struct Equation {
  Combination combination;
  double value_mm = 0;
  double variance_mm2 = 0;
  std::array<double, 2> share_mm2{};  ///< share of variance, by comb
  std::array<int, 2> tool{};
  Purpose purpose = Purpose::kTool;
  Axis axis = Axis::kX;
  int direction = 1;
};

/// Index of each unknown in the vector of all.
struct Columns {
  std::map<int, int> tool;
  std::map<std::pair<int, int>, int> pick_up;
  std::map<int, int> radial;
  int backlash = 0;
  int bias = 0;
  bool by_direction = false;
  int count = 0;

  Columns(const std::vector<Equation>& equations, bool bias_by_direction)
      : by_direction(bias_by_direction) {
    for (const Equation& equation : equations) {
      for (const auto& [number, weight] : equation.combination.tool) Add(tool, number);
      for (const auto& [number, weight] : equation.combination.pick_up) Add(pick_up, number);
      for (const auto& [number, weight] : equation.combination.radial) Add(radial, number);
    }
    backlash = count;
    bias = count + 2;
    count += by_direction ? 6 : 4;
  }

  /// Fills in the row; false if the combination has an unknown that no equation has.
  bool Row(const Combination& c, Eigen::Ref<Eigen::VectorXd> row) const {
    row.setZero();
    const auto add = [&](int column, SheetPoint weight) {
      row[column] += weight.u_mm;
      row[column + 1] += weight.v_mm;
    };
    for (const auto& [number, weight] : c.tool) {
      const auto found = tool.find(number);
      if (found == tool.end()) return false;
      add(found->second, weight);
    }
    for (const auto& [number, weight] : c.pick_up) {
      const auto found = pick_up.find(number);
      if (found == pick_up.end()) return false;
      add(found->second, weight);
    }
    for (const auto& [number, weight] : c.radial) {
      const auto found = radial.find(number);
      if (found == radial.end()) return false;
      add(found->second, weight);
    }
    add(backlash, c.backlash);
    add(bias, c.bias[0]);
    add(by_direction ? bias + 2 : bias, c.bias[1]);
    return true;
  }

 private:
  template <class Key>
  void Add(std::map<Key, int>& columns, const Key& key) {
    if (columns.emplace(key, count).second) count += 2;
  }
};

}  // namespace

WeightedFit FitWeighted(const Eigen::MatrixXd& design, const Eigen::VectorXd& y,
                        const Eigen::VectorXd& variance) {
  const Eigen::VectorXd root = variance.cwiseSqrt().cwiseInverse();
  const double scale = root.size() > 0 ? root.maxCoeff() : 1;
  const Eigen::MatrixXd weighted = (root / scale).asDiagonal() * design;
  const geometry::SingularValues of = geometry::DecomposeSingular(weighted.transpose() * weighted);
  const double smallest = 1e-9 * std::max(1e-300, of.values.maxCoeff());
  const auto rank = (of.values.array() > smallest).count();
  const Eigen::MatrixXd known = of.v.leftCols(rank);
  WeightedFit fit;
  fit.unknowable = of.v.rightCols(design.cols() - rank);
  fit.influence = known * of.values.head(rank).cwiseInverse().asDiagonal() * known.transpose() *
                  weighted.transpose() * (root / scale).asDiagonal();
  fit.unknowns = fit.influence * y;
  fit.chi_square = root.cwiseProduct(y - design * fit.unknowns).squaredNorm();
  fit.freedom = static_cast<int>(design.rows() - rank);
  return fit;
}

SheetPoint BacklashAlong(const SheetPlan& plan, const Structure& structure, const Leg& leg) {
  const double tilt_rad = plan.settings.tilt_deg * std::numbers::pi / 180;
  const double c = std::cos(tilt_rad);
  const double s = std::sin(tilt_rad);
  const double du = leg.end.u_mm - leg.start.u_mm;
  const double dv = leg.end.v_mm - leg.start.v_mm;
  const double lag_x = -std::copysign(0.5, du * c - dv * s);
  const double lag_y = -std::copysign(0.5, du * s + dv * c);
  return structure.axis == Axis::kX ? SheetPoint{lag_x * c, lag_y * s}
                                    : SheetPoint{-lag_x * s, lag_y * c};
}

double Programmed_mm(const Structure& structure) {
  return Along(structure.axis, structure.combs[1].programmed) -
         Along(structure.axis, structure.combs[0].programmed);
}

struct SheetModel::Solution {
  std::map<int, ToolScatter> scatter;
  std::vector<Equation> equations;
  std::optional<Columns> columns;
  WeightedFit fit;
  double widening = 1;          ///< factor of all variances
  double assumed_variance = 1;  ///< heights' and colours', relative to the stated variance

  using Photos = std::vector<const std::vector<StructureReading>*>;
  void Pool(const SheetPlan& plan, const Photos& photos);
  [[nodiscard]] Equation EquationOf(const SheetPlan& plan, const StructureReading& reading) const;
  void Collect(const SheetPlan& plan, const Photos& photos);
  /// Adds the equations of one structure, each of a photo, as their mean and their differences.
  void AddViews(const std::vector<Equation>& views, double of_photo);
  /// Adds the prior of each tool's height and colour.
  void Assume(const RadialSpread& spread);
  void Solve(bool bias_by_direction);
  /// Solves again with the prior scaled to the tools' lines.
  void ScaleAssumed(const RadialSpread& spread, bool bias_by_direction);
  /// Returns the mean square of heights and colours in units of their present prior, over their
  /// degrees of freedom: the former ones and as many as the photo determines.
  double LinesAgainstAssumed(double freedom_before);
  [[nodiscard]] bool ControlsDisagree() const;
  [[nodiscard]] bool HasEveryControl() const;
  [[nodiscard]] Quantity Spread(double value_mm, const Eigen::VectorXd& gain) const;
};

Combination StructureEquation(const SheetPlan& plan, const Structure& structure) {
  Combination combination;
  const bool is_x = structure.axis == Axis::kX;
  const auto unit = [&](double sign) { return is_x ? SheetPoint{sign, 0} : SheetPoint{0, sign}; };
  const auto add = [](SheetPoint& to, SheetPoint what) {
    to.u_mm += what.u_mm;
    to.v_mm += what.v_mm;
  };
  for (const std::size_t comb : {std::size_t{0}, std::size_t{1}}) {
    const Comb& drawn = structure.combs[comb];
    const double sign = comb == 1 ? 1 : -1;
    if (drawn.tool != plan.settings.reference_tool) {
      add(combination.tool[drawn.tool], unit(sign));
    }
    if (drawn.pick_up > 0) add(combination.pick_up[{drawn.tool, drawn.pick_up}], unit(sign));
    if (plan.original) {
      add(combination.bias[structure.swapped ? 1 : 0], unit(0.5));
      continue;
    }
    const SheetPoint backlash =
        BacklashAlong(plan, structure, FingerLegs(plan, structure, comb, 0)[0]);
    add(combination.backlash, {sign * backlash.u_mm, sign * backlash.v_mm});
    add(combination.bias[drawn.direction > 0 ? 0 : 1], unit(0.5));
  }
  return combination;
}

namespace {

/// Computes the effect of the tools' heights and colours on a structure of which only comb 1 moves.
std::map<int, SheetPoint> RadialOf(const SheetPlan& plan, const Structure& structure,
                                   SheetPoint lever) {
  std::map<int, SheetPoint> radial;
  for (const std::size_t comb : {std::size_t{0}, std::size_t{1}}) {
    const int tool = structure.combs[comb].tool;
    if (tool == plan.settings.reference_tool) continue;
    const double sign = comb == 1 ? 1 : -1;
    SheetPoint& weight = radial[tool];
    weight.u_mm += sign * lever.u_mm;
    weight.v_mm += sign * lever.v_mm;
  }
  return radial;
}

void AddTo(Combination& sum, const Combination& more, double factor) {
  const auto add = [factor](SheetPoint& to, SheetPoint what) {
    to.u_mm += factor * what.u_mm;
    to.v_mm += factor * what.v_mm;
  };
  for (const auto& [tool, weight] : more.tool) add(sum.tool[tool], weight);
  for (const auto& [key, weight] : more.pick_up) add(sum.pick_up[key], weight);
  for (const auto& [tool, weight] : more.radial) add(sum.radial[tool], weight);
  add(sum.backlash, more.backlash);
  add(sum.bias[0], more.bias[0]);
  add(sum.bias[1], more.bias[1]);
}

/// Averages equations of one structure, one per photo.
/// @param share  the mean's variance in parts of one photo's.
Equation Mean(const std::vector<Equation>& views, double share) {
  Equation mean = views.front();
  const double part = 1 / static_cast<double>(views.size());
  mean.combination = {};
  mean.value_mm = 0;
  mean.share_mm2 = {};
  for (const Equation& view : views) {
    AddTo(mean.combination, view.combination, part);
    mean.value_mm += part * view.value_mm;
    for (const std::size_t comb : {std::size_t{0}, std::size_t{1}}) {
      mean.share_mm2[comb] += part * share * view.share_mm2[comb];
    }
  }
  mean.variance_mm2 = mean.share_mm2[0] + mean.share_mm2[1];
  return mean;
}

/// Estimates the part of the fingers' variance that is a photo's own: from differences of their
/// residuals between one photo and the next.
double PhotoShare(const std::vector<const std::vector<StructureReading>*>& photos) {
  constexpr double kMin = 0.02;
  double apart = 0;
  double both = 0;
  for (std::size_t k = 1; k < photos.size(); ++k) {
    for (std::size_t i = 0; i < photos[k]->size(); ++i) {
      const StructureReading& one = (*photos[k - 1])[i];
      const StructureReading& other = (*photos[k])[i];
      if (!one.offset_mm.good() || !other.offset_mm.good()) continue;
      for (std::size_t f = 0; f < std::min(one.fingers.size(), other.fingers.size()); ++f) {
        const FingerReading& a = one.fingers[f];
        const FingerReading& b = other.fingers[f];
        if (!a.left_out.empty() || !b.left_out.empty()) continue;
        apart += (a.residual_mm - b.residual_mm) * (a.residual_mm - b.residual_mm);
        both += a.residual_mm * a.residual_mm + b.residual_mm * b.residual_mm;
      }
    }
  }
  return both > 0 ? std::clamp(apart / both, kMin, 1.0) : 1;
}

/// Returns the equation of the displacement's growth along a structure of two tools.
/// @param offset  the structure's own equation.
std::optional<Equation> GrowthOf(const SheetPlan& plan, const StructureReading& reading,
                                 const Equation& offset) {
  if (!reading.lever || offset.tool[0] == offset.tool[1]) return std::nullopt;
  Equation equation = offset;
  equation.combination = {};
  equation.combination.radial =
      RadialOf(plan, plan.structures[reading.structure],
               {reading.lever->height_per_mm, reading.lever->colour_per_px});
  equation.purpose = Purpose::kTool;
  equation.value_mm = reading.growth;
  for (const std::size_t comb : {std::size_t{0}, std::size_t{1}}) {
    const double ratio = reading.growth_gain[comb] / reading.gain[comb];
    equation.share_mm2[comb] *= ratio * ratio;
  }
  equation.variance_mm2 = equation.share_mm2[0] + equation.share_mm2[1];
  return equation;
}

}  // namespace

Combination ReadingEquation(const SheetPlan& plan, const StructureReading& reading) {
  const Structure& structure = plan.structures[reading.structure];
  Combination combination = StructureEquation(plan, structure);
  if (reading.lever) {
    combination.radial =
        RadialOf(plan, structure, {reading.lever->height, reading.lever->colour_mm_px});
  }
  return combination;
}

void SheetModel::Solution::Pool(const SheetPlan& plan, const Photos& photos) {
  // Photos of one print show the same scatter.
  const auto views = static_cast<double>(photos.size());
  for (const std::vector<StructureReading>* structures : photos) {
    for (const StructureReading& reading : *structures) {
      if (!reading.offset_mm.good()) continue;
      for (const std::size_t comb : {std::size_t{0}, std::size_t{1}}) {
        ToolScatter& tool = scatter[plan.structures[reading.structure].combs[comb].tool];
        tool.squares_mm2 += reading.comb_squares_mm2[comb] / views;
        tool.freedom += reading.comb_freedom[comb] / views;
      }
    }
  }
}

Equation SheetModel::Solution::EquationOf(const SheetPlan& plan,
                                          const StructureReading& reading) const {
  /// Ratio above which a structure worse than its tools elsewhere has its own variance.
  constexpr double kWorse = 2.5;
  constexpr double kMin_mm2 = 1e-12;  // 1 nm: a drawn page without noise
  const Structure& structure = plan.structures[reading.structure];
  Equation equation;
  equation.combination = ReadingEquation(plan, reading);
  equation.value_mm = reading.offset_mm.quantity().value - Programmed_mm(structure);
  equation.purpose = structure.purpose;
  equation.axis = structure.axis;
  equation.direction = plan.original ? (structure.swapped ? -1 : 1) : structure.combs[0].direction;
  for (const std::size_t comb : {std::size_t{0}, std::size_t{1}}) {
    equation.tool[comb] = structure.combs[comb].tool;
    const double pooled_mm2 = scatter.at(equation.tool[comb]).variance_mm2();
    const double own_mm2 =
        reading.comb_squares_mm2[comb] / std::max(1e-9, reading.comb_freedom[comb]);
    equation.share_mm2[comb] =
        std::max(kMin_mm2, own_mm2 > kWorse * pooled_mm2 ? own_mm2 : pooled_mm2) *
        reading.gain[comb] * reading.gain[comb];
  }
  equation.variance_mm2 = equation.share_mm2[0] + equation.share_mm2[1];
  return equation;
}

void SheetModel::Solution::Collect(const SheetPlan& plan, const Photos& photos) {
  const double of_photo = PhotoShare(photos);
  for (std::size_t i = 0; i < photos.front()->size(); ++i) {
    std::vector<Equation> offsets;
    std::vector<Equation> growths;
    for (const std::vector<StructureReading>* structures : photos) {
      const StructureReading& reading = (*structures)[i];
      if (!reading.offset_mm.good()) continue;
      if (plan.structures[reading.structure].purpose == Purpose::kSelfTest) continue;
      offsets.push_back(EquationOf(plan, reading));
      if (auto growth = GrowthOf(plan, reading, offsets.back())) growths.push_back(*growth);
    }
    AddViews(offsets, of_photo);
    AddViews(growths, of_photo);
  }
}

void SheetModel::Solution::AddViews(const std::vector<Equation>& views, double of_photo) {
  if (views.empty()) return;
  if (views.size() == 1) {
    equations.push_back(views.front());
    return;
  }
  const auto count = static_cast<double>(views.size());
  equations.push_back(Mean(views, 1 - of_photo * (1 - 1 / count)));
  // Adds the difference of each equation from the mean of those before.
  for (std::size_t next = 1; next < views.size(); ++next) {
    const auto before = static_cast<double>(next);
    Equation contrast = Mean({views.begin(), views.begin() + static_cast<std::ptrdiff_t>(next)},
                             of_photo * (1 + 1 / before));
    if (contrast.combination.radial.empty()) continue;
    contrast.value_mm -= views[next].value_mm;
    AddTo(contrast.combination, views[next].combination, -1);
    contrast.purpose = Purpose::kTool;
    equations.push_back(contrast);
  }
}

void SheetModel::Solution::Assume(const RadialSpread& spread) {
  std::map<int, bool> tools;
  for (const Equation& equation : equations) {
    for (const auto& [tool, weight] : equation.combination.radial) tools[tool] = true;
  }
  if (tools.empty()) return;
  constexpr double kMin = 1e-6;
  scatter[kAssumed].freedom = spread.freedom;
  for (const auto& [tool, known] : tools) {
    for (const bool height : {true, false}) {
      Equation equation;
      equation.combination.radial[tool] = {height ? 1.0 : 0.0, height ? 0.0 : 1.0};
      const double one = std::max(kMin, height ? spread.height_mm : spread.colour_px);
      equation.variance_mm2 = one * one;
      equation.share_mm2 = {equation.variance_mm2, 0};
      equation.tool = {kAssumed, kAssumed};
      equations.push_back(equation);
    }
  }
}

void SheetModel::Solution::Solve(bool bias_by_direction) {
  columns.emplace(equations, bias_by_direction);
  const auto rows = static_cast<Eigen::Index>(equations.size());
  Eigen::MatrixXd design(rows, columns->count);
  Eigen::VectorXd y(rows);
  Eigen::VectorXd variance(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Equation& equation = equations[static_cast<std::size_t>(i)];
    Eigen::VectorXd row(columns->count);
    columns->Row(equation.combination, row);
    design.row(i) = row.transpose();
    y[i] = equation.value_mm;
    variance[i] = equation.variance_mm2;
  }
  fit = FitWeighted(design, y, variance);
}

void SheetModel::Solution::ScaleAssumed(const RadialSpread& spread, bool bias_by_direction) {
  constexpr int kMaxRounds = 30;
  constexpr double kSame = 1e-4;
  if (scatter.count(kAssumed) == 0) return;
  for (int round = 0; round < kMaxRounds; ++round) {
    const double factor = LinesAgainstAssumed(spread.freedom);
    assumed_variance *= factor;
    for (Equation& equation : equations) {
      if (equation.tool[0] != kAssumed) continue;
      equation.variance_mm2 *= factor;
      equation.share_mm2[0] *= factor;
    }
    Solve(bias_by_direction);
    if (std::abs(factor - 1) < kSame) break;
  }
}

double SheetModel::Solution::LinesAgainstAssumed(double freedom_before) {
  double squares = freedom_before / assumed_variance;
  double freedom_of_lines = freedom_before;
  Eigen::VectorXd variance(static_cast<Eigen::Index>(equations.size()));
  for (std::size_t i = 0; i < equations.size(); ++i) {
    variance[static_cast<Eigen::Index>(i)] = equations[i].variance_mm2;
  }
  Eigen::VectorXd row(columns->count);
  for (const Equation& equation : equations) {
    if (equation.tool[0] != kAssumed) continue;
    columns->Row(equation.combination, row);
    const Eigen::VectorXd gain = fit.influence.transpose() * row;
    const double value = row.dot(fit.unknowns);
    squares += value * value / equation.variance_mm2;
    freedom_of_lines += std::max(0.0, 1 - gain.cwiseAbs2().dot(variance) / equation.variance_mm2);
  }
  scatter[kAssumed].freedom = freedom_of_lines;
  return squares / freedom_of_lines;
}

bool SheetModel::Solution::ControlsDisagree() const {
  double sum = 0;
  int tests = 0;
  for (const Axis axis : {Axis::kX, Axis::kY}) {
    std::array<double, 2> weight{};
    std::array<double, 2> mean_mm{};
    for (const Equation& equation : equations) {
      if (equation.purpose != Purpose::kControl || equation.axis != axis) continue;
      const std::size_t way = equation.direction > 0 ? 0 : 1;
      weight[way] += 1 / equation.variance_mm2;
      mean_mm[way] += equation.value_mm / equation.variance_mm2;
    }
    if (weight[0] == 0 || weight[1] == 0) continue;
    const double apart_mm = mean_mm[0] / weight[0] - mean_mm[1] / weight[1];
    sum += apart_mm * apart_mm / (1 / weight[0] + 1 / weight[1]);
    ++tests;
  }
  return ChiSquareTail(sum, tests) < kBiasByDirection;
}

/// True if a control of each kind was readable along both axes.
bool SheetModel::Solution::HasEveryControl() const {
  std::array<bool, 4> has{};
  for (const Equation& equation : equations) {
    if (equation.purpose != Purpose::kControl) continue;
    has[(equation.axis == Axis::kX ? 0U : 2U) + (equation.direction > 0 ? 0U : 1U)] = true;
  }
  return has[0] && has[1] && has[2] && has[3];
}

/// Returns the value with the uncertainty from the fingers' scatter; degrees of freedom after Welch
/// and Satterthwaite.
Quantity SheetModel::Solution::Spread(double value_mm, const Eigen::VectorXd& gain) const {
  std::map<int, double> share_mm2;
  for (std::size_t i = 0; i < equations.size(); ++i) {
    const double squared = gain[static_cast<Eigen::Index>(i)] * gain[static_cast<Eigen::Index>(i)];
    for (const std::size_t comb : {std::size_t{0}, std::size_t{1}}) {
      share_mm2[equations[i].tool[comb]] += squared * equations[i].share_mm2[comb];
    }
  }
  double variance_mm2 = 0;
  double fourth = 0;
  for (const auto& [tool, share] : share_mm2) {
    variance_mm2 += share;
    fourth += share * share / std::max(1.0, scatter.at(tool).freedom);
  }
  double degrees = fourth > 0 ? variance_mm2 * variance_mm2 / fourth : 1e6;
  if (widening > 1) degrees = std::min(degrees, std::max(1.0, static_cast<double>(fit.freedom)));
  return Around(value_mm, std::sqrt(variance_mm2 * widening), StudentT95(degrees));
}

SheetModel::SheetModel(const SheetPlan& plan, const std::vector<StructureReading>& structures,
                       const RadialSpread& spread)
    : SheetModel(plan, std::vector<const std::vector<StructureReading>*>{&structures}, spread) {}

SheetModel::SheetModel(const SheetPlan& plan,
                       const std::vector<const std::vector<StructureReading>*>& photos,
                       const RadialSpread& spread)
    : solution_(std::make_unique<Solution>()) {
  solution_->Pool(plan, photos);
  solution_->Collect(plan, photos);
  solution_->Assume(spread);
  const bool by_direction =
      plan.original ? solution_->HasEveryControl() : solution_->ControlsDisagree();
  solution_->Solve(by_direction);
  solution_->ScaleAssumed(spread, by_direction);
  if (ChiSquareTail(solution_->fit.chi_square, solution_->fit.freedom) < kContradiction) {
    solution_->widening = solution_->fit.chi_square / solution_->fit.freedom;
  }
}

SheetModel::~SheetModel() = default;

std::optional<Quantity> SheetModel::Estimate(const Combination& combination) const {
  constexpr double kDetermined = 1e-6;
  Eigen::VectorXd row(solution_->columns->count);
  if (!solution_->columns->Row(combination, row)) return std::nullopt;
  if ((solution_->fit.unknowable.transpose() * row).norm() > kDetermined) return std::nullopt;
  return solution_->Spread(row.dot(solution_->fit.unknowns),
                           solution_->fit.influence.transpose() * row);
}

std::optional<Quantity> SheetModel::WithoutBias(const SheetPlan& plan,
                                                const StructureReading& reading) const {
  if (!reading.offset_mm.good()) return std::nullopt;
  Combination bias;
  bias.bias = StructureEquation(plan, plan.structures[reading.structure]).bias;
  const auto known = Estimate(bias);
  if (!known) return std::nullopt;
  const Quantity& quantity = reading.offset_mm.quantity();
  return Around(quantity.value - known->value,
                std::hypot(quantity.standard_uncertainty, known->standard_uncertainty),
                StudentT95(std::max(1.0, reading.comb_freedom[0] + reading.comb_freedom[1])));
}

double SheetModel::line_spread() const { return std::sqrt(solution_->assumed_variance); }
double SheetModel::chi_square() const { return solution_->fit.chi_square; }
int SheetModel::freedom() const { return solution_->fit.freedom; }
bool SheetModel::bias_by_direction() const { return solution_->columns->by_direction; }
bool SheetModel::widened() const { return solution_->widening > 1; }

double SheetModel::pooled_scatter_mm() const {
  ToolScatter all;
  for (const auto& [tool, scatter] : solution_->scatter) {
    if (tool == kAssumed) continue;
    all.squares_mm2 += scatter.squares_mm2;
    all.freedom += scatter.freedom;
  }
  return std::sqrt(all.variance_mm2());
}

}  // namespace trammel::tool_offset
