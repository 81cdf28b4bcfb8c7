#include "tool_offset/original/original_gcode.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <tuple>

namespace trammel::tool_offset {
namespace {

constexpr std::string_view kComment = ";print ";
/// On the bed; the file has three decimals, and its legs are compared to this.
constexpr double kSame_mm = 0.01;

/// A straight line of ink, on the bed.
struct Stroke {
  long line = 0;  ///< of the file
  SheetPoint start;
  SheetPoint end;
  [[nodiscard]] double length_mm() const {
    return std::hypot(end.u_mm - start.u_mm, end.v_mm - start.v_mm);
  }
};

/// What is drawn behind one comment; the box stands before the first.
struct Section {
  Axis axis = Axis::kX;
  bool tested = false;
  int pair = 0;
  int tool = -1;
  long line = 0;
  std::vector<Stroke> strokes;
};

tl::unexpected<Error> FailAt(long line, const std::string& what) {
  return Fail(fmt::format("line {}: {}", line, what));
}

bool StartsWith(std::string_view& text, std::string_view with) {
  if (!text.starts_with(with)) return false;
  text.remove_prefix(with.size());
  return true;
}

/// "vertical interlocked signal pattern 3": vertical combs measure along v.
std::optional<Section> SectionOf(std::string_view text) {
  Section section;
  if (StartsWith(text, "vertical ")) {
    section.axis = Axis::kY;
  } else if (!StartsWith(text, "horizontal ")) {
    return std::nullopt;
  }
  if (!StartsWith(text, "interlocked ")) return std::nullopt;
  section.tested = StartsWith(text, "signal ");
  if (!section.tested && !StartsWith(text, "reference ")) return std::nullopt;
  if (!StartsWith(text, "pattern ")) return std::nullopt;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), section.pair);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return section;
}

/// The file's moves, line by line.
class Moves {
 public:
  Result<void> Take(long line, std::string_view text) {
    if (std::string_view comment = text; StartsWith(comment, kComment)) {
      return TakeComment(line, comment);
    }
    text = text.substr(0, text.find(';'));
    const std::string_view word = text.substr(0, text.find(' '));
    if (word.size() > 1 && word[0] == 'T') return TakeTool(line, word.substr(1));
    const bool straight = word == "G0" || word == "G1";
    if (!straight && word != "G2" && word != "G3") return {};
    return TakeMove(line, text.substr(word.size()), straight);
  }

  std::vector<Section> sections{Section{}};  ///< the first is the box

 private:
  Result<void> TakeComment(long line, std::string_view comment) {
    auto section = SectionOf(comment);
    if (!section) return {};
    constexpr std::size_t kMost = 1 + 8 * kMostOriginalPairs;
    if (sections.size() >= kMost) {
      return FailAt(line, fmt::format("more than {} combs of an original sheet", kMost - 1));
    }
    section->line = line;
    sections.push_back(std::move(*section));
    return {};
  }

  Result<void> TakeTool(long line, std::string_view number) {
    int tool = -1;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), tool);
    if (error != std::errc{} || end != number.data() + number.size() || tool < 0 ||
        tool > kHighestOriginalTool) {
      return FailAt(line, fmt::format("a tool that is no number in [0, {}]", kHighestOriginalTool));
    }
    tool_ = tool;
    return {};
  }

  Result<void> TakeMove(long line, std::string_view words, bool straight) {
    SheetPoint to = at_;
    double extruded = 0;
    bool moved = false;
    while (!words.empty()) {
      const std::size_t start = words.find_first_not_of(" \t");
      if (start == std::string_view::npos) break;
      words.remove_prefix(start);
      const std::string_view word = words.substr(0, words.find_first_of(" \t"));
      words.remove_prefix(word.size());
      double value = 0;
      const auto [end, error] = std::from_chars(word.data() + 1, word.data() + word.size(), value);
      constexpr double kMost_mm = 10000;
      if (word.size() < 2 || error != std::errc{} || end != word.data() + word.size() ||
          !(std::abs(value) <= kMost_mm)) {
        return FailAt(line, "a move has a word that is no letter with a number");
      }
      switch (word[0]) {
        case 'X':
          to.u_mm = value;
          moved = true;
          break;
        case 'Y':
          to.v_mm = value;
          moved = true;
          break;
        case 'E':
          extruded = value;
          break;
        default:
          break;
      }
    }
    // The box has twelve lines, and two combs 66 legs and as many spines.
    constexpr std::size_t kMostStrokes = 200;
    Section& section = sections.back();
    if (straight && moved && extruded > 0) {
      if (section.strokes.size() >= kMostStrokes) {
        return FailAt(line, fmt::format("more than {} lines in a row without a comment of the "
                                        "original generator",
                                        kMostStrokes));
      }
      if (section.tool >= 0 && section.tool != tool_) {
        return FailAt(line, "the tool changes within a comb");
      }
      section.tool = tool_;
      section.strokes.push_back({line, at_, to});
    }
    at_ = to;
    return {};
  }

  SheetPoint at_;
  int tool_ = -1;
};

