// trammel align budget, and trammel align study: the published tables with ours beside.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/number_range.h"
#include "app/slow_work.h"
#include "app/today.h"
#include "document/interval_text.h"
#include "part_alignment/budget/budget.h"
#include "part_alignment/budget/budget_study.h"
#include "part_alignment/budget/repeated.h"
#include "part_alignment/camera/calibration_age.h"
#include "part_alignment/commands/align_commands.h"
#include "part_alignment/commands/align_outputs.h"
#include "part_alignment/files/alignment_file.h"
#include "part_alignment/files/budget_file.h"
#include "part_alignment/files/camera_file.h"
#include "part_alignment/report/part_metrology_text.h"

namespace trammel::app {
namespace {

struct BudgetArguments {
  std::string scene;
  std::vector<std::string> cameras;
  std::vector<std::string> observations;
  int trials = 20'000;
  std::uint64_t seed = 1000;
  bool json = false;
};

// Lengths and tolerance, where the scene has them; false where one of them is not held.
bool JudgeScene(const files::BudgetFile& file, const part_alignment::Budget& budget,
                std::string& text) {
  bool held = true;
  const part_alignment::BudgetScene& scene = file.scene;
  if (!file.lengths.empty()) {
    const auto judged = part_alignment::JudgeLengths(file.lengths, scene.length_error_mm,
                                                     scene.length_error_per_mm);
    if (!judged) {
      text += fmt::format("lengths   {}\n", judged.error().message);
      return false;
    }
    held = judged->within;
    text += fmt::format("lengths   largest error {:.4f} mm, {} {:g} mm + {:g} mm/m\n",
                        judged->largest_mm, judged->within ? "within" : "NOT within",
                        scene.length_error_mm, 1000 * scene.length_error_per_mm);
    for (const std::string& notice : judged->notices) text += fmt::format("notice    {}\n", notice);
  }
  if (file.tolerance_mm) {
    const auto& [lower, upper] = *file.tolerance_mm;
    double expanded_mm = 0;
    for (const auto& axis : budget.axes) expanded_mm = std::max(expanded_mm, axis.expanded_mm);
    const auto capability = part_alignment::JudgeCapability(expanded_mm, lower, upper);
    held = held && capability.capable;
    text += fmt::format(
        "capable   {}: U / T = {:.1f} % with T = {:g} mm, the tolerance's full width ({:.1f} % of "
        "its half); Berndt's rule asks for at most 20 %\n",
        capability.capable ? "yes" : "NO", 100 * capability.ratio, upper - lower,
        100 * capability.ratio_of_half_width);
  }
  return held;
}

// The same file twice would pass for two measurements that agree.
Result<void> CheckOnce(const char* option, const std::vector<std::string>& paths) {
  std::set<std::filesystem::path> seen;
  for (const std::string& path : paths) {
    std::error_code error;
    if (seen.insert(std::filesystem::weakly_canonical(std::filesystem::absolute(path), error))
            .second)
      continue;
    return Fail(
        fmt::format("{} {} is given twice: each must be a calibration or a measurement of "
                    "its own",
                    option, path));
  }
  return {};
}

// The targets' uncertainty from repeated calibrations and measurements, instead of the scene's.
Result<std::string> TakeRepeats(const BudgetArguments& arguments,
                                part_alignment::BudgetScene& scene) {
  if (auto once = CheckOnce("--camera", arguments.cameras); !once) {
    return tl::unexpected(once.error());
  }
  if (auto once = CheckOnce("--observations", arguments.observations); !once) {
    return tl::unexpected(once.error());
  }
  std::vector<part_alignment::Camera> cameras;
  for (const std::string& path : arguments.cameras) {
    const auto camera = files::ReadCameraFile(path);
    if (!camera) return tl::unexpected(camera.error());
    cameras.push_back(camera->camera);
    if (!camera->calibration) continue;
    if (const auto old = part_alignment::NoticeOfAge(camera->calibration->date, Today())) {
      fmt::print(stderr, "{}: {}\n", path, *old);
    }
  }
  std::vector<part_alignment::Measurement> measurements;
  part_alignment::SolveOptions options;
  for (const std::string& path : arguments.observations) {
    auto input = files::ReadAlignmentFile(path);
    if (!input) return tl::unexpected(input.error());
    options.unknowns = input->unknowns;
    measurements.push_back(std::move(input->measurement));
  }
  const auto repeated = part_alignment::RepeatAlignments(cameras, measurements, options);
  if (!repeated) return tl::unexpected(repeated.error());
  scene.target_sigma_mm = repeated->single_mm;
  scene.motion_covariance = repeated->motion_covariance;
  scene.repeats = static_cast<int>(std::min(cameras.size(), measurements.size()));
  const Eigen::Vector3d single_um = report::kUmPerMm * repeated->single_mm;
  const Eigen::Vector3d joint_um = report::kUmPerMm * repeated->joint_mm;
  return fmt::format(
      "targets   one calibration and one measurement scatter by {:.1f}, {:.1f}, {:.1f} µm "
      "(standard deviations); "
      "all "
      "{} x {} values by {:.1f}, {:.1f}, {:.1f} µm\n",
      single_um.x(), single_um.y(), single_um.z(), cameras.size(), measurements.size(),
      joint_um.x(), joint_um.y(), joint_um.z());
}

int RunBudget(const BudgetArguments& arguments) {
  auto file = files::ReadBudgetFile(arguments.scene);
  if (!file) return PrintError(file.error());
  std::string repeats;
  if (!arguments.cameras.empty() || !arguments.observations.empty()) {
    const auto taken = TakeRepeats(arguments, file->scene);
    if (!taken) return PrintError(taken.error());
    repeats = *taken;
  }
  Random random(arguments.seed);
  const SlowWork work(fmt::format("drawing {} measurements", arguments.trials));
  const auto budget = part_alignment::MakeBudget(file->scene, arguments.trials, random);
  if (!budget) {
    return PrintError(
        {budget.error().kind, fmt::format("{}: {}", arguments.scene, budget.error().message)});
  }
  std::string text = repeats + report::BudgetText(*budget);
  const bool held = JudgeScene(*file, *budget, text);
  PrintAnswer(arguments.json, report::ToJson(*budget), text);
  return held ? kExitGood : kExitNotTrusted;
}

struct StudyArguments {
  int trials = 20'000;
  int repeats = 1000;
  std::uint64_t seed = 1000;
};

Result<std::string> GaugingLine(const char* name, const part_alignment::GaugingScene& gauging,
                                double limit_mm, const char* paper, const StudyArguments& arguments,
                                Random& random) {
  const auto result = part_alignment::SimulateGauging(gauging, limit_mm, arguments.repeats, random);
  if (!result) return tl::unexpected(result.error());
  return fmt::format(
      "  {:<44} 2 σ = {:.3f} mm ({:.3f} … {:.3f}), largest {:.3f} mm, within ±{:.2f} mm in {:.0f} "
      "% "
      "| paper {}\n",
      name, result->two_sigma_mm, result->two_sigma_low_mm, result->two_sigma_high_mm,
      result->largest_mm, limit_mm, 100 * result->within, paper);
}

int RunStudy(const StudyArguments& arguments) {
  Random random(arguments.seed);
  const SlowWork work(fmt::format("drawing {} measurements a table", arguments.trials));
  const auto tables = part_alignment::BudgetTables(arguments.trials, random);
  if (!tables) return PrintError(tables.error());
  fmt::print("{}", report::StudyText(*tables));
  fmt::print("Gauging: 10 targets in each of 10 measurements, {} times (median, 95 % of them)\n",
             arguments.repeats);
  part_alignment::GaugingScene laboratory;
  laboratory.scene = part_alignment::PaperLaboratory();
  part_alignment::GaugingScene cautious = laboratory;
  cautious.scene.out_sigma_mm = Eigen::Vector3d(0.0709, 0.0705, 0.0703);
  part_alignment::GaugingScene industry;
  industry.scene = part_alignment::PaperIndustry();
  part_alignment::GaugingScene turning = industry;
  turning.scene = part_alignment::PaperIndustryWithLaboratoryAngles();
  constexpr double kLaboratory_mm = 0.15;
  constexpr double kIndustry_mm = 0.5;
  for (const auto& line : {GaugingLine("laboratory, u_out of 50 µm + 20 µm/m", laboratory,
                                       kLaboratory_mm, "0.10 mm, ±0.15 mm", arguments, random),
                           GaugingLine("laboratory, u_out as the paper measured it", cautious,
                                       kLaboratory_mm, "0.10 mm, ±0.15 mm", arguments, random),
                           GaugingLine("industry, u_out of 50 µm + 20 µm/m", industry, kIndustry_mm,
                                       "0.34 mm, ±0.50 mm", arguments, random),
                           GaugingLine("the same with the laboratory's angles", turning,
                                       kIndustry_mm, "0.34 mm, ±0.50 mm", arguments, random)}) {
    if (!line) return PrintError(line.error());
    fmt::print("{}", *line);
  }
  fmt::print(
      "  - The error out of the machine stays with a point over all measurements, pose and "
      "temperature are drawn for each; the probe adds 2 µm.\n"
      "Capability of the industrial scene: U = 0.336 mm is {:.1f} % of T = 2 mm (full width) and "
      "{:.1f} % of 1 mm: the paper's 17 % takes the full width.\n",
      100 * part_alignment::JudgeCapability(0.336, -1, 1).ratio,
      100 * part_alignment::JudgeCapability(0.336, -1, 1).ratio_of_half_width);
  return kExitGood;
}

}  // namespace

void AddAlignBudgetCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "budget", "the uncertainty of any point of a part, by propagation and by simulation");
  const auto arguments = std::make_shared<BudgetArguments>();
  command->add_option("scene", arguments->scene, "SCENE.json (docs/formats.md)")->required();
  command->add_option("--camera", arguments->cameras,
                      "camera files of repeated calibrations: with --observations, instead of the "
                      "scene's target_sigma_mm");
  command->add_option("--observations", arguments->observations,
                      "observations of repeated measurements of one part");
  command->add_option("--trials", arguments->trials, "of the simulation; 0: none")
      ->check(CLI::Range(0, 10'000'000))
      ->capture_default_str();
  command->add_option("--seed", arguments->seed, "of the simulation")
      ->check(SeedNumber())
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "one JSON object instead of text");
  command->callback([arguments, &exit_code] { exit_code = RunBudget(*arguments); });
}

void AddAlignStudyCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "study", "the published uncertainty tables and gauging, with ours beside");
  const auto arguments = std::make_shared<StudyArguments>();
  command->add_option("--trials", arguments->trials, "of each table's simulation")
      ->check(CLI::Range(0, 10'000'000))
      ->capture_default_str();
  command->add_option("--repeats", arguments->repeats, "of the gauging")
      ->check(CLI::Range(10, 1'000'000))
      ->capture_default_str();
  command->add_option("--seed", arguments->seed, "of all random numbers")
      ->check(SeedNumber())
      ->capture_default_str();
  command->callback([arguments, &exit_code] { exit_code = RunStudy(*arguments); });
}

}  // namespace trammel::app
