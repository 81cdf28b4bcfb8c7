// Which sheet is printed: the settings, the command line above them, and what the printer itself
// reports.
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
  ConfigText text;  ///< where it was read from
  tool_offset::SheetSettings sheet;
};

/// Errors name the option, or the file and its line. What the sheet's settings are worth together
/// is not judged yet.
[[nodiscard]] Result<SheetConfig> ConfigureSheet(const SheetOptions& options);

/// That such a sheet can be printed, and what it is heated to.
[[nodiscard]] Result<void> CheckSheet(const SheetConfig& config);

/// What is printed where, to what it is heated, how long it takes: on standard output; warnings on
/// standard error.
void PrintSheetPlan(const tool_offset::SheetSettings& asked, const tool_offset::SheetPlan& plan,
                    const tool_offset::SheetGcode& gcode);

/// The settings, with the printer's address and key. Errors: as ConfigureSheet; a dialect that is
/// not Klipper's.
/// @param printer  its address; empty: the settings'
[[nodiscard]] Result<SheetConfig> ConfigureForPrinter(const SheetOptions& options,
                                                      const std::string& printer);

/// Takes the tools that are asked for, or all that were found, and how this printer picks them up
/// where nobody says it. Errors: nobody keeps their offsets, and none are named; the printer's.
[[nodiscard]] Result<void> FitToPrinter(const SheetOptions& options, const std::vector<int>& tools,
                                        const procedure::Session& session,
                                        const procedure::PrinterTools& found, SheetConfig& config);

}  // namespace trammel::app
