// trammel align solve: observations of a part in, where it is and how the camera is clamped out.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "app/align_commands.h"
#include "app/commands.h"
#include "part_alignment/solve.h"
#include "report/alignment_json.h"
#include "report/alignment_text.h"
#include "store/alignment_file.h"
#include "store/whole_file.h"

namespace trammel::app {
namespace {

struct SolveArguments {
  std::string file;
  std::string method = "ceres";
  std::vector<std::string> unknowns;
  bool not_robust = false;
  bool json = false;
  std::string out;
};

// Distances outside of those at which the camera was calibrated are extrapolated.
void AddDistanceNotice(const store::AlignmentInput& input, part_alignment::Alignment& alignment) {
  if (!input.calibration || alignment.verdict != Verdict::kGood) return;
  part_alignment::Camera camera = input.measurement.camera;
  if (input.unknowns.camera_offset) {
    camera.taper_from_camera.translation_mm = alignment.camera_offset_mm;
  }
  double nearest_mm = 1e300;
  double farthest_mm = 0;
  for (const part_alignment::View& view : input.measurement.views) {
    for (const part_alignment::Observation& seen : view.observations) {
      for (const part_alignment::PartTarget& target : input.measurement.targets) {
        if (target.id != seen.target) continue;
        const Eigen::Vector3d at_mm = part_alignment::CameraFromPart(
            camera, alignment.clamping, view, alignment.machine_from_part, target.ideal_mm);
        nearest_mm = std::min(nearest_mm, std::abs(at_mm.z()));
        farthest_mm = std::max(farthest_mm, std::abs(at_mm.z()));
      }
    }
  }
  const store::CameraCalibration& known = *input.calibration;
  if (nearest_mm >= known.nearest_mm && farthest_mm <= known.farthest_mm) return;
  alignment.notices.push_back(
      fmt::format("targets were seen from {:.0f} … {:.0f} mm, but the camera was calibrated ({}) "
                  "from {:.0f} to "
                  "{:.0f} mm: its figures are extrapolated",
                  nearest_mm, farthest_mm, known.date, known.nearest_mm, known.farthest_mm));
}

int RunSolve(const SolveArguments& arguments) {
  auto input = store::ReadAlignmentFile(arguments.file);
  if (!input) return Report(input.error());
  if (!arguments.unknowns.empty()) {
    const auto unknowns = store::ParseUnknowns(arguments.unknowns);
    if (!unknowns) return Report({ErrorKind::kInput, "--unknowns " + unknowns.error().message});
    input->unknowns = *unknowns;
  }
  part_alignment::SolveOptions options;
  options.unknowns = input->unknowns;
  options.robust = !arguments.not_robust;
  options.method = arguments.method == "gauss_newton" ? part_alignment::SolveMethod::kGaussNewton
                                                      : part_alignment::SolveMethod::kCeres;
  auto alignment = part_alignment::Solve(input->measurement, options);
  if (!alignment) {
    return Report({alignment.error().kind, arguments.file + ": " + alignment.error().message});
  }
  AddDistanceNotice(*input, *alignment);
  const report::AlignmentOutput output{input->measurement, store::NamesOf(input->unknowns),
                                       input->unknowns, input->numeric_ids, std::move(*alignment)};
  const std::string json = report::ToJson(output);
  if (!arguments.out.empty()) {
    if (auto written = store::WriteWholeFile(arguments.out, json); !written) {
      return Report(written.error());
    }
  }
  std::fputs(json.c_str(), stdout);
  if (!arguments.json) std::fputs(report::AlignmentText(output).c_str(), stderr);
  return output.alignment.verdict == Verdict::kGood ? kExitGood : kExitNotTrusted;
}

}  // namespace

void AddAlignSolveCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command =
      parent.add_subcommand("solve", "where the part is, and how the camera is clamped");
  const auto arguments = std::make_shared<SolveArguments>();
  command->add_option("file", arguments->file, "observations (docs/formats.md)")->required();
  command->add_option("--method", arguments->method)
      ->check(CLI::IsMember(std::vector<std::string>{"ceres", "gauss_newton"}))
      ->capture_default_str();
  command
      ->add_option("--unknowns", arguments->unknowns,
                   "instead of the file's: pose, clamp_angle, clamp_eccentricity, clamp_tilt, "
                   "focal_length, camera_offset; with commas or blanks between them")
      ->delimiter(',');
  command->add_flag("--no-robust", arguments->not_robust, "leave no wrong target out");
  command->add_flag("--json", arguments->json, "no words on standard error beside the JSON");
  command->add_option("--out", arguments->out, "write the JSON to this file, too");
  command->callback([arguments, &exit_code] { exit_code = RunSolve(*arguments); });
}

}  // namespace trammel::app
