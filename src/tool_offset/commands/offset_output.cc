#include "tool_offset/commands/offset_output.h"

#include <fmt/format.h>

#include <filesystem>
#include <system_error>
#include <utility>

#include "app/output_files.h"
#include "app/printer_session.h"
#include "app/provenance.h"
#include "app/result_file.h"
#include "tool_offset/report/offset_figures.h"
#include "tool_offset/report/offset_json.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;

Result<void> WriteFigures(const std::string& figures, const report::OffsetReportInput& input,
                          bool force) {
  const fs::path folder = figures;
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) {
    return Fail(fmt::format("--figures {}: cannot make the folder: {}", figures, error.message()));
  }
  std::vector<OutputFile> files;
  const auto add = [&](const std::string& prefix, const report::DrawnFigure& figure) {
    files.push_back({folder / (prefix + figure.name + ".svg"), figure.svg});
  };
  for (const report::Figure& figure : report::OffsetValueFigures(*input.analysis)) {
    add("", report::Drawn(figure));
  }
  for (std::size_t i = 0; i < input.pictures.size(); ++i) {
    const std::string prefix = fmt::format("scan{}-", i + 1);
    add(prefix, input.pictures[i].page);
    for (const report::DrawnFigure& figure : input.pictures[i].structures) add(prefix, figure);
  }
  return WriteOutputs(files, force);
}

// As it is drawn for a phone: the same picture is to be read on small and large screens.
Result<void> WritePicture(const std::string& path, const report::OffsetAnalysis& analysis,
                          bool force) {
  constexpr double kScale = 3;
  const auto figure = report::ToolArrowsFigure(analysis);
  if (!figure) return {};
  const report::Canvas& canvas = figure->narrow ? *figure->narrow : figure->canvas;
  return WriteOutputs({{path, canvas.ToPng(figure->narrow ? kScale : figure->png_scale)}}, force);
}

measurement::Outcome OutcomeOf(const report::OffsetAnalysis& analysis) {
  measurement::Outcome outcome;
  std::vector<std::string> sources;
  for (const report::OffsetScan& scan : analysis.scans) sources.push_back(scan.source);
  for (const tool_offset::CombinedTool& tool : analysis.combined.tools) {
    outcome.answers.push_back({fmt::format("tool_{}_dx", tool.tool), "mm", tool.dx_mm});
    outcome.answers.push_back({fmt::format("tool_{}_dy", tool.tool), "mm", tool.dy_mm});
  }
  outcome.answers.push_back({"backlash_x", "mm", analysis.combined.backlash_mm.x});
  outcome.answers.push_back({"backlash_y", "mm", analysis.combined.backlash_mm.y});
  const Verdict verdict = report::VerdictOf(analysis);
  if (verdict != Verdict::kGood && outcome.verdict() == Verdict::kGood) {
    constexpr const char* kWhy = "a self-test of the sheet is not good";
    outcome.answers.push_back(
        {"self_tests", "",
         verdict == Verdict::kRefused ? Measured::Refused(kWhy) : Measured::CannotTell(kWhy)});
  }
  outcome.notices = report::NoticesOf(analysis);
  outcome.provenance = ProvenanceOf(measurement::Instrument::kToolOffset, std::move(sources));
  return outcome;
}

}  // namespace

Result<void> WriteOffsetOutput(const OffsetOutput& output, const report::OffsetReportInput& input) {
  if (!output.result.empty()) {
    const ResultFile result{OutcomeOf(*input.analysis), report::JsonOf(*input.analysis)};
    TRY(WriteOutputs({OutputOf(output.result, result)}, output.force));
  }
  if (!output.recording.empty()) {
    ResultFile result{OutcomeOf(*input.analysis), report::JsonOf(*input.analysis)};
    result.outcome.subject = output.subject;
    TRY(KeepInRecording(output.recording, result));
  }
  if (!output.report.empty()) {
    TRY(WriteOutputs({{output.report, report::OffsetReport(input)}}, output.force));
  }
  if (!output.picture.empty()) {
    TRY(WritePicture(output.picture, *input.analysis, output.force));
  }
  if (!output.figures.empty()) return WriteFigures(output.figures, input, output.force);
  return {};
}

}  // namespace trammel::app
