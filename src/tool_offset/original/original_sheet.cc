#include "tool_offset/original/original_sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <span>

namespace trammel::tool_offset {
namespace {

// Published lengths along the print's axes.
constexpr double kAcross_mm = 8;  // width of a structure: both spines
constexpr double kGap_mm = 3;     // between structures
constexpr double kStep_mm = kAcross_mm + kGap_mm;
constexpr double kPlaced_mm = 70;    // the length of a structure as places are computed
constexpr double kDrawn_mm = 68;     // and of whole periods, as the box is
constexpr double kBoxGap_mm = 5;     // around everything
constexpr double kBoxLine_mm = 0.4;  // line spacing
constexpr double kPitch_mm = 4;
constexpr int kTeeth = 17;
constexpr double kSpacing_mm = 0.75;
constexpr double kOverlap_mm = 4;
constexpr double kReferenceStart_mm = 2;  // reference comb's first leg along the structure
constexpr double kLineWidth_mm = 0.44;    // 0.4 mm nozzle, 1.1 times the filament

/// Length beside a turn in which a leg is displaced until the slower axis has taken up its
/// backlash: 0.23 mm for 60 µm at 15 degrees.
constexpr double kBesideTurn_mm = 0.5;

/// @param count  how many structures before this one would have the same name.
std::string Name(int tool, Purpose purpose, Axis axis, bool plus, int count) {
  const std::string of = purpose == Purpose::kTool      ? fmt::format("T{}", tool)
                         : purpose == Purpose::kControl ? "control"
                                                        : "self-test";
  const std::string name =
      fmt::format("{} {}{}", of, axis == Axis::kX ? 'X' : 'Y', plus ? '+' : '-');
  return count == 0 ? name : fmt::format("{} {}", name, count + 1);
}

/// @param start_mm   of the structure along its axis
/// @param across_mm  of its lower edge across
Structure OneStructure(const OriginalSheet& sheet, std::size_t pair, Axis axis, bool plus,
                       double start_mm, double across_mm) {
  Structure structure;
  structure.axis = axis;
  structure.swapped = !plus;
  const Comb reference{sheet.reference_tool, 1, 0, {}};
  const Comb tested{sheet.tools[pair], plus ? 1 : -1, 0, sheet.moved[pair]};
  structure.combs = {plus ? tested : reference, plus ? reference : tested};
  const bool moved = tested.programmed.u_mm != 0 || tested.programmed.v_mm != 0;
  structure.purpose = tested.tool != sheet.reference_tool ? Purpose::kTool
                      : moved                             ? Purpose::kSelfTest
                                                          : Purpose::kControl;
  // The very first leg of every comb is a travel.
  structure.incomplete = plus ? std::array{0, 0} : std::array{0, kTeeth - 1};
  // The reference comb's fingers are the same in both; of "-" they come first.
  const double first_mm = start_mm + kReferenceStart_mm + kSpacing_mm / 2;
  const double half_mm = (kTeeth - 1) / 2.0 * kPitch_mm;
  const double along_mm = first_mm + half_mm + (plus ? -kPitch_mm : kPitch_mm) / 4;
  const double middle_mm = across_mm + kAcross_mm / 2;
  structure.middle = PointAt(axis, along_mm, middle_mm);
  return structure;
}

/// Lists the limits of this sheet; they go with every result of it.
std::vector<std::string> NoticesOf(const OriginalSheet& sheet) {
  std::vector<std::string> notices{
      "identity not checked: an original sheet carries no number. Another sheet of as many tools, "
      "another order of the tools or another reference tool than were stated cannot be noticed"};
  const bool control =
      std::find(sheet.tools.begin(), sheet.tools.end(), sheet.reference_tool) != sheet.tools.end();
  if (!control) {
    notices.push_back(fmt::format(
        "no control: T{} is not in the list of tools, so that no structure of a known offset shows "
        "the method's own bias; the intervals hold the scatter of the lines alone",
        sheet.reference_tool));
  }
  const bool alone = std::all_of(sheet.tools.begin(), sheet.tools.end(),
                                 [&](int tool) { return tool == sheet.reference_tool; });
  if (alone) {
    notices.push_back(fmt::format("T{} alone has drawn this sheet: no tool has an offset on it",
                                  sheet.reference_tool));
  }
  std::string moved;
  for (std::size_t i = 0; i < sheet.tools.size(); ++i) {
    const SheetPoint& by = sheet.moved[i];
    if (sheet.tools[i] == sheet.reference_tool || (by.u_mm == 0 && by.v_mm == 0)) continue;
    moved += fmt::format("{}T{} by {:+.3f} / {:+.3f} mm", moved.empty() ? "" : ", ", sheet.tools[i],
                         by.u_mm, by.v_mm);
  }
  if (!moved.empty()) {
    notices.push_back(fmt::format(
        "the file moves combs on purpose along the print's axes ({}), which is taken off. Whether "
        "the sheet was printed with just these cannot be seen on a tool that is listed once",
        moved));
  }
  return notices;
}

}  // namespace

Result<void> Validate(const OriginalSheet& sheet) {
  if (sheet.tools.empty() || static_cast<int>(sheet.tools.size()) > kMaxOriginalPairs) {
    return Fail(fmt::format("the list of tools has {} entries, an original sheet has 1 to {}",
                            sheet.tools.size(), kMaxOriginalPairs));
  }
  if (std::min(sheet.reference_tool, *std::min_element(sheet.tools.begin(), sheet.tools.end())) <
      0) {
    return Fail("lines are drawn before any tool is named");
  }
  constexpr double kMin_deg = 5;   // less, and one axis hardly moves along a leg
  constexpr double kMax_deg = 40;  // more, and the two axes' play cannot be told apart
  if (!(sheet.rotation_deg >= kMin_deg && sheet.rotation_deg <= kMax_deg)) {
    return Fail(fmt::format("the print is turned by {:.4g} degrees on the bed; {} to {} are read",
                            sheet.rotation_deg, kMin_deg, kMax_deg));
  }
  constexpr double kMax_mm = 0.5;  // legs of both combs still stand apart
  for (const SheetPoint& by : sheet.moved) {
    if (std::max(std::abs(by.u_mm), std::abs(by.v_mm)) <= kMax_mm) continue;
    return Fail(fmt::format("a pair is moved by {:.4g} / {:.4g} mm on purpose; up to {} are read",
                            by.u_mm, by.v_mm, kMax_mm));
  }
  return {};
}

SheetPlan PlanOriginal(const OriginalSheet& sheet) {
  SheetPlan plan;
  plan.original = true;
  plan.leg_end_mm = kBesideTurn_mm;
  plan.turn_mm = kSpacing_mm / 2 + kLineWidth_mm / 2;
  SheetSettings& settings = plan.settings;
  settings.tools.clear();
  for (const int tool : sheet.tools) {
    if (std::find(settings.tools.begin(), settings.tools.end(), tool) == settings.tools.end()) {
      settings.tools.push_back(tool);
    }
  }
  settings.reference_tool = sheet.reference_tool;
  if (std::find(settings.tools.begin(), settings.tools.end(), sheet.reference_tool) ==
      settings.tools.end()) {
    settings.tools.insert(settings.tools.begin(), sheet.reference_tool);
  }
  settings.pitch_mm = kPitch_mm;
  settings.teeth = kTeeth;
  settings.leg_spacing_mm = kSpacing_mm;
  settings.leg_length_mm = kOriginalLeg_mm;
  settings.overlap_mm = kOverlap_mm;
  settings.structure_gap_mm = kGap_mm;
  settings.tilt_deg = sheet.rotation_deg;
  settings.line_width_mm = kLineWidth_mm;
  settings.printer.dialect = gcode::Dialect::kRepRapFirmware;
  plan.box_insets_mm = {0, kBoxLine_mm, 2 * kBoxLine_mm};
  const auto pairs = static_cast<double>(sheet.tools.size());
  const double across_mm = 2 * kStep_mm * pairs - kGap_mm;  // for all structures of an axis
  plan.width_mm = across_mm + kGap_mm + kDrawn_mm + 2 * kBoxGap_mm;
  plan.height_mm = std::max(across_mm, kDrawn_mm) + 2 * kBoxGap_mm;
  const double placed_mm = across_mm + kGap_mm + kPlaced_mm;
  std::map<std::string, int> named;
  for (const Axis axis : {Axis::kX, Axis::kY}) {
    const bool is_x = axis == Axis::kX;
    for (std::size_t pair = 0; pair < sheet.tools.size(); ++pair) {
      for (const bool plus : {true, false}) {
        const double aside_mm = kStep_mm * (2 * static_cast<double>(pair) + (plus ? 0 : 1));
        Structure structure =
            is_x
                ? OneStructure(sheet, pair, axis, plus, placed_mm / 2 - kPlaced_mm,
                               -across_mm / 2 + aside_mm)
                : OneStructure(sheet, pair, axis, plus, -kPlaced_mm / 2, -placed_mm / 2 + aside_mm);
        const int tool = sheet.tools[pair];
        int& before = named[Name(tool, structure.purpose, axis, plus, 0)];
        structure.name = Name(tool, structure.purpose, axis, plus, before++);
        plan.structures.push_back(std::move(structure));
      }
    }
  }
  plan.notices = NoticesOf(sheet);
  return plan;
}

namespace {

/// Tolerance of legs in the comparison: the file has three decimals.
constexpr double kSame_mm = 0.01;
constexpr std::size_t kBoxStrokes = 12;  // three times four sides
constexpr std::size_t kLegsOfComb = 33;  // 17 fingers of two legs, of which the first is a travel
constexpr std::size_t kCombsOfPair = 8;  // per axis "+" and "-", a tested and a reference comb
constexpr std::size_t kMaxLegs = kLegsOfComb * kCombsOfPair * kMaxOriginalPairs;

/// Straight line of ink, on the bed.
struct Stroke {
  long line = 0;  ///< line in the file
  int tool = -1;
  SheetPoint start;
  SheetPoint end;
};

tl::unexpected<Error> FailAt(long line, const std::string& what) {
  return Fail(fmt::format("line {}: {}", line, what));
}

double Far(const SheetPoint& a, const SheetPoint& b) {
  return std::hypot(a.u_mm - b.u_mm, a.v_mm - b.v_mm);
}

template <class Number>
bool Parse(std::string_view text, Number& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc{} && end == text.data() + text.size();
}

/// Follows the file's moves line by line.
class Moves {
 public:
  Result<void> Take(long line, std::string_view text) {
    text = text.substr(0, text.find(';'));
    const std::string_view word = text.substr(0, text.find(' '));
    if (word.size() > 1 && word[0] == 'T') {
      if (Parse(word.substr(1), tool_) && tool_ >= 0 && tool_ <= kHighestOriginalTool) return {};
      return FailAt(line, fmt::format("a tool that is no number in [0, {}]", kHighestOriginalTool));
    }
    const bool straight = word == "G0" || word == "G1";
    if (!straight && word != "G2" && word != "G3") return {};
    return TakeMove(line, text.substr(word.size()), straight);
  }

