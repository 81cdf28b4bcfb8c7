// trammel align plan: the views to take, within the machine's travel and clear
// of part and fixture.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "app/align_commands.h"
#include "app/commands.h"
#include "part_alignment/view_plan.h"
#include "store/alignment_file.h"
#include "store/whole_file.h"

namespace trammel::app {
namespace {

using part_alignment::MachineBox;
using part_alignment::ViewPlan;

struct PlanArguments {
  std::string file;
  std::vector<double> rough_mm;
  std::vector<double> rough_mm_per_m = {0, 0, 0};
  std::vector<double> travel;
  std::vector<double> obstacles;
  part_alignment::ViewPlanOptions options;
  std::string out;
};

constexpr std::size_t kBoxNumbers = 6;

MachineBox BoxOf(const std::vector<double>& n, std::size_t from) {
  return {{n[from], n[from + 1], n[from + 2]}, {n[from + 3], n[from + 4], n[from + 5]}};
}

// Not the covariance's: what a person has to know before driving.
void Tell(const ViewPlan& plan) {
  fmt::print(stderr, "verdict    {}\n", ToString(plan.verdict));
  if (!plan.reason.empty()) fmt::print(stderr, "reason     {}\n", plan.reason);
  int number = 0;
  for (const part_alignment::PlannedView& view : plan.views) {
    fmt::print(stderr, "view {:<5} X {:9.2f}  Y {:9.2f}  Z {:9.2f}   {}: {}\n", number++,
               view.spindle_mm.x(), view.spindle_mm.y(), view.spindle_mm.z(),
               fmt::join(view.targets, ", "), view.why);
  }
  fmt::print(stderr,
             "views tell {} of {} unknowns; the weakest direction to {:.4f} mm "
             "(k = 1)\n",
             plan.observability.rank, plan.observability.unknowns,
             plan.observability.weakest_sigma_mm);
  if (!plan.observability.words.empty()) {
    fmt::print(stderr, "           {}\n", plan.observability.words);
  }
}

int RunPlan(PlanArguments arguments) {
  constexpr double kPerMille = 1e-3;
  auto input = store::ReadAlignmentFile(arguments.file, 0);
  if (!input) return Report(input.error());
  if (arguments.obstacles.size() % kBoxNumbers != 0) {
    return Report({ErrorKind::kInput,
                   "--obstacle takes six numbers: the least "
                   "X, Y, Z and the most X, Y, Z"});
  }
  part_alignment::ViewPlanOptions& options = arguments.options;
  options.unknowns = input->unknowns;
  options.travel = BoxOf(arguments.travel, 0);
  for (std::size_t i = 0; i < arguments.obstacles.size(); i += kBoxNumbers) {
    options.obstacles.push_back(BoxOf(arguments.obstacles, i));
  }
  const std::vector<double>& mm = arguments.rough_mm;
  const std::vector<double>& turn = arguments.rough_mm_per_m;
  const geometry::Pose rough{{mm[0], mm[1], mm[2]},
                             {turn[0] * kPerMille, turn[1] * kPerMille, turn[2] * kPerMille}};
  const auto plan = part_alignment::PlanViews(input->measurement.camera, input->measurement.targets,
                                              rough, options);
  if (!plan) return Report(plan.error());
  input->measurement.views.clear();
  input->pictures.clear();
  for (const part_alignment::PlannedView& view : plan->views) {
    input->measurement.views.push_back({view.spindle_mm, view.spindle_rotation, {}});
  }
  Tell(*plan);
  const std::string text = store::AlignmentFileText(*input);
  if (arguments.out.empty()) {
    std::fputs(text.c_str(), stdout);
  } else if (auto written = store::WriteWholeFile(arguments.out, text); !written) {
    return Report(written.error());
  }
  return plan->verdict == Verdict::kGood ? kExitGood : kExitNotTrusted;
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
  command
      ->add_option("--travel", arguments->travel,
                   "of the spindle: the least X,Y,Z and the most X,Y,Z")
      ->expected(static_cast<int>(kBoxNumbers))
      ->delimiter(',')
      ->required();
  command
      ->add_option("--obstacle", arguments->obstacles,
                   "least X,Y,Z and most X,Y,Z of part or fixture; may be repeated")
      ->delimiter(',');
  command->add_option("--distance", options.working_distance_mm, "from camera to target, mm")
      ->check(CLI::Range(20.0, 10000.0))
      ->capture_default_str();
  command->add_option("--sigma-px", options.sigma_px, "expected of a centre")
      ->check(CLI::Range(1e-4, 10.0))
      ->capture_default_str();
  command->add_option("--goal", options.weakest_goal_mm, "wanted of the weakest direction, mm")
      ->check(CLI::Range(1e-4, 10.0))
      ->capture_default_str();
  command->add_option("--clearance", options.clearance_mm, "kept from obstacles, mm")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  command->add_option("--most-views", options.most_views)
      ->check(CLI::Range(1, 200))
      ->capture_default_str();
  command->add_option("--out", arguments->out, "a file for align measure; else standard output");
  command->callback([arguments, &exit_code] { exit_code = RunPlan(*arguments); });
}

}  // namespace trammel::app
