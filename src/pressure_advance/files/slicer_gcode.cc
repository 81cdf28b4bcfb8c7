#include "pressure_advance/files/slicer_gcode.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "base/statistics.h"
#include "files/whole_file.h"
#include "pressure_advance/files/gcode_archive.h"

namespace trammel::files {
namespace {

constexpr std::size_t kMaxMoves = 4'000'000;  // 80 bytes each
constexpr std::size_t kMaxCandidates = 2000;

// Straight extrusion with the state in which it was commanded.
struct Extrusion {
  double x0 = 0, y0 = 0, x1 = 0, y1 = 0, z = 0;
  double e_mm = 0;
  double speed_mm_s = 0;
  double pressure_advance_s = 0;
  double acceleration_mm_s2 = 0;  // 0: not set
  bool known = false;             // a pressure advance was set before

  [[nodiscard]] double length() const { return std::hypot(x1 - x0, y1 - y0); }
};

// Words of a command: letters with numbers, or Klipper's KEY=VALUE, upper case.
struct Command {
  std::string name;
  std::map<std::string, double, std::less<>> values;

  [[nodiscard]] std::optional<double> Find(std::string_view key) const {
    const auto found = values.find(key);
    return found == values.end() ? std::nullopt : std::optional(found->second);
  }
};

std::optional<double> Number(std::string_view text) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  constexpr double kBeyond = 1e9;
  if (error != std::errc{} || end != text.data() + text.size() || !(std::abs(value) < kBeyond)) {
    return std::nullopt;
  }
  return value;
}

char Upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; }

// Takes the next word off a line; empty at its end.
std::string_view NextWord(std::string_view& line) {
  const std::size_t begin = line.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  const std::size_t end = std::min(line.find_first_of(" \t\r", begin), line.size());
  const std::string_view word = line.substr(begin, end - begin);
  line.remove_prefix(end);
  return word;
}

// Parses a line into `command`, whose storage is used again. False for a line without a command.
bool Parse(std::string_view line, Command& command) {
  line = line.substr(0, line.find(';'));
  const std::string_view name = NextWord(line);
  if (name.empty() || name.size() > 40) return false;
  command.name.assign(name);
  std::transform(name.begin(), name.end(), command.name.begin(), Upper);
  command.values.clear();
  for (std::string_view word = NextWord(line); !word.empty(); word = NextWord(line)) {
    const std::size_t equals = word.find('=');
    const std::size_t split = equals == std::string_view::npos ? 1 : equals;
    const auto value = Number(word.substr(split + (equals == std::string_view::npos ? 0 : 1)));
    std::string key(word.substr(0, split));
    std::transform(key.begin(), key.end(), key.begin(), Upper);
    if (value) command.values[key] = *value;
  }
  return true;
}

// State of the machine while a file is read.
struct Reader {
  bool absolute = true, absolute_e = true;
  double x = 0, y = 0, z = 0, e = 0;
  double feed_mm_s = 0;
  double acceleration_mm_s2 = 0;
  double pressure_advance_s = 0;
  bool known = false;
  double smooth_time_s = 0.04;  // default of Klipper and of Prusa's firmware
  bool prusa = false;
  bool smooth_time_changes = false;
  double filament_mm = 1.75;  // diameter; the usual one where the file has none
  std::optional<gcode::PrintedBy> printed_by;
  std::vector<Extrusion> extrusions;

  void SetAdvance(std::optional<double> value, std::optional<gcode::PrintedBy> by) {
    if (!value) return;
    pressure_advance_s = *value;
    known = true;
    printed_by = by;
  }

  void Move(const Command& command);
  void Do(const Command& command);
};

void Reader::Move(const Command& command) {
  const auto to = [&](std::string_view axis, double now, bool is_absolute) {
    const auto value = command.Find(axis);
    return !value ? now : is_absolute ? *value : now + *value;
  };
  const double x1 = to("X", x, absolute), y1 = to("Y", y, absolute);
  const double e1 = to("E", e, absolute_e && absolute);
  z = to("Z", z, absolute);
  if (const auto feed = command.Find("F")) feed_mm_s = *feed / 60;
  constexpr double kShortest_mm = 1;
  const Extrusion extrusion{
      x, y, x1, y1, z, e1 - e, feed_mm_s, pressure_advance_s, acceleration_mm_s2, known};
  if (e1 > e && extrusion.length() > kShortest_mm && extrusions.size() < kMaxMoves) {
    extrusions.push_back(extrusion);
  }
  x = x1;
  y = y1;
  e = e1;
}