  std::vector<Stroke> box;   ///< the first strokes
  std::vector<Stroke> legs;  ///< all later ones of a leg's length, and one more than a sheet has

 private:
  Result<void> TakeMove(long line, std::string_view words, bool straight) {
    SheetPoint to = at_;
    double extruded = 0;
    while (true) {
      const std::size_t start = words.find_first_not_of(" \t");
      if (start == std::string_view::npos) break;
      words.remove_prefix(start);
      const std::string_view word = words.substr(0, words.find_first_of(" \t"));
      words.remove_prefix(word.size());
      double value = 0;
      constexpr double kMax_mm = 10000;
      if (!Parse(word.substr(1), value) || !(std::abs(value) <= kMax_mm)) {
        return FailAt(line, "a move has a word that is no letter with a number");
      }
      if (word[0] == 'X') to.u_mm = value;
      if (word[0] == 'Y') to.v_mm = value;
      if (word[0] == 'E') extruded = value;
    }
    const double length_mm = Far(at_, to);
    if (straight && extruded > 0 && length_mm > 0) {
      if (box.size() < kBoxStrokes) {
        box.push_back({line, tool_, at_, to});
      } else if (std::abs(length_mm - kOriginalLeg_mm) < kSame_mm && legs.size() <= kMaxLegs) {
        legs.push_back({line, tool_, at_, to});
      }
    }
    at_ = to;
    return {};
  }

