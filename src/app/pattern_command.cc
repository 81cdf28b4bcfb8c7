// trammel pa pattern: writes the G-code of the pattern, its plan and what it costs.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/commands.h"
#include "app/pa_values.h"
#include "pressure_advance/pattern.h"
#include "pressure_advance/pattern_plan.h"
#include "store/plan_file.h"
#include "store/text_file.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using pressure_advance::PatternConfig;
using pressure_advance::PatternLayout;
using pressure_advance::PatternSummary;

struct PatternArguments {
  std::string out = "pattern.gcode";
  std::string pa;
  std::string grid;
  std::string dialect;
  bool force = false;
};

/// `9x3`: columns and rows.
Result<void> SetGrid(const std::string& text, PatternConfig& config) {
  const char* end = text.data() + text.size();
  const auto columns = std::from_chars(text.data(), end, config.columns);
  if (columns.ec == std::errc{} && columns.ptr != end && *columns.ptr == 'x') {
    const auto rows = std::from_chars(columns.ptr + 1, end, config.rows);
    if (rows.ec == std::errc{} && rows.ptr == end) return {};
  }
  return Fail(fmt::format("--grid {}: must be COLUMNSxROWS, for example 9x3", text));
}

Result<PatternConfig> Configure(const PatternArguments& arguments) {
  PatternConfig config;
  if (!arguments.pa.empty()) {
    auto values = ParsePressureAdvances(arguments.pa);
    if (!values) return tl::unexpected(values.error());
    config.pressure_advances_s = std::move(*values);
  }
  if (!arguments.grid.empty()) {
    if (auto done = SetGrid(arguments.grid, config); !done) return tl::unexpected(done.error());
  }
  if (!arguments.dialect.empty()) {
    const auto dialect = gcode::ParseDialect(arguments.dialect);
    if (!dialect) {
      return Fail(fmt::format("--dialect {}: must be klipper, marlin or reprapfirmware",
                              arguments.dialect));
    }
    config.dialect = *dialect;
  }
  if (auto valid = Validate(config); !valid) return tl::unexpected(valid.error());
  return config;
}

/// All or none: looks before anything is written.
Result<void> RefuseToOverwrite(const std::vector<fs::path>& paths, bool force) {
  if (force) return {};
  for (const fs::path& path : paths) {
    std::error_code ignored;
    if (fs::exists(path, ignored)) {
      return Fail(fmt::format("{}: is there already; --force overwrites it, --out names another",
                              path.string()));
    }
  }
  return {};
}

void Print(const PatternSummary& summary, const PatternLayout& layout) {
  const auto minutes = static_cast<int>(summary.time_s / 60);
  fmt::print("lines      {} in {} pattern(s)\n", layout.lines.size(), layout.patterns.size());
  fmt::print("filament   {:.1f} mm, {:.2f} g\n", summary.filament_mm, summary.filament_g);
  fmt::print("time       {} min {:.0f} s without heating\n", minutes,
             summary.time_s - 60 * minutes);
  fmt::print("bounds     X {:.2f} ... {:.2f} mm, Y {:.2f} ... {:.2f} mm\n",
             summary.printed.min_x_mm, summary.printed.max_x_mm, summary.printed.min_y_mm,
             summary.printed.max_y_mm);
  fmt::print("peak flow  {:.1f} mm^3/s\n", summary.peak_flow_mm3_s);
}

Result<void> RunPattern(const PatternArguments& arguments) {
  const Result<PatternConfig> config = Configure(arguments);
  if (!config) return tl::unexpected(config.error());
  const fs::path gcode_path = arguments.out;
  fs::path plan_path = gcode_path;
  plan_path.replace_extension(".plan.json");
  if (auto may = RefuseToOverwrite({gcode_path, plan_path}, arguments.force); !may) return may;
  const PatternLayout layout = LayOut(*config);
  if (auto done = store::WriteTextFile(gcode_path, WriteGcode(layout, *config)); !done) return done;
  const auto plan = MakePlan(layout, *config, gcode_path.filename().string());
  if (auto done = store::WriteTextFile(plan_path, store::FormatPlan(plan)); !done) return done;
  fmt::print("G-code     {}\nplan       {}\n", gcode_path.string(), plan_path.string());
  Print(Summarise(layout, *config), layout);
  return {};
}

}  // namespace

void AddPatternCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "pattern", "write the G-code of lines at rising pressure advance, and where they lie");
  auto arguments = std::make_shared<PatternArguments>();
  command->add_option("--out", arguments->out, "G-code file; the plan is written beside it")
      ->capture_default_str();
  command->add_option("--pa", arguments->pa,
                      "pressure advance in s: START:END:COUNT, START:END:STEP or a,b,c");
  command->add_option("--grid", arguments->grid, "several patterns: COLUMNSxROWS");
  command->add_option("--dialect", arguments->dialect, "klipper, marlin or reprapfirmware");
  command->add_flag("--force", arguments->force, "overwrite files");
  command->callback([arguments, &exit_code] {
    const Result<void> done = RunPattern(*arguments);
    if (!done) exit_code = Report(done.error());
  });
}

}  // namespace trammel::app
