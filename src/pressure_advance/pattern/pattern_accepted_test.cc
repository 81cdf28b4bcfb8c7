// Each line of each file against the commands and parameters that its firmware documents: a list of
// its own, written from those sources and from no code of trammel.
#include <gtest/gtest.h>

#include <algorithm>
#include <charconv>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <unordered_set>
#include <vector>

#include "pressure_advance/pattern/pattern.h"
#include "settings/material.h"

namespace trammel::pressure_advance {
namespace {

using gcode::Dialect;

/// Parameters of a command. Klipper's extended commands have names, all others letters.
struct Accepted {
  std::set<std::string> numbers = {};  ///< each with a number
  std::set<std::string> flags = {};    ///< each without a value
  std::set<std::string> texts = {};    ///< each with a name
  bool text = false;                   ///< the rest of the line is text
};
using AcceptList = std::map<std::string, Accepted>;

const Accepted kMove{.numbers = {"X", "Y", "Z", "E", "F"}};
const Accepted kTarget{.numbers = {"S"}};

/// Commands with the same parameters in all five: RS-274's and the first RepRap's.
AcceptList Common() {
  return {{"G0", kMove},
          {"G1", kMove},
          {"G21", {}},
          {"G28", {}},
          {"G90", {}},
          {"M104", kTarget},
          {"M109", kTarget},
          {"M140", kTarget},
          {"M190", kTarget},
          {"M220", kTarget},
          {"M221", kTarget},
          {"M400", {}},
          {"G92", {.numbers = {"E"}}}};
}

AcceptList With(AcceptList more) {
  more.merge(Common());
  return more;
}

const AcceptList& AcceptedBy(Dialect dialect) {
  // Klipper, docs/G-Codes.md: G-code commands, [extruder], SET_VELOCITY_LIMIT, SAVE_GCODE_STATE,
  // [display_status]; klippy/extras/gcode_move.py: G21. The two macros are of klipper/trammel.cfg.
  static const AcceptList kKlipper = With(
      {{"M82", {}},
       {"M84", {}},
       {"M107", {}},
       {"M117", {.text = true}},
       {"SET_PRESSURE_ADVANCE", {.numbers = {"ADVANCE"}, .texts = {"EXTRUDER"}}},
       {"SET_VELOCITY_LIMIT", {.numbers = {"ACCEL", "MINIMUM_CRUISE_RATIO", "ACCEL_TO_DECEL"}}},
       {"SAVE_GCODE_STATE", {.texts = {"NAME"}}},
       {"RESTORE_GCODE_STATE", {.texts = {"NAME"}}},
       {"_TRAMMEL_KEEP_SETTINGS", {}},
       {"_TRAMMEL_BRING_BACK_SETTINGS", {}}});
  // Marlin, https://marlinfw.org/meta/gcode: a page a command.
  static const AcceptList kMarlin = With({{"M82", {}},
                                          {"M84", {}},
                                          {"M107", {}},
                                          {"M117", {.text = true}},
                                          {"M204", {.numbers = {"P", "T"}}},
                                          {"M900", {.numbers = {"K"}}}});
  // RepRapFirmware 3, https://docs.duet3d.com/User_manual/Reference/Gcodes and
  // src/GCodes/GCodes2.cpp: M107 and M109 are deprecated and carried out.
  static const AcceptList kRepRap = With({{"M82", {}},
                                          {"M84", {}},
                                          {"M107", {}},
                                          {"M117", {.text = true}},
                                          {"M120", {}},
                                          {"M121", {}},
                                          {"M204", {.numbers = {"P", "T"}}},
                                          {"M572", {.numbers = {"D", "S"}}}});
  // Prusa-Firmware-Buddy, lib/Marlin/Marlin/src/gcode: gcode.cpp, the comment of each command, and
  // feature/bedlevel/ubl/ubl_G29.cpp.
  static const AcceptList kPrusa = With({{"G29", {.numbers = {"P"}, .flags = {"A"}}},
                                         {"M17", {}},
                                         {"M82", {}},
                                         {"M84", {.flags = {"X", "Y", "E"}}},
                                         {"M107", {}},
                                         {"M117", {.text = true}},
                                         {"M204", {.numbers = {"P", "T"}}},
                                         {"M555", {.numbers = {"X", "Y", "W", "H"}}},
                                         {"M572", {.numbers = {"S"}}}});
  // BambuStudio, resources/profiles/BBL/machine/*machine_start_gcode.json and
  // *machine_end_gcode.json, and src/libslic3r/GCodeWriter.cpp: Bambu documents no commands.
  static const AcceptList kBambu = With({{"G29.2", kTarget},
                                         {"M83", {}},
                                         {"M106", kTarget},
                                         {"M204", kTarget},
                                         {"M900", {.numbers = {"K", "L", "M"}}},
                                         {"M975", kTarget}});
  switch (dialect) {
    case Dialect::kKlipper:
      return kKlipper;
    case Dialect::kMarlin:
      return kMarlin;
    case Dialect::kRepRapFirmware:
      return kRepRap;
    case Dialect::kPrusa:
      return kPrusa;
    case Dialect::kBambu:
      return kBambu;
  }
  throw std::logic_error("a dialect without a list");
}

std::optional<double> NumberOf(std::string_view text) {
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [read, error] = std::from_chars(text.data(), end, value, std::chars_format::fixed);
  return error == std::errc{} && read == end && !text.empty() ? std::optional(value) : std::nullopt;
}

struct Parameter {
  std::string name;
  std::string value;
};

struct Line {
  std::string command;
  std::vector<Parameter> parameters;
};

Line Split(const std::string& text) {
  Line line;
  std::istringstream in(text.substr(0, text.find(';')));
  in >> line.command;
  for (std::string word; in >> word;) {
    const std::size_t equals = word.find('=');
    line.parameters.push_back(equals == std::string::npos
                                  ? Parameter{word.substr(0, 1), word.substr(1)}
                                  : Parameter{word.substr(0, equals), word.substr(equals + 1)});
  }
  return line;
}

/// Returns the reason for which the firmware would not carry out a line; empty: it does.
std::string Objection(const Line& line, const AcceptList& list) {
  if (line.command.empty()) return "";
  const auto found = list.find(line.command);
  if (found == list.end()) return "no such command";
  const Accepted& accepted = found->second;
  if (accepted.text) return "";
  std::set<std::string> seen;
  for (const Parameter& parameter : line.parameters) {
    if (!seen.insert(parameter.name).second) return parameter.name + " twice";
    const bool number = accepted.numbers.contains(parameter.name) && NumberOf(parameter.value);
    const bool flag = accepted.flags.contains(parameter.name) && parameter.value.empty();
    const bool name = accepted.texts.contains(parameter.name) && !parameter.value.empty();
    if (!number && !flag && !name) return "no parameter " + parameter.name + parameter.value;
  }
  return "";
}

std::vector<std::string> LinesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

PatternConfig ConfigFor(Dialect dialect) {
  PatternConfig config;
  config.material = "petg";
  config.dialect = dialect;
  config.start_gcode = gcode::WordsOf(dialect).start_gcode;
  config.end_gcode = gcode::WordsOf(dialect).end_gcode;
  config.bed_size_x_mm = config.bed_size_y_mm = 300;
  return config;
}

/// Option with its values; each sets one or more settings.
using Choice = std::function<void(PatternConfig&)>;
using Option = std::vector<Choice>;

void Nothing(PatternConfig& /*config*/) {}

std::vector<Option> Options() {
  return {
      {[](PatternConfig& c) { ApplyPreset(PatternPreset::kQuick, c); },
       [](PatternConfig& c) { ApplyPreset(PatternPreset::kPhoto, c); }, Nothing},
      {Nothing, [](PatternConfig& c) { c.finish = Finish::kIdle; }},
      {Nothing,
       [](PatternConfig& c) {
         c.restore_pressure_advance_s = 0.031;
         c.restore_acceleration_mm_s2 = 1234.5;
       }},
      {Nothing,
       [](PatternConfig& c) {
         c.columns = 2;
         c.conditions = {{80, 3000}, {100, 4000}};
       }},
      {Nothing,
       [](PatternConfig& c) {
         c.retract_length_mm = c.prime_length_mm = c.z_hop_mm = 0;
         c.frame_loops = std::min(c.frame_loops, c.corner_mark ? 1 : 0);
       }},
      {Nothing, [](PatternConfig& c) { c.start_gcode = "G28\n"; },
       [](PatternConfig& c) { c.bed_temperature_c = 0; }},
      {Nothing,
       [](PatternConfig& c) {
         c.bed_origin_x_mm = c.bed_origin_y_mm = -150;  // negative coordinates
         c.z_offset_mm = -0.05;
         c.frame_pressure_advance_s = 0.02;
         c.extruder_drive = 3;
         c.advance_motors = {"extruder", "belted"};
       }},
  };
}

/// Calls `visit` with every combination of the options.
void ForEach(std::span<const Option> options, const PatternConfig& config,
             const std::function<void(const PatternConfig&)>& visit) {
  if (options.empty()) return visit(config);
  for (const Choice& choice : options.front()) {
    PatternConfig next = config;
    choice(next);
    ForEach(options.subspan(1), next, visit);
  }
}

TEST(PatternAccepted, EveryLineOfEveryFileIsACommandOfItsFirmware) {
  const std::vector<Option> options = Options();
  for (const gcode::FirmwareWords& words : gcode::Firmwares()) {
    const AcceptList& list = AcceptedBy(words.dialect);
    std::set<std::string> objections;
    std::unordered_set<std::string> seen;
    int files = 0;
    ForEach(options, ConfigFor(words.dialect), [&](const PatternConfig& config) {
      const auto problem = FindProblem(config);
      ASSERT_FALSE(problem) << words.name << ": " << problem->key << ": " << problem->message;
      ++files;
      for (const std::string& text : LinesOf(WriteGcode(LayOut(config), config))) {
        if (!seen.insert(text).second) continue;
        const std::string objection = Objection(Split(text), list);
        if (!objection.empty()) objections.insert(text + ": " + objection);
      }
    });
    EXPECT_EQ(files, 288) << words.name;
    for (const std::string& objection : objections)
      ADD_FAILURE() << words.name << ": " << objection;
  }
}

TEST(PatternAccepted, TheListsRefuseWhatAnotherFirmwareHas) {
  const auto refuses = [](Dialect dialect, const char* line) {
    return !Objection(Split(line), AcceptedBy(dialect)).empty();
  };
  EXPECT_TRUE(refuses(Dialect::kPrusa, "M572 D0 S0.04"));
  EXPECT_TRUE(refuses(Dialect::kPrusa, "M120"));
  EXPECT_TRUE(refuses(Dialect::kMarlin, "M900 K0.04 L1000 M10"));
  EXPECT_TRUE(refuses(Dialect::kMarlin, "M900 K"));
  EXPECT_TRUE(refuses(Dialect::kMarlin, "SET_PRESSURE_ADVANCE ADVANCE=0.04"));
  EXPECT_TRUE(refuses(Dialect::kBambu, "M117 PA 0.04"));
  EXPECT_TRUE(refuses(Dialect::kBambu, "G1 X1e3"));
  EXPECT_TRUE(refuses(Dialect::kKlipper, "M900 K0.04"));
  EXPECT_FALSE(refuses(Dialect::kBambu, "M900 K0.04 L1000 M10 ; note"));
}

TEST(PatternAccepted, NothingHeatsButToAStatedTemperatureAndAllIsOffAtTheEnd) {
  for (const gcode::FirmwareWords& words : gcode::Firmwares()) {
    const PatternConfig config = ConfigFor(words.dialect);
    const auto stated = settings::TemperaturesOf(config);
    std::map<std::string, double> target;  // nozzle and bed, as of the last command
    bool waited_nozzle = false, homed = false;
    for (const std::string& text : LinesOf(WriteGcode(LayOut(config), config))) {
      const Line line = Split(text);
      homed = homed || line.command == "G28";
      const bool nozzle = line.command == "M104" || line.command == "M109";
      if (nozzle || line.command == "M140" || line.command == "M190") {
        const double value_c = NumberOf(line.parameters.at(0).value).value();
        const std::set<double> allowed = nozzle
                                             ? std::set{0.0, stated.idle_nozzle_c, stated.nozzle_c}
                                             : std::set{0.0, stated.bed_c};
        EXPECT_TRUE(allowed.contains(value_c)) << words.name << ": " << text;
        target[nozzle ? "nozzle" : "bed"] = value_c;
        waited_nozzle =
            waited_nozzle || (line.command == "M109" && value_c == stated.nozzle_c && homed);
      }
      const bool extrudes = line.command == "G1" && text.find(" E") != std::string::npos;
      EXPECT_TRUE(!extrudes || waited_nozzle) << words.name << ": " << text;
    }
    EXPECT_EQ(target, (std::map<std::string, double>{{"nozzle", 0}, {"bed", 0}})) << words.name;
  }
}

// Bambu's profiles exclude the bed's front left 18 x 28 mm: the head would press its cutter.
TEST(PatternAccepted, NoMoveOfABambuEntersTheCornerOfItsCutter) {
  for (const std::string& text :
       LinesOf(WriteGcode(LayOut(ConfigFor(Dialect::kBambu)), ConfigFor(Dialect::kBambu)))) {
    const Line line = Split(text);
    if (line.command != "G0" && line.command != "G1") continue;
    for (const Parameter& parameter : line.parameters) {
      if (parameter.name == "X") EXPECT_GT(NumberOf(parameter.value).value(), 18) << text;
    }
  }
}

/// Filament that a file drives forwards, less that drawn back, as its firmware counts it.
double FilamentOf_mm(const std::string& gcode) {
  double sum_mm = 0, e_mm = 0;
  bool relative = false;
  for (const std::string& text : LinesOf(gcode)) {
    const Line line = Split(text);
    if (line.command == "M83") relative = true;
    if (line.command == "M82") relative = false;
    if (line.command != "G1") continue;
    for (const Parameter& parameter : line.parameters) {
      if (parameter.name != "E") continue;
      const double value_mm = NumberOf(parameter.value).value();
      sum_mm += relative ? value_mm : value_mm - e_mm;
      e_mm = value_mm;
    }
  }
  return sum_mm;
}

TEST(PatternAccepted, RelativeFilamentDoesNotDrift) {
  PatternConfig config = ConfigFor(Dialect::kBambu);
  config.columns = config.rows = 3;
  const PatternLayout layout = LayOut(config);
  constexpr double kLastDigit_mm = 1e-5;
  EXPECT_NEAR(FilamentOf_mm(WriteGcode(layout, config)), Summarise(layout, config).filament_mm,
              kLastDigit_mm);
}

}  // namespace
}  // namespace trammel::pressure_advance
