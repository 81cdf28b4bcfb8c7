#include "tool_offset/commands/offset_job.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/serve_command.h"
#include "document/interval_text.h"
#include "session/uploads.h"
#include "tool_offset/commands/offset_recording.h"
#include "tool_offset/commands/sheet_options.h"
#include "tool_offset/files/offset_files.h"
#include "tool_offset/procedure/sheet_print.h"
#include "tool_offset/sheet/sheet_bed.h"
#include "tool_offset/sheet/sheet_temperatures.h"

namespace trammel::app {
namespace {

using service::AnswerSummary;
using service::Arguments;
using service::Offer;
using service::PrinterPlace;

constexpr const char* kTools = "tools";
constexpr const char* kMaterial = "material";
constexpr const char* kFile = "file";

/// "1,2,3", at most 100 of them; nothing where it is no such list.
std::optional<std::vector<int>> ParseToolList(std::string_view text) {
  constexpr std::size_t kMax = 100;
  std::vector<int> tools;
  for (;;) {
    int tool = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), tool);
    if (error != std::errc{} || tools.size() >= kMax) return std::nullopt;
    tools.push_back(tool);
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    if (text.empty()) return tools;
    if (text.front() != ',') return std::nullopt;
    text.remove_prefix(1);
  }
}

/// Sheet that a run is to print.
struct AskedSheet {
  SheetOptions options;
  std::string address;
  std::vector<int> tools = {};  ///< empty: none are named
};

Result<AskedSheet> AskedFor(const PrinterPlace& place, const Arguments& arguments) {
  AskedSheet asked;
  asked.options.config = place.config;
  asked.options.set = place.set;
  asked.options.material = place.material;
  asked.address = place.address;
  const auto given = [&arguments](const char* name) {
    const auto found = arguments.find(name);
    return found == arguments.end() ? std::string() : found->second;
  };
  if (const std::string text = given(kTools); !text.empty()) {
    auto tools = ParseToolList(text);
    if (!tools) {
      return Fail("TOOLS must be a list of numbers, such as TOOLS=0,1: those that are printed");
    }
    asked.tools = std::move(*tools);
  }
  if (const std::string text = given(service::kTemperatureArgument); !text.empty()) {
    TRY(CheckTemperatureArgument(text));
    asked.options.set.push_back(fmt::format("{}={}", service::kTemperatureSetting, text));
  }
  if (const std::string text = given(kMaterial); !text.empty()) asked.options.material = text;
  return asked;
}

/// Reads the settings of a run. Errors: unreadable, or without a temperature. The sheet's plan is
/// checked on request only.
Result<SheetConfig> SettingsFor(const AskedSheet& asked, const Arguments& arguments) {
  auto config = ConfigureForPrinter(asked.options, asked.address);
  if (!config) return config;
  if (!asked.tools.empty()) config->sheet.tools = asked.tools;
  const bool each_has_its_own = !config->sheet.nozzle_temperatures_c.empty();
  if (each_has_its_own && arguments.contains(service::kTemperatureArgument)) {
    return Fail(
        "TEMP: nozzle_temperatures in [tool_offset_pattern] has each tool's own; leave it out");
  }
  const auto problem = each_has_its_own ? std::nullopt : FindTemperatureProblem(config->sheet);
  if (!problem) return config;
  return tl::unexpected(
      files::LocateProblem(*problem, config->config, config->text.text, config->text.file));
}

/// Checks the sheet's job; with a printer also where to put the paper, by its tools.
Result<Offer> CheckSheetJob(const PrinterPlace& place, const Arguments& arguments,
                            machine::Printer* printer) {
  const auto asked = TRY(AskedFor(place, arguments));
  auto config = TRY(SettingsFor(asked, arguments));
  if (printer == nullptr) {
    return Offer{
        "Is paper taped flat on the COLD bed, and are the tools ready? It homes, heats and prints"};
  }
  const procedure::Session session{*printer, {}, {}};
  const auto found = TRY(ReadTools(session));
  TRY(FitToPrinter(asked.options, asked.tools, session, found, config));
  TRY(CheckSheet(config));
  const tool_offset::SheetPlan plan = tool_offset::PlanSheet(config.sheet);
  const auto paper = tool_offset::PaperAround(plan);
  const tool_offset::BedBounds& bounds =
      paper ? paper->bounds
            : tool_offset::SheetBounds(plan.settings, plan.width_mm, plan.height_mm);
  std::string tools;
  for (const int tool : plan.settings.tools) {
    tools += fmt::format("{}T{}", tools.empty() ? "" : ", ", tool);
  }
  return Offer{fmt::format(
      "Is {} paper ({:.0f} mm along X, {:.0f} along Y) taped flat on the COLD bed, its "
      "middle at X {:.0f}, Y {:.0f}, hands out, and are {} ready? It homes, heats ({}) "
      "and prints.",
      paper ? paper->name : "a", bounds.max_x_mm - bounds.min_x_mm,
      bounds.max_y_mm - bounds.min_y_mm, (bounds.min_x_mm + bounds.max_x_mm) / 2,
      (bounds.min_y_mm + bounds.max_y_mm) / 2, tools, DescribeTemperatures(plan.settings))};
}

