// Prints the pattern on printers around and past the ends of what its settings assume: every fact
// that a printer reports, over every value that a user's printer may have.
//
// Each draw takes a usual printer, changes one to three facts, sets up to two settings, and asks
// trammel for a print. What Klipper would make of the file decides (klipper_model.h): a print is
// refused by the name of a changed fact, or it is right. Prints the tally of each fact.
//
// TRAMMEL_STUDY_SEEDS: draws; TRAMMEL_STUDY_FIRST_SEED: the first (support/study.h).
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "app/stated_settings.h"
#include "machine/moonraker/client/status.h"
#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/procedure/scan_checks.h"
#include "printer_draws.h"
#include "session/fake_printer.h"
#include "support/study.h"

namespace trammel::test {
namespace {

using files::Config;
using nlohmann::json;

Config Configured(const std::vector<std::string>& settings) {
  Config config = files::DefaultConfig();
  EXPECT_TRUE(files::OverrideConfig("material=pla", config));
  for (const std::string& setting : settings) {
    const auto set = files::OverrideConfig(setting, config);
    EXPECT_TRUE(set) << setting << ": " << set.error().message;
  }
  return config;
}

/// Outcome of `pa print --photo` before anything moves.
struct Asked {
  std::string refusal;  ///< empty: it prints
  bool adapted = false;
  Config config;
};

Asked AskForPrint(const json& told, const std::vector<std::string>& settings) {
  Asked asked;
  asked.config = Configured(settings);
  procedure::testing::FakePrinter printer;
  std::string fault;
  printer.state = machine::ReadStatus(told, &fault);
  if (!fault.empty()) {
    asked.refusal = fault;
    return asked;
  }
  printer.told = told;
  const procedure::Session session{printer, {}, [&asked](const auto&) { asked.adapted = true; }};
  const auto fitted = app::FitPattern(session, asked.config);
  if (!fitted) {
    asked.refusal = fitted.error().message;
    return asked;
  }
  const auto checked =
      FirstFailure(CheckForPrint(session, {asked.config.pattern}), ErrorKind::kMachine);
  if (!checked) asked.refusal = checked.error().message;
  return asked;
}

/// The speed that a line is planned at, at a place: as fast as its segments, its ends and its
/// acceleration allow.
double PlannedSpeed_mm_s(const pressure_advance::PatternConfig& config, double at_mm) {
  const double length_mm = config.line_length_mm;
  const double twice = 2 * config.acceleration_mm_s2;
  double speed2 = std::min(twice * at_mm, twice * (length_mm - at_mm));
  double from_mm = 0;
  for (const auto& segment : config.segments) {
    const double to_mm = from_mm + segment.fraction * length_mm;
    const double away_mm = std::max({0.0, from_mm - at_mm, at_mm - to_mm});
    speed2 = std::min(speed2, segment.speed_mm_s * segment.speed_mm_s + twice * away_mm);
    from_mm = to_mm;
  }
  return std::sqrt(std::max(0.0, speed2));
}

/// A caliper's value that a user sets holds where filament of the printer's diameter may have it.
double TrueFilament_mm(const ModelExtruder& extruder, const Config& config) {
  constexpr double kTolerance_mm = 0.05;  // tolerance of commercial filament
  const double set_mm = config.pattern.filament_diameter_mm;
  const bool measured = config.IsSet("filament.filament_diameter") &&
                        std::abs(set_mm - extruder.filament_diameter_mm) <= kTolerance_mm + 1e-9;
  return measured ? set_mm : extruder.filament_diameter_mm;
}

std::string FindWrongSpeed(const ModelLine& line, const pressure_advance::PatternConfig& config) {
  constexpr double kShare = 2e-4;         // of the squared speed: limits have four digits
  constexpr double kRounding_mm = 0.002;  // of the position: files have three digits
  if (std::abs(line.Length_mm() - config.line_length_mm) > 0.01) {
    return fmt::format("a line of {:.3f} mm", line.Length_mm());
  }
  for (int i = 1; i < 100; ++i) {
    const double at_mm = config.line_length_mm * i / 100;
    const double is = line.SpeedAt_mm_s(at_mm), planned = PlannedSpeed_mm_s(config, at_mm);
    if (std::abs(is * is - planned * planned) >
        kShare * planned * planned + 2 * config.acceleration_mm_s2 * kRounding_mm) {
      return fmt::format("{:.1f} mm/s instead of {:.1f} at {:.1f} mm", is, planned, at_mm);
    }
  }
  return "";
}

std::string FindWrongFilament(const ModelLine& line, const ModelExtruder& extruder,
                              const Config& config) {
  const auto& pattern = config.pattern;
  const double filament_mm = TrueFilament_mm(extruder, config);
  const double laid_mm3 = line.filament_mm * std::numbers::pi / 4 * filament_mm * filament_mm;
  // A bead is a rectangle with round sides.
  const double height_mm = pattern.layer_height_mm;
  const double bead_mm2 = (pattern.line_width_mm - height_mm) * height_mm +
                          std::numbers::pi / 4 * height_mm * height_mm;
  const double share = laid_mm3 / (bead_mm2 * pattern.line_length_mm);
  return std::abs(share - 1) > 0.02 ? fmt::format("{:.3f} times the filament", share) : "";
}

std::string FindWrongAdvance(const ModelLine& line, const ModelPrinter& printer, double planned_s) {
  int pushing = 0;
  for (const auto& [section, motor] : printer.motors) {
    if (motor.queue != printer.active) continue;
    ++pushing;
    if (std::abs(line.pressure_advance_s.at(section) - planned_s) > 1e-6) {
      return fmt::format("{} has a pressure advance of {} instead of {}", section,
                         line.pressure_advance_s.at(section), planned_s);
    }
    constexpr double kLongest_s = 0.06;  // longer ones make answers too high
    if (motor.smooth_time_s > kLongest_s + 1e-9) {
      return fmt::format("{} smooths over {:.3f} s", section, motor.smooth_time_s);
    }
  }
  return pushing > 0 ? "" : "no motor pushes the filament";
}

/// Returns the fault of a print with these settings; empty: none.
std::string FindWrong(const ModelPrinter& printer, const Config& config) {
  const auto& pattern = config.pattern;
  const ModelExtruder& extruder = printer.extruders.at(printer.active);
  const auto layout = LayOut(pattern);
  const ModelPrint print = PrintOn(printer, WriteGcode(layout, pattern));
  if (!print.refusal.empty()) return "Klipper: " + print.refusal;
  for (int i = 0; i < PatternCount(pattern); ++i) {
    if (SettingsOf(pattern, i).acceleration_mm_s2 > 1.000001 * printer.max_accel_mm_s2) {
      return "accelerates faster than the printer's owner allows";
    }
  }
  if (print.lines.size() != layout.lines.size()) return "lines are missing";
  for (std::size_t i = 0; i < print.lines.size(); ++i) {
    const auto one = SettingsOf(pattern, layout.lines[i].pattern);
    for (const std::string& wrong :
         {FindWrongSpeed(print.lines[i], one), FindWrongFilament(print.lines[i], extruder, config),
          FindWrongAdvance(print.lines[i], printer, layout.lines[i].pressure_advance_s)}) {
      if (!wrong.empty()) return fmt::format("line {}: {}", i, wrong);
    }
  }
  const std::string& model = extruder.pressure_advance_model;
  if (!model.empty() && model != "linear" && model != "Linear") return "no linear advance";
  // trammel heats the bed by name before it prints.
  if (!printer.bed_max_temp_c && pattern.bed_temperature_c.value_or(60) > 0) {
    return "a bed is heated that the printer does not have";
  }
  const double nozzle_mm = extruder.nozzle_diameter_mm;
  if (std::abs(pattern.nozzle_diameter_mm - nozzle_mm) > 0.0101) return "another nozzle";
  constexpr double kOozes_s = 1;
  const double asked_s = 1.5 * std::max(pattern.retract_length_mm, pattern.prime_length_mm) /
                         pattern.retract_speed_mm_s;
  if (print.longest_filament_move_s > std::max(kOozes_s, asked_s)) {
    return fmt::format("retracts for {:.1f} s", print.longest_filament_move_s);
  }
  return "";
}

// ---- The study ----

struct Row {
  int drawn = 0, refused = 0, adapted = 0, right = 0, wrong = 0, unnamed = 0, refused_fine = 0;
};

bool Names(const std::string& refusal, const std::vector<std::string>& words) {
  return std::any_of(words.begin(), words.end(), [&](const std::string& word) {
    return refusal.find(word) != std::string::npos;
  });
}

/// Refusals of printers on which the model prints right, judged one by one: Klipper would print, by
/// luck of rounding or without limits of its own, or the file would name another stepper.
bool IsJudged(const std::string& refusal, const ModelPrinter& printer) {
  return Names(refusal, {"instantaneous_corner_velocity", "max_angular_velocity",
                         "has no stepper of its own", "no kinematics of [printer]",
                         "bed_shape is \"rectangle\"", "mm in a circle"}) ||
         printer.kinematics == "none" || printer.kinematics == "winch";
}

class Study {
 public:
  void Run(Random& random, std::uint64_t seed) {
    const ModelPrinter base = OneOf(random, printers_);
    Draw draw;
    draw.printer = base;
    // A user's settings that contradict the unchanged printer are no fact's fault.
    for (int tries = 0; tries < 20; ++tries) {
      draw.settings = DrawSettings(random);
      const Asked usual = AskForPrint(ToldBy(base), draw.settings);
      if (usual.refusal.empty() && FindWrong(base, usual.config).empty()) break;
      draw.settings.clear();
    }
    std::vector<const Fact*> changed;
    std::string words;
    const int count = 1 + static_cast<int>(random.Below(3));
    for (int i = 0; i < count; ++i) {
      const Fact& fact = OneOf(random, facts_);
      if (std::find(changed.begin(), changed.end(), &fact) != changed.end()) continue;
      if (std::ranges::any_of(changed, [&](const Fact* other) {
            return Hides(fact.name, other->name) || Hides(other->name, fact.name);
          })) {
        continue;
      }
      changed.push_back(&fact);
      words += (words.empty() ? "" : "; ") + fact.change(random, draw);
    }
    for (const std::string& setting : draw.settings) words += " [" + setting + "]";
    Judge(draw, changed, fmt::format("seed {}, {}: {}", seed, base.name, words));
  }

