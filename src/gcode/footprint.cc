#include "gcode/footprint.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>

#include "base/check.h"

namespace trammel::gcode {
namespace {

constexpr double kMost_mm = 1e6;
constexpr int kMostCells = 2000;                   // along a side of the plate
constexpr std::size_t kMostLooks = 2'000'000'000;  // some thousand km of beads

char Upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; }

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

std::string_view Trimmed(std::string_view text) {
  while (!text.empty() && IsBlank(text.front())) text.remove_prefix(1);
  while (!text.empty() && IsBlank(text.back())) text.remove_suffix(1);
  return text;
}

// Without its comment, its number and its checksum.
std::string_view Statement(std::string_view line) {
  line = Trimmed(line.substr(0, line.find_first_of(";*")));
  if (line.size() > 1 && Upper(line[0]) == 'N' && IsDigit(line[1])) {
    line.remove_prefix(1);
    while (!line.empty() && IsDigit(line.front())) line.remove_prefix(1);
    line = Trimmed(line);
  }
  return line;
}

// "G1" of "G01 X5" and of "g1x5"; of other commands all to the next blank, in capitals.
std::string Command(std::string_view statement, std::string_view& rest) {
  std::size_t end = 0;
  const bool short_one = statement.size() > 1 && IsDigit(statement[1]);
  if (short_one) {
    end = 1;
    while (end < statement.size() && (IsDigit(statement[end]) || statement[end] == '.')) ++end;
  } else {
    while (end < statement.size() && !IsBlank(statement[end])) ++end;
  }
  rest = Trimmed(statement.substr(end));
  std::string command;
  for (const char c : statement.substr(0, end)) {
    if (short_one && c == '0' && command.size() == 1 && command.size() + 1 < end) continue;
    command += Upper(c);
  }
  if (short_one && command.size() == 1) command += '0';  // G00
  return command;
}

// Of the state that Klipper keeps under a name; RepRapFirmware's have none.
std::string NameOf(std::string_view command, std::string_view rest) {
  constexpr std::string_view kName = "NAME=";
  std::string capitals;
  for (const char c : rest) capitals += Upper(c);
  const std::size_t at = capitals.find(kName);
  if (command.front() == 'M' || at == std::string::npos) return "";
  rest = rest.substr(at + kName.size());
  return std::string(rest.substr(0, rest.find(' ')));
}

// Behind these nobody can tell where a print lies.
struct Refused {
  std::string_view command;
  std::string_view why;
};
constexpr std::array kRefused = {
    Refused{"G5", "lays splines, which are not read"}, Refused{"G18", "turns the plane of arcs"},
    Refused{"G19", "turns the plane of arcs"},         Refused{"G20", "counts in inches"},
    Refused{"M605", "may print copies elsewhere"},
};

}  // namespace

Footprint::Footprint(const PlateArea& plate) : plate_(plate) {
  const double width_mm = plate.max_x_mm - plate.min_x_mm;
  const double depth_mm = plate.max_y_mm - plate.min_y_mm;
  TRAMMEL_CHECK(width_mm > 0 && depth_mm > 0 && std::isfinite(width_mm + depth_mm), "{} x {} mm",
                width_mm, depth_mm);
  cell_mm_ = std::max({1.0, width_mm / kMostCells, depth_mm / kMostCells});
  columns_ = static_cast<int>(std::ceil(width_mm / cell_mm_));
  rows_ = static_cast<int>(std::ceil(depth_mm / cell_mm_));
  cells_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), 0);
}