void Reader::Do(const Command& command) {
  const std::string& name = command.name;
  if (name == "G1" || name == "G0") return Move(command);
  if (name == "G90") {
    absolute = true;
  } else if (name == "G91") {
    absolute = false;
  } else if (name == "M82") {
    absolute_e = true;
  } else if (name == "M83") {
    absolute_e = false;
  } else if (name == "G92") {
    x = command.Find("X").value_or(x);
    y = command.Find("Y").value_or(y);
    z = command.Find("Z").value_or(z);
    e = command.Find("E").value_or(e);
  } else if (name == "SET_PRESSURE_ADVANCE") {
    SetAdvance(command.Find("ADVANCE"), gcode::PrintedBy{gcode::Dialect::kKlipper, 0});
    if (const auto smooth = command.Find("SMOOTH_TIME")) {
      smooth_time_changes |= !extrusions.empty() && *smooth != smooth_time_s;
      smooth_time_s = *smooth;
    }
  } else if (name == "M900") {
    const bool bambu = command.Find("L") && command.Find("M");
    SetAdvance(command.Find("K"),
               gcode::PrintedBy{bambu ? gcode::Dialect::kBambu : gcode::Dialect::kMarlin, 0});
  } else if (name == "M572") {
    std::optional<gcode::PrintedBy> by;
    const auto drive = command.Find("D");
    if (drive && *drive >= 0 && *drive <= 31) {  // as PatternConfig::extruder_drive
      by = gcode::PrintedBy{gcode::Dialect::kRepRapFirmware, static_cast<int>(*drive)};
    }
    if (const auto smooth = command.Find("W")) {  // Prusa's alone
      prusa = true;
      smooth_time_s = *smooth;
    }
    SetAdvance(command.Find("S"), by);
  } else if (name == "M862.3") {  // checks the model, of Prusa's
    prusa = true;
  } else if (name == "M204") {
    const auto both = command.Find("S");
    acceleration_mm_s2 = command.Find("P").value_or(both.value_or(acceleration_mm_s2));
  } else if (name == "SET_VELOCITY_LIMIT") {
    acceleration_mm_s2 = command.Find("ACCEL").value_or(acceleration_mm_s2);
  }
}

// Printed line or wall of a chevron.
struct Candidate {
  double x = 0, y = 0;    // middle of a line, or apex
  double dx = 0, dy = 0;  // unit: along a line, or from the arms' ends to the apex
  double z = 0;
  double length_mm = 0;
  std::array<double, 3> part_mm{};
  double slow_mm_s = 0, speed_mm_s = 0;
  double filament_mm_s = 0;
  double pressure_advance_s = 0;
  double acceleration_mm_s2 = 0;
  bool known = false;
};

bool Meet(const Extrusion& a, const Extrusion& b) {
  constexpr double kGap_mm = 0.02;
  return std::hypot(b.x0 - a.x1, b.y0 - a.y1) < kGap_mm && a.z == b.z &&
         a.pressure_advance_s == b.pressure_advance_s;
}

double CosineOf(const Extrusion& a, const Extrusion& b) {
  return ((a.x1 - a.x0) * (b.x1 - b.x0) + (a.y1 - a.y0) * (b.y1 - b.y0)) /
         (a.length() * b.length());
}

Candidate Describe(const Extrusion& first, const Extrusion& fast) {
  Candidate candidate;
  candidate.z = first.z;
  candidate.speed_mm_s = fast.speed_mm_s;
  candidate.filament_mm_s = fast.e_mm / fast.length() * fast.speed_mm_s;
  candidate.pressure_advance_s = fast.pressure_advance_s;
  candidate.acceleration_mm_s2 = fast.acceleration_mm_s2;
  candidate.known = fast.known;
  return candidate;
}