  void Print() const {
    fmt::print("\n{:<30} drawn refused adapted right | wrong unnamed refused though right\n", "");
    for (const auto& [name, row] : rows_) {
      fmt::print("{:<30} {:>5} {:>7} {:>7} {:>5} | {:>5} {:>7} {:>7}\n", name, row.drawn,
                 row.refused, row.adapted, row.right, row.wrong, row.unnamed, row.refused_fine);
    }
    for (const auto& [reason, examples] : fine_) {
      fmt::print("refused though right, {} times, as in:\n  {}\n", examples.size(), examples[0]);
    }
  }

  [[nodiscard]] const std::vector<std::string>& wrong() const { return wrong_; }
  [[nodiscard]] const std::vector<std::string>& unnamed() const { return unnamed_; }
  /// Refused, where all is told and nothing is wrong.
  [[nodiscard]] const std::vector<std::string>& unreasonable() const { return unreasonable_; }

 private:
  void Judge(const Draw& draw, const std::vector<const Fact*>& changed, const std::string& words) {
    const Asked asked = AskForPrint(draw.Told(), draw.settings);
    const auto count = [&](int Row::*counted) {
      for (const Fact* fact : changed) ++(rows_[fact->name].*counted);
      ++(rows_["all"].*counted);
    };
    count(&Row::drawn);
    const bool laid = Validate(asked.config.pattern).has_value();
    const std::string fault = laid ? FindWrong(draw.printer, asked.config) : "not laid";
    if (!asked.refusal.empty()) {
      count(&Row::refused);
      const bool named = std::any_of(changed.begin(), changed.end(), [&](const Fact* fact) {
        return Names(asked.refusal, fact->words);
      });
      if (!named) {
        count(&Row::unnamed);
        unnamed_.push_back(words + " -> " + asked.refusal);
      }
      if (fault.empty()) {
        count(&Row::refused_fine);
        fine_[asked.refusal.substr(0, 28)].push_back(words + " -> " + asked.refusal);
        if (draw.instead.empty() && !IsJudged(asked.refusal, draw.printer)) {
          unreasonable_.push_back(words + " -> " + asked.refusal);
        }
      }
    } else if (!fault.empty()) {
      count(&Row::wrong);
      wrong_.push_back(words + " -> " + fault);
    } else {
      count(asked.adapted ? &Row::adapted : &Row::right);
    }
  }

