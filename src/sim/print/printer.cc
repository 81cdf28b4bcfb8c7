#include "sim/print/printer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

#include "base/measured.h"
#include "base/statistics.h"
#include "sim/print/bead.h"
#include "sim/print/corner_truth.h"
#include "sim/print/extruder.h"
#include "sim/print/gcode_interpreter.h"
#include "sim/print/laid_beads.h"
#include "sim/print/layered_beads.h"
#include "sim/print/planner.h"

namespace trammel::sim {

namespace {

constexpr double kSpacingMm = 0.04;
constexpr double kLongestPrintS = 3600;
constexpr double kLongestLineMm = 150e3;
constexpr double kColdNozzleC = 170;  // Klipper's min_extrude_temp
constexpr double kMinGapMm = 0.03;    // a nozzle pressed onto the plate still leaves a film
constexpr double kSlipReferenceMm3S = 15;

double FilamentArea(const PrinterTraits& traits) {
  return std::numbers::pi / 4 * traits.filament_diameter_mm * traits.filament_diameter_mm;
}

double CruiseFlow(const TimedMove& timed) {
  return timed.cruise_v_mm_s * timed.move.e_mm / timed.length_mm;
}

// True if one stroke continues straight into the next.
bool Straight(const Move& a, const Move& b) {
  const double ax = a.to.x_mm - a.from.x_mm;
  const double ay = a.to.y_mm - a.from.y_mm;
  const double bx = b.to.x_mm - b.from.x_mm;
  const double by = b.to.y_mm - b.from.y_mm;
  return ax * bx + ay * by > 0.9999 * std::hypot(ax, ay) * std::hypot(bx, by);
}

struct LineFlows {
  double slow_mm_s = 0;
  double fast_mm_s = 0;
  bool change = false;  ///< found from speed changes within straight strokes
};

LineFlows FindLineFlows(std::span<const TimedMove> plan, std::span<const Stroke> strokes) {
  constexpr double kMinChange = 0.05;
  std::vector<double> slow;
  std::vector<double> fast;
  std::map<double, double> length_by_flow;
  for (const Stroke& stroke : strokes) {
    for (std::size_t i = stroke.first; i <= stroke.last; ++i) {
      const double flow = CruiseFlow(plan[i]);
      length_by_flow[flow] += plan[i].length_mm;
      if (i == stroke.first || !Straight(plan[i - 1].move, plan[i].move)) {
        continue;
      }
      const double before = CruiseFlow(plan[i - 1]);
      if (std::abs(flow - before) > kMinChange * std::max(flow, before)) {
        slow.push_back(std::min(flow, before));
        fast.push_back(std::max(flow, before));
      }
    }
  }
  if (!slow.empty()) {
    return {Median(slow), Median(fast), true};
  }
  const auto most =
      std::max_element(length_by_flow.begin(), length_by_flow.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  return {0, most->first, false};
}

// Draws the random traits of each stroke.
std::vector<StrokeFlow> DrawFlows(std::span<const Stroke> strokes, const StorageModel& law,
                                  const PrinterTraits& traits, Random& random) {
  constexpr double kMinFactor = 0.2;
  std::vector<StrokeFlow> flows;
  for (std::size_t k = 0; k < strokes.size(); ++k) {
    StrokeFlow flow;
    flow.law = law;
    flow.law.scale_s *=
        std::max(kMinFactor, 1 + random.Normal(0, traits.lag_scatter_s) / traits.k_star_s);
    flow.factor =
        std::max(kMinFactor, traits.flow_factor * (1 + random.Normal(0, traits.flow_scatter)));
    flow.start_loss_mm = traits.start_loss_mm + random.Normal(0, traits.start_loss_scatter_mm);
    flows.push_back(flow);
  }
  return flows;
}

// Positions of the nozzle along a stroke, for rising distances.
class StrokePath {
 public:
  StrokePath(std::span<const TimedMove> plan, const Stroke& stroke)
      : plan_(plan), move_(stroke.first), last_(stroke.last) {}

  Position At(double distance_mm) {
    while (move_ < last_ && distance_mm > passed_mm_ + plan_[move_].length_mm) {
      passed_mm_ += plan_[move_].length_mm;
      ++move_;
    }
    const TimedMove& timed = plan_[move_];
    const double share = std::clamp((distance_mm - passed_mm_) / timed.length_mm, 0.0, 1.0);
    const Position& a = timed.move.from;
    const Position& b = timed.move.to;
    return {std::lerp(a.x_mm, b.x_mm, share), std::lerp(a.y_mm, b.y_mm, share),
            std::lerp(a.z_mm, b.z_mm, share)};
  }

 private:
  std::span<const TimedMove> plan_;
  std::size_t move_;
  std::size_t last_;
  double passed_mm_ = 0;
};

double GapAt(const Position& nozzle, const PrinterTraits& traits) {
  const double plate_mm = traits.plate_tilt_x * (nozzle.x_mm - 0.5 * traits.bed_size_x_mm) +
                          traits.plate_tilt_y * (nozzle.y_mm - 0.5 * traits.bed_size_y_mm);
  return std::max(kMinGapMm, nozzle.z_mm + traits.gap_error_mm - plate_mm);
}

// Follows the nozzle over the plate.
StrandPath PathOverPlate(std::span<const TimedMove> plan, const Stroke& stroke,
                         const StrokeDeposit& deposit, const PrinterTraits& traits) {
  const std::size_t count = deposit.filament_mm.size();
  StrokePath walker(plan, stroke);
  StrandPath path;
  path.base_mm.assign(count, 0);
  for (std::size_t i = 0; i < count; ++i) {
    path.nozzle.push_back(walker.At(static_cast<double>(i) * deposit.spacing_mm));
    path.gap_mm.push_back(GapAt(path.nozzle[i], traits));
  }
  return path;
}

// Returns the area of the bead at each node of the path.
std::vector<double> AreasOf(const StrokeDeposit& deposit, const StrandPath& path,
                            const PrinterTraits& traits, const BeadOptions& options, bool layered,
                            Random& random) {
  const std::size_t count = deposit.filament_mm.size();
  const double spacing_mm = deposit.spacing_mm;
  std::vector<double> full(count);
  std::vector<double> area(count);
  for (std::size_t i = 0; i < count; ++i) {
    full[i] = FullArea(path.gap_mm[i], options);
    const double length_mm = (i == 0 || i + 1 == count ? 0.5 : 1.0) * spacing_mm;
    area[i] = deposit.filament_mm[i] * FilamentArea(traits) / length_mm;
  }
  AddFlowNoise(area, spacing_mm, traits.flow_noise, traits.flow_noise_length_mm, random);
  AddBlobs(area, spacing_mm, traits.blobs_per_m, random);
  Smear(area, spacing_mm, traits.smear_mm);
  if (layered) CarryOn(area, full, spacing_mm);
  SpreadSurplus(area, full, spacing_mm);
  CutGaps(area, spacing_mm, traits.gaps_per_m, random);
  BreakUp(area, spacing_mm, traits.break_area_mm2, random);
  return area;
}

Strand StrandOf(const StrandPath& path, std::span<const double> area, const BeadOptions& options) {
  Strand strand;
  strand.samples.reserve(area.size());
  for (std::size_t i = 0; i < area.size(); ++i) {
    const BeadShape shape = ShapeOf(area[i], path.gap_mm[i], options);
    strand.samples.push_back({path.nozzle[i].x_mm, path.nozzle[i].y_mm, area[i], shape.width_mm,
                              shape.height_mm, path.base_mm[i]});
  }
  return strand;
}

// Widens the first layer at the same area.
void AddFoot(Strand& strand, double foot_mm) {
  for (BeadSample& sample : strand.samples) {
    if (sample.base_mm > 0 || sample.width_mm <= 0) continue;
    sample.height_mm *= sample.width_mm / (sample.width_mm + foot_mm);
    sample.width_mm += foot_mm;
  }
}

// Lays strands, in the order of printing.
class StrandLayer {
 public:
  StrandLayer(std::span<const TimedMove> plan, std::span<const Stroke> strokes,
              const PrinterTraits& traits)
      : plan_(plan),
        traits_(traits),
        options_{traits.nozzle_diameter_mm, traits.smear_mm, traits.break_area_mm2} {
    if (!HasLayers(strokes)) return;
    constexpr double kMostRise = 0.15;  // the nozzle passes again: beside it and one layer higher
    options_.most_rise = kMostRise;
    laid_.emplace(Region(strokes));
  }

  /// Appends the strand, and in prints of several layers what fills its corners.
  void Lay(const Stroke& stroke, const StrokeDeposit& deposit, Random& random,
           std::vector<Strand>& strands) {
    StrandPath path = PathOverPlate(plan_, stroke, deposit, traits_);
    if (!laid_) {
      strands.push_back(
          StrandOf(path, AreasOf(deposit, path, traits_, options_, false, random), options_));
      return;
    }
    const std::vector<PathCorner> corners = FindCorners(plan_, stroke, deposit.spacing_mm);
    RoundPath(path.nozzle, deposit.spacing_mm, traits_.corner_round_mm);
    RestOn(*laid_, path);
    std::vector<double> area = AreasOf(deposit, path, traits_, options_, true, random);
    std::vector<Strand> fillets = FillCorners(corners, path, traits_.fillet_mm, *laid_, area);
    PushedStrand pushed = PushAside(*laid_, path, area, deposit.spacing_mm, options_);
    laid_->Add(pushed.pieces);
    AddFoot(pushed.strand, traits_.foot_mm);
    std::move(fillets.begin(), fillets.end(), std::back_inserter(strands));
    strands.push_back(std::move(pushed.strand));
  }

  [[nodiscard]] bool has_layers() const { return laid_.has_value(); }

 private:
  // True if the nozzle prints at several heights.
  [[nodiscard]] bool HasLayers(std::span<const Stroke> strokes) const {
    const auto height = [&](const Stroke& stroke) { return plan_[stroke.first].move.to.z_mm; };
    double least = height(strokes.front());
    double most = least;
    for (const Stroke& stroke : strokes) {
      least = std::min(least, height(stroke));
      most = std::max(most, height(stroke));
    }
    return most > least + LaidBeads::kSameLayerMm;
  }

  [[nodiscard]] BedRegion Region(std::span<const Stroke> strokes) const {
    const Position& first = plan_[strokes.front().first].move.from;
    BedRegion region{first.x_mm, first.y_mm, first.x_mm, first.y_mm};
    for (const Stroke& stroke : strokes) {
      for (std::size_t i = stroke.first; i <= stroke.last; ++i) {
        for (const Position& at : {plan_[i].move.from, plan_[i].move.to}) {
          region = {std::min(region.min_x_mm, at.x_mm), std::min(region.min_y_mm, at.y_mm),
                    std::max(region.max_x_mm, at.x_mm), std::max(region.max_y_mm, at.y_mm)};
        }
      }
    }
    constexpr double kAroundMm = 2;
    return {region.min_x_mm - kAroundMm, region.min_y_mm - kAroundMm, region.max_x_mm + kAroundMm,
            region.max_y_mm + kAroundMm};
  }

  std::span<const TimedMove> plan_;
  const PrinterTraits& traits_;
  BeadOptions options_;
  std::optional<LaidBeads> laid_;  // in prints of several layers
};

// Adds strings that wander off from the last strand, before it.
void AddStrings(const StrokeDeposit& deposit, const PrinterTraits& traits, Random& random,
                std::vector<Strand>& strands) {
  const double length_mm = deposit.spacing_mm * static_cast<double>(deposit.filament_mm.size() - 1);
  const int count = DrawCount(traits.strings_per_m, length_mm, random);
  for (int i = 0; i < count; ++i) {
    const std::vector<BeadSample>& samples = strands.back().samples;
    const BeadSample from = samples[random.Below(samples.size())];
    Strand string = DrawString(from.x_mm, from.y_mm, kSpacingMm, random);
    for (BeadSample& sample : string.samples) sample.base_mm = from.base_mm;
    strands.insert(strands.end() - 1, std::move(string));
  }
}

std::vector<std::string> NotesOf(const Program& program, const LineFlows& flows, const Bed& bed) {
  std::vector<std::string> notes;
  for (const auto& [name, count] : program.ignored) {
    notes.push_back(fmt::format("ignored {} unknown command(s) {}", count, name));
  }
  if (program.hottest_nozzle_c < kColdNozzleC) {
    notes.push_back(
        fmt::format("no command heats the nozzle to {} °C or more; a real printer "
                    "refuses to extrude",
                    kColdNozzleC));
  }
  if (!flows.change) {
    notes.push_back(
        "no straight stroke changes its speed; the truth holds between standstill and the most "
        "used flow");
  }
  std::size_t off = 0;
  for (const Strand& strand : bed.strands) {
    off += std::any_of(strand.samples.begin(), strand.samples.end(), [&](const BeadSample& s) {
      return s.x_mm < 0 || s.y_mm < 0 || s.x_mm > bed.size_x_mm || s.y_mm > bed.size_y_mm;
    });
  }
  if (off > 0) {
    notes.push_back(
        fmt::format("{} strand(s) leave the bed of {} x {} mm", off, bed.size_x_mm, bed.size_y_mm));
  }
  return notes;
}

Result<void> CheckExtent(std::span<const TimedMove> plan, std::span<const Stroke> strokes) {
  if (strokes.empty()) {
    return Fail(
        "the G-code prints nothing: no move in x or y pushes filament; check that the "
        "file is a whole pattern and that its E values rise (or that M83 stands in it)");
  }
  if (plan.back().end_s() > kLongestPrintS) {
    return Fail(
        fmt::format("the G-code would print for {:.0f} s; the virtual printer takes at "
                    "most {:.0f} s: print fewer lines or faster ones",
                    plan.back().end_s(), kLongestPrintS));
  }
  double length_mm = 0;
  for (const Stroke& stroke : strokes) length_mm += stroke.length_mm;
  if (length_mm > kLongestLineMm) {
    return Fail(
        fmt::format("the G-code prints {:.0f} mm of line; the virtual printer takes at "
                    "most {:.0f} mm: print fewer lines",
                    length_mm, kLongestLineMm));
  }
  return {};
}

ExtruderOptions DrawExtruder(const PrinterTraits& traits, Random& random) {
  ExtruderOptions options;
  options.starvation = traits.starvation;
  options.slip = traits.slip;
  options.slip_reference_mm_s = kSlipReferenceMm3S / FilamentArea(traits);
  options.drift = traits.flow_drift;
  options.drift_phase_rad = random.Uniform(0, 2 * std::numbers::pi);
  options.drift_period_s = random.Uniform(20, 120);
  return options;
}

}  // namespace

Result<Print> PrintGcode(std::string_view gcode, const PrinterTraits& traits, Random& random) {
  const Program program =
      TRY(InterpretGcode(gcode, {traits.max_velocity_mm_s, traits.max_acceleration_mm_s2,
                                 traits.square_corner_velocity_mm_s, traits.minimum_cruise_ratio,
                                 traits.smooth_time_s}));
  const std::vector<TimedMove> plan = PlanMotion(program.moves);
  const std::vector<Stroke> strokes = FindStrokes(plan);
  TRY(CheckExtent(plan, strokes));
  const LineFlows lines = FindLineFlows(plan, strokes);
  const StorageModel law = ScaledTo(traits.law, traits.k_star_s, lines.slow_mm_s, lines.fast_mm_s);
  const std::vector<StrokeFlow> flows = DrawFlows(strokes, law, traits, random);
  StrandLayer layer(plan, strokes, traits);
  ExtruderOptions extruder = DrawExtruder(traits, random);
  // Labels of short strokes would lose most of them. Lines of one layer are long, and remain as
  // they were when the published studies printed them.
  extruder.slips_standing = !layer.has_layers();
  const Extrusion extrusion =
      Extrude(plan, strokes, DrivenFilament(plan), flows, extruder, kSpacingMm);
  Print print;
  print.bed.size_x_mm = traits.bed_size_x_mm;
  print.bed.size_y_mm = traits.bed_size_y_mm;
  for (std::size_t k = 0; k < strokes.size(); ++k) {
    layer.Lay(strokes[k], extrusion.strokes[k], random, print.bed.strands);
    AddStrings(extrusion.strokes[k], traits, random, print.bed.strands);
  }
  print.truth.pressure_advance_s = IdealPressureAdvance(law, lines.slow_mm_s, lines.fast_mm_s);
  print.truth.tangent_s = 1 / FlowFromStored(law, Stored(law, lines.fast_mm_s)).slope_per_s;
  if (layer.has_layers()) print.truth.corners = CornerTruths(plan, strokes, law);
  if (!print.truth.corners.empty()) print.truth.corner_s = print.truth.corners.back().corner_s;
  print.truth.flow_factor = traits.flow_factor;
  print.notes = NotesOf(program, lines, print.bed);
  return print;
}

namespace {

// Random streams of a world; new parts get new numbers, so that old worlds are unchanged.
enum Stream : std::uint64_t { kTruth = 1, kTraits, kPrint, kPhotoReader, kLaserReader = 100 };

constexpr Interval kTruthS{0.015, 0.045};  // the middle half of what a pattern tests by default
constexpr Interval kFlowFactors{0.2, 2};   // of PrinterTraits

}  // namespace

double TruthOf(std::uint64_t seed) {
  return Random(seed).Fork(kTruth).Uniform(kTruthS.lo, kTruthS.hi);
}

Result<Print> PrintInWorld(std::string_view gcode, std::uint64_t seed,
                           std::optional<double> k_star_s, std::optional<double> exponent,
                           double flow_factor) {
  const Random world(seed);
  if (!k_star_s) k_star_s = TruthOf(seed);
  if (!(*k_star_s >= 0.0001 && *k_star_s <= 10)) {
    return Fail(fmt::format(
        "a virtual printer's true pressure advance of {} s is outside 0.0001 ... 10", *k_star_s));
  }
  if (!(flow_factor >= kFlowFactors.lo && flow_factor <= kFlowFactors.hi)) {
    return Fail(fmt::format("a virtual printer's flow factor of {} is outside {} ... {}",
                            flow_factor, kFlowFactors.lo, kFlowFactors.hi));
  }
  Random traits_random = world.Fork(kTraits);
  Random print_random = world.Fork(kPrint);
  PrinterTraits traits = DrawTraits(*k_star_s, traits_random);
  if (exponent) {
    if (!(*exponent >= 0.2 && *exponent <= 1)) {
      return Fail(
          fmt::format("an exponent of {} of the storage law is outside 0.2 ... 1", *exponent));
    }
    traits.law.kind = StorageKind::kPower;
    traits.law.exponent = *exponent;
  }
  traits.flow_factor = flow_factor;
  return PrintGcode(gcode, traits, print_random);
}

Random LaserRandom(std::uint64_t seed, const Condition& condition) {
  const auto index = static_cast<std::uint64_t>(condition.plate) * 4 +
                     static_cast<std::uint64_t>(condition.filament) * 2 +
                     (condition.ambient ? 1U : 0U);
  return Random(seed).Fork(kLaserReader + index);
}

Random PhotoRandom(std::uint64_t seed) { return Random(seed).Fork(kPhotoReader); }

}  // namespace trammel::sim