std::optional<Candidate> LineAt(const std::vector<Extrusion>& moves, std::size_t i) {
  if (i + 2 >= moves.size()) return std::nullopt;
  const Extrusion &a = moves[i], &b = moves[i + 1], &c = moves[i + 2];
  constexpr double kStraight = 0.9999, kFaster = 1.2;
  if (!Meet(a, b) || !Meet(b, c)) return std::nullopt;
  if (CosineOf(a, b) < kStraight || CosineOf(b, c) < kStraight) return std::nullopt;
  const double slow = std::max(a.speed_mm_s, c.speed_mm_s);
  if (!(slow > 0) || b.speed_mm_s < kFaster * slow) return std::nullopt;
  Candidate line = Describe(a, b);
  line.length_mm = std::hypot(c.x1 - a.x0, c.y1 - a.y0);
  line.x = (a.x0 + c.x1) / 2;
  line.y = (a.y0 + c.y1) / 2;
  line.dx = (c.x1 - a.x0) / line.length_mm;
  line.dy = (c.y1 - a.y0) / line.length_mm;
  line.part_mm = {a.length(), b.length(), c.length()};
  line.slow_mm_s = slow;
  return line;
}

std::optional<Candidate> WallAt(const std::vector<Extrusion>& moves, std::size_t i) {
  if (i + 1 >= moves.size()) return std::nullopt;
  const Extrusion &a = moves[i], &b = moves[i + 1];
  constexpr double kShortestArm_mm = 8, kRightAngle = 0.1, kAlike = 0.02;
  const double length = a.length();
  if (!Meet(a, b) || length < kShortestArm_mm || a.speed_mm_s != b.speed_mm_s) return std::nullopt;
  if (std::abs(CosineOf(a, b)) > kRightAngle) return std::nullopt;
  if (std::abs(b.length() - length) > kAlike * length) return std::nullopt;
  Candidate wall = Describe(a, a);
  wall.length_mm = length;
  wall.x = a.x1;
  wall.y = a.y1;
  const double mx = (a.x0 + b.x1) / 2, my = (a.y0 + b.y1) / 2;
  const double high = std::hypot(a.x1 - mx, a.y1 - my);
  wall.dx = (a.x1 - mx) / high;
  wall.dy = (a.y1 - my) / high;
  return wall;
}

// Distance of b from a along and across a's direction.
std::pair<double, double> Offset(const Candidate& a, const Candidate& b) {
  const double x = b.x - a.x, y = b.y - a.y;
  return {x * a.dx + y * a.dy, y * a.dx - x * a.dy};
}

bool SameKind(const Candidate& a, const Candidate& b) {
  constexpr double kAlike = 0.02;
  return std::abs(a.length_mm - b.length_mm) < kAlike * a.length_mm &&
         std::abs(a.dx * b.dx + a.dy * b.dy) > 1 - kAlike && a.speed_mm_s == b.speed_mm_s &&
         a.acceleration_mm_s2 == b.acceleration_mm_s2;
}

// Walls of one chevron are neighbours with one pressure advance: replaces them by their mean.
std::vector<Candidate> MergeWalls(const std::vector<Candidate>& walls) {
  constexpr double kAcross_mm = 0.05, kWalls_mm = 1.2;
  std::vector<Candidate> chevrons;
  int count = 0;
  Candidate last;
  for (const Candidate& wall : walls) {
    if (!chevrons.empty() && SameKind(last, wall)) {
      const auto [along, across] = Offset(last, wall);
      if (std::abs(across) < kAcross_mm && std::abs(along) < kWalls_mm && along != 0 &&
          wall.pressure_advance_s == last.pressure_advance_s && wall.z == last.z) {
        Candidate& mean = chevrons.back();
        mean.x = (mean.x * count + wall.x) / (count + 1);
        mean.y = (mean.y * count + wall.y) / (count + 1);
        ++count;
        last = wall;
        continue;
      }
    }
    chevrons.push_back(wall);
    count = 1;
    last = wall;
  }
  return chevrons;
}

// Candidates side by side, in their order on the plate.
using Row = std::vector<Candidate>;

