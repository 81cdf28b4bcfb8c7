#include "gcode/footprint_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <utility>

namespace trammel::gcode {
namespace {

constexpr double kMost_mm = 1e6;
constexpr std::string_view kLengths = "XYZEIJR";   // letters of a move
constexpr std::size_t kMostLooks = 1'000'000'000;  // hundreds of km of beads

char Upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; }

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

bool IsBlank(char c) { return c == ' ' || c == '\t'; }

std::string_view Trimmed(std::string_view text) {
  while (!text.empty() && IsBlank(text.front())) text.remove_prefix(1);
  while (!text.empty() && IsBlank(text.back())) text.remove_suffix(1);
  return text;
}

std::string Capitals(std::string_view text) {
  std::string capitals(text);
  std::transform(text.begin(), text.end(), capitals.begin(), Upper);
  return capitals;
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

// "G1" of "G01 X5", "g1x5" and "G 1 X5"; empty where a statement begins otherwise.
std::string ShortCommand(std::string_view statement, std::string_view& rest) {
  const char letter = Upper(statement.front());
  std::string_view behind = Trimmed(statement.substr(1));
  if (behind.empty() || !IsDigit(behind.front())) return "";
  std::size_t end = 0;
  while (end < behind.size() && (IsDigit(behind[end]) || behind[end] == '.')) ++end;
  rest = Trimmed(behind.substr(end));
  std::string_view number = behind.substr(0, end);
  while (number.size() > 1 && number.front() == '0' && IsDigit(number[1])) number.remove_prefix(1);
  return letter + std::string(number);
}

// The value of "NAME=value" behind one of Klipper's long commands, in capitals.
std::optional<std::string> Parameter(std::string_view rest, std::string_view name) {
  while (!(rest = Trimmed(rest)).empty()) {
    const std::string_view word = rest.substr(0, rest.find_first_of(" \t"));
    const std::size_t equals = word.find('=');
    if (equals != word.npos && Capitals(word.substr(0, equals)) == name) {
      return Capitals(word.substr(equals + 1));
    }
    rest.remove_prefix(word.size());
  }
  return std::nullopt;
}

// Whether a parameter is a number other than 0, or none.
bool Differs(const std::optional<std::string>& parameter, double from_0 = 0) {
  if (!parameter) return false;
  double value = 0;
  const auto [stop, code] =
      std::from_chars(parameter->data(), parameter->data() + parameter->size(), value);
  return code != std::errc() || stop != parameter->data() + parameter->size() ||
         !(std::abs(value) <= from_0);
}

// Behind these nobody can tell where a print lies: where one of the letters stands behind them, or
// in any case.
struct Refused {
  std::string_view command, letters, why;
};
constexpr std::array kRefused = {
    Refused{"G5", "", "lays splines, which are not read"},
    Refused{"G10", "L", "shifts the origin"},
    Refused{"G20", "", "counts in inches"},
    Refused{"G53", "", "moves in other coordinates"},
    Refused{"G54", "", "chooses other coordinates"},
    Refused{"G55", "", "chooses other coordinates"},
    Refused{"G56", "", "chooses other coordinates"},
    Refused{"G57", "", "chooses other coordinates"},
    Refused{"G58", "", "chooses other coordinates"},
    Refused{"G59", "", "chooses other coordinates"},
    Refused{"G61", "", "moves to a place that was kept"},
    Refused{"G68", "", "turns the coordinates"},
    Refused{"G92.1", "", "shifts the origin"},
    Refused{"M206", "XY", "shifts the origin"},
    Refused{"M290", "XY", "shifts the origin"},
};

// How the long commands begin that leave the nozzle where it is, in Klipper and what comes with it.
constexpr std::array<std::string_view, 12> kStaying = {
    "SET_",         "SAVE_",          "RESTORE_",          "EXCLUDE_OBJECT",
    "RESPOND",      "BED_MESH_CLEAR", "BED_MESH_PROFILE",  "TEMPERATURE_WAIT",
    "SKEW_PROFILE", "PRINT_STATS_",   "ACTIVATE_EXTRUDER", "UPDATE_DELAYED_GCODE"};

bool MayMove(std::string_view command) {
  return std::none_of(kStaying.begin(), kStaying.end(),
                      [&](std::string_view begin) { return command.starts_with(begin); });
}

tl::unexpected<Error> CannotTell(std::string_view command, std::string_view why) {
  return Fail(fmt::format("{} {}: where the print lies cannot be told", command, why));
}

}  // namespace

/// The numbers behind a command's letters.
struct FootprintReader::Words {
  std::array<std::optional<double>, 26> numbers;
  std::string bare;             // letters without a number
  bool command_behind = false;  // another one, as RepRapFirmware takes them

