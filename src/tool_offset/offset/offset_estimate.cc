#include "tool_offset/offset/offset_estimate.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "base/measured.h"
#include "base/statistics.h"
#include "tool_offset/reading/structure_reader.h"
#include "tool_offset/reading/tool_search.h"

namespace trammel::tool_offset {
namespace {

struct BacklashOfLegs {
  std::optional<Quantity> x_mm;  ///< bed axes; absent if not determined
  std::optional<Quantity> y_mm;
};

/// Probability below which a contradiction is not by chance and widens the intervals.
constexpr double kContradiction = 0.01;

/// Mean distance of a comb's legs beyond the planned one.
struct CombSpacing {
  std::pair<int, Axis> of;  ///< tool and axis: what shares a line's shape
  SheetPoint backlash;      ///< per mm of each axis' play
  double mean_mm = 0;
  double squares_mm2 = 0;  ///< about the mean
  int count = 0;
};

std::vector<CombSpacing> SpacingsOf(const SheetPlan& plan,
                                    const std::vector<StructureReading>& structures) {
  constexpr int kFewest = 4;
  std::vector<CombSpacing> combs;
  for (const StructureReading& reading : structures) {
    if (!reading.offset_mm.good()) continue;
    const Structure& structure = plan.structures[reading.structure];
    for (const std::size_t comb : {std::size_t{0}, std::size_t{1}}) {
      std::vector<double> beyond_mm;
      for (const FingerReading& finger : reading.fingers) {
        if (finger.comb != comb || !finger.left_out.empty()) continue;
        const double apart_mm = finger.legs[1].position_mm - finger.legs[0].position_mm;
        beyond_mm.push_back(apart_mm / (1 + reading.stretch) - plan.settings.leg_spacing_mm);
      }
      if (static_cast<int>(beyond_mm.size()) < kFewest) continue;
      CombSpacing spacing;
      spacing.of = {structure.combs[comb].tool, structure.axis};
      const auto legs = FingerLegs(plan, structure, comb, 1);
      const SheetPoint lower = BacklashAlong(plan, structure, legs[0]);
      const SheetPoint upper = BacklashAlong(plan, structure, legs[1]);
      spacing.backlash = {upper.u_mm - lower.u_mm, upper.v_mm - lower.v_mm};
      spacing.mean_mm = Mean(beyond_mm);
      for (const double mm : beyond_mm) spacing.squares_mm2 += std::pow(mm - spacing.mean_mm, 2);
      spacing.count = static_cast<int>(beyond_mm.size());
      combs.push_back(spacing);
    }
  }
  return combs;
}

/// Computes the variance of each comb's mean: its tool's scatter, pooled.
Eigen::VectorXd Variances(const std::vector<CombSpacing>& combs, double& freedom) {
  constexpr double kMin_mm2 = 1e-12;  // 1 nm: a drawn page without noise
  std::map<int, std::pair<double, double>> pooled;
  freedom = 0;
  for (const CombSpacing& comb : combs) {
    pooled[comb.of.first].first += comb.squares_mm2;
    pooled[comb.of.first].second += comb.count - 1;
    freedom += comb.count - 1;
  }
  Eigen::VectorXd variance(static_cast<Eigen::Index>(combs.size()));
  for (std::size_t i = 0; i < combs.size(); ++i) {
    const auto& [squares, degrees] = pooled[combs[i].of.first];
    variance[static_cast<Eigen::Index>(i)] = std::max(kMin_mm2, squares / degrees) / combs[i].count;
  }
  return variance;
}

/// Estimates backlash from the distance of fingers' two legs.
///
/// Backlash does not move the middle of a finger that is drawn there and back, but its legs lag in
/// opposite directions: combs stepped one way have their legs closer together, the others farther
/// apart. The effect of the lines' shape on the distance is the same in all combs of a tool and
/// axis, and is fitted together with the backlash: least squares, each comb weighted by the scatter
/// of its tool's distances. Intervals widen if combs contradict each other (chi-square, 1 %).
/// @param structures  with their fingers, of this plan.
BacklashOfLegs EstimateBacklashOfLegs(const SheetPlan& plan,
                                      const std::vector<StructureReading>& structures) {
  const std::vector<CombSpacing> combs = SpacingsOf(plan, structures);
  if (combs.empty()) return {};
  std::map<std::pair<int, Axis>, Eigen::Index> column;
  for (const CombSpacing& comb : combs) {
    column.emplace(comb.of, static_cast<Eigen::Index>(column.size()) + 2);
  }
  const auto rows = static_cast<Eigen::Index>(combs.size());
  const auto columns = static_cast<Eigen::Index>(column.size()) + 2;
  double degrees = 0;
  const Eigen::VectorXd variance = Variances(combs, degrees);
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(rows, columns);
  Eigen::VectorXd y(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const CombSpacing& comb = combs[static_cast<std::size_t>(i)];
    design(i, 0) = comb.backlash.u_mm;
    design(i, 1) = comb.backlash.v_mm;
    design(i, column.at(comb.of)) = 1;
    y[i] = comb.mean_mm;
  }
  const WeightedFit fit = FitWeighted(design, y, variance);
  const bool widened =
      fit.freedom > 0 && ChiSquareTail(fit.chi_square, fit.freedom) < kContradiction;
  const double widening = widened ? fit.chi_square / fit.freedom : 1;
  const double factor = StudentT95(widened ? fit.freedom : std::max(1.0, degrees));
  const auto answer = [&](Eigen::Index axis) -> std::optional<Quantity> {
    constexpr double kDetermined = 1e-6;
    if (fit.unknowable.row(axis).norm() > kDetermined) return std::nullopt;
    const double of_mean = fit.influence.row(axis).cwiseAbs2().dot(variance);
    return Around(fit.unknowns[axis], std::sqrt(widening * of_mean), factor);
  };
  return {answer(0), answer(1)};
}

/// Bed axis in the sheet's axes.
struct Turn {
  double c = 1;
  double s = 0;