  SheetPoint at_;
  int tool_ = -1;
};

/// Position of the box on the bed.
struct Placing {
  SheetPoint middle;
  double angle_rad = 0;

  explicit Placing(const std::vector<Stroke>& box) {
    constexpr std::size_t kSides = 4;
    for (std::size_t i = 0; i < kSides; ++i) {
      middle.u_mm += box[i].start.u_mm / kSides;
      middle.v_mm += box[i].start.v_mm / kSides;
    }
    const Stroke& first = box.front();
    angle_rad = std::atan2(first.end.v_mm - first.start.v_mm, first.end.u_mm - first.start.u_mm);
  }
  [[nodiscard]] SheetPoint OnSheet(const SheetPoint& bed) const {
    const double x = bed.u_mm - middle.u_mm;
    const double y = bed.v_mm - middle.v_mm;
    const double c = std::cos(angle_rad);
    const double s = std::sin(angle_rad);
    return {c * x + s * y, -s * x + c * y};
  }
  /// True if a stroke matches a leg of the plan.
  [[nodiscard]] bool IsAt(const Stroke& stroke, const Leg& leg) const {
    return Far(OnSheet(stroke.start), leg.start) <= kSame_mm &&
           Far(OnSheet(stroke.end), leg.end) <= kSame_mm;
  }
};

Result<void> CheckBox(const std::vector<Stroke>& box, const Placing& placing,
                      const SheetPlan& plan) {
  for (std::size_t i = 0; i < box.size(); ++i) {
    const double inset_mm = plan.box_insets_mm[i / 4];
    const double u_mm = plan.width_mm / 2 - inset_mm;
    const double v_mm = plan.height_mm / 2 - inset_mm;
    const std::array<SheetPoint, 4> corners{
        SheetPoint{-u_mm, -v_mm}, {u_mm, -v_mm}, {u_mm, v_mm}, {-u_mm, v_mm}};
    if (placing.IsAt(box[i], {corners[i % 4], corners[(i + 1) % 4]})) continue;
    return FailAt(box[i].line,
                  fmt::format("a line of the box is not where the published generator draws that "
                              "of {} pairs, {:.1f} x {:.1f} mm",
                              plan.structures.size() / 4, plan.width_mm, plan.height_mm));
  }
  return {};
}

/// Comb in the generator's drawing order.
struct DrawnComb {
  Axis axis = Axis::kY;
  std::size_t pair = 0;
  bool plus = true;
  bool tested = false;
};

std::vector<DrawnComb> DrawnCombs(std::size_t pairs) {
  std::vector<DrawnComb> combs;
  for (const Axis axis : {Axis::kY, Axis::kX}) {
    for (std::size_t pair = 0; pair < pairs; ++pair) {
      for (const bool plus : {true, false}) combs.push_back({axis, pair, plus, false});
    }
  }
  for (std::size_t pair = 0; pair < pairs; ++pair) {
    for (const Axis axis : {Axis::kY, Axis::kX}) {
      for (const bool plus : {true, false}) combs.push_back({axis, pair, plus, true});
    }
  }
  return combs;
}

/// Returns the planned legs of a comb in drawing order.
std::vector<Leg> PlannedLegs(const SheetPlan& plan, const DrawnComb& drawn) {
  const std::size_t of_axis = plan.structures.size() / 2;  // X structures come first
  const Structure& structure = plan.structures[(drawn.axis == Axis::kX ? 0 : of_axis) +
                                               2 * drawn.pair + (drawn.plus ? 0 : 1)];
  const std::size_t comb = drawn.plus == drawn.tested ? 0 : 1;
  const bool up = structure.combs[comb].direction > 0;
  std::vector<Leg> legs;
  for (int i = 0; i < plan.settings.teeth; ++i) {
    const auto finger = FingerLegs(plan, structure, comb, up ? i : plan.settings.teeth - 1 - i);
    legs.push_back(finger[up ? 0 : 1]);
    legs.push_back(finger[up ? 1 : 0]);
  }
  legs.erase(legs.begin());
  return legs;
}

/// Computes the common offset of a comb's legs from the plan.
Result<SheetPoint> MovedBy(std::span<const Stroke> legs, const std::vector<Leg>& planned,
                           const Placing& placing) {
  SheetPoint mean;
  for (std::size_t i = 0; i < legs.size(); ++i) {
    const SheetPoint start = placing.OnSheet(legs[i].start);
    mean.u_mm += (start.u_mm - planned[i].start.u_mm) / kLegsOfComb;
    mean.v_mm += (start.v_mm - planned[i].start.v_mm) / kLegsOfComb;
  }
  for (std::size_t i = 0; i < legs.size(); ++i) {
    if (placing.IsAt(legs[i], Shifted(planned[i], mean))) continue;
    return FailAt(legs[i].line, "a leg is not where the published generator draws it");
  }
  if (std::max(std::abs(mean.u_mm), std::abs(mean.v_mm)) <= kSame_mm / 4) mean = {};
  return mean;
}

/// Compares all combs with the plan of the sheet, and fills in its programmed offsets.
Result<void> CompareCombs(const std::vector<Stroke>& legs, const Placing& placing,
                          OriginalSheet& sheet) {
  const SheetPlan plan = PlanOriginal(sheet);
  std::vector<std::optional<SheetPoint>> moved(sheet.tools.size());
  std::size_t first = 0;
  for (const DrawnComb& drawn : DrawnCombs(sheet.tools.size())) {
    const std::span<const Stroke> of_comb = std::span(legs).subspan(first, kLegsOfComb);
    first += kLegsOfComb;
    const int tool = drawn.tested ? sheet.tools[drawn.pair] : sheet.reference_tool;
    for (const Stroke& leg : of_comb) {
      if (leg.tool == tool) continue;
      return FailAt(leg.line, fmt::format("drawn by T{}, its pair by T{}", leg.tool, tool));
    }
    const auto by = TRY(MovedBy(of_comb, PlannedLegs(plan, drawn), placing));
    std::optional<SheetPoint>& expected = moved[drawn.pair];
    if (drawn.tested && !expected) expected = by;
    if (Far(by, drawn.tested ? *expected : SheetPoint{}) > kSame_mm) {
      return FailAt(of_comb.front().line,
                    fmt::format("its comb is moved by {:+.3f} / {:+.3f} mm, others of the pair are "
                                "not",
                                by.u_mm, by.v_mm));
    }
  }
  for (std::size_t pair = 0; pair < moved.size(); ++pair) sheet.moved[pair] = *moved[pair];
  return {};
}

}  // namespace

bool IsOriginalGcode(std::string_view gcode) {
  return gcode.find(";print vertical interlocked reference pattern 0") != std::string_view::npos;
}

Result<OriginalSheet> ReadOriginalGcode(std::string_view gcode) {
  Moves moves;
  for (long line = 1; !gcode.empty(); ++line) {
    const std::size_t end = std::min(gcode.find('\n'), gcode.size());
    std::string_view text = gcode.substr(0, end);
    gcode.remove_prefix(std::min(end + 1, gcode.size()));
    while (text.ends_with('\r') || text.ends_with(' ')) text.remove_suffix(1);
    TRY(moves.Take(line, text));
  }
  const std::size_t pairs = moves.legs.size() / (kLegsOfComb * kCombsOfPair);
  if (moves.box.size() < kBoxStrokes || pairs == 0 || moves.legs.size() > kMaxLegs ||
      moves.legs.size() % (kLegsOfComb * kCombsOfPair) != 0) {
    return Fail(fmt::format(
        "has {} legs of {} mm behind the {} lines of a box; the published "
        "generator draws {} for each tool, up to {}: the file is cut off or of "
        "another geometry",
        moves.legs.size(), kOriginalLeg_mm, kBoxStrokes, kLegsOfComb * kCombsOfPair, kMaxLegs));
  }
  const Placing placing(moves.box);
  OriginalSheet sheet;
  // Three decimals of a line of 100 mm.
  sheet.rotation_deg = std::round(placing.angle_rad * 180 / std::numbers::pi * 1000) / 1000;
  sheet.reference_tool = moves.box.front().tool;
  sheet.tools.clear();
  for (std::size_t pair = 0; pair < pairs; ++pair) {
    sheet.tools.push_back(moves.legs[kLegsOfComb * 4 * (pairs + pair)].tool);
  }
  sheet.moved.assign(pairs, {});
  TRY(Validate(sheet));
  TRY(CheckBox(moves.box, placing, PlanOriginal(sheet)));
  TRY(CompareCombs(moves.legs, placing, sheet));
  TRY(Validate(sheet));
  return sheet;
}

}  // namespace trammel::tool_offset