  [[nodiscard]] const std::optional<double>& operator[](char letter) const {
    return numbers[static_cast<std::size_t>(letter - 'A')];
  }
  [[nodiscard]] bool Named(char letter) const {
    return (*this)[letter] || bare.find(letter) != std::string::npos;
  }
  [[nodiscard]] bool Any(std::string_view letters) const {
    return std::any_of(letters.begin(), letters.end(),
                       [this](char letter) { return (*this)[letter].has_value(); });
  }

  static Result<Words> Read(std::string_view text) {
    Words words;
    while (!(text = Trimmed(text)).empty()) {
      if (text.front() == '(') {  // a comment
        text.remove_prefix(std::min(text.find(')'), text.size() - 1) + 1);
        continue;
      }
      const char letter = Upper(text.front());
      text = Trimmed(text.substr(1));
      if (text.starts_with(':')) text.remove_prefix(1);
      std::size_t end = 0;
      while (end < text.size() &&
             (IsDigit(text[end]) || text[end] == '.' || text[end] == '-' || text[end] == '+')) {
        ++end;
      }
      std::string_view number = text.substr(0, end);
      text.remove_prefix(end);
      if (letter < 'A' || letter > 'Z') continue;
      if (number.empty()) {
        if (words.bare.find(letter) == std::string::npos) words.bare += letter;
        continue;
      }
      words.command_behind = words.command_behind || letter == 'G' || letter == 'M';
      if (number.front() == '+') number.remove_prefix(1);
      double value = 0;
      const auto [stop, code] =
          std::from_chars(number.data(), number.data() + number.size(), value);
      const bool sound = code == std::errc() && stop == number.data() + number.size() &&
                         std::abs(value) <= kMost_mm;
      if (!sound && kLengths.find(letter) != kLengths.npos) {
        return Fail(fmt::format("{}{:.40} is no number up to 1e6 mm", letter, number));
      }
      if (sound) words.numbers[static_cast<std::size_t>(letter - 'A')] = value;
    }
    return words;
  }
};

Result<void> FootprintReader::Line(std::string_view line) {
  ++line_;
  while (!line.empty()) {  // some firmwares take a carriage return for an end
    const std::size_t end = line.find('\r');
    const std::string_view statement = Statement(line.substr(0, end));
    line.remove_prefix(end == line.npos ? line.size() : end + 1);
    if (statement.empty()) continue;
    auto done = Carry(statement);
    if (!done) return Fail(fmt::format("line {}: {}", line_, done.error().message));
  }
  if (looked_at_ > kMostLooks) {
    return Fail(fmt::format("line {}: lays more filament so far than any print does", line_));
  }
  return {};
}

Result<void> FootprintReader::Carry(std::string_view statement) {
  std::string_view rest;
  const std::string command = ShortCommand(statement, rest);
  if (command.empty()) {
    const std::size_t end = std::min(statement.find_first_of(" \t"), statement.size());
    return CarryLong(Capitals(statement.substr(0, end)), Trimmed(statement.substr(end)));
  }
  const char letter = command.front();
  if (letter != 'G' && letter != 'M') {
    constexpr std::string_view kMove = "XYZE";
    if (kMove.find(letter) == kMove.npos) return {};  // a tool, a feed rate
    return CannotTell(command, "stands without a command");
  }
  const bool of_a_text = command == "M117" || command == "M118" || command == "M486";
  if (of_a_text || (letter == 'M' && command.size() > 4)) return {};
  auto words = Words::Read(rest);
  if (letter == 'M' && !words) return {};  // whose letters are no lengths
  if (!words) return tl::unexpected(words.error());
  for (const Refused& refused : kRefused) {
    if (command == refused.command && (refused.letters.empty() || words->Any(refused.letters))) {
      return CannotTell(command, refused.why);
    }
  }
  if (letter == 'G' && words->command_behind) {
    return CannotTell(command, "has another command in its line");
  }
  if (command.size() == 2 && letter == 'G' && command[1] <= '3') {
    return Move(*words, command[1] - '0');
  }
  if (command == "G17" || command == "G18" || command == "G19") plane_xy_ = command == "G17";
  if (command == "G90" || command == "G91") modes_.relative = command == "G91";
  if (command == "M82" || command == "M83") modes_.relative_e = command == "M83";
  if (command == "G28") {
    const bool all = !words->Named('X') && !words->Named('Y') && !words->Named('Z');
    if (all || words->Named('X')) x_mm_ = std::nullopt;
    if (all || words->Named('Y')) y_mm_ = std::nullopt;
    if (all || words->Named('Z')) z_mm_ = 0;
  }
  if (command == "G30" && (*words)['X'] && (*words)['Y']) {  // probes there
    looked_at_ += footprint_.Mark(*(*words)['X'], *(*words)['Y'], *(*words)['X'], *(*words)['Y']);
  }
  if (command == "G92") return SetPlace(*words);
  if (command == "M605" && (*words)['S'].value_or(2) > 1) {
    return CannotTell(command, "may print copies elsewhere");
  }
  constexpr std::size_t kMostPushed = 64;
  if (command == "M120" && pushed_.size() < kMostPushed) pushed_.push_back(modes_);
  if (command == "M121" && !pushed_.empty()) {
    modes_ = pushed_.back();
    pushed_.pop_back();
  }
  return {};
}

Result<void> FootprintReader::CarryLong(std::string_view command, std::string_view rest) {
  if (!lays_ && MayMove(command)) {  // a macro of the print's beginning; later ones hand it back
    x_mm_ = y_mm_ = std::nullopt;
    z_mm_ = 0;
  }
  if (command == "SET_KINEMATIC_POSITION") return CannotTell(command, "shifts the origin");
  if (command == "SET_DUAL_CARRIAGE") {
    if (Parameter(rest, "MODE").value_or("PRIMARY") == "PRIMARY") return {};
    return CannotTell(command, "may print copies elsewhere");
  }
  if (command == "SET_GCODE_OFFSET") {
    constexpr double kMostZ_mm = 0.5;  // a first layer's; less than what is called low leaves over
    for (const char* axis : {"X", "Y", "X_ADJUST", "Y_ADJUST"}) {
      if (Differs(Parameter(rest, axis))) return CannotTell(command, "shifts the origin");
    }
    for (const char* axis : {"Z", "Z_ADJUST"}) {
      if (Differs(Parameter(rest, axis), kMostZ_mm)) {
        return CannotTell(command, "shifts the height by more than 0.5 mm");
      }
    }
  }
  if (command == "SAVE_GCODE_STATE") {
    constexpr std::size_t kMostNames = 256;
    const std::string name = Parameter(rest, "NAME").value_or("");
    if (named_.size() == kMostNames && !named_.contains(name)) {
      return Fail(fmt::format("keeps more than {} states", kMostNames));
    }
    named_[name] = modes_;
  }
  return command == "RESTORE_GCODE_STATE" ? Restore(rest) : Result<void>();
}

Result<void> FootprintReader::Restore(std::string_view rest) {
  const auto found = named_.find(Parameter(rest, "NAME").value_or(""));
  if (found == named_.end()) {
    return CannotTell("RESTORE_GCODE_STATE", "brings back a state that the file did not keep");
  }
  if (Differs(Parameter(rest, "MOVE"))) {
    return CannotTell("RESTORE_GCODE_STATE", "moves to where the state was kept");
  }
  modes_ = found->second;
  return {};
}

Result<void> FootprintReader::SetPlace(const Words& words) {
  const bool same = (!words['X'] || words['X'] == x_mm_) && (!words['Y'] || words['Y'] == y_mm_) &&
                    (!words['Z'] || words['Z'] == z_mm_);
  if (!same || !(words.Any("XYZ") || words.Named('E'))) {
    return CannotTell("G92", "shifts the origin");
  }
  if (words.Named('E')) modes_.e_mm = words['E'].value_or(0);
  return {};
}

std::optional<double> FootprintReader::Target(std::optional<double> from,
                                              std::optional<double> word) const {
  if (!word) return from;
  if (!modes_.relative) return word;
  return from ? std::optional(*from + *word) : std::nullopt;
}

Result<void> FootprintReader::Move(const Words& words, int kind) {
  for (const char letter : words.bare) {
    if (kLengths.find(letter) != kLengths.npos)
      return Fail(fmt::format("{} has no number", letter));
  }
  const std::optional<double>& e = words['E'];
  const double fed_mm = !e ? 0 : modes_.relative_e ? *e : *e - modes_.e_mm;
  if (e) modes_.e_mm = modes_.relative_e ? modes_.e_mm + *e : *e;
  const auto x_mm = Target(x_mm_, words['X']);
  const auto y_mm = Target(y_mm_, words['Y']);
  const double z_mm = Target(z_mm_, words['Z']).value_or(0);
  if (std::max({std::abs(x_mm.value_or(0)), std::abs(y_mm.value_or(0)), std::abs(z_mm)}) >
      kMost_mm) {
    return Fail("moves further than 1e6 mm");
  }
  const bool arc = kind >= 2;
  const bool lays = fed_mm > 0 && (words.Any("XY") || arc);
  if (lays && (!x_mm || !y_mm)) {
    return Fail("lays filament at a place that the file does not name");
  }
  if (arc && !plane_xy_) return Fail("lies on an arc that stands upright, which is not read");
  lays_ = lays_ || lays;
  if ((lays || std::min(z_mm_, z_mm) < low_mm_) && x_mm && y_mm) {
    if (arc && x_mm_ && y_mm_) {
      MarkArc(words, *x_mm, *y_mm, kind == 2);
    } else {
      Mark(*x_mm, *y_mm);
    }
  }
  x_mm_ = x_mm;
  y_mm_ = y_mm;
  z_mm_ = z_mm;
  return {};
}

void FootprintReader::Mark(double to_x_mm, double to_y_mm) {
  if (x_mm_ && y_mm_) {
    looked_at_ += footprint_.Mark(*x_mm_, *y_mm_, to_x_mm, to_y_mm);
    return;
  }
  // From anywhere at two edges, or where one coordinate is known, from there.
  constexpr double kStep_mm = 1;
  const double front_mm = y_mm_.value_or(plate_.min_y_mm);
  const double left_mm = x_mm_.value_or(plate_.min_x_mm);
  for (double x = plate_.min_x_mm; !x_mm_ && x <= plate_.max_x_mm; x += kStep_mm) {
    looked_at_ += footprint_.Mark(x, front_mm, to_x_mm, to_y_mm);
  }
  for (double y = plate_.min_y_mm; !y_mm_ && y <= plate_.max_y_mm; y += kStep_mm) {
    looked_at_ += footprint_.Mark(left_mm, y, to_x_mm, to_y_mm);
  }
}

void FootprintReader::MarkArc(const Words& words, double to_x_mm, double to_y_mm, bool clockwise) {
  constexpr double kChord_mm = 0.5;
  constexpr double kMostChords = 4096;  // half a mm of sagitta at 1e6 mm of radius
  constexpr std::size_t kLooksPerChord = 16;
  double centre_x = *x_mm_ + words['I'].value_or(0);
  double centre_y = *y_mm_ + words['J'].value_or(0);
  const double dx = to_x_mm - *x_mm_;
  const double dy = to_y_mm - *y_mm_;
  if (const auto& r = words['R']) {  // the shorter way round for R > 0, the longer for R < 0
    const double half = std::hypot(dx, dy) / 2;
    const double height = std::sqrt(std::max(0.0, *r * *r - half * half));
    const double side = (clockwise == (*r > 0) ? -1 : 1) / std::max(2 * half, 1e-9);
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
    looked_at_ += footprint_.Mark(x, y, next_x, next_y) + kLooksPerChord;
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
