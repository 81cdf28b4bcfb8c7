// Options of the sheet to print: the settings, overridden by the command line, and the printer's
// own report.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/config/config_file.h"
#include "app/stated_settings.h"
#include "base/result.h"
#include "session/session.h"
#include "tool_offset/procedure/tool_offsets.h"
#include "tool_offset/sheet/sheet_gcode.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace CLI {
class App;
}

namespace trammel::app {

struct SheetOptions {
  std::string config;            ///< file; empty: trammel.toml of this folder, if there is one
  std::vector<std::string> set;  ///< key=value
  std::string dialect;           ///< the following are empty where the settings say it
  std::string material;
  std::string tool_change;
  std::optional<int> tool;  ///< this one alone, against the reference tool
  bool self_test = false;
  bool for_photo = false;
};

/// --config, --set, --material, --tool-change and --for-photo.
void AddSheetOptions(CLI::App& command, SheetOptions& options);

struct SheetConfig {
  files::Config config;
  ConfigText text;  ///< source of the settings
  tool_offset::SheetSettings sheet;
};

/// Reads the sheet's settings. Errors name the option, or the file and its line. Does not check the
/// settings' combination yet.
[[nodiscard]] Result<SheetConfig> ConfigureSheet(const SheetOptions& options);

/// Checks that the sheet can be printed, and its temperatures.
[[nodiscard]] Result<void> CheckSheet(const SheetConfig& config);

/// Prints the layout, temperatures and duration on standard output; warnings on standard error.
void PrintSheetPlan(const tool_offset::SheetSettings& asked, const tool_offset::SheetPlan& plan,
                    const tool_offset::SheetGcode& gcode);

/// Reads the settings, with the printer's address and key. Errors: as ConfigureSheet; a dialect
/// that is not Klipper's.
/// @param printer  its address; empty: the settings'
[[nodiscard]] Result<SheetConfig> ConfigureForPrinter(const SheetOptions& options,
                                                      const std::string& printer);

/// Selects the requested tools, or all that were found, and this printer's tool change unless one
/// is set. Errors: the printer stores no offsets, and no tools are named; the printer's.
[[nodiscard]] Result<void> FitToPrinter(const SheetOptions& options, const std::vector<int>& tools,
                                        const procedure::Session& session,
                                        const procedure::PrinterTools& found, SheetConfig& config);

}  // namespace trammel::app