/// Where the box lies on the bed.
struct Placing {
  SheetPoint middle;
  double angle_rad = 0;
  double width_mm = 0;
  double height_mm = 0;

  [[nodiscard]] SheetPoint OnSheet(const SheetPoint& bed) const {
    const double x = bed.u_mm - middle.u_mm;
    const double y = bed.v_mm - middle.v_mm;
    const double c = std::cos(angle_rad);
    const double s = std::sin(angle_rad);
    return {c * x + s * y, -s * x + c * y};
  }
};

Result<Placing> PlacingOf(const Section& box) {
  constexpr std::size_t kSides = 4;
  if (box.strokes.size() != kSides * 3) {
    return Fail(
        fmt::format("{} lines stand before the first comb, not the three times four of a "
                    "box",
                    box.strokes.size()));
  }
  Placing placing;
  for (std::size_t i = 0; i < kSides; ++i) {
    placing.middle.u_mm += box.strokes[i].start.u_mm / kSides;
    placing.middle.v_mm += box.strokes[i].start.v_mm / kSides;
  }
  const Stroke& first = box.strokes[0];
  placing.angle_rad =
      std::atan2(first.end.v_mm - first.start.v_mm, first.end.u_mm - first.start.u_mm);
  placing.width_mm = first.length_mm();
  placing.height_mm = box.strokes[1].length_mm();
  return placing;
}

double Far(const SheetPoint& a, const SheetPoint& b) {
  return std::hypot(a.u_mm - b.u_mm, a.v_mm - b.v_mm);
}

/// Whether the twelve lines are the plan's.
Result<void> CheckBox(const Section& box, const Placing& placing, const SheetPlan& plan) {
  for (std::size_t i = 0; i < box.strokes.size(); ++i) {
    const double inset_mm = plan.box_insets_mm[i / 4];
    const double u_mm = plan.width_mm / 2 - inset_mm;
    const double v_mm = plan.height_mm / 2 - inset_mm;
    const std::array<SheetPoint, 4> corners{
        SheetPoint{-u_mm, -v_mm}, {u_mm, -v_mm}, {u_mm, v_mm}, {-u_mm, v_mm}};
    const Stroke& stroke = box.strokes[i];
    if (Far(placing.OnSheet(stroke.start), corners[i % 4]) > kSame_mm ||
        Far(placing.OnSheet(stroke.end), corners[(i + 1) % 4]) > kSame_mm) {
      return FailAt(stroke.line,
                    fmt::format("a line of the box is not where the published generator draws that "
                                "of {} tools, {:.1f} x {:.1f} mm",
                                (plan.structures.size() + 3) / 4, plan.width_mm, plan.height_mm));
    }
  }
  return {};
}

/// The drawn legs of a comb in their order.
std::vector<Leg> DrawnLegs(const SheetPlan& plan, const Structure& structure, std::size_t comb) {
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

/// Compares a section's legs with those of the plan, and says by how much all of them are moved.
Result<SheetPoint> MovedBy(const Section& section, const Placing& placing, const SheetPlan& plan) {
  std::vector<Leg> planned;
  for (std::size_t i = 0; i < plan.structures.size(); ++i) {
    const Structure& structure = plan.structures[i];
    const bool plus = !structure.swapped;
    // X structures come first, two of each pair.
    const std::size_t of_axis = plan.structures.size() / 2;
    if (structure.axis != section.axis || static_cast<int>(i % of_axis) / 2 != section.pair) {
      continue;
    }
    const std::vector<Leg> legs = DrawnLegs(plan, structure, plus == section.tested ? 0 : 1);
    planned.insert(planned.end(), legs.begin(), legs.end());
  }
  std::vector<const Stroke*> drawn;
  for (const Stroke& stroke : section.strokes) {
    if (std::abs(stroke.length_mm() - plan.settings.leg_length_mm) < kSame_mm) {
      drawn.push_back(&stroke);
    }
  }
  if (drawn.size() != planned.size()) {
    return FailAt(section.line,
                  fmt::format("{} legs of {} mm follow, the published generator "
                              "draws {}: the file is cut off or of another geometry",
                              drawn.size(), plan.settings.leg_length_mm, planned.size()));
  }
  SheetPoint mean;
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    const SheetPoint start = placing.OnSheet(drawn[i]->start);
    const auto count = static_cast<double>(drawn.size());
    mean.u_mm += (start.u_mm - planned[i].start.u_mm) / count;
    mean.v_mm += (start.v_mm - planned[i].start.v_mm) / count;
  }
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    const Leg leg = Shifted(planned[i], mean);
    if (Far(placing.OnSheet(drawn[i]->start), leg.start) > kSame_mm ||
        Far(placing.OnSheet(drawn[i]->end), leg.end) > kSame_mm) {
      return FailAt(drawn[i]->line, "a leg is not where the published generator draws it");
    }
  }
  return mean;
}