std::size_t Footprint::Mark(double from_x_mm, double from_y_mm, double to_x_mm, double to_y_mm) {
  TRAMMEL_CHECK(std::isfinite(from_x_mm + from_y_mm + to_x_mm + to_y_mm), "({}, {}) to ({}, {})",
                from_x_mm, from_y_mm, to_x_mm, to_y_mm);
  // The part of the line on the plate, from 0 to 1 (Liang and Barsky 1984).
  double lo = 0;
  double hi = 1;
  const double dx = to_x_mm - from_x_mm;
  const double dy = to_y_mm - from_y_mm;
  for (const auto& [along, room] :
       {std::pair{-dx, from_x_mm - plate_.min_x_mm}, std::pair{dx, plate_.max_x_mm - from_x_mm},
        std::pair{-dy, from_y_mm - plate_.min_y_mm}, std::pair{dy, plate_.max_y_mm - from_y_mm}}) {
    if (along == 0) {
      if (room < 0) return 1;
    } else if (along < 0) {
      lo = std::max(lo, room / along);
    } else {
      hi = std::min(hi, room / along);
    }
  }
  if (lo > hi) return 1;
  sums_.clear();
  const double length_mm = (hi - lo) * std::hypot(dx, dy);
  const int steps = std::max(1, static_cast<int>(std::ceil(2 * length_mm / cell_mm_)));
  for (int i = 0; i <= steps; ++i) {
    const double at = lo + (hi - lo) * i / steps;
    const double x = (from_x_mm + at * dx - plate_.min_x_mm) / cell_mm_;
    const double y = (from_y_mm + at * dy - plate_.min_y_mm) / cell_mm_;
    const int column = std::clamp(static_cast<int>(std::floor(x)), 0, columns_ - 1);
    const int row = std::clamp(static_cast<int>(std::floor(y)), 0, rows_ - 1);
    cells_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column)] = 1;
  }
  return static_cast<std::size_t>(steps) + 1;
}

void Footprint::Sum() const {
  const auto width = static_cast<std::size_t>(columns_) + 1;
  sums_.assign(width * (static_cast<std::size_t>(rows_) + 1), 0);
  for (std::size_t y = 0; y + 1 < sums_.size() / width; ++y) {
    for (std::size_t x = 0; x + 1 < width; ++x) {
      sums_[(y + 1) * width + x + 1] = sums_[y * width + x + 1] + sums_[(y + 1) * width + x] -
                                       sums_[y * width + x] + cells_[y * (width - 1) + x];
    }
  }
}

bool Footprint::Clear(const PlateArea& area) const {
  if (sums_.empty()) Sum();
  const auto cell = [&](double at_mm, double origin_mm, int most) {
    return static_cast<std::size_t>(
        std::clamp(std::floor((at_mm - origin_mm) / cell_mm_), 0.0, static_cast<double>(most)));
  };
  const std::size_t left = cell(area.min_x_mm, plate_.min_x_mm, columns_ - 1);
  const std::size_t front = cell(area.min_y_mm, plate_.min_y_mm, rows_ - 1);
  const std::size_t right = cell(area.max_x_mm, plate_.min_x_mm, columns_ - 1) + 1;
  const std::size_t back = cell(area.max_y_mm, plate_.min_y_mm, rows_ - 1) + 1;
  if (right <= left || back <= front) return true;
  const auto width = static_cast<std::size_t>(columns_) + 1;
  return sums_[back * width + right] + sums_[front * width + left] ==
         sums_[front * width + right] + sums_[back * width + left];
}

std::optional<PlateArea> Footprint::Bounds() const {
  int left = columns_, right = -1, front = rows_, back = -1;
  for (int y = 0; y < rows_; ++y) {
    for (int x = 0; x < columns_; ++x) {
      if (cells_[static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) +
                 static_cast<std::size_t>(x)] == 0) {
        continue;
      }
      left = std::min(left, x);
      right = std::max(right, x);
      front = std::min(front, y);
      back = std::max(back, y);
    }
  }
  if (right < 0) return std::nullopt;
  return PlateArea{plate_.min_x_mm + left * cell_mm_, plate_.min_y_mm + front * cell_mm_,
                   plate_.min_x_mm + (right + 1) * cell_mm_,
                   plate_.min_y_mm + (back + 1) * cell_mm_};
}

/// The numbers behind a move's letters.
struct FootprintReader::Words {
  std::optional<double> x, y, z, e, i, j, r;

