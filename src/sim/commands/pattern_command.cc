// trammel-sim pattern: writes the pressure-advance patterns of other tools.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/commands.h"
#include "app/option_values.h"
#include "files/new_file.h"
#include "sim/commands/commands.h"
#include "sim/print/named_number.h"
#include "sim/slicer_patterns/slicer_pattern.h"

namespace trammel::app {
namespace {

struct SimPatternArguments {
  std::string kind;
  std::string firmware;
  std::string values;
  std::string bed = "250x250";
  std::string speeds;
  std::string accelerations;
  std::vector<std::string> settings;
  std::string out;
};

using Options = sim::PatternOptions;

constexpr sim::NamedNumber<Options> kPatternNumbers[] = {
    {"slow", [](double v, Options& o) { o.slow_mm_s = v; }},
    {"fast", [](double v, Options& o) { o.fast_mm_s = v; }},
    {"first-layer-speed", [](double v, Options& o) { o.first_layer_mm_s = v; }},
    {"acceleration", [](double v, Options& o) { o.acceleration_mm_s2 = v; }},
    {"corner", [](double v, Options& o) { o.corner_mm_s = v; }},
    {"smooth-time", [](double v, Options& o) { o.smooth_time_s = v; }},
    {"nozzle", [](double v, Options& o) { o.nozzle_mm = v; }},
    {"first-layer", [](double v, Options& o) { o.first_layer_mm = v; }},
    {"layer", [](double v, Options& o) { o.layer_mm = v; }},
    {"flow-ratio", [](double v, Options& o) { o.flow_ratio = v; }},
    {"round-bed", [](double v, Options& o) { o.round_bed = v != 0; }},
    {"rotation", [](double v, Options& o) { o.rotation_deg = sim::WholeOf(v); }},
    {"numbers", [](double v, Options& o) { o.numbers = v != 0; }},
    {"frame", [](double v, Options& o) { o.frame = v != 0; }},
    {"prime", [](double v, Options& o) { o.prime = v != 0; }},
    {"alternate", [](double v, Options& o) { o.alternate = v != 0; }},
    {"bars", [](double v, Options& o) { o.bars = sim::WholeOf(v); }},
    {"walls", [](double v, Options& o) { o.walls = sim::WholeOf(v); }},
    {"layers", [](double v, Options& o) { o.layers = sim::WholeOf(v); }},
    {"spacing", [](double v, Options& o) { o.spacing_mm = v; }},
    {"absolute-e", [](double v, Options& o) { o.absolute_e = v != 0; }},
    {"comments", [](double v, Options& o) { o.comments = v != 0; }},
};

Result<void> ReadValues(const std::string& text, Options& options) {
  if (text.empty()) return {};
  const auto parts = Split(text, ':', 2);
  const auto number = [&](std::size_t i) {
    return i < parts.size() ? ParseNumber<double>(parts[i]) : std::optional<double>();
  };
  const auto start = number(0);
  const auto end = number(1);
  const auto step = number(2);
  if (!start || !end || !step || parts.size() != 3) {
    return Fail(fmt::format("--pa {}: must be START:END:STEP in s, for example 0:0.1:0.002",
                            text.substr(0, 60)));
  }
  options.start_s = *start;
  options.end_s = *end;
  options.step_s = *step;
  return {};
}

Result<void> ReadList(const char* option, const std::string& text, std::vector<double>& list) {
  if (text.empty()) return {};
  list.clear();
  for (const auto& part : Split(text, ',', 20)) {
    const auto number = ParseNumber<double>(part);
    if (!number) {
      return Fail(fmt::format("{} {}: must be numbers, for example 50,100,200", option,
                              text.substr(0, 60)));
    }
    list.push_back(*number);
  }
  return {};
}

Result<void> WritePattern(const SimPatternArguments& arguments) {
  Options options = sim::PatternDefaults(TRY(sim::ParsePatternKind(arguments.kind)));
  if (!arguments.firmware.empty()) {
    options.firmware = TRY(sim::ParsePatternFirmware(arguments.firmware));
  }
  TRY(ReadValues(arguments.values, options));
  const auto bed = ParseWholePair(arguments.bed);
  if (!bed) {
    return Fail(fmt::format("--bed {}: must be WIDTHxDEPTH in mm, for example 250x250",
                            arguments.bed.substr(0, 40)));
  }
  options.bed_x_mm = bed->first;
  options.bed_y_mm = bed->second;
  TRY(ReadList("--speeds", arguments.speeds, options.speeds_mm_s));
  TRY(ReadList("--accelerations", arguments.accelerations, options.accelerations_mm_s2));
  for (const std::string& text : arguments.settings) {
    const auto named = TRY(sim::ParseNamedValue("--set", text));
    if (!TRY(sim::SetNamed(kPatternNumbers, named, options))) {
      return sim::NoSuchName("--set", text, sim::NamesOf(kPatternNumbers));
    }
  }
  const sim::SlicerPattern pattern = TRY(sim::WriteSlicerPattern(options));
  TRY(files::WriteWholeFile(arguments.out, pattern.gcode, files::IfThere::kRefuse));
  const std::vector<double>& values = pattern.pressure_advance_s;
  fmt::print("{}: {} values, {:g} ... {:g} s\n", arguments.out, values.size(), values.front(),
             values.back());
  return {};
}

}  // namespace

void AddSimPattern(CLI::App& parent, int& exit_code) {
  const auto arguments = std::make_shared<SimPatternArguments>();
  CLI::App* pattern =
      parent.add_subcommand("pattern", "write the pressure-advance pattern of another tool");
  pattern
      ->add_option("kind", arguments->kind,
                   "orca-line, orca-pattern, orca-batch, ellis or marlin-lines")
      ->required();
  pattern->add_option("--pa", arguments->values,
                      "START:END:STEP in s; without it, what the tool proposes");
  pattern->add_option("--firmware", arguments->firmware, "klipper, marlin, rrf, bambu or prusa");
  pattern->add_option("--speeds", arguments->speeds, "of orca-batch, mm/s: 50,100,200");
  pattern->add_option("--accelerations", arguments->accelerations,
                      "of orca-batch, mm/s^2: 1000,3000,10000");
  pattern->add_option("--bed", arguments->bed, "WIDTHxDEPTH, mm")->capture_default_str();
  pattern->add_option("--set", arguments->settings,
                      "NAME=NUMBER, may be given again; mm, mm/s, mm/s^2, s; names: " +
                          sim::NamesOf(kPatternNumbers));
  pattern->add_option("-o,--out", arguments->out, "new G-code file")->required();
  pattern->callback([arguments, &exit_code] {
    const Result<void> done = WritePattern(*arguments);
    exit_code = done ? kExitGood : PrintError(done.error());
  });
}

}  // namespace trammel::app
