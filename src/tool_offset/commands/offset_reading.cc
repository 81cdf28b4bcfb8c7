#include "tool_offset/commands/offset_reading.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <system_error>
#include <utility>

#include "app/option_values.h"
#include "app/output_files.h"
#include "app/printer_session.h"
#include "app/provenance.h"
#include "app/slow_work.h"
#include "files/whole_file.h"
#include "machine/page/page_file.h"
#include "tool_offset/original/original_sheet.h"
#include "tool_offset/report/offset_figures.h"
#include "tool_offset/report/offset_report.h"
#include "tool_offset/sheet/sheet_comments.h"

namespace trammel::app {
namespace {

using tool_offset::PageKind;

/// Returns the kind stated by the user.
std::optional<PageKind> StatedKind(const ReadingOptions& asked) {
  if (asked.photo || asked.film_focal_mm) return PageKind::kPhoto;
  return asked.dpi.empty() ? std::nullopt : std::optional(PageKind::kScan);
}

std::string KindWord(const std::optional<PageKind>& kind) {
  if (!kind) return "picture";
  return *kind == PageKind::kPhoto ? "photo" : "scan";
}

Result<tool_offset::SheetResult> AnalysePage(const Page& page, const std::string& path, int number,
                                             const tool_offset::SheetPlan& plan,
                                             const ReadingOptions& asked) {
  tool_offset::AnalyseOptions options{page.dpi_x, page.dpi_y, StatedKind(asked), {}};
  if (!asked.dpi.empty()) {
    options.dpi_x = asked.dpi.front();
    options.dpi_y = asked.dpi.back();
  }
  options.photo.spread = asked.spread;
  options.photo.film_focal_mm = asked.film_focal_mm;
  if (!asked.film_focal_mm && page.film_focal_mm) {
    options.photo.film_focal_mm = *page.film_focal_mm;
  }
  auto result = tool_offset::AnalyseSheet(page.view(), plan, options);
  if (!result) {
    const std::string where = number > 1 ? fmt::format(", page {}", number) : "";
    return tl::unexpected(Error{
        result.error().kind,
        fmt::format("{} {}{}: {}", KindWord(options.kind), path, where, result.error().message)});
  }
  return result;
}

/// Evaluates several photos of one print together.
void JoinThePhotos(const tool_offset::SheetPlan& plan,
                   std::vector<tool_offset::SheetResult>& sheet) {
  const bool all = std::all_of(sheet.begin(), sheet.end(),
                               [](const auto& result) { return result.photo.has_value(); });
  if (all && sheet.size() > 1) sheet = {tool_offset::JoinPhotos(plan, sheet)};
}

Result<tool_offset::SheetPlan> PlanOfText(const std::string& text) {
  if (tool_offset::IsOriginalGcode(text)) {
    const auto sheet = TRY(tool_offset::ReadOriginalGcode(text));
    return PlanOriginal(sheet);
  }
  const auto settings = TRY(tool_offset::ReadSheetFile(text));
  return tool_offset::PlanSheet(settings);
}

/// Reads every page of one file; pages are large, and each is released after it has been read and
/// drawn. On an error nothing of the file is added.
Result<void> ReadFile(const std::string& file, int sheet, const ReadingOptions& asked,
                      bool pictures, ReadSheets& sheets) {
  machine::PageReadOptions limits;
  limits.most_pixels = static_cast<std::int64_t>(1e6 * asked.max_megapixels);
  const tool_offset::SheetPlan& plan = sheets.analysis.plan;
  std::vector<report::OffsetScan> scans;
  std::vector<report::DrawnFigure> drawn;
  auto read = machine::ForEachPage(file, limits, [&](const Page& page) -> Result<void> {
    const int number = static_cast<int>(scans.size()) + 1;
    auto result = TRY(AnalysePage(page, file, number, plan, asked));
    drawn.push_back(pictures ? report::DrawnPage(page.view(), plan, result)
                             : report::DrawnFigure{});
    scans.push_back({file, number, sheet, std::move(result)});
    return {};
  });
  if (!read) return read;
  std::move(scans.begin(), scans.end(), std::back_inserter(sheets.analysis.scans));
  std::move(drawn.begin(), drawn.end(), std::back_inserter(sheets.pictures));
  return {};
}

/// Combines all scans by their sheets.
tool_offset::CombinedResult CombineScans(const report::OffsetAnalysis& analysis) {
  std::vector<std::vector<tool_offset::SheetResult>> sheets;
  int sheet = 0;
  for (const report::OffsetScan& scan : analysis.scans) {
    if (scan.sheet != sheet) sheets.emplace_back();
    sheet = scan.sheet;
    sheets.back().push_back(scan.result);
  }
  for (auto& results : sheets) JoinThePhotos(analysis.plan, results);
  return tool_offset::Combine(sheets);
}

}  // namespace

void AddReadingOptions(CLI::App& command, ReadingOptions& options) {
  CLI::Option* const photo = command.add_flag(
      "--photo", options.photo, "a phone's photo; without it, it is told from the picture");
  command
      .add_option("--film-focal", options.film_focal_mm,
                  "of a photo: focal length in mm as if on film of 35 mm; else as the file says, "
                  "or from the box")
      ->check(NumberIn(5.0, 1000.0));
  command
      .add_option("--dpi", options.dpi,
                  "of a scan, or along a row and down the page; else as the file says, and only "
                  "compared with what the sheet shows")
      ->expected(1, 2)
      ->check(NumberIn(20.0, 20000.0))
      ->excludes(photo)
      ->excludes("--film-focal");
}

Result<tool_offset::SheetPlan> ReadPlan(const std::string& pattern) {
  constexpr std::size_t kMaxBytes = std::size_t{256} << 20U;
  const auto text = TRY(files::ReadWholeFile(pattern, kMaxBytes));
  auto plan = PlanOfText(text);
  if (plan) return plan;
  return tl::unexpected(
      Error{plan.error().kind, fmt::format("--pattern {}: {}", pattern, plan.error().message)});
}

ReadSheets ReadScans(const std::vector<std::string>& files, const tool_offset::SheetPlan& plan,
                     const ReadingOptions& options, bool pictures) {
  ReadSheets read{{plan, {}, {}, {}}, {}, {}};
  int sheet = 1;
  for (const std::string& file : files) {
    if (file == kNextSheet) {
      ++sheet;
      continue;
    }
    const SlowWork work("reading " + file);
    if (auto done = ReadFile(file, sheet, options, pictures, read); !done) {
      read.analysis.refused.push_back({file, done.error().message});
      read.errors.push_back(done.error());
    }
  }
  if (!read.analysis.scans.empty()) read.analysis.combined = CombineScans(read.analysis);
  return read;
}

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
    add(fmt::format("scan{}-", i + 1), input.pictures[i]);
  }
  return WriteOutputs(files, force);
}

// Draws the layout for a phone: the same picture must be legible on small and large screens.
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
