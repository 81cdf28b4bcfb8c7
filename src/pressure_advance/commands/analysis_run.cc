#include "pressure_advance/commands/analysis_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/output_files.h"
#include "app/provenance.h"
#include "base/json_text.h"
#include "base/statistics.h"
#include "document/answer_head.h"
#include "document/interval_text.h"
#include "pressure_advance/commands/laser_recording.h"
#include "pressure_advance/report/analysis_json.h"
#include "pressure_advance/report/pressure_advance_report.h"
#include "pressure_advance/response/flow_ratio.h"
#include "pressure_advance/response/response.h"
#include "pressure_advance/timing/frame_stamps.h"
#include "service/job_record.h"

namespace trammel::app {

using pressure_advance::LineMotion;

AnalysisRun RefusedRun(const std::string& reason) {
  AnalysisRun run;
  run.analysis.pressure_advance = Measured::Refused(reason);
  run.analysis.response.pressure_advance = run.analysis.pressure_advance;
  run.analysis.response.acceleration.pressure_advance = run.analysis.pressure_advance;
  run.analysis.response.deceleration.pressure_advance = run.analysis.pressure_advance;
  return run;
}

namespace {

std::string BusyComputer(const pressure_advance::ScanLine& line) {
  return pressure_advance::NameBusyComputer(
      {line.late_s, line.frame_positions_mm.size(), line.lost_frames});
}

Measured WithReason(const Measured& measured, std::string reason) {
  return measured.verdict() == Verdict::kRefused ? Measured::Refused(std::move(reason))
                                                 : Measured::CannotTell(std::move(reason));
}

}  // namespace

void BlameBusyComputer(const pressure_advance::Scan& scan, pressure_advance::Analysis& analysis) {
  std::size_t in_question = 0, busy_lines = 0;
  std::string worst;
  std::size_t max_lost = 0;
  const bool some_unused =
      !std::ranges::all_of(analysis.lines, &pressure_advance::LineResult::used);
  for (std::size_t i = 0; i < analysis.lines.size(); ++i) {
    auto& line = analysis.lines[i];
    if (some_unused && line.used) continue;
    ++in_question;
    const std::string busy = BusyComputer(scan.lines.at(i));
    if (busy.empty()) continue;
    ++busy_lines;
    if (!line.used) line.reason = fmt::format("{} ({})", busy, line.reason);
    if (worst.empty() || scan.lines[i].lost_frames > max_lost) {
      worst = busy;
      max_lost = scan.lines[i].lost_frames;
    }
  }
  Measured& answer = analysis.pressure_advance;
  if (answer.good() || 2 * busy_lines < in_question || busy_lines == 0) return;
  answer = WithReason(answer, fmt::format("{} ({}): {}", worst, answer.reason(),
                                          pressure_advance::kBusyComputerRemedy));
}

namespace {

Result<pressure_advance::AreaReading> ReadReference(const FlowReference& reference,
                                                    const pressure_advance::Scan& scan) {
  const auto fail = [&](const std::string& why) {
    return Fail(fmt::format("--flow-reference {}: {}", reference.folder.string(), why));
  };
  const auto measured = MeasureRecording(reference.folder);
  if (!measured) return fail(measured.error().message);
  const pressure_advance::Scan& other = measured->scan;
  if (other.px_per_mm != scan.px_per_mm || other.laser_angle_rad != scan.laser_angle_rad) {
    return fail(
        "it has another px_per_mm or laser_angle_deg, so the camera was set up anew in between: "
        "scan the reference again");
  }
  if (!other.px_per_mm || !other.commanded_area_mm2) {
    return fail(
        "its scan.json has no px_per_mm or no commanded_area_mm2; scan it with this trammel");
  }
  const auto areas = pressure_advance::MeasureSteadyAreas(measured->profiles, other.motion,
                                                          *other.commanded_area_mm2);
  if (!areas.slow || !(areas.slow->value > 0)) return fail(areas.fault);
  return pressure_advance::ReadingByReference(*areas.slow, reference.ratio);
}

}  // namespace

Result<AnalysisRun> AnalyseRecording(const std::filesystem::path& folder,
                                     const std::optional<FlowReference>& reference) {
  Result<LaserMeasurement> measured = MeasureRecording(folder);
  if (!measured) {
    if (measured.error().kind == ErrorKind::kMeasurement) {
      return RefusedRun(measured.error().message);
    }
    return tl::unexpected(measured.error());
  }
  std::optional<pressure_advance::AreaReading> reading;
  if (reference) reading = TRY(ReadReference(*reference, measured->scan));
  AnalysisRun run;
  run.analysis = pressure_advance::Analyse(std::move(measured->profiles), measured->scan.motion,
                                           std::move(measured->deviation));
  run.analysis.flow = pressure_advance::EstimateFlowRatio(
      run.analysis.profiles, measured->scan.motion,
      {measured->scan.commanded_area_mm2, HeightScaleOf(measured->scan),
       measured->scan.opaque_plate},
      reading);
  run.analysis.notices.insert(run.analysis.notices.begin(), measured->notices.begin(),
                              measured->notices.end());
  BlameBusyComputer(measured->scan, run.analysis);
  run.analysis.scale = HeightScaleOf(measured->scan);
  run.scan = std::move(measured->view);
  return run;
}

namespace {

namespace fs = std::filesystem;
using pressure_advance::Analysis;

constexpr std::size_t kDateLength = 10;  // of ISO 8601: 2026-11-28

/// Returns the recording or photo.
const std::string& SourceOf(const ResultFile& result) {
  return result.outcome.provenance.sources.front();
}

/// Lists the subject for users: filament, nozzle, printer, date.
std::vector<std::pair<std::string, std::string>> FactsOf(const ResultFile& result) {
  std::vector<std::pair<std::string, std::string>> facts;
  for (const measurement::SubjectText& text : measurement::SubjectTexts()) {
    const std::string& value = result.outcome.subject.*text.text;
    if (!value.empty()) facts.emplace_back(text.words, value);
  }
  facts.emplace_back("date", result.outcome.provenance.utc.substr(0, kDateLength));
  return facts;
}

Result<void> WriteReport(const std::string& path, const ResultFile& result, const AnalysisRun& run,
                         const std::vector<report::Figure>& figures, bool force) {
  if (path.empty()) return {};
  report::ReportOptions options;
  options.source = SourceOf(result);
  options.facts = FactsOf(result);
  return WriteOutputs({{path, report::PressureAdvanceReport(run.analysis, figures, options)}},
                      force);
}

Result<void> WriteFigures(const std::string& figures_folder, const std::string& answer_png,
                          const std::vector<report::Figure>& figures, bool force) {
  if (figures_folder.empty()) return {};
  const fs::path folder = figures_folder;
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) {
    return Fail(
        fmt::format("--figures {}: cannot make the folder: {}", folder.string(), error.message()));
  }
  std::vector<OutputFile> files = {{folder / service::kAnswerPicture, answer_png}};
  for (const report::Figure& figure : figures) {
    files.push_back({folder / (figure.name + ".png"), figure.canvas.ToPng(figure.png_scale)});
    files.push_back({folder / (figure.name + ".svg"), figure.canvas.ToSvg()});
  }
  return WriteOutputs(files, force);
}

report::AnswerHead HeadOf(const Analysis& analysis, const ResultFile& result) {
  const Measured& answer = analysis.pressure_advance;
  report::AnswerHead head{.title = "Pressure advance", .verdict = answer.verdict()};
  if (answer.good()) {
    const Quantity& quantity = answer.quantity();
    head.value = report::ValueText(quantity.value, quantity.interval95, report::kSeconds);
    head.interval = report::IntervalText(quantity.interval95, report::kSeconds);
  } else {
    head.reason = answer.reason();
  }
  const measurement::Subject& subject = result.outcome.subject;
  for (const std::string& fact : {subject.filament, subject.printer}) {
    if (!fact.empty()) head.facts.push_back(fact);
  }
  head.facts.push_back(result.outcome.provenance.utc.substr(0, kDateLength));
  return head;
}

// Draws the answer above the photo, or above the first figure, in the phone's layout, so that the
// same picture is legible on small and large screens.
std::string AnswerPng(const report::AnswerHead& head, const std::vector<report::Figure>& figures) {
  constexpr double kScale = 3;
  const report::Canvas answer = DrawAnswerHead(head, report::kNarrowWidthPx);
  std::vector<const report::Canvas*> drawings = {&answer};
  const auto photo = std::ranges::find(figures, "photo", &report::Figure::name);
  if (!figures.empty()) {
    const report::Figure& figure = photo != figures.end() ? *photo : figures.front();
    drawings.push_back(figure.narrow ? &*figure.narrow : &figure.canvas);
  }
  return report::Canvas::StackedPng(drawings, kScale);
}

Result<void> WriteResult(const ResultFile& result, const AnalysisOutput& output) {
  if (output.keep_in_recording) {
    TRY(KeepInRecording(SourceOf(result), result));
  }
  if (output.files.result.empty()) return {};
  return WriteOutputs({OutputOf(output.files.result, result)}, output.files.force);
}

/// Files written beside the answer.
struct Written {
  std::string report;           ///< path; empty if none
  std::optional<Error> failed;  ///< the first file that could not be written
};

Written WriteFiles(const AnalysisRun& run, const ResultFile& result, const AnalysisOutput& output) {
  Written written;
  if (auto done = WriteResult(result, output); !done) written.failed = done.error();
  const bool draws = !output.files.report.empty() || !output.files.figures.empty() ||
                     !output.files.picture.empty();
  if (!draws) return written;
  const std::vector<report::Figure> figures = report::PressureAdvanceFigures(run);
  if (auto done = WriteReport(output.files.report, result, run, figures, output.files.force);
      done) {
    written.report = output.files.report;
  } else if (!written.failed) {
    written.failed = done.error();
  }
  const std::string answer_png = AnswerPng(HeadOf(run.analysis, result), figures);
  auto done = WriteFigures(output.files.figures, answer_png, figures, output.files.force);
  if (!done && !written.failed) written.failed = done.error();
  if (output.files.picture.empty()) return written;
  done = WriteOutputs({{output.files.picture, answer_png}}, output.files.force);
  if (!done && !written.failed) written.failed = done.error();
  return written;
}

void PrintFlow(const pressure_advance::FlowRatio& flow, const LineMotion& motion) {
  const std::string sentence = report::FlowSentence(flow);
  if (!flow.ratio.good()) {
    fmt::print("flow ratio        {}: {}\n", VerdictText(flow.ratio.verdict()), sentence);
    return;
  }
  const Quantity& ratio = flow.ratio.quantity();
  fmt::print("flow ratio        {}: {}\n", report::WithInterval(ratio, report::kFlowRatio),
             sentence);
  if (const std::string slip = report::SlipSentence(flow, motion); !slip.empty()) {
    fmt::print("                  {}\n", slip);
  }
  fmt::print(
      "  to use it       filament_flow_ratio = {:.3f} in OrcaSlicer, in place of the ratio there\n"
      "                  M221 S{:.1f} with a slicer's flow ratio of 1 (nothing applied)\n",
      ratio.value, 100 * ratio.value);
}

// Prints the commands of the firmware that printed the lines, or of each if unknown.
void PrintHowToUse(const std::optional<gcode::PrintedBy>& printed_by, const std::string& value_s) {
  const auto say = [&](gcode::Dialect dialect, int drive, const char* begin, std::string_view end) {
    for (const std::string& line : PressureAdvanceCommands(dialect, value_s, {{}, drive})) {
      fmt::print("{:<17} {}{}\n", begin, line, end);
    }
  };
  constexpr const char* kUse = "to use it";
  if (printed_by) {
    say(printed_by->dialect, printed_by->drive, kUse, "");
    PrintWrapped("to keep it", std::string(gcode::WordsOf(printed_by->dialect).keep));
    return;
  }
  for (const gcode::FirmwareWords& words : gcode::Firmwares()) {
    say(words.dialect, 0, &words == &gcode::Firmwares().front() ? kUse : "",
        fmt::format(" ({}{}{})", words.title, words.advance_note.empty() ? "" : "; ",
                    words.advance_note));
  }
}

// Prints the count of lines or corners, and the unused ones by reason.
void PrintUsed(const Analysis& analysis) {
  if (analysis.lines.empty()) return;
  const auto used = std::ranges::count_if(analysis.lines, &pressure_advance::LineResult::used);
  fmt::print("{:<17} {} of {} used\n", analysis.corners ? "corners" : "lines", used,
             analysis.lines.size());
  std::vector<std::pair<std::string, std::string>> unused;  // reason, values
  for (const auto& line : analysis.lines) {
    if (line.used || line.reason.empty()) continue;  // the verdict says why no line is used
    const auto same = std::ranges::find(unused, line.reason, &decltype(unused)::value_type::first);
    const std::string value = fmt::format("{:.4f}", line.pressure_advance_s);
    if (same != unused.end()) {
      same->second += ", " + value;
    } else {
      unused.emplace_back(line.reason, value);
    }
  }
  for (const auto& [reason, values] : unused) fmt::print("  at {} s: {}\n", values, reason);
}

}  // namespace