/// Files that number each comb by itself, two of a pair one after the other, as those that number
/// pairs.
std::vector<Section> ByPairs(std::vector<Section> sections) {
  constexpr std::ptrdiff_t kMostOfOneComb = 40;  // long lines; it has 33 legs
  constexpr double kLong_mm = 5;                 // spines have 2.5
  if (sections.size() < 2) return sections;
  const std::vector<Stroke>& strokes = sections[1].strokes;
  const auto legs = std::count_if(strokes.begin(), strokes.end(), [](const Stroke& stroke) {
    return stroke.length_mm() > kLong_mm;
  });
  if (legs > kMostOfOneComb) return sections;
  std::vector<Section> pairs{sections[0]};
  std::map<std::tuple<Axis, bool, int>, std::size_t> first;
  for (std::size_t i = 1; i < sections.size(); ++i) {
    Section& section = sections[i];
    const bool second = section.pair % 2 == 1;
    section.pair /= 2;
    const auto [known, added] =
        first.emplace(std::tuple{section.axis, section.tested, section.pair}, pairs.size());
    if (added || !second || section.tool != pairs[known->second].tool) {
      pairs.push_back(std::move(section));
      continue;
    }
    Section& before = pairs[known->second];
    before.strokes.insert(before.strokes.end(), section.strokes.begin(), section.strokes.end());
  }
  return pairs;
}

/// The tools of all pairs, each with four sections.
Result<OriginalSheet> ToolsOf(const std::vector<Section>& sections) {
  OriginalSheet sheet;
  sheet.reference_tool = sections[0].tool;
  std::map<std::tuple<Axis, bool, int>, int> seen;
  for (std::size_t i = 1; i < sections.size(); ++i) {
    const Section& section = sections[i];
    const auto [before, added] =
        seen.emplace(std::tuple{section.axis, section.tested, section.pair}, section.tool);
    if (added) continue;
    return FailAt(section.line, fmt::format("pattern {} stands twice, drawn by T{} and by T{}",
                                            section.pair, before->second, section.tool));
  }
  const auto pairs = (sections.size() - 1) / 4;
  if (sections.size() % 4 != 1 || pairs == 0) {
    return Fail(
        fmt::format("has {} patterns, four for each tool were expected: the file is cut "
                    "off",
                    sections.size() - 1));
  }
  sheet.tools.assign(pairs, -1);
  sheet.moved.assign(pairs, {});
  for (std::size_t i = 1; i < sections.size(); ++i) {
    const Section& section = sections[i];
    if (section.pair < 0 || section.pair >= static_cast<int>(pairs)) {
      return FailAt(section.line,
                    fmt::format("pattern {}, but there are all patterns of {} tools only: the file "
                                "is cut off",
                                section.pair, pairs));
    }
    int& tool =
        section.tested ? sheet.tools[static_cast<std::size_t>(section.pair)] : sheet.reference_tool;
    if (tool < 0) tool = section.tool;
    if (section.tool < 0 || section.tool != tool) {
      return FailAt(section.line, fmt::format("drawn by T{}, its pair by T{}", section.tool, tool));
    }
  }
  return sheet;
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
    if (const auto taken = moves.Take(line, text); !taken) return tl::unexpected(taken.error());
  }
  moves.sections = ByPairs(std::move(moves.sections));
  const auto placing = PlacingOf(moves.sections[0]);
  if (!placing) return tl::unexpected(placing.error());
  auto sheet = ToolsOf(moves.sections);
  if (!sheet) return sheet;
  sheet->from_gcode = true;
  // Three decimals of a line of 100 mm.
  sheet->rotation_deg = std::round(placing->angle_rad * 180 / std::numbers::pi * 1000) / 1000;
  if (const auto valid = Validate(*sheet); !valid) return tl::unexpected(valid.error());
  const SheetPlan plan = PlanOriginal(*sheet);
  if (const auto box = CheckBox(moves.sections[0], *placing, plan); !box) {
    return tl::unexpected(box.error());
  }
  std::vector<int> seen(sheet->tools.size(), 0);
  for (std::size_t i = 1; i < moves.sections.size(); ++i) {
    const Section& section = moves.sections[i];
    const auto by = MovedBy(section, *placing, plan);
    if (!by) return tl::unexpected(by.error());
    const bool moved = std::max(std::abs(by->u_mm), std::abs(by->v_mm)) > kSame_mm / 4;
    const auto pair = static_cast<std::size_t>(section.pair);
    if (section.tested ? seen[pair]++ > 0 && Far(*by, sheet->moved[pair]) > kSame_mm : moved) {
      return FailAt(section.line, fmt::format("its combs are moved by {:+.3f} / {:+.3f} mm, others "
                                              "of the pair are not",
                                              by->u_mm, by->v_mm));
    }
    if (section.tested && moved) sheet->moved[pair] = *by;
  }
  if (const auto valid = Validate(*sheet); !valid) return tl::unexpected(valid.error());
  return sheet;
}

}  // namespace trammel::tool_offset