  static Result<Words> Read(std::string_view text) {
    Words words;
    const std::array<std::pair<char, std::optional<double>*>, 7> known = {{{'X', &words.x},
                                                                           {'Y', &words.y},
                                                                           {'Z', &words.z},
                                                                           {'E', &words.e},
                                                                           {'I', &words.i},
                                                                           {'J', &words.j},
                                                                           {'R', &words.r}}};
    while (!(text = Trimmed(text)).empty()) {
      if (text.front() == '(') {  // a comment
        text.remove_prefix(std::min(text.find(')'), text.size() - 1) + 1);
        continue;
      }
      const char letter = Upper(text.front());
      text = Trimmed(text.substr(1));
      std::size_t end = 0;
      while (end < text.size() &&
             (IsDigit(text[end]) || text[end] == '.' || text[end] == '-' || text[end] == '+')) {
        ++end;
      }
      std::string_view number = text.substr(0, end);
      text.remove_prefix(end);
      const auto found = std::find_if(known.begin(), known.end(),
                                      [letter](const auto& one) { return one.first == letter; });
      if (found == known.end()) continue;
      if (!number.empty() && number.front() == '+') number.remove_prefix(1);
      double value = 0;
      const auto [stop, code] =
          std::from_chars(number.data(), number.data() + number.size(), value);
      if (code != std::errc() || stop != number.data() + number.size() ||
          !(std::abs(value) <= kMost_mm)) {
        return Fail(fmt::format("{}{:.40} is no number up to 1e6 mm", letter, number));
      }
      *found->second = value;
    }
    return words;
  }
};

Result<void> FootprintReader::Line(std::string_view line) {
  ++line_;
  const std::string_view statement = Statement(line);
  if (statement.empty()) return {};
  std::string_view rest;
  const std::string command = Command(statement, rest);
  auto done = Carry(command, rest);
  if (!done) return Fail(fmt::format("line {}: {}", line_, done.error().message));
  if (looked_at_ > kMostLooks) {
    return Fail(fmt::format("line {}: lays more filament so far than any print does", line_));
  }
  return {};
}

Result<void> FootprintReader::Carry(std::string_view command, std::string_view rest) {
  for (const Refused& refused : kRefused) {
    if (command != refused.command) continue;
    return Fail(fmt::format("{} {}: where the print lies cannot be told", command, refused.why));
  }
  if (command == "G90" || command == "G91") relative_ = command == "G91";
  if (command == "M82" || command == "M83") relative_e_ = command == "M83";
  if (command == "G28") x_mm_ = y_mm_ = z_mm_ = std::nullopt;
  if (command == "SAVE_GCODE_STATE" || command == "M120") return Save(NameOf(command, rest));
  if (command == "RESTORE_GCODE_STATE" || command == "M121") {
    return Restore(NameOf(command, rest), rest);
  }
  if (command == "SET_GCODE_OFFSET") {
    for (std::size_t at = 0; at + 1 < rest.size(); ++at) {
      const char axis = Upper(rest[at]);
      const bool begins = at == 0 || IsBlank(rest[at - 1]);
      if (!begins || (axis != 'X' && axis != 'Y')) continue;
      return Fail(fmt::format("{} shifts {}: where the print lies cannot be told", command, axis));
    }
  }
  const bool sets = command == "G92";
  const bool moves =
      command.size() == 2 && command[0] == 'G' && IsDigit(command[1]) && command[1] <= '3';
  if (!sets && !moves) return {};
  const auto words = Words::Read(rest);
  if (!words) return tl::unexpected(words.error());
  if (moves) return Move(*words, command[1] - '0');
  if ((words->x && words->x != x_mm_) || (words->y && words->y != y_mm_) ||
      (words->z && words->z != z_mm_)) {
    return Fail("G92 shifts the origin: where the print lies cannot be told");
  }
  if (words->e) e_mm_ = *words->e;
  return {};
}

Result<void> FootprintReader::Save(std::string name) {
  constexpr std::size_t kMostNames = 16;
  if (saved_.size() == kMostNames && !saved_.contains(name)) {
    return Fail(fmt::format("keeps more than {} states", kMostNames));
  }
  saved_[std::move(name)] = {relative_, relative_e_, e_mm_};
  return {};
}

Result<void> FootprintReader::Restore(const std::string& name, std::string_view rest) {
  const auto found = saved_.find(name);
  if (found == saved_.end()) return Fail("brings back a state that the file did not keep");
  std::string capitals;
  for (const char c : rest) capitals += Upper(c);
  const std::size_t move = capitals.find("MOVE=");
  if (move != std::string::npos && capitals.substr(move, 6) != "MOVE=0") {
    return Fail("moves to where a state was kept: where the print lies cannot be told");
  }
  std::tie(relative_, relative_e_, e_mm_) = found->second;
  return {};
}