// A scan moves and heats nothing.
Result<Offer> CheckScanJob(const PrinterPlace& place, const Arguments&, machine::Printer*) {
  TRY(LoadSettings(OptionsAt(place)));
  return Offer{};
}

/// Returns half of the interval, in mm.
double HalfWidth(const measurement::Answer& answer) {
  const Interval& interval = answer.value.quantity().interval95;
  return (interval.hi - interval.lo) / 2;
}

/// Returns each tool's own line, and all in one.
Result<AnswerSummary> AnswerIn(const std::string& folder) {
  const auto measured = TRY(files::ReadOffsetFile(folder));
  const auto record = TRY(files::ReadStart(folder));
  AnswerSummary answer;
  std::string all;
  double half_mm = 0;
  for (const files::MeasuredOffset& tool : measured.good) {
    const auto* const x = measured.result.Find(fmt::format("tool_{}_dx", tool.tool));
    const auto* const y = measured.result.Find(fmt::format("tool_{}_dy", tool.tool));
    answer.lines.push_back(
        fmt::format("tool_offset T{} x = {}, y = {}", tool.tool,
                    report::WithInterval(x->value.quantity(), report::kOffsetMillimetres),
                    report::WithInterval(y->value.quantity(), report::kOffsetMillimetres)));
    constexpr int kMicrometres = 3;  // decimals of firmware commands
    all += fmt::format("{}T{} x {}, y {}", all.empty() ? "" : ", ", tool.tool,
                       report::NumberText(tool.dx_mm, kMicrometres, true),
                       report::NumberText(tool.dy_mm, kMicrometres, true));
    half_mm = std::max({half_mm, HalfWidth(*x), HalfWidth(*y)});
    const bool told = std::any_of(record.tools.begin(), record.tools.end(), [&](const auto& each) {
      return each.tool == tool.tool && each.kept;
    });
    if (!told) {
      answer.why_not_set = fmt::format(
          "Klipper keeps no offset of these tools: trammel offset apply {} --for "
          "klipper-gcode-offset --now TOOL:X,Y shows the lines for your macros",
          folder);
    }
  }
  for (const std::string& line : measured.refused) answer.lines.push_back("tool_offset " + line);
  if (measured.good.empty()) {
    answer.words = measured.refused.front();
    return answer;
  }
  answer.verdict = Verdict::kGood;
  answer.words = fmt::format("tool offsets {} mm ({})", all,
                             report::WithinText({&half_mm, 1}, report::kMillimetres));
  if (!measured.refused.empty()) {
    answer.words += fmt::format("; {} without a value", measured.refused.size());
  }
  return answer;
}

}  // namespace

service::JobKind OffsetSheetJob() {
  service::JobKind kind;
  kind.name = "offset_sheet";
  kind.method = "trammel_offer_sheet";
  kind.arguments = {kTools, kMaterial, service::kTemperatureArgument};
  kind.check = CheckSheetJob;
  kind.command = {"offset", "start", "--print-only",
                  fmt::format("--yes={},{}", procedure::kMoveQuestion, procedure::kPaperQuestion)};
  kind.done = fmt::format(
      "Sheet printed, everything is off. Let the bed cool, take the paper off, scan it at 300 to "
      "600 dpi or photograph it, upload that into the folder {} beside printer.cfg. Measure it?",
      procedure::kUploadFolder);
  kind.start_buttons = procedure::Buttons::kSheet;
  kind.done_buttons = procedure::Buttons::kScan;
  return kind;
}

service::JobKind OffsetScanJob() {
  service::JobKind kind;
  kind.name = "offset_scan";
  kind.method = "trammel_offset_scan";
  kind.arguments = {kFile};
  kind.check = CheckScanJob;
  kind.command = {"offset", "measure"};
  kind.apply = [](const std::string& folder, const Arguments&) {
    return std::vector<std::string>{"offset", "apply", folder, "--apply", "--brief"};
  };
  kind.instrument = measurement::Instrument::kToolOffset;
  kind.undo = {"offset", "apply", "--undo"};
  kind.use = [](const PrinterPlace&, const Arguments&) {
    return std::string("Set the new offsets until Klipper restarts");
  };
  kind.answer = AnswerIn;
  return kind;
}

}  // namespace trammel::app