// Returns 1, or -1 for a line whose left side, as seen along it, is the nearer to the front.
double SideOf(const Candidate& line) {
  const double nx = -line.dy, ny = line.dx;
  return std::abs(ny) > 1e-6 ? (ny > 0 ? 1 : -1) : (nx > 0 ? 1 : -1);
}

// Position along the row: across lines, along the apexes' direction of chevrons. Lines count from
// the front; for upright ones from the left.
double PlaceOf(const Candidate& candidate, PatternForm form) {
  if (form == PatternForm::kCorners) {
    return candidate.x * candidate.dx + candidate.y * candidate.dy;
  }
  return SideOf(candidate) * (candidate.y * candidate.dx - candidate.x * candidate.dy);
}

// Groups candidates of one kind that lie beside each other.
std::vector<Row> Rows(std::vector<Candidate> candidates, PatternForm form) {
  constexpr double kFarthest_mm = 12, kAside_mm = 1;
  std::stable_sort(candidates.begin(), candidates.end(), [&](const auto& a, const auto& b) {
    return PlaceOf(a, form) < PlaceOf(b, form);
  });
  std::vector<Row> rows;
  for (const Candidate& candidate : candidates) {
    const auto belongs = [&](const Row& row) {
      if (!SameKind(row.back(), candidate)) return false;
      const auto [along, across] = Offset(row.back(), candidate);
      const double ahead = form == PatternForm::kLines ? std::abs(across) : along;
      const double aside = form == PatternForm::kLines ? std::abs(along) : std::abs(across);
      return aside < kAside_mm && ahead < kFarthest_mm;
    };
    const auto row = std::find_if(rows.begin(), rows.end(), belongs);
    if (row == rows.end()) {
      rows.push_back({candidate});
      continue;
    }
    // A higher layer of the same place counts instead.
    if (std::abs(PlaceOf(row->back(), form) - PlaceOf(candidate, form)) < 0.05) {
      if (candidate.z >= row->back().z) row->back() = candidate;
      continue;
    }
    row->push_back(candidate);
  }
  constexpr std::size_t kFewest = 4;
  std::erase_if(rows, [](const Row& row) { return row.size() < kFewest; });
  return rows;
}

// Returns the firmware: M572 without a drive is Prusa's, where other commands are.
std::optional<gcode::PrintedBy> PrinterOf(const Reader& reader) {
  if (!reader.printed_by && reader.prusa) return gcode::PrintedBy{gcode::Dialect::kPrusa, 0};
  return reader.printed_by;
}

SlicerPattern PatternOf(Row row, PatternForm form, const std::vector<double>& heights,
                        const Reader& reader) {
  SlicerPattern pattern;
  pattern.form = form;
  if (form == PatternForm::kLines) {
    pattern.to_and_fro = std::any_of(row.begin(), row.end(), [&](const Candidate& line) {
      return line.dx * row.front().dx + line.dy * row.front().dy < 0;
    });
    // A pattern that is turned on the plate has the same order as one that is not.
    if (!pattern.to_and_fro && SideOf(row.front()) < 0) std::reverse(row.begin(), row.end());
  }
  std::vector<double> steps;
  for (std::size_t i = 0; i < row.size(); ++i) {
    pattern.pressure_advance_s.push_back(row[i].pressure_advance_s);
    if (i > 0) steps.push_back(std::abs(PlaceOf(row[i], form) - PlaceOf(row[i - 1], form)));
  }
  const Candidate& one = row.front();
  pattern.spacing_mm = Median(steps);
  pattern.length_mm = one.length_mm;
  pattern.speed_mm_s = one.speed_mm_s;
  pattern.flow_mm3_s =
      one.filament_mm_s * std::numbers::pi * reader.filament_mm * reader.filament_mm / 4;
  if (one.acceleration_mm_s2 > 0) pattern.acceleration_mm_s2 = one.acceleration_mm_s2;
  const auto by = PrinterOf(reader);
  if (by && (by->dialect == gcode::Dialect::kKlipper || by->dialect == gcode::Dialect::kPrusa)) {
    pattern.smooth_time_s = reader.smooth_time_s;
  }
  if (form == PatternForm::kCorners) pattern.heading_rad = std::atan2(one.dy, one.dx);
  if (form == PatternForm::kLines) {
    for (std::size_t part = 0; part < 3; ++part) {
      pattern.segments.push_back(
          {one.part_mm[part] / one.length_mm, part == 1 ? one.speed_mm_s : one.slow_mm_s});
    }
  }
  const auto above = std::find(heights.begin(), heights.end(), one.z);
  if (above != heights.end() && above != heights.begin()) {
    pattern.layer_height_mm = *above - *std::prev(above);
  } else {
    pattern.layer_height_mm = one.z;
  }
  pattern.x_mm = (row.front().x + row.back().x) / 2;
  pattern.y_mm = (row.front().y + row.back().y) / 2;
  return pattern;
}

