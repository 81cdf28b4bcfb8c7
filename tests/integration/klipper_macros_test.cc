// klipper/trammel.cfg and trammel_laser.cfg against themselves and against the settings that name
// its macros.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "settings/scan_settings.h"
#include "support/matchers.h"

namespace trammel {
namespace {

constexpr const char* kAll = "trammel.cfg";
constexpr const char* kLaser = "trammel_laser.cfg";

/// Adds the text of each section, by its header, without comments. Examples in comments are not
/// there.
void ReadSections(const std::string& name, std::map<std::string, std::string>& sections) {
  std::ifstream file(TRAMMEL_KLIPPER_FOLDER + name);
  EXPECT_TRUE(file) << name;
  std::string header;
  for (std::string line; std::getline(file, line);) {
    line = line.substr(0, line.find('#'));  // like Klipper, at any position
    if (line.starts_with('[')) {
      header = line.substr(1, line.find(']') - 1);
      EXPECT_FALSE(sections.contains(header)) << header << " stands twice";
      sections[header] = "";
    } else if (!header.empty()) {
      sections[header] += line + '\n';
    }
  }
}

std::map<std::string, std::string> ReadSections() {
  std::map<std::string, std::string> sections;
  ReadSections(kAll, sections);
  ReadSections(kLaser, sections);
  return sections;
}

/// Returns the word after each occurrence of `prefix`.
std::vector<std::string> TextsAfter(const std::string& text, const std::string& prefix) {
  std::vector<std::string> words;
  const std::regex pattern(prefix + "([A-Za-z0-9_]+)");
  for (std::sregex_iterator it(text.begin(), text.end(), pattern), end; it != end; ++it) {
    words.push_back((*it)[1]);
  }
  return words;
}

TEST(KlipperMacros, EveryNameThatAMacroUsesIsDefined) {
  const auto sections = ReadSections();
  const std::string& limits = sections.at("gcode_macro _TRAMMEL_LIMITS");
  std::size_t uses = 0;
  for (const auto& [header, text] : sections) {
    for (const std::string& id : TextsAfter(text, "UPDATE_DELAYED_GCODE ID=")) {
      EXPECT_TRUE(sections.contains("delayed_gcode " + id)) << header << " uses " << id;
      ++uses;
    }
    for (const std::string& pin : TextsAfter(text, "SET_PIN PIN=")) {
      EXPECT_TRUE(sections.contains("output_pin " + pin)) << header << " uses " << pin;
      ++uses;
    }
    for (const std::string& macro : TextsAfter(text, "SET_GCODE_VARIABLE MACRO=")) {
      EXPECT_TRUE(sections.contains("gcode_macro " + macro)) << header << " uses " << macro;
      ++uses;
    }
    for (const std::string& name : TextsAfter(text, "_TRAMMEL_LIMITS\"\\]\\.")) {
      EXPECT_THAT(limits, testing::HasSubstr("variable_" + name + ":")) << header;
      ++uses;
    }
    for (const std::string& name : TextsAfter(text, "\\n *(?=LASER_|_?TRAMMEL_)")) {
      EXPECT_TRUE(sections.contains("gcode_macro " + name)) << header << " calls " << name;
      ++uses;
    }
  }
  EXPECT_GE(uses, 15U);
}

// A section that names no pin would keep Klipper from starting.
TEST(KlipperMacros, APrinterWithoutALaserNeedsNothingOfTheLasers) {
  std::map<std::string, std::string> sections;
  ReadSections(kAll, sections);
  const std::regex guarded(
      "\\{% if \"gcode_macro LASER_OFF\" in printer %\\}\\s*LASER_OFF\\s*\\{% endif %\\}");
  for (const auto& [header, text] : sections) {
    EXPECT_FALSE(header.starts_with("output_pin")) << header;
    const std::string rest = std::regex_replace(text, guarded, "");
    EXPECT_THAT(TextsAfter(rest, "\\n *(?=LASER_)"), testing::IsEmpty()) << header;
    EXPECT_THAT(TextsAfter(rest, "ID=(?=_trammel_laser)"), testing::IsEmpty()) << header;
  }
}

TEST(KlipperMacros, TheDefaultsOfTheScanAreAmongThem) {
  const auto sections = ReadSections();
  const settings::ScanSettings defaults;
  EXPECT_TRUE(sections.contains("gcode_macro " + defaults.laser_on_gcode));
  EXPECT_TRUE(sections.contains("gcode_macro " + defaults.laser_off_gcode));
}

TEST(KlipperMacros, TheLaserIsLimitedBeforeItIsOnAndOffWhereTheBoardShutsDown) {
  const auto sections = ReadSections();
  const std::string& on = sections.at("gcode_macro _LASER_ON");
  EXPECT_LT(on.find("UPDATE_DELAYED_GCODE ID=_trammel_laser_limit"), on.find("SET_PIN"));
  for (const auto& [header, text] : sections) {
    const bool switches_on = text.find("PIN=trammel_laser VALUE=1") != std::string::npos;
    EXPECT_EQ(switches_on, header == "gcode_macro _LASER_ON") << header;
  }
  EXPECT_THAT(sections.at("delayed_gcode _trammel_laser_limit"),
              testing::HasSubstr("SET_PIN PIN=trammel_laser VALUE=0"));
  const std::string& pin = sections.at("output_pin trammel_laser");
  EXPECT_THAT(pin, Containing("\nshutdown_value: 0", "\nvalue: 0"));
}

TEST(KlipperMacros, TheHeatersLimitSwitchesLaserAndHeatersOff) {
  const std::string limit = ReadSections().at("delayed_gcode _trammel_heater_limit");
  EXPECT_THAT(limit, Containing("LASER_OFF\n", "TURN_OFF_HEATERS\n"));
}

TEST(KlipperMacros, WhatAPrintThatEndsEarlyChangedComesBack) {
  const auto sections = ReadSections();
  EXPECT_THAT(sections.at("gcode_macro _TRAMMEL_KEEP_SETTINGS"),
              testing::HasSubstr("UPDATE_DELAYED_GCODE ID=_trammel_print_ended DURATION=2"));
  const std::string& ended = sections.at("delayed_gcode _trammel_print_ended");
  const auto again = ended.find("UPDATE_DELAYED_GCODE ID=_trammel_print_ended DURATION=2");
  const auto back = ended.find("_TRAMMEL_BRING_BACK_SETTINGS");
  EXPECT_LT(ended.find("in (\"printing\", \"paused\")"), again);
  EXPECT_LT(again, ended.find("{% else %}"));
  ASSERT_NE(back, std::string::npos);
  EXPECT_LT(ended.find("{% else %}"), back);
}

TEST(KlipperMacros, ATapRisesSlowlyBehindTheProbeAndAsksWhenItIsDone) {
  const auto sections = ReadSections();
  const std::string& tap = sections.at("gcode_macro _TRAMMEL_TAP");
  // One PROBE leaves one tap: several samples would lift the nozzle in between.
  // A Klipper whose probe lifts by itself rises slowly, too.
  EXPECT_THAT(tap, testing::HasSubstr("PROBE {rawparams} SAMPLES=1 SAMPLE_RETRACT_DIST={rise} "
                                      "LIFT_SPEED={speed}\n"));
  EXPECT_LT(tap.find("PROBE {"), tap.find("_TRAMMEL_TAP_RISE"));
  EXPECT_LT(tap.find("_TRAMMEL_TAP_RISE"), tap.find("_TRAMMEL_TAP_ASK SINCE="));
  const std::string& rise = sections.at("gcode_macro _TRAMMEL_TAP_RISE");
  std::size_t at = 0;
  for (const char* line : {"SAVE_GCODE_STATE NAME=_trammel_tap\n", "M220 S100\n", "G91\n",
                           "G1 Z{rise} F{speed * 60}\n", "G4 P", "G1 Z{lift} ",
                           "RESTORE_GCODE_STATE NAME=_trammel_tap\n", "M400\n"}) {
    const std::size_t next = rise.find(line, at);
    ASSERT_NE(next, std::string::npos) << line;
    at = next + 1;
  }
  // Less than what is taken for a lift.
  EXPECT_THAT(tap, testing::HasSubstr("rise = [0.9, [0.02, "));
}

TEST(KlipperMacros, ThePrinterBelongsToOneRunUntilItIsReleasedOrItsLimitIsReached) {
  const auto sections = ReadSections();
  const std::string& alive = sections.at("gcode_macro _TRAMMEL_KEEP_ALIVE");
  EXPECT_LT(alive.find("action_raise_error"), alive.find("SET_GCODE_VARIABLE"));
  const std::string free = "SET_GCODE_VARIABLE MACRO=_TRAMMEL_RUN VARIABLE=owner VALUE=\"''\"";
  EXPECT_THAT(sections.at("gcode_macro _TRAMMEL_RELEASE"), testing::HasSubstr(free));
  EXPECT_THAT(sections.at("delayed_gcode _trammel_heater_limit"), testing::HasSubstr(free));
}

// A macro that calls trammel is refused during a print, and reports a missing answer.
TEST(KlipperMacros, WhoeverAsksLooksForAPrintFirstAndWaitsForAnAnswer) {
  const auto sections = ReadSections();
  for (const char* name : {"TRAMMEL_PA", "TRAMMEL_PA_PATTERN", "_TRAMMEL_START", "TRAMMEL_PA_PHOTO",
                           "TRAMMEL_OFFSET", "TRAMMEL_OFFSET_SCAN"}) {
    const std::string& text = sections.at(std::string("gcode_macro ") + name);
    const std::size_t asks = text.find("action_call_remote_method");
    ASSERT_NE(asks, std::string::npos) << name;
    EXPECT_LT(text.find("if state in (\"printing\", \"paused\")"), asks) << name;
    EXPECT_LT(text.find("action_raise_error"), asks) << name;
    EXPECT_GT(text.find("ID=_trammel_no_answer DURATION={"), asks) << name;
  }
}

TEST(KlipperMacros, TheButtonsOfADialogCallMacrosAndHandOnWhatTheyWereGiven) {
  const auto sections = ReadSections();
  const std::string& ask = sections.at("gcode_macro TRAMMEL_ASK");
  const auto called = TextsAfter(ask, "prompt_footer_button [A-Za-z ]+\\|");
  EXPECT_GE(called.size(), 13U);
  for (const std::string& macro : called) {
    EXPECT_TRUE(sections.contains("gcode_macro " + macro)) << macro;
  }
  EXPECT_THAT(called, testing::IsSupersetOf({"_TRAMMEL_START", "TRAMMEL_OFFSET_SCAN"}));
  EXPECT_THAT(ask, testing::HasSubstr("\"TOKEN\""));
  EXPECT_THAT(sections.at("gcode_macro _TRAMMEL_START"), testing::HasSubstr("token=params.TOKEN"));
}

/// The macros that a macro calls, and what those call.
std::set<std::string> Called(const std::map<std::string, std::string>& sections,
                             const std::string& macro, std::set<std::string> known = {}) {
  for (const std::string& name :
       TextsAfter(sections.at("gcode_macro " + macro), "\\n *(?=_?[A-Z])")) {
    if (!sections.contains("gcode_macro " + name) || !known.insert(name).second) continue;
    known.merge(Called(sections, name, known));
  }
  return known;
}

// Front ends make a button of each macro whose name does not begin with "_".
TEST(KlipperMacros, WhatIsAButtonNeitherHeatsNorMovesNorLightsNorBeginsAJobNorTakesThePrinter) {
  const auto sections = ReadSections();
  const std::regex acts(
      "\\n *(G0|G1|G2|G3|G28|PROBE|M104|M109|M140|M190|SET_HEATER_TEMPERATURE|TEMPERATURE_WAIT|"
      "MANUAL_STEPPER|FORCE_MOVE|SET_PIN [^\\n]*VALUE=[^0\\n]|"
      "UPDATE_DELAYED_GCODE ID=_trammel_heater_limit|SET_GCODE_VARIABLE MACRO=_TRAMMEL_RUN)");
  std::size_t buttons = 0;
  for (const auto& [header, text] : sections) {
    const std::string kind = "gcode_macro ";
    if (!header.starts_with(kind) || header[kind.size()] == '_') continue;
    ++buttons;
    const std::string name = header.substr(kind.size());
    std::set<std::string> all = Called(sections, name);
    all.insert(name);
    for (const std::string& each : all) {
      const std::string& body = sections.at(kind + each);
      EXPECT_FALSE(std::regex_search(body, acts)) << name << " by " << each;
      EXPECT_THAT(body, testing::Not(testing::HasSubstr("\"trammel_start\""))) << name;
    }
    // A run's limit goes with its release.
    EXPECT_FALSE(all.contains("_TRAMMEL_RELEASE")) << name;
  }
  EXPECT_GE(buttons, 15U);
  for (const char* old : {"TRAMMEL_CALIBRATE_PRESSURE_ADVANCE", "TRAMMEL_PRINT_PATTERN",
                          "TRAMMEL_PRINT_SHEET", "LASER_ON", "TRAMMEL_KEEP_ALIVE"}) {
    EXPECT_FALSE(sections.contains(std::string("gcode_macro ") + old)) << old;
  }
}

TEST(KlipperMacros, WhatADialogOfMacrosBeginsLooksFirstWhetherItIsOpen) {
  const auto sections = ReadSections();
  std::size_t dialogs = 0;
  for (const auto& [header, text] : sections) {
    for (const std::string& macro : TextsAfter(text, "_TRAMMEL_CONFIRM [^\\n]*MACRO=")) {
      const std::string& button = sections.at("gcode_macro " + macro);
      EXPECT_THAT(button, testing::HasSubstr("gcode:\n    _TRAMMEL_CONFIRMED TOKEN=")) << macro;
      ++dialogs;
    }
  }
  EXPECT_EQ(dialogs, 3U);
  const std::string& confirmed = sections.at("gcode_macro _TRAMMEL_CONFIRMED");
  EXPECT_LT(confirmed.find("action_raise_error"), confirmed.find("VALUE=\"''\""));
}

TEST(KlipperMacros, BracesAndBlocksAreBalancedInEveryTemplate) {
  for (const auto& [header, text] : ReadSections()) {
    EXPECT_EQ(std::count(text.begin(), text.end(), '{'), std::count(text.begin(), text.end(), '}'))
        << header;
    EXPECT_EQ(TextsAfter(text, "\\{% (?=if )").size(), TextsAfter(text, "\\{% (?=endif )").size())
        << header;
    // A variable's name is lower case in Klipper, whoever set it.
    for (const std::string& name : TextsAfter(text, "\nvariable_")) {
      EXPECT_TRUE(std::none_of(name.begin(), name.end(), [](unsigned char c) {
        return std::isupper(c) != 0;
      })) << name;
    }
  }
}

}  // namespace
}  // namespace trammel