  std::vector<ModelPrinter> printers_ = UsualPrinters();
  std::vector<Fact> facts_ = AllFacts();
  std::map<std::string, Row> rows_;
  std::vector<std::string> wrong_, unnamed_, unreasonable_;
  std::map<std::string, std::vector<std::string>> fine_;
};

TEST(PrinterNeighbourhood, AUsualPrinterPrintsThePatternAsItIsPlanned) {
  for (const ModelPrinter& printer : UsualPrinters()) {
    const Asked asked = AskForPrint(ToldBy(printer), {});
    EXPECT_EQ(asked.refusal, "") << printer.name;
    EXPECT_EQ(FindWrong(printer, asked.config), "") << printer.name;
  }
}

TEST(PrinterNeighbourhood, APrintIsRefusedByTheFactsNameOrRight) {
  const StudySeeds seeds = SeedsOfStudy(2000);
  Study study;
  for (int i = 0; i < seeds.count; ++i) {
    const std::uint64_t seed = seeds.first + static_cast<std::uint64_t>(i);
    Random random(seed);
    study.Run(random, seed);
  }
  study.Print();
  const auto expect_none = [](const char* what, const std::vector<std::string>& list) {
    constexpr std::size_t kShown = 20;
    EXPECT_EQ(list.size(), 0U) << what;
    for (std::size_t i = 0; i < std::min(kShown, list.size()); ++i) {
      fmt::print("{}: {}\n", what, list[i]);
    }
  };
  expect_none("printed, and wrong", study.wrong());
  expect_none("refused without the name of a changed fact", study.unnamed());
  expect_none("refused without need", study.unreasonable());
}
}  // namespace
}  // namespace trammel::test