// Layers of the candidates.
std::vector<double> HeightsOf(const std::vector<Candidate>& candidates) {
  std::vector<double> heights;
  for (const Candidate& candidate : candidates) heights.push_back(candidate.z);
  std::sort(heights.begin(), heights.end());
  heights.erase(std::unique(heights.begin(), heights.end()), heights.end());
  return heights;
}

// Drops patterns under others: the first layer is slower, and its arms are shorter.
void DropCovered(const std::vector<double>& heights, std::vector<SlicerPattern>& patterns) {
  constexpr double kSamePlace_mm = 5;
  std::vector<SlicerPattern> top;
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    bool covered = false;
    for (std::size_t j = 0; j < patterns.size(); ++j) {
      covered |= heights[j] > heights[i] && patterns[j].form == patterns[i].form &&
                 std::hypot(patterns[j].x_mm - patterns[i].x_mm,
                            patterns[j].y_mm - patterns[i].y_mm) < kSamePlace_mm;
    }
    if (!covered) top.push_back(patterns[i]);
  }
  patterns = std::move(top);
}

// Returns the filament's diameter in the settings that PrusaSlicer, OrcaSlicer and Bambu Studio
// write as comments; the first extruder's.
std::optional<double> FilamentIn(std::string_view gcode) {
  constexpr std::string_view kSetting = "\n; filament_diameter = ";
  constexpr Interval kPossible_mm{1, 4};
  const std::size_t at = gcode.find(kSetting);
  if (at == std::string_view::npos) return std::nullopt;
  const std::string_view values = gcode.substr(at + kSetting.size());
  const auto value = Number(values.substr(0, values.find_first_of(",; \r\n")));
  if (!value || *value < kPossible_mm.lo || *value > kPossible_mm.hi) return std::nullopt;
  return value;
}

Result<void> Check(const SlicerPattern& pattern, const Row& row, const std::string& file) {
  for (const Candidate& candidate : row) {
    if (!candidate.known) {
      return Fail(
          fmt::format("{}: no pressure advance is set before the pattern at x {:.0f}, y "
                      "{:.0f} mm (SET_PRESSURE_ADVANCE, M900 K or M572 S)",
                      file, pattern.x_mm, pattern.y_mm));
    }
    if (!(candidate.pressure_advance_s >= 0 && candidate.pressure_advance_s <= 10)) {
      return Fail(
          fmt::format("{}: a pressure advance of {:g} s is not between 0 and 10; Marlin's "
                      "K before version 1.5 is no time",
                      file, candidate.pressure_advance_s));
    }
  }
  return {};
}

}  // namespace

