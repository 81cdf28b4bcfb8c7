// trammel align budget.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "app/commands.h"
#include "app/option_values.h"
#include "app/slow_work.h"
#include "part_alignment/budget/budget.h"
#include "part_alignment/commands/align_commands.h"
#include "part_alignment/commands/align_outputs.h"
#include "part_alignment/files/part_fit_file.h"
#include "part_alignment/report/part_fit_report.h"

namespace trammel::app {
namespace {

struct BudgetArguments {
  std::string scene;
  int trials = 20'000;
  std::uint64_t seed = 1000;
  bool json = false;
};

// Checks lengths and tolerance, if the scene has them; false if one of them is exceeded.
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

Result<int> RunBudget(const BudgetArguments& arguments) {
  auto file = TRY(files::ReadBudgetFile(arguments.scene));
  Random random(arguments.seed);
  const SlowWork work(fmt::format("drawing {} measurements", arguments.trials));
  const auto budget = part_alignment::MakeBudget(file.scene, arguments.trials, random);
  if (!budget) {
    return Fail(fmt::format("{}: {}", arguments.scene, budget.error().message),
                budget.error().kind);
  }
  std::string text = report::BudgetText(*budget);
  const bool held = JudgeScene(file, *budget, text);
  fmt::print("{}", arguments.json ? report::ToJson(*budget) : text);
  return held ? kExitGood : kExitNotTrusted;
}

}  // namespace

void AddAlignBudgetCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "budget", "the uncertainty of any point of a part, by propagation and by simulation");
  const auto arguments = std::make_shared<BudgetArguments>();
  command->add_option("scene", arguments->scene, "SCENE.json (docs/reference/formats.md)")
      ->required();
  command->add_option("--trials", arguments->trials, "of the simulation; 0: none")
      ->check(CLI::Range(0, 10'000'000))
      ->capture_default_str();
  command->add_option("--seed", arguments->seed, "of the simulation")
      ->check(SeedNumber())
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "one JSON object instead of text");
  OnRun(*command, exit_code, [arguments] { return RunBudget(*arguments); });
}

}  // namespace trammel::app
