// trammel tap plot: pictures of taps.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/output_files.h"
#include "app/slow_work.h"
#include "tap/commands/tap_commands.h"
#include "tap/commands/tap_run.h"
#include "tap/files/tap_file.h"
#include "tap/report/tap_report.h"

namespace trammel::app {
namespace {

struct PlotArguments {
  TapArguments tap;
  std::string out;
  bool force = false;
  std::string figure;
};

/// Runs both methods on every tap. The files have been read.
std::vector<report::PlottedTap> PlottedOf(const TapRun& run, const tap::TapOptions& options) {
  tap::TapOptions contact = options;
  contact.method = tap::Method::kContact;
  tap::TapOptions two_line = options;
  two_line.method = tap::Method::kTwoLine;
  tap::TapAnalyser contact_analyser(contact);
  std::vector<report::PlottedTap> plotted;
  for (const report::AnalysedTap& tap : run.taps) {
    if (!tap.unread.empty()) continue;
    const tap::TapAnalysis by_contact = AnalyseRecorded(tap.recording, contact, contact_analyser);
    // Both methods are drawn over the same heights.
    two_line.latency_s = by_contact.latency_s;
    tap::TapAnalyser two_line_analyser(two_line);
    plotted.push_back({tap.recording, by_contact,
                       AnalyseRecorded(tap.recording, two_line, two_line_analyser),
                       by_contact.latency_s});
  }
  return plotted;
}

report::TapReportInput InputOf(std::span<const report::PlottedTap> taps) {
  std::vector<report::AnalysedTap> analysed;
  for (const report::PlottedTap& tap : taps) analysed.push_back({tap.recording, tap.contact, {}});
  constexpr double kWanted_mm = 0.001;  // a first layer does not show 1 um
  TapAdviceRun advice = AdviseOn(analysed, kWanted_mm);
  return {taps, tap::Summarise(ResultsOf(analysed)), std::move(advice.noise),
          std::move(advice.advice)};
}

/// Returns the requested picture, or the first one.
Result<std::string> PictureOf(const report::TapReportInput& input, const std::string& wanted,
                              bool svg) {
  constexpr std::size_t kOneTap = 1;
  std::string known;
  for (const report::Figure& figure : report::TapFigures(input, kOneTap)) {
    if (wanted.empty() || wanted == figure.name) {
      return svg ? figure.canvas.ToSvg() : figure.canvas.ToPng(figure.png_scale);
    }
    known += (known.empty() ? "" : ", ") + figure.name;
  }
  return Fail(fmt::format("--figure {}: these taps have the figures {}", wanted, known));
}

Result<std::string> BytesOf(const PlotArguments& arguments,
                            std::span<const report::PlottedTap> taps) {
  const std::string ending = std::filesystem::path(arguments.out).extension().string();
  const report::TapReportInput input = InputOf(taps);
  if (ending == ".html") {
    if (!arguments.figure.empty()) {
      return Fail(
          fmt::format("--figure {}: a page has them all; name an .svg or .png", arguments.figure));
    }
    return report::TapReport(input);
  }
  if (ending == ".svg" || ending == ".png") {
    return PictureOf(input, arguments.figure, ending == ".svg");
  }
  return Fail(fmt::format("--out {}: must end in .html, .svg or .png", arguments.out));
}

int RunPlot(const PlotArguments& arguments) {
  const auto options = TapOptionsOf(arguments.tap);
  if (!options) return PrintError(options.error());
  const SlowWork work("analysing and drawing the taps");
  const TapRun run = AnalyseFiles(arguments.tap, *options);
  for (const Error& error : run.failed) return PrintError(error);
  const std::vector<report::PlottedTap> taps = PlottedOf(run, *options);
  const auto bytes = BytesOf(arguments, taps);
  if (!bytes) return PrintError(bytes.error());
  if (auto written = WriteOutputs({{arguments.out, *bytes}}, arguments.force); !written) {
    return PrintError(written.error());
  }
  fmt::print("{} of {} taps good; written to {}\n",
             std::count_if(taps.begin(), taps.end(),
                           [](const auto& tap) { return tap.contact.verdict == Verdict::kGood; }),
             taps.size(), arguments.out);
  return kExitGood;
}

}  // namespace

void AddTapPlotCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand("plot", "draw taps as both methods read them");
  const auto arguments = std::make_shared<PlotArguments>();
  AddTapFiles(*command, arguments->tap);
  AddTapMeasuring(*command, arguments->tap);
  command->add_option("-o,--out", arguments->out, "file to write: .html, .svg or .png")->required();
  command->add_flag("--force", arguments->force, "overwrite it");
  command->add_option("--figure", arguments->figure,
                      "picture: series, mesh, tap or noise (default: the first there is); of "
                      "several taps the first one's");
  command->callback([arguments, &exit_code] { exit_code = RunPlot(*arguments); });
}

}  // namespace trammel::app