  explicit Turn(const SheetPlan& plan)
      : c(std::cos(plan.settings.tilt_deg * std::numbers::pi / 180)),
        s(std::sin(plan.settings.tilt_deg * std::numbers::pi / 180)) {}
  /// bed = c u - s v, s u + c v
  [[nodiscard]] SheetPoint x() const { return {c, -s}; }
  [[nodiscard]] SheetPoint y() const { return {s, c}; }
  [[nodiscard]] SheetPoint Bed(SheetPoint sheet) const {
    return {c * sheet.u_mm - s * sheet.v_mm, s * sheet.u_mm + c * sheet.v_mm};
  }
};

Measured Answer(const std::optional<Quantity>& quantity, const std::string& why_not) {
  return quantity ? Measured::Good(*quantity) : Measured::CannotTell(why_not);
}

/// Returns the first reason why structures with this tool were unreadable.
std::string FirstReason(const SheetPlan& plan, const SheetResult& result, int tool) {
  for (const StructureReading& reading : result.structures) {
    const Structure& structure = plan.structures[reading.structure];
    if (reading.offset_mm.good() || structure.purpose != Purpose::kTool) continue;
    if (structure.combs[0].tool != tool && structure.combs[1].tool != tool) continue;
    return fmt::format("{}: {}", reading.name, reading.offset_mm.reason());
  }
  return "too few of its structures could be read";
}

void Refuse(const std::string& reason, ToolReading& tool) {
  tool.dx_mm = tool.dy_mm = Measured::Refused(reason);
}

/// Reports the approximate reading and the remedy for a tool whose teeth touch, or are among
/// others.
void AnswerCoarsely(const SheetPlan& plan, ToolReading& tool) {
  const double max_mm = std::max(std::abs(tool.coarse_mm.u_mm), std::abs(tool.coarse_mm.v_mm));
  const double reach_mm = plan.original ? kOriginalReach_mm : kCoarseReach_mm;
  if (max_mm > reach_mm) {
    return Refuse(
        fmt::format("T{} is about {:+.1f} / {:+.1f} mm off, more than the {:.3g} mm that a sheet "
                    "answers: set its offset roughly first, then print the sheet again",
                    tool.tool, tool.coarse_mm.u_mm, tool.coarse_mm.v_mm, reach_mm),
        tool);
  }
  // Fingers are searched for within 0.3 mm; on flat paper they are within 0.04 mm of each other.
  constexpr double kMaxSpread_mm = 0.12;
  if (tool.coarse_reading.spread_mm > kMaxSpread_mm) {
    return Refuse(
        fmt::format(
            "T{}: the fingers of its combs lie unevenly, by {:.2f} mm: the paper was folded "
            "or moved; print on a flat sheet, taped down along all edges",
            tool.tool, tool.coarse_reading.spread_mm),
        tool);
  }
  tool.coarse = true;
  tool.dx_mm =
      Measured::Good(Around(tool.coarse_mm.u_mm, tool.coarse_reading.standard_uncertainty_mm, 2));
  tool.dy_mm =
      Measured::Good(Around(tool.coarse_mm.v_mm, tool.coarse_reading.standard_uncertainty_mm, 2));
  tool.notice = fmt::format(
      "T{} is {:+.2f} / {:+.2f} mm off, too far for its combs (up to {:.2f} mm): apply this coarse "
      "value, then print and scan the sheet again",
      tool.tool, tool.coarse_mm.u_mm, tool.coarse_mm.v_mm, FineReach_mm(plan.settings));
}

/// Explains why a tool was not found.
std::string NotFound(const ToolReading& tool) {
  const CoarseReading& coarse = tool.coarse_reading;
  constexpr double kMaxPrinted = 0.8;  // of lines; above it they seem present
  if (coarse.beside >= 0 && coarse.legs_share > kMaxPrinted) {
    return fmt::format(
        "T{}: cannot tell where it prints: T{} prints over its lines; set the offset of both "
        "roughly first, or print the sheet with one of them only",
        tool.tool, coarse.beside);
  }
  if (coarse.ambiguous) {
    return fmt::format(
        "T{}: cannot tell where it prints: its lines seem to be at two places; look "
        "for what covers them, or set its offset roughly first",
        tool.tool);
  }
  if (coarse.ink.channels > 0 && !IsReadable(coarse.ink)) {
    return fmt::format("T{}: {}", tool.tool, WhyUnreadable(coarse.ink, coarse.strength));
  }
  return fmt::format(
      "T{}: at no place within {:.0f} mm of its own more than {:.0f} % of its lines are there: it "
      "did not print, breaks off, is too faint on this paper, or is further off; check that it "
      "extrudes and sticks, use a colour that stands out, or set its offset roughly first",
      tool.tool, kSearch_mm, 100 * coarse.legs_share);
}

/// Computes the error of a faint line by a scanner's one-sided light. The shadow beside a line
/// shifts the position that halves its ink by the shadow's ink over the line's. Flatbeds' shadows
/// take up to half of the light over up to 0.2 mm.
double ShadowUncertainty_mm(double reference, double tool) {
  constexpr double kFaintest_mm = 0.008;  // standard uncertainty against a line of no contrast
  const double ratio = std::min(reference, tool) / std::max({reference, tool, 1e-9});
  // Tones of one filament differ by some per cent.
  return ratio > 0.9 ? 0 : kFaintest_mm * (1 - ratio);
}

/// Computes the error of lines of another height by a photo's uncertain focal length: the lens's
/// foot point moves with its square. Sheet axes, with signs; zero for a scan.
SheetPoint StandUncertainty_mm(const SheetModel& model, const SheetResult& result) {
  if (!result.photo) return {};
  const PhotoPose& pose = result.photo->pose;
  const double apart_mm = model.line_spread() * result.photo->spread.height_mm;
  const double factor = 2 * pose.focal_uncertainty * apart_mm / pose.height_mm;
  return {factor * (pose.foot.u_mm - pose.aim.u_mm), factor * (pose.foot.v_mm - pose.aim.v_mm)};
}

/// Computes the error of lines in another scale than the reference tool's by the lens's uncertain
/// axis: they grow about another point.
double AxisUncertainty_mm(const SheetModel& model, const SheetResult& result, int tool) {
  if (!result.photo) return 0;
  std::vector<double> colour_per_px;
  for (const StructureReading& reading : result.structures) {
    if (reading.lever) colour_per_px.push_back(reading.lever->colour_per_px);
  }
  if (colour_per_px.empty()) return 0;
  Combination scale;
  scale.radial[tool] = {1 / result.photo->pose.height_mm, Mean(colour_per_px)};
  const auto seen = model.Estimate(scale);
  if (!seen) return 0;
  return result.photo->pose.centre_uncertainty_px / result.photo->px_per_mm *
         std::hypot(seen->value, seen->standard_uncertainty);
}

Quantity Widened(const Quantity& quantity, double by_mm) {
  constexpr double kNormal95 = 1.96;
  const double half =
      std::hypot((quantity.interval95.hi - quantity.interval95.lo) / 2, kNormal95 * by_mm);
  Quantity wide = quantity;
  wide.standard_uncertainty = std::hypot(quantity.standard_uncertainty, by_mm);
  wide.interval95 = {quantity.value - half, quantity.value + half};
  return wide;
}

void AnswerFinely(const SheetPlan& plan, const SheetModel& model, const SheetResult& result,
                  ToolReading& tool) {
  constexpr double kAgree_mm = 0.25;  // the finder's reach is 0.45 mm
  const Turn turn(plan);
  Combination dx;
  Combination dy;
  dx.tool[tool.tool] = turn.x();
  dy.tool[tool.tool] = turn.y();
  const auto x = model.Estimate(dx);
  const auto y = model.Estimate(dy);
  if (!x || !y) {
    return Refuse(fmt::format("T{}: {}", tool.tool, FirstReason(plan, result, tool.tool)), tool);
  }
  const SheetPoint& coarse = tool.coarse_mm;
  const double apart_mm = std::hypot(x->value - coarse.u_mm, y->value - coarse.v_mm);
  if (apart_mm > kAgree_mm) {
    return Refuse(fmt::format("T{}: its teeth say {:+.3f} / {:+.3f} mm, but its combs as a whole "
                              "{:+.2f} / {:+.2f} mm: something else lies among them; print the "
                              "sheet again",
                              tool.tool, x->value, y->value, coarse.u_mm, coarse.v_mm),
                  tool);
  }
  const double shadow_mm =
      ShadowUncertainty_mm(result.reference_strength, Strength(tool.coarse_reading.ink));
  const SheetPoint stand_mm = turn.Bed(StandUncertainty_mm(model, result));
  const double axis_mm = AxisUncertainty_mm(model, result, tool.tool);
  tool.dx_mm = Measured::Good(Widened(*x, std::hypot(shadow_mm, axis_mm, stand_mm.u_mm)));
  tool.dy_mm = Measured::Good(Widened(*y, std::hypot(shadow_mm, axis_mm, stand_mm.v_mm)));
}

void AnswerTools(const SheetPlan& plan, const SheetModel& model, SheetResult& result) {
  const Turn turn(plan);
  const double reach_mm = FineReach_mm(plan.settings);
  for (ToolReading& tool : result.tools) {
    if (!tool.coarse_reading.found) {
      Refuse(NotFound(tool), tool);
      continue;
    }
    const SheetPoint& apart = tool.coarse_reading.from_reference;
    tool.coarse_mm = turn.Bed(apart);
    if (std::max(std::abs(apart.u_mm), std::abs(apart.v_mm)) > reach_mm) {
      AnswerCoarsely(plan, tool);
    } else {
      AnswerFinely(plan, model, result, tool);
    }
  }
}

void AnswerAxes(const SheetPlan& plan, const SheetModel& model, SheetResult& result) {
  const std::string unread = "too few structures of the reference tool could be read";
  Combination weight;
  if (plan.original) {
    const BacklashOfLegs backlash = EstimateBacklashOfLegs(plan, result.structures);
    const std::string none = "of no tool combs that are stepped both ways could be read";
    result.backlash_mm = {Answer(backlash.x_mm, none), Answer(backlash.y_mm, none)};
  } else {
    weight.backlash = {1, 0};
    result.backlash_mm.x = Answer(model.Estimate(weight), unread);
    weight.backlash = {0, 1};
    result.backlash_mm.y = Answer(model.Estimate(weight), unread);
    weight.backlash = {};
  }
  weight.bias = {SheetPoint{0.5, 0}, SheetPoint{0.5, 0}};
  result.control_bias_mm.x = Answer(model.Estimate(weight), unread);
  weight.bias = {SheetPoint{0, 0.5}, SheetPoint{0, 0.5}};
  result.control_bias_mm.y = Answer(model.Estimate(weight), unread);
}

void AnswerScale(const SheetPlan& plan, SheetResult& result) {
  for (const Axis axis : {Axis::kX, Axis::kY}) {
    std::vector<double> scale;
    for (const StructureReading& reading : result.structures) {
      const Structure& structure = plan.structures[reading.structure];
      if (structure.axis != axis || !reading.offset_mm.good()) continue;
      const LocalMap local = result.sheet.map.Near(structure.middle);
      scale.push_back(Length(axis == Axis::kX ? local.u_px_mm : local.v_px_mm) *
                      (1 + reading.stretch));
    }
    Measured& answer = axis == Axis::kX ? result.px_per_mm.x : result.px_per_mm.y;
    if (scale.size() < 2) {
      answer = Measured::CannotTell("fewer than two structures along this axis could be read");
      continue;
    }
    const auto count = static_cast<double>(scale.size());
    answer = Measured::Good(
        Around(Mean(scale), StandardDeviation(scale) / std::sqrt(count), StudentT95(count - 1)));
  }
}

void AnswerPickUps(const SheetPlan& plan, const SheetModel& model, SheetResult& result) {
  const Turn turn(plan);
  for (const int tool : plan.settings.tools) {
    for (int pick_up = 1; pick_up <= plan.settings.pick_ups; ++pick_up) {
      const std::string unread =
          fmt::format("T{}: its structures of pick-up {} could not be read", tool, pick_up);
      Combination x;
      Combination y;
      x.pick_up[{tool, pick_up}] = turn.x();
      y.pick_up[{tool, pick_up}] = turn.y();
      result.pick_ups.push_back(
          {tool, pick_up, Answer(model.Estimate(x), unread), Answer(model.Estimate(y), unread)});
    }
  }
}

void ExpectStructures(const SheetPlan& plan, const SheetModel& model, SheetResult& result) {
  for (StructureReading& reading : result.structures) {
    const Structure& structure = plan.structures[reading.structure];
    const auto expected = model.Estimate(ReadingEquation(plan, reading));
    if (expected) reading.expected_mm = expected->value + Programmed_mm(structure);
  }
}

void AnswerSelfTest(const SheetPlan& plan, const SheetModel& model, SheetResult& result) {
  for (const StructureReading& reading : result.structures) {
    const Structure& structure = plan.structures[reading.structure];
    if (structure.purpose != Purpose::kSelfTest) continue;
    const std::string why_not =
        reading.offset_mm.good() ? "the method's bias is not known" : reading.offset_mm.reason();
    result.self_tests.push_back({reading.name, Programmed_mm(structure),
                                 Answer(model.WithoutBias(plan, reading), why_not)});
  }
}

/// Describes the parts of a photo's intervals besides scatter.
std::string PhotoNotice(const PhotoOnPage& photo) {
  return fmt::format(
      "a photo: the intervals allow for lines of one tool that lie {:.0f} um higher than another's "
      "and for a colour seen {:.2g} px further out in the corner (1 sigma), or more where the "
      "lines "
      "show it{}",
      1e3 * photo.spread.height_mm, photo.spread.colour_px,
      photo.pose.focal_stated ? ""
                              : "; the file states no focal length, which they allow for, too");
}

void Notify(const SheetPlan& plan, const SheetModel& model, SheetResult& result) {
  constexpr double kWorse =
      2;  // times the sheet's scatter; chance does not make it with 24 fingers
  constexpr double kMin_mm = 0.003;
  constexpr double kUnlike = 2;  // lines of different tools, against what is taken for granted
  result.finger_scatter_mm = model.pooled_scatter_mm();
  result.chi_square_per_freedom = model.freedom() > 0 ? model.chi_square() / model.freedom() : 1;
  if (result.photo) result.notices.push_back(PhotoNotice(*result.photo));
  if (result.photo && !result.photo->pose.as_stored) {
    result.notices.emplace_back(
        "the picture has a size that no camera stores: where it was cropped, the lens's axis is "
        "not in its middle. The intervals are wider for that: give the file as the phone stored "
        "it");
  }
  if (result.photo && model.line_spread() > kUnlike) {
    result.notices.push_back(fmt::format(
        "lines of the tools are seen in another scale, by {:.1f} times what is allowed for: their "
        "heights or colours differ much (a nozzle set too low or too high?). The intervals are "
        "wider by that; a second photo from the other side makes them narrow, or a scan",
        model.line_spread()));
  }
  if (model.bias_by_direction() && !plan.original) {
    result.notices.push_back(
        "the control structures drawn one way disagree with those drawn the other way beyond their "
        "scatter: a bias for each way is fitted, and the intervals are wider");
  }
  if (model.widened()) {
    result.notices.push_back(fmt::format(
        "the structures contradict each other by {:.1f} times what the scatter of their fingers "
        "explains: all intervals are wider by that much",
        std::sqrt(result.chi_square_per_freedom)));
  }
  for (const StructureReading& reading : result.structures) {
    const double scatter_mm = reading.residual_rms_mm;
    if (!reading.offset_mm.good() ||
        scatter_mm < std::max(kMin_mm, kWorse * result.finger_scatter_mm)) {
      continue;
    }
    result.notices.push_back(fmt::format(
        "the fingers of {} scatter by {:.1f} um, those of the whole sheet by {:.1f} um: look there "
        "for dirt, a loose sheet or a clogged nozzle",
        reading.name, 1e3 * scatter_mm, 1e3 * result.finger_scatter_mm));
  }
}

}  // namespace

void EstimateOffsets(const SheetPlan& plan, SheetResult& result) {
  EstimateOffsets(
      plan,
      SheetModel(plan, result.structures, result.photo ? result.photo->spread : RadialSpread{}),
      result);
}

void EstimateOffsets(const SheetPlan& plan, const SheetModel& model, SheetResult& result) {
  AnswerTools(plan, model, result);
  AnswerAxes(plan, model, result);
  AnswerScale(plan, result);
  AnswerPickUps(plan, model, result);
  AnswerSelfTest(plan, model, result);
  ExpectStructures(plan, model, result);
  Notify(plan, model, result);
}

}  // namespace trammel::tool_offset
