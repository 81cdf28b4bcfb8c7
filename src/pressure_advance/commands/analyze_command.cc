// trammel pa analyze: computes pressure advance with its uncertainty from a recorded laser scan or
// a photo.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/commands.h"
#include "app/provenance.h"
#include "app/slow_work.h"
#include "pressure_advance/commands/analysis_run.h"
#include "pressure_advance/commands/kept_result.h"
#include "pressure_advance/commands/photo_batch.h"
#include "pressure_advance/commands/photo_reading.h"
#include "pressure_advance/commands/pressure_advance_commands.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;

Result<AnalysisRun> RunReader(const LocalAnalysis& arguments, const files::SlicerPrint* print) {
  const fs::path path = arguments.path;
  std::error_code ignored;
  if (!fs::exists(path, ignored)) {
    return Fail(
        fmt::format("{}: there is no such file or folder; give a recording's folder or a "
                    "photo",
                    path.string()));
  }
  if (!fs::is_directory(path, ignored)) {
    if (arguments.flow_reference.empty()) return ReadPhoto(arguments.path, arguments.photo, print);
    return Fail(
        fmt::format("--flow-reference: {} is a photo, which shows no flow ratio: its beads' "
                    "height is not seen",
                    path.string()));
  }
  if (const std::string option = FirstGiven(arguments.photo); !option.empty()) {
    return Fail(fmt::format("{} is for photos; {} is a recording, whose scan.json says it", option,
                            path.string()));
  }
  std::optional<FlowReference> reference;
  if (!arguments.flow_reference.empty()) {
    reference = FlowReference{arguments.flow_reference, arguments.reference_flow_ratio};
  }
  return AnalyseRecording(path, reference);
}

bool IsOfKlipper(const pressure_advance::Analysis& analysis) {
  return analysis.printed_by && analysis.printed_by->dialect == gcode::Dialect::kKlipper;
}

// Returns pa apply's argument: a file with the answer, or the value.
std::string ToApply(const LocalAnalysis& arguments, double value_s) {
  std::error_code ignored;
  if (!arguments.output.files.result.empty()) return ShellQuoted(arguments.output.files.result);
  return fs::is_directory(arguments.path, ignored) ? ShellQuoted(arguments.path)
                                                   : fmt::format("{:.4f}", value_s);
}

}  // namespace

Result<int> RunLocalAnalysis(const LocalAnalysis& arguments) {
  const std::string& gcode = arguments.photo.gcode;
  if (gcode.empty() && !arguments.more.empty()) {
    return Fail("several photos need the G-code that was printed (--gcode)");
  }
  std::optional<files::SlicerPrint> print;
  if (!gcode.empty()) print = TRY(files::ReadSlicerGcode(gcode, arguments.photo.plate));
  if (print && (print->patterns.size() > 1 || !arguments.more.empty())) {
    if (const std::string option = FirstOutput(arguments.output.files); !option.empty()) {
      return Fail(
          fmt::format("{} is for one pattern; {} holds {}", option, gcode, print->patterns.size()));
    }
    std::vector<std::string> photos = arguments.more;
    photos.insert(photos.begin(), arguments.path);
    return RunPhotoBatch(photos, gcode, *print, arguments.output.json);
  }
  TRY(CheckOutputs(arguments.output.files));
  const SlowWork work("analysing " + arguments.path);
  const auto run = TRY(RunReader(arguments, print ? &*print : nullptr));
  ResultFile result = ResultOf(run.analysis, arguments.path);
  result.outcome.subject = SubjectIn(arguments.path);
  const int code = PrintAnalysis(run, result, arguments.output);
  const Measured& measured = run.analysis.pressure_advance;
  if (!arguments.output.json && measured.good() && IsOfKlipper(run.analysis)) {
    PrintWrapped("nothing applied",
                 "trammel pa apply " + ToApply(arguments, measured.quantity().value));
  }
  return code;
}

void AddLocalAnalysisOptions(CLI::App& command, LocalAnalysis& arguments) {
  command.add_option("--report", arguments.output.files.report, "write a one-page report (HTML)");
  command.add_option("--figures", arguments.output.files.figures,
                     "write each figure as PNG and SVG here");
  command.add_option("--result", arguments.output.files.result,
                     "keep the answer as JSON here, for pa apply");
  command.add_flag("--force", arguments.output.files.force, "overwrite files");
  AddPhotoReadingOptions(command, arguments.photo);
}

void AddAnalyzeCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "analyze", "pressure advance from a recorded laser scan or a photo of the pattern");
  const auto arguments = std::make_shared<LocalAnalysis>();
  command->add_option("path", arguments->path, "folder with scan.json, or a photo")->required();
  command->add_flag("--json", arguments->output.json, "print everything as one JSON object");
  AddLocalAnalysisOptions(*command, *arguments);
  CLI::Option* reference = command->add_option(
      "--flow-reference", arguments->flow_reference,
      "recording: that of a print whose flow ratio is known, on this plate with this filament's "
      "colour and this camera; makes the flow ratio sharper, and possible on any plate");
  command
      ->add_option("--reference-flow-ratio", arguments->reference_flow_ratio,
                   "the ratio that is right for the reference's filament")
      ->check(CLI::Range(0.2, 5.0))
      ->capture_default_str()
      ->needs(reference);
  command->callback([arguments, &exit_code] { exit_code = CodeOf(RunLocalAnalysis(*arguments)); });
}

}  // namespace trammel::app