Result<SlicerPrint> FindSlicerPatterns(std::string_view gcode, const std::string& file) {
  Reader reader;
  reader.filament_mm = FilamentIn(gcode).value_or(reader.filament_mm);
  Command command;
  while (!gcode.empty()) {
    const std::string_view line = gcode.substr(0, gcode.find('\n'));
    gcode.remove_prefix(std::min(gcode.size(), line.size() + 1));
    if (Parse(line, command)) reader.Do(command);
  }
  std::vector<Candidate> lines, walls;
  for (std::size_t i = 0; i < reader.extrusions.size(); ++i) {
    if (auto line = LineAt(reader.extrusions, i)) lines.push_back(*line);
    if (auto wall = WallAt(reader.extrusions, i)) walls.push_back(*wall);
  }
  const std::vector<Candidate> chevrons = MergeWalls(walls);
  if (lines.size() + chevrons.size() > 8 * kMaxCandidates) {
    return Fail(
        fmt::format("{}: more than {} lines or corners; is it a pattern of pressure "
                    "advance?",
                    file, 8 * kMaxCandidates));
  }
  SlicerPrint print;
  std::vector<double> heights_of;  // z of each pattern
  print.printed_by = PrinterOf(reader);
  print.filament_mm = reader.filament_mm;
  for (const PatternForm form : {PatternForm::kLines, PatternForm::kCorners}) {
    const auto& candidates = form == PatternForm::kLines ? lines : chevrons;
    const std::vector<double> heights = HeightsOf(candidates);
    for (const Row& row : Rows(candidates, form)) {
      // Frames and infill have one pressure advance throughout.
      const bool varies = std::any_of(row.begin(), row.end(), [&](const Candidate& one) {
        return one.pressure_advance_s != row.front().pressure_advance_s;
      });
      if (!varies && row.front().known) continue;
      SlicerPattern pattern = PatternOf(row, form, heights, reader);
      TRY(Check(pattern, row, file));
      print.patterns.push_back(std::move(pattern));
      heights_of.push_back(row.front().z);
    }
  }
  DropCovered(heights_of, print.patterns);
  if (print.patterns.empty()) {
    return Fail(fmt::format(
        "{}: holds no lines slow-fast-slow and no nested corners with a pressure advance of their "
        "own{}",
        file,
        reader.smooth_time_changes ? "; its smooth time changes instead, which is not measured"
                                   : "; give the file that printed the pattern in the photo"));
  }
  std::stable_sort(print.patterns.begin(), print.patterns.end(), [](const auto& a, const auto& b) {
    return std::pair(a.y_mm, a.x_mm) < std::pair(b.y_mm, b.x_mm);
  });
  return print;
}

namespace {

// Keeps the plate of a name or a number.
Result<void> Select(const std::string& name, const std::string& file,
                    std::vector<GcodePlate>& plates) {
  std::vector<std::string> names;
  for (const GcodePlate& plate : plates) names.push_back(plate.name);
  std::erase_if(plates, [&](const GcodePlate& plate) {
    return plate.name != name && plate.name != "plate_" + name;
  });
  if (!plates.empty()) return {};
  return Fail(fmt::format("--plate {}: {} holds {}", name, file, fmt::join(names, ", ")));
}

// Joins the patterns of all plates; a plate of the archive may hold other things.
Result<SlicerPrint> FindOnPlates(const std::vector<GcodePlate>& plates, const std::string& file) {
  std::optional<Result<SlicerPrint>> all;
  for (const GcodePlate& plate : plates) {
    Result<SlicerPrint> print = FindSlicerPatterns(plate.gcode, file);
    if (print) {
      for (SlicerPattern& pattern : print->patterns) pattern.plate = plate.name;
    }
    if (!all || !*all) {
      if (!all || print) all = std::move(print);
    } else if (print) {
      std::ranges::move(print->patterns, std::back_inserter((*all)->patterns));
    }
  }
  return *std::move(all);
}

}  // namespace

Result<SlicerPrint> ReadSlicerGcode(const std::filesystem::path& file, const std::string& plate) {
  const std::string text = TRY(ReadWholeFile(file, kLargestSlicerGcode));
  if (IsArchive(text)) {
    auto plates = TRY(ReadGcodeArchive(text, file.string(), kLargestSlicerGcode));
    if (!plate.empty()) TRY(Select(plate, file.string(), plates));
    return FindOnPlates(plates, file.string());
  }
  if (!plate.empty()) {
    return Fail(fmt::format("--plate {}: {} is no archive with plates", plate, file.string()));
  }
  if (text.empty()) return Fail(fmt::format("{}: is empty: export it again", file.string()));
  if (text.starts_with("GCDE")) {
    return Fail(fmt::format(
        "{}: is binary G-code, which is not read: turn it off in PrusaSlicer (Printer Settings, "
        "General, Supports binary G-code) and export the file again",
        file.string()));
  }
  if (text.find('\0') != std::string::npos) {
    return Fail(fmt::format("{}: is no G-code but a binary file", file.string()));
  }
  return FindSlicerPatterns(text, file.string());
}

}  // namespace trammel::files
