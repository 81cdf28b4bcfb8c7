// trammel align plan: plans the views to take, within the machine's travel and clear of part and
// fixture.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/option_values.h"
#include "app/output_files.h"
#include "app/provenance.h"
#include "app/slow_work.h"
#include "files/new_file.h"
#include "part_alignment/commands/align_commands.h"
#include "part_alignment/commands/align_outputs.h"
#include "part_alignment/commands/machine_options.h"
#include "part_alignment/files/alignment_file.h"
#include "part_alignment/report/alignment_report.h"
#include "part_alignment/views/view_plan.h"

namespace trammel::app {
namespace {

using part_alignment::ViewPlan;

struct PlanArguments {
  std::string file;
  std::vector<double> rough_mm;
  std::vector<double> rough_mm_per_m = {0, 0, 0};
  MachineBoxArguments boxes;
  part_alignment::ViewPlanOptions options;
  std::string out;
  bool force = false;
};

// Prints what the operator must know before driving.
void PrintPlan(const ViewPlan& plan) {
  fmt::print(stderr, "verdict    {}\n", VerdictText(plan.verdict));
  if (!plan.reason.empty()) fmt::print(stderr, "reason     {}\n", plan.reason);
  int number = 1;
  for (const part_alignment::PlannedView& view : plan.views) {
    fmt::print(stderr, "view {:<5} X {:9.2f}  Y {:9.2f}  Z {:9.2f}   {}: {}\n", number++,
               view.spindle_mm.x(), view.spindle_mm.y(), view.spindle_mm.z(),
               fmt::join(view.targets, ", "), view.why);
  }
  fmt::print(stderr, "{}", report::ObservabilityText(plan.observability, plan.reason));
}

Result<int> RunPlan(PlanArguments arguments) {
  constexpr double kRadPerMmPerM = 1e-3;
  if (!arguments.out.empty()) {
    TRY(RefuseToOverwrite({arguments.out}, arguments.force));
  }
  auto input = TRY(files::ReadAlignmentFile(arguments.file, 0));
  part_alignment::ViewPlanOptions& options = arguments.options;
  options.unknowns = input.unknowns;
  options.travel = TravelOf(arguments.boxes);
  options.obstacles = TRY(ObstaclesOf(arguments.boxes));
  options.tool_radius_mm = arguments.boxes.camera_radius_mm;
  options.tool_length_mm = arguments.boxes.camera_below_mm;
  const std::vector<double>& mm = arguments.rough_mm;
  const std::vector<double>& turn = arguments.rough_mm_per_m;
  const geometry::Pose rough{
      {mm[0], mm[1], mm[2]},
      {turn[0] * kRadPerMmPerM, turn[1] * kRadPerMmPerM, turn[2] * kRadPerMmPerM}};
  const SlowWork work("planning the views");
  const auto plan = TRY(part_alignment::PlanViews(input.measurement.camera,
                                                  input.measurement.targets, rough, options));
  input.measurement.views.clear();
  input.pictures.clear();
  for (const part_alignment::PlannedView& view : plan.views) {
    input.measurement.views.push_back({view.spindle_mm, view.spindle_rotation, {}});
  }
  PrintPlan(plan);
  // An insufficient plan is not written, as measure would drive through it.
  if (plan.verdict != Verdict::kGood) {
    fmt::print(stderr, "trammel: no plan is written: {}\n", plan.reason);
    return kExitNotTrusted;
  }
  const std::string text = files::AlignmentFileText(input);
  if (arguments.out.empty()) {
    std::fputs(text.c_str(), stdout);
    return kExitGood;
  }
  TRY(files::WriteWholeFile(arguments.out, text, files::ReplaceIf(arguments.force)));
  PrintWrapped("next",
               fmt::format("trammel align measure {} --source CAMERA", ShellQuoted(arguments.out)),
               11, stderr);
  return kExitGood;
}

}  // namespace

void AddAlignPlanCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand("plan", "the views to take, each with its reason");
  const auto arguments = std::make_shared<PlanArguments>();
  part_alignment::ViewPlanOptions& options = arguments->options;
  command
      ->add_option("file", arguments->file,
                   "camera, targets and unknowns, as observations have them; "
                   "views are not looked at")
      ->required();
  command->add_option("--rough", arguments->rough_mm, "about where the part's origin is: X,Y,Z mm")
      ->expected(3)
      ->delimiter(',')
      ->required();
  command
      ->add_option("--rough-angles", arguments->rough_mm_per_m,
                   "about how the part is turned: alpha,beta,gamma in mm/m")
      ->expected(3)
      ->delimiter(',');
  AddMachineBoxes(*command, arguments->boxes);
  command->get_option("--travel")->required();
  AddNumber(*command, "--distance", options.working_distance_mm, "from camera to target, mm", 20.0,
            10000.0);
  AddNumber(*command, "--sigma-px", options.sigma_px, "expected of a centre", 1e-4, 10.0);
  AddNumber(*command, "--goal", options.weakest_goal_mm, "wanted of the weakest direction, mm",
            1e-4, 10.0);
  AddNumber(*command, "--clearance", options.clearance_mm,
            "kept between camera and obstacles, mm: for how roughly the place is known", 0.0,
            1000.0);
  command->add_option("--most-views", options.max_views)
      ->check(CLI::Range(1, 200))
      ->capture_default_str();
  command->add_option("-o,--out", arguments->out, "a file for align measure; else standard output");
  command->add_flag("--force", arguments->force, "overwrite that file");
  OnRun(*command, exit_code, [arguments] { return RunPlan(*arguments); });
}

}  // namespace trammel::app