void PrintAnswer(const Analysis& analysis) {
  const Measured& answer = analysis.pressure_advance;
  if (answer.good()) {
    fmt::print("pressure advance  {}\n", report::WithInterval(answer.quantity(), report::kSeconds));
  }
  if (answer.good() || analysis.repeats) {
    for (const report::AnswerRow& row : report::AnswerRows(analysis)) {
      fmt::print("  {:<18}  {}{}{}{}\n", row.name, row.value,
                 row.interval.empty() ? "" : " (" + row.interval + ")",
                 row.note.empty() ? "" : ", ", row.note);
    }
  }
  PrintUsed(analysis);
  for (const std::string& notice : analysis.notices) fmt::print("notice            {}\n", notice);
  fmt::print("verdict           {}\n", VerdictText(answer.verdict()));
  if (!answer.good()) fmt::print("because           {}\n", answer.reason());
  if (answer.good()) {
    const Quantity& q = answer.quantity();
    PrintHowToUse(analysis.printed_by, report::SecondsText(q.value, q.standard_uncertainty));
  }
  if (analysis.flow) PrintFlow(*analysis.flow, analysis.motion);
  std::fflush(stdout);  // before the files, which take longer than the analysis
}

AnalysisOutput KeptIn(const std::filesystem::path& recording, bool json) {
  AnalysisOutput output;
  output.files.report = (recording / "report.html").string();
  output.files.picture = (recording / service::kAnswerPicture).string();
  output.files.figures = (recording / service::kFiguresFolder).string();
  output.json = json;
  output.keep_in_recording = true;
  return output;
}

Result<void> KeepAnalysis(const AnalysisRun& run, const ResultFile& result,
                          const AnalysisOutput& output) {
  const Written written = WriteFiles(run, result, output);
  if (written.failed) return tl::unexpected(*written.failed);
  return {};
}

int WriteAnalysis(const AnalysisRun& run, const ResultFile& result, const AnalysisOutput& output) {
  // Prints the answer even if files failed: a full disk must not lose it.
  const Written written = WriteFiles(run, result, output);
  if (output.json) {
    std::optional<std::string> report_path;
    if (!written.report.empty()) report_path = written.report;
    std::fputs(JsonText(report::JsonOf(run.analysis, report_path)).c_str(), stdout);
  } else if (!written.report.empty()) {
    fmt::print("report            {}\n", written.report);
  }
  if (written.failed) return PrintError(*written.failed);
  return run.analysis.pressure_advance.good() ? kExitGood : kExitNotTrusted;
}

int PrintAnalysis(const AnalysisRun& run, const ResultFile& result, const AnalysisOutput& output) {
  if (!output.json) PrintAnswer(run.analysis);
  return WriteAnalysis(run, result, output);
}

}  // namespace trammel::app
