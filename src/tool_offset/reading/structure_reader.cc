#include "tool_offset/reading/structure_reader.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "base/statistics.h"
#include "geometry/decompositions.h"
#include "geometry/linear_systems.h"
#include "geometry/robust_line.h"

namespace trammel::tool_offset {
namespace {

/// Comb with its located position.
struct CombSites {
  std::vector<FingerSite> sites;  ///< planned, plus the expected shift
  std::vector<double> shift_mm;   ///< per finger, from its site to the comb's line
  std::vector<bool> seen;
};

/// Sets the usable part of a comb's legs, from the structure's middle along the legs, and the part
/// of it beyond the other comb's reach.
void SetRows(const SheetPlan& plan, bool from_low, double own_shift_mm, double other_shift_mm,
             FingerSite& site) {
  const double inner_mm = plan.settings.overlap_mm / 2;
  const double outer_mm = plan.settings.leg_length_mm - inner_mm;
  const double side = from_low ? 1 : -1;
  // Uses a coordinate that rises towards the other comb.
  const double start_mm = -outer_mm + side * own_shift_mm + plan.leg_end_mm;
  const double end_mm = inner_mm + side * own_shift_mm - plan.leg_end_mm;
  const double other_mm = -inner_mm + side * other_shift_mm - kLegEnd_mm - plan.turn_mm;
  const double clear_mm = std::clamp(other_mm, start_mm + 0.2, end_mm);
  site.low_mm = from_low ? start_mm : -end_mm;
  site.high_mm = from_low ? end_mm : -start_mm;
  site.clear_low_mm = from_low ? start_mm : -clear_mm;
  site.clear_high_mm = from_low ? clear_mm : -start_mm;
}

double ExpectedShift_mm(const Structure& structure, std::size_t comb,
                        const CombExpectation& expected) {
  return Along(structure.axis, expected.shift) +
         Along(structure.axis, structure.combs[comb].programmed);
}

CombSites PlanSites(const SheetPlan& plan, const Structure& structure, std::size_t comb,
                    const std::array<CombExpectation, 2>& expected) {
  CombSites planned;
  const Axis axis = structure.axis;
  const auto across_shift_mm = [&](std::size_t i) {
    return Across(axis, expected[i].shift) + Across(axis, structure.combs[i].programmed);
  };
  for (int finger = 0; finger < plan.settings.teeth; ++finger) {
    FingerSite site;
    site.axis = axis;
    const double along_mm = FingerPosition_mm(plan, structure, comb, finger) +
                            ExpectedShift_mm(structure, comb, expected[comb]);
    const double across_mm = Across(axis, structure.middle);
    site.middle = PointAt(axis, along_mm, across_mm);
    SetRows(plan, structure.FromLowSide(comb), across_shift_mm(comb), across_shift_mm(1 - comb),
            site);
    planned.sites.push_back(site);
  }
  return planned;
}

/// Finds the comb's fingers one by one, and fits a line to their shifts.
bool LocateComb(const PageView& page, const PageMap& map, const SheetPlan& plan,
                const ChannelMix& mix, CombSites& comb, ReaderWorkspace& workspace) {
  constexpr double kReach_mm = 0.45;
  constexpr double kOffLine_mm = 0.15;
  std::vector<double> number;
  std::vector<double> shift_mm;
  for (std::size_t i = 0; i < comb.sites.size(); ++i) {
    const auto found =
        LocateFinger(page, mix, map, plan.settings, comb.sites[i], kReach_mm, workspace);
    comb.seen.push_back(found.has_value());
    if (!found) continue;
    number.push_back(static_cast<double>(i));
    shift_mm.push_back(*found);
  }
  if (2 * number.size() <= comb.sites.size() || number.size() < 3) return false;
  const geometry::RobustLine line = geometry::FitRobustLine(number, shift_mm, workspace.scratch);
  std::size_t on_line = 0;
  std::size_t next = 0;
  for (std::size_t i = 0; i < comb.sites.size(); ++i) {
    const double at_mm = line.at(static_cast<double>(i));
    const double found_mm = comb.seen[i] ? shift_mm[next++] : at_mm;
    const bool near = std::abs(found_mm - at_mm) < kOffLine_mm;
    comb.shift_mm.push_back(near ? found_mm : at_mm);
    if (comb.seen[i] && near) ++on_line;
  }
  return 2 * on_line > comb.sites.size();
}

/// Returns the usable distance outwards from a leg's middle if the next finger's middle is
/// `apart_mm` from its own: half-way to the next ink.
double Free_mm(const SheetSettings& settings, double apart_mm) {
  const double gap_mm = apart_mm - settings.leg_spacing_mm - settings.line_width_mm;
  const double half_line_mm = settings.line_width_mm / 2;
  return std::clamp(half_line_mm + gap_mm / 2, 1.1 * half_line_mm, settings.leg_spacing_mm / 2);
}

/// @param ahead_mm  the other comb's shift minus this one's.
void SetNeighbours(const SheetSettings& settings, std::size_t comb, int finger, double ahead_mm,
                   FingerSite& site) {
  const double half_mm = settings.leg_spacing_mm / 2;
  const bool first = comb == 0 && finger == 0;
  const bool last = comb == 1 && finger == settings.teeth - 1;
  site.free_low_mm = first ? half_mm : Free_mm(settings, settings.pitch_mm / 2 - ahead_mm);
  site.free_high_mm = last ? half_mm : Free_mm(settings, settings.pitch_mm / 2 + ahead_mm);
}

/// Explains why a finger cannot count; empty if it can.
std::string Fault(const SheetSettings& settings, const FingerReading& finger, double comb_ink_mm) {
  constexpr double kThin = 0.6;  // of the comb's ink per leg
  constexpr double kThick = 1.5;
  constexpr double kApart_mm = 0.15;
  for (const LegReading& leg : finger.legs) {
    if (leg.rows_used == 0) return "no ink found";
    if (leg.ink_mm < kThin * comb_ink_mm) return "too little ink";
    if (leg.ink_mm > kThick * comb_ink_mm) return "too much ink: merged or blotted";
    if (2 * leg.rows_used < leg.rows) return "broken: less than half of a leg can be read";
  }
  const double apart_mm = finger.legs[1].position_mm - finger.legs[0].position_mm;
  if (std::abs(apart_mm - settings.leg_spacing_mm) > kApart_mm) {
    return fmt::format("its legs are {:.2f} mm apart", apart_mm);
  }
  return {};
}

/// Reads the comb's fingers at their located positions.
std::vector<FingerReading> ReadComb(const PageView& page, const PageMap& map, const SheetPlan& plan,
                                    const Structure& structure, std::size_t comb,
                                    const CombExpectation& expected, const CombSites& located,
                                    double ahead_mm, ReaderWorkspace& workspace) {
  std::vector<FingerReading> fingers;
  std::vector<double> ink_mm;
  for (std::size_t i = 0; i < located.sites.size(); ++i) {
    FingerSite site = located.sites[i];
    SetNeighbours(plan.settings, comb, static_cast<int>(i), ahead_mm, site);
    site.middle = site.middle + PointAt(site.axis, located.shift_mm[i], 0);
    FingerReading finger;
    finger.comb = comb;
    finger.finger = static_cast<int>(i);
    finger.planned_mm = FingerPosition_mm(plan, structure, comb, finger.finger) -
                        Along(site.axis, structure.middle);
    const auto legs = ReadLegs(page, expected.mix, map, plan.settings, site, workspace);
    if (!legs) {
      finger.left_out = "beside the page";
    } else {
      finger.legs = *legs;
      const double middle_mm = ((*legs)[0].position_mm + (*legs)[1].position_mm) / 2;
      finger.position_mm =
          ExpectedShift_mm(structure, comb, expected) + located.shift_mm[i] + middle_mm;
      const LocalMap local = map.Near(site.middle);
      finger.place = local.ToPage(PointAt(site.axis, middle_mm, 0));
      for (const LegReading& leg : *legs) ink_mm.push_back(leg.ink_mm);
    }
    fingers.push_back(finger);
  }
  const double comb_ink_mm = ink_mm.empty() ? 0 : Median(ink_mm);
  for (FingerReading& finger : fingers) {
    if (finger.left_out.empty()) finger.left_out = Fault(plan.settings, finger, comb_ink_mm);
    if (finger.finger == structure.incomplete[comb]) {
      finger.left_out = "its first leg is not drawn, as planned";
    }
  }
  return fingers;
}

/// Returns the median of a comb's legs.
double LegWidth_mm(const std::vector<FingerReading>& fingers, std::size_t comb) {
  std::vector<double> ink_mm;
  for (const FingerReading& finger : fingers) {
    if (finger.comb != comb || !finger.left_out.empty()) continue;
    for (const LegReading& leg : finger.legs) ink_mm.push_back(leg.ink_mm);
  }
  return ink_mm.empty() ? 0 : Median(ink_mm);
}

/// Skips fingers near lines of a tool far off.
void LeaveOutForeign(const SheetSettings& settings, std::span<const ForeignLeg> foreign,
                     const Structure& structure, std::vector<FingerReading>& fingers,
                     const std::array<CombExpectation, 2>& expected) {
  /// Distance from a leg's edge to the paper to read.
  constexpr double kClear_mm = 0.5;
  for (FingerReading& finger : fingers) {
    const double at_mm = Along(structure.axis, structure.middle) + finger.planned_mm +
                         ExpectedShift_mm(structure, finger.comb, expected[finger.comb]);
    const double side = structure.FromLowSide(finger.comb) ? -1 : 1;
    const double across_mm = Across(structure.axis, structure.middle) +
                             Across(structure.axis, expected[finger.comb].shift) +
                             side * (settings.leg_length_mm - settings.overlap_mm) / 2;
    const double half_mm = settings.leg_spacing_mm / 2 + settings.line_width_mm;
    const double half_leg_mm = settings.leg_length_mm / 2;
    const int tool =
        ForeignTool(foreign, PointAt(structure.axis, at_mm - half_mm, across_mm - half_leg_mm),
                    PointAt(structure.axis, at_mm + half_mm, across_mm + half_leg_mm), kClear_mm);
    if (tool >= 0) finger.left_out = fmt::format("T{}, far off, has printed across it", tool);
  }
}

}  // namespace

double FineReach_mm(const SheetSettings& settings) {
  constexpr double kMargin_mm = 0.1;
  return std::max(
      0.0, settings.pitch_mm / 2 - settings.leg_spacing_mm - settings.line_width_mm - kMargin_mm);
}

Result<std::vector<FingerReading>> ReadStructure(const PageView& page, const PageMap& map,
                                                 const SheetPlan& plan, const Structure& structure,
                                                 const std::array<CombExpectation, 2>& expected,
                                                 std::span<const ForeignLeg> foreign) {
  ReaderWorkspace workspace;
  std::array<CombSites, 2> combs;
  std::array<double, 2> shift_mm{};
  for (const std::size_t comb : {std::size_t{0}, std::size_t{1}}) {
    combs[comb] = PlanSites(plan, structure, comb, expected);
    if (!LocateComb(page, map, plan, expected[comb].mix, combs[comb], workspace)) {
      return Fail(fmt::format("{} of {}: less than half of its fingers were found", structure.name,
                              expected[comb].tool),
                  ErrorKind::kMeasurement);
    }
    shift_mm[comb] =
        ExpectedShift_mm(structure, comb, expected[comb]) + Median(combs[comb].shift_mm);
  }
  // Legs that nearly touch lose the white between them, and so their positions.
  constexpr double kWidest = 1;  // relative to their distance
  const double ahead_mm = shift_mm[1] - shift_mm[0];
  std::vector<FingerReading> fingers =
      ReadComb(page, map, plan, structure, 0, expected[0], combs[0], ahead_mm, workspace);
  const std::vector<FingerReading> second =
      ReadComb(page, map, plan, structure, 1, expected[1], combs[1], -ahead_mm, workspace);
  fingers.insert(fingers.end(), second.begin(), second.end());
  for (const std::size_t comb : {std::size_t{0}, std::size_t{1}}) {
    const double width_mm = LegWidth_mm(fingers, comb);
    if (width_mm < kWidest * plan.settings.leg_spacing_mm) continue;
    return Fail(
        fmt::format("the lines of {} are {:.2f} mm wide, {} mm were planned: the two legs of "
                    "its fingers run together; lower its flow or raise the nozzle",
                    expected[comb].tool, width_mm, plan.settings.line_width_mm),
        ErrorKind::kMeasurement);
  }
  LeaveOutForeign(plan.settings, foreign, structure, fingers, expected);
  return fingers;
}

namespace {

constexpr int kFewestTeeth = 4;

/// Computes Legendre polynomials 0 … degree at x in [-1, 1].
Eigen::RowVectorXd Legendre(double x, int degree) {
  Eigen::RowVectorXd p(degree + 1);
  p[0] = 1;
  if (degree > 0) p[1] = x;
  for (int n = 1; n < degree; ++n) p[n + 1] = ((2 * n + 1) * x * p[n] - n * p[n - 1]) / (n + 1);
  return p;
}

/// Returns a degree high enough for the shortest wrinkle over the comb's length, and low enough for
/// the fingers.
int Degree(const SheetSettings& settings, int fingers) {
  constexpr double kShortestWrinkle_mm = 40;
  constexpr int kBeyond = 5;  // orders until a wrinkle's share falls below a hundredth
  const double periods = settings.teeth * settings.pitch_mm / kShortestWrinkle_mm;
  const int wanted = static_cast<int>(std::ceil(std::numbers::pi * periods)) + kBeyond;
  return std::clamp(std::min(wanted, fingers / 3), 1, 40);
}

/// Fit to the used fingers.
struct Fit {
  std::vector<FingerReading*> used;
  Eigen::VectorXd residual;
  Eigen::VectorXd leverage;
  Eigen::VectorXd influence;  ///< per finger, on the offset
  double offset_mm = 0;
  double stretch = 0;
  double growth = 0;  ///< increase of the displacement per mm, if permitted
  Eigen::VectorXd growth_influence;
};

Fit FitOnce(const SheetSettings& settings, StructureReading& structure) {
  Fit fit;
  for (FingerReading& finger : structure.fingers) {
    if (finger.left_out.empty()) fit.used.push_back(&finger);
  }
  const auto count = static_cast<Eigen::Index>(fit.used.size());
  const int degree = Degree(settings, static_cast<int>(count));
  const double half_mm = settings.teeth * settings.pitch_mm / 2;
  const bool grows = structure.lever.has_value();
  const Eigen::Index last = degree + (grows ? 2 : 1);
  Eigen::MatrixXd design(count, last + 1);
  Eigen::VectorXd y(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const FingerReading& finger = *fit.used[static_cast<std::size_t>(i)];
    design.row(i).head(degree + 1) = Legendre(finger.planned_mm / half_mm, degree);
    design(i, last) = finger.comb == 1 ? 0.5 : -0.5;
    if (grows) design(i, last - 1) = design(i, last) * finger.planned_mm / half_mm;
    y[i] = finger.position_mm;
  }
  const auto [q, r] = geometry::DecomposeOrthogonal(design);
  const Eigen::VectorXd solution = geometry::SolveUpper(r, q.transpose() * y);
  fit.residual = y - design * solution;
  fit.leverage = q.rowwise().squaredNorm();
  // The offset is the last unknown: its row of the inverse of R is 1 / r in the last place.
  fit.influence = q.col(last) / r(last, last);
  fit.offset_mm = solution[last];
  if (grows) {
    fit.growth = solution[last - 1] / half_mm;
    fit.growth_influence =
        (q.col(last - 1) - r(last - 1, last) * fit.influence) / (r(last - 1, last - 1) * half_mm);
  }
  // Slope of a straight line through the residual of the displacement.
  const Eigen::VectorXd shared = y - fit.offset_mm * design.col(last);
  fit.stretch = shared.dot(q.col(1)) / r(1, 1) / half_mm;
  return fit;
}

/// Returns the finger farthest from the others, if it is an outlier.
FingerReading* Outlier(const Fit& fit) {
  constexpr double kLimit = 4.5;        // standard deviations: 1 in 100 000 of a normal sample
  constexpr double kFinest_mm = 0.001;  // less is not worth a finger
  std::vector<double> scaled;
  for (Eigen::Index i = 0; i < fit.residual.size(); ++i) {
    scaled.push_back(fit.residual[i] / std::sqrt(std::max(0.05, 1 - fit.leverage[i])));
  }
  const double limit_mm = kLimit * std::max(RobustStandardDeviation(scaled), kFinest_mm / kLimit);
  const auto worst = std::max_element(scaled.begin(), scaled.end(),
                                      [](double a, double b) { return std::abs(a) < std::abs(b); });
  return std::abs(*worst) > limit_mm ? fit.used[static_cast<std::size_t>(worst - scaled.begin())]
                                     : nullptr;
}

std::array<int, 2> CountTeeth(const StructureReading& structure) {
  std::array<int, 2> count{};
  for (const FingerReading& finger : structure.fingers) {
    if (finger.left_out.empty()) ++count[finger.comb];
  }
  return count;
}

/// Returns the commonest fault of the excluded teeth.
std::string CommonFault(const StructureReading& structure) {
  std::map<std::string, int> faults;
  for (const FingerReading& finger : structure.fingers) {
    if (!finger.left_out.empty()) ++faults[finger.left_out];
  }
  const auto commonest =
      std::max_element(faults.begin(), faults.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  return commonest == faults.end() ? "none has a fault" : commonest->first;
}

void Report(const Fit& fit, StructureReading& structure) {
  structure.comb_squares_mm2 = {};
  structure.comb_freedom = {};
  std::array<double, 2> influence{};
  std::array<double, 2> growth{};
  for (Eigen::Index i = 0; i < fit.residual.size(); ++i) {
    FingerReading& finger = *fit.used[static_cast<std::size_t>(i)];
    finger.residual_mm = fit.residual[i];
    structure.comb_squares_mm2[finger.comb] += fit.residual[i] * fit.residual[i];
    structure.comb_freedom[finger.comb] += 1 - fit.leverage[i];
    influence[finger.comb] += fit.influence[i] * fit.influence[i];
    if (structure.lever) {
      growth[finger.comb] += fit.growth_influence[i] * fit.growth_influence[i];
    }
  }
  const double freedom = structure.comb_freedom[0] + structure.comb_freedom[1];
  const double squares = structure.comb_squares_mm2[0] + structure.comb_squares_mm2[1];
  structure.gain = {std::sqrt(influence[0]), std::sqrt(influence[1])};
  structure.growth = fit.growth;
  structure.growth_gain = {std::sqrt(growth[0]), std::sqrt(growth[1])};
  structure.stretch = fit.stretch;
  structure.residual_rms_mm = std::sqrt(squares / freedom);
  const double uncertainty =
      structure.residual_rms_mm * std::hypot(structure.gain[0], structure.gain[1]);
  structure.offset_mm =
      Measured::Good(Around(fit.offset_mm / (1 + fit.stretch), uncertainty, StudentT95(freedom)));
}

}  // namespace

void FitCombs(const SheetSettings& settings, StructureReading& structure) {
  constexpr double kMaxOutliers = 0.3;
  const auto most = static_cast<int>(kMaxOutliers * static_cast<double>(structure.fingers.size()));
  for (int outliers = 0;; ++outliers) {
    structure.teeth_used = CountTeeth(structure);
    const auto [first, second] = structure.teeth_used;
    if (first < kFewestTeeth || second < kFewestTeeth) {
      structure.offset_mm = Measured::Refused(
          fmt::format("only {} and {} of {} teeth of the two combs can be read, {} are needed ({})",
                      first, second, settings.teeth, kFewestTeeth, CommonFault(structure)));
      return;
    }
    const Fit fit = FitOnce(settings, structure);
    FingerReading* outlier = outliers < most ? Outlier(fit) : nullptr;
    if (outlier == nullptr) return Report(fit, structure);
    outlier->left_out = "far from where its neighbours say it should be";
  }
}

}  // namespace trammel::tool_offset
