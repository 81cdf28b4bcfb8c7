// trammel align solve: computes the part's pose and the camera's clamping from observations.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/option_values.h"
#include "app/output_files.h"
#include "app/provenance.h"
#include "app/slow_work.h"
#include "base/json_text.h"
#include "base/random.h"
#include "part_alignment/commands/align_commands.h"
#include "part_alignment/commands/align_outputs.h"
#include "part_alignment/files/alignment_file.h"
#include "part_alignment/pose/pose_uncertainty.h"
#include "part_alignment/pose/solve.h"
#include "part_alignment/report/alignment_report.h"

namespace trammel::app {
namespace {

struct SolveArguments {
  std::string file;
  std::vector<std::string> unknowns;
  bool not_robust = false;
  int trials = 0;
  std::uint64_t seed = 1;
  bool force = false;
  bool json = false;
  std::string out;
  std::string result;
  std::string report;
};

// Returns the pictures that exist; the other views are drawn without.
std::vector<std::filesystem::path> PicturesOf(const files::AlignmentInput& input,
                                              const std::filesystem::path& file) {
  std::vector<std::filesystem::path> pictures;
  for (const std::string& name : input.pictures) {
    const std::filesystem::path picture = name.empty() ? "" : file.parent_path() / name;
    std::error_code error;
    pictures.push_back(std::filesystem::is_regular_file(picture, error) ? picture : "");
  }
  return pictures;
}

// Runs the simulation; its failure must not lose the result.
std::optional<part_alignment::MonteCarloUncertainty> Simulate(
    const SolveArguments& arguments, const files::AlignmentInput& input,
    const part_alignment::SolveOptions& options, part_alignment::Alignment& alignment) {
  if (arguments.trials == 0 || alignment.verdict != Verdict::kGood) return std::nullopt;
  Random random(arguments.seed);
  auto simulated = part_alignment::SimulateAnswer(input.measurement, options, alignment,
                                                  arguments.trials, random);
  if (!simulated) {
    alignment.notices.push_back("no simulation: " + simulated.error().message);
    return std::nullopt;
  }
  if (auto notice = part_alignment::NoticeOfSimulation(alignment, *simulated)) {
    alignment.notices.push_back(std::move(*notice));
  }
  return std::move(*simulated);
}

CLI::Validator NumberOfTrials() {
  return CLI::Validator(
      [](const std::string& text) -> std::string {
        constexpr int kMin = 100;
        constexpr int kMax = 1'000'000;
        int trials = -1;
        const bool whole = CLI::detail::lexical_cast(text, trials);
        if (whole && (trials == 0 || (trials >= kMin && trials <= kMax))) return {};
        return fmt::format("{} is neither 0 nor a whole number in {} … {}", text, kMin, kMax);
      },
      "INT");
}

Result<void> Write(const SolveArguments& arguments, const files::AlignmentInput& input,
                   const report::AlignmentOutput& output, const ResultFile& result) {
  std::vector<OutputFile> files;
  if (!arguments.out.empty()) files.push_back({arguments.out, JsonText(result.details)});
  if (!arguments.result.empty()) files.push_back(OutputOf(arguments.result, result));
  TRY(WriteOutputs(files, arguments.force));
  if (arguments.report.empty()) return {};
  return WriteAlignmentReport(arguments.report, output, &result, PicturesOf(input, arguments.file),
                              arguments.force);
}

Result<int> RunSolve(const SolveArguments& arguments) {
  TRY(CheckFree({arguments.out, arguments.report, arguments.json, arguments.force}));
  TRY(CheckOutputs({.result = arguments.result, .force = arguments.force}));
  auto input = TRY(files::ReadAlignmentFile(arguments.file));
  if (!arguments.unknowns.empty()) {
    const auto unknowns = files::ParseUnknowns(arguments.unknowns);
    if (!unknowns) return Fail("--unknowns " + unknowns.error().message);
    input.unknowns = *unknowns;
  }
  part_alignment::SolveOptions options = SolveOptionsOf(input);
  options.robust = !arguments.not_robust;
  const SlowWork work("solving the views");
  auto alignment = part_alignment::Solve(input.measurement, options);
  if (!alignment) {
    return Fail(arguments.file + ": " + alignment.error().message, alignment.error().kind);
  }
  auto simulated = Simulate(arguments, input, options, *alignment);
  report::AlignmentOutput output = OutputOf(input, std::move(*alignment));
  output.simulated = std::move(simulated);
  // The result is printed even if the files cannot be written.
  const ResultFile result = ResultOf(output, arguments.file);
  const auto written = Write(arguments, input, output, result);
  PrintAlignment(output, result, arguments.json,
                 arguments.out.empty() ? arguments.result : arguments.out);
  if (!written) return tl::unexpected(written.error());
  if (!arguments.json && output.alignment.verdict == Verdict::kGood) {
    PrintWrapped("next",
                 arguments.result.empty()
                     ? "with --result FILE: trammel align correct FILE"
                     : "trammel align correct " + ShellQuoted(arguments.result),
                 11, stderr);
  }
  return output.alignment.verdict == Verdict::kGood ? kExitGood : kExitNotTrusted;
}

}  // namespace

void AddAlignSolveCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command =
      parent.add_subcommand("solve", "where the part is, and how the camera is clamped");
  const auto arguments = std::make_shared<SolveArguments>();
  command->add_option("file", arguments->file, "observations (docs/reference/formats.md)")
      ->required();
  command
      ->add_option("--unknowns", arguments->unknowns,
                   "instead of the file's: pose, clamp_angle, clamp_eccentricity, clamp_tilt, "
                   "focal_length, camera_offset; with commas or blanks between them")
      ->delimiter(',');
  command->add_flag("--no-robust", arguments->not_robust, "leave no wrong target out");
  command
      ->add_option("--trials", arguments->trials,
                   "of a simulation of this measurement, whose scatter is put beside what is "
                   "stated: 100 to 1000000; 0: none")
      ->capture_default_str();
  command->get_option("--trials")->check(NumberOfTrials());
  command->add_option("--seed", arguments->seed, "of the simulation")
      ->check(SeedNumber())
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "JSON alone, without the text");
  command->add_option("-o,--out", arguments->out, "write the JSON to this file, too");
  command->add_option("--result", arguments->result,
                      "keep the answer as JSON here, for align correct");
  command->add_flag("--force", arguments->force, "overwrite those files, and the page");
  command->add_option("--report", arguments->report,
                      "a folder for a page with every view: what was found, projected and left "
                      "over, on the pictures that the file names");
  OnRun(*command, exit_code, [arguments] { return RunSolve(*arguments); });
}

}  // namespace trammel::app