Result<void> FootprintReader::Move(const Words& words, int kind) {
  const double fed_mm = !words.e ? 0 : relative_e_ ? *words.e : *words.e - e_mm_;
  if (words.e) e_mm_ = relative_e_ ? e_mm_ + *words.e : *words.e;
  const auto target = [this](const std::optional<double>& from, const std::optional<double>& word) {
    if (!word) return from;
    if (!relative_) return word;
    return from ? std::optional(*from + *word) : from;
  };
  const auto x_mm = target(x_mm_, words.x);
  const auto y_mm = target(y_mm_, words.y);
  const auto z_mm = target(z_mm_, words.z);
  const bool arc = kind >= 2;
  const bool along = words.x || words.y || arc;
  const bool lays = along && fed_mm > 0;
  const double to_z_mm = z_mm.value_or(0);
  const bool low = along && std::min(z_mm_.value_or(to_z_mm), to_z_mm) < low_mm_;
  if (lays && (!x_mm || !y_mm)) {
    return Fail("lays filament from a place that the file does not name");
  }
  if ((x_mm && std::abs(*x_mm) > kMost_mm) || (y_mm && std::abs(*y_mm) > kMost_mm)) {
    return Fail("moves further than 1e6 mm");
  }
  lays_ = lays_ || lays;
  if ((lays || low) && x_mm && y_mm) {
    if (arc && x_mm_ && y_mm_) {
      MarkArc(words, *x_mm, *y_mm, kind == 2);
    } else {
      looked_at_ += footprint_.Mark(x_mm_.value_or(*x_mm), y_mm_.value_or(*y_mm), *x_mm, *y_mm);
    }
  }
  x_mm_ = x_mm;
  y_mm_ = y_mm;
  z_mm_ = z_mm;
  return {};
}

void FootprintReader::MarkArc(const Words& words, double to_x_mm, double to_y_mm, bool clockwise) {
  constexpr double kChord_mm = 0.5;
  constexpr double kMostChords = 4096;  // half a mm of sagitta at 1e6 mm of radius
  double centre_x = *x_mm_ + words.i.value_or(0);
  double centre_y = *y_mm_ + words.j.value_or(0);
  const double dx = to_x_mm - *x_mm_;
  const double dy = to_y_mm - *y_mm_;
  if (words.r) {  // the shorter way round for R > 0, the longer for R < 0
    const double half = std::hypot(dx, dy) / 2;
    const double height = std::sqrt(std::max(0.0, *words.r * *words.r - half * half));
    const double side = (clockwise == (*words.r > 0) ? -1 : 1) / std::max(2 * half, 1e-9);
    centre_x = *x_mm_ + dx / 2 - side * height * dy;
    centre_y = *y_mm_ + dy / 2 + side * height * dx;
  }
  const double radius_mm = std::hypot(*x_mm_ - centre_x, *y_mm_ - centre_y);
  const double begin = std::atan2(*y_mm_ - centre_y, *x_mm_ - centre_x);
  double turn = std::atan2(to_y_mm - centre_y, to_x_mm - centre_x) - begin;
  if (dx == 0 && dy == 0) turn = 0;
  constexpr double kWhole = 2 * std::numbers::pi;
  if (clockwise && turn >= 0) turn -= kWhole;
  if (!clockwise && turn <= 0) turn += kWhole;
  const int chords = static_cast<int>(
      std::clamp(std::ceil(std::abs(turn) * radius_mm / kChord_mm), 1.0, kMostChords));
  double x = *x_mm_;
  double y = *y_mm_;
  for (int i = 1; i <= chords; ++i) {
    const bool last = i == chords;
    const double angle = begin + turn * i / chords;
    const double next_x = last ? to_x_mm : centre_x + radius_mm * std::cos(angle);
    const double next_y = last ? to_y_mm : centre_y + radius_mm * std::sin(angle);
    looked_at_ += footprint_.Mark(x, y, next_x, next_y);
    x = next_x;
    y = next_y;
  }
}

Result<Footprint> FootprintReader::Done() && {
  if (!lays_ || !footprint_.Bounds()) {
    return Fail("prints nothing on the plate: is it what a slicer exported for this printer?");
  }
  return std::move(footprint_);
}

}  // namespace trammel::gcode
