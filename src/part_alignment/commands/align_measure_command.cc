// trammel align measure: drives through the planned views, takes and reads the pictures, solves,
// and writes a dated folder.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/option_values.h"
#include "app/provenance.h"
#include "app/secrets.h"
#include "measurement/outcome_file.h"
#include "part_alignment/commands/align_commands.h"
#include "part_alignment/commands/align_outputs.h"
#include "part_alignment/commands/machine_options.h"
#include "part_alignment/pose/disc_centres.h"
#include "part_alignment/procedure/align_measure.h"
#include "part_alignment/report/alignment_report.h"
#include "part_alignment/views/view_plan.h"
#include "session/session.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using procedure::MeasureOutcome;

struct MeasureArguments {
  std::string plan;
  std::string source;
  std::string out = ".";
  int bits = 14;
  double feed_mm_min = 3000;
  double settle_s = 0.5;
  double disc_radius_mm = 0;
  std::vector<double> normal = {0, 0, 1};
  MachineBoxArguments boxes;
  procedure::MeasureOptions options;
  LinuxCncArguments linuxcnc;
  bool no_correction = false;
  bool json = false;
};

Result<part_alignment::Alignment> SolveOutcome(const MeasureArguments& arguments,
                                               const MeasureOutcome& outcome,
                                               files::AlignmentInput& input) {
  const part_alignment::SolveOptions options = SolveOptionsOf(input);
  if (arguments.no_correction) return part_alignment::Solve(input.measurement, options);
  const std::vector<double>& normal = arguments.normal;
  return part_alignment::SolveByDiscs(options,
                                      {{normal[0], normal[1], normal[2]}, arguments.disc_radius_mm},
                                      outcome.discs, input.measurement);
}

Result<int> Finish(const MeasureArguments& arguments, files::AlignmentInput input,
                   const MeasureOutcome& outcome, AlignmentRecord& record) {
  input.measurement = outcome.measurement;
  auto alignment = SolveOutcome(arguments, outcome, input);
  if (!alignment) return tl::unexpected(record.Stopped(alignment.error(), outcome.notices));
  alignment->notices.insert(alignment->notices.end(), outcome.notices.begin(),
                            outcome.notices.end());
  const auto missing = procedure::MissingTargets(outcome, *alignment);
  alignment->notices.insert(alignment->notices.end(), missing.begin(), missing.end());
  // Stored again, as the centres may have been corrected since.
  TRY(record.KeepObservations(input.measurement));
  const report::AlignmentOutput output = OutputOf(input, std::move(*alignment));
  // The result is printed even if the files cannot be written.
  const ResultFile result = ResultOf(output, record.folder().string());
  auto written = KeepInRecording(record.folder(), result);
  if (written) {
    written = WriteAlignmentReport(record.folder(), output, nullptr, record.pictures(), false);
  }
  PrintAlignment(output, result, arguments.json, (record.folder() / files::kResultFile).string());
  if (!arguments.json) {
    fmt::print(stderr, "report     {}\n", record.folder().string());
    if (output.alignment.verdict == Verdict::kGood) {
      PrintWrapped("next", "trammel align correct " + ShellQuoted(record.folder().string()), 11,
                   stderr);
    }
  }
  if (!written) return tl::unexpected(written.error());
  return output.alignment.verdict == Verdict::kGood ? kExitGood : kExitNotTrusted;
}

Result<void> CheckNormal(const std::vector<double>& normal) {
  const double norm = std::hypot(normal[0], normal[1], normal[2]);
  constexpr double kMin = 1e-6;
  if (norm >= kMin && std::isfinite(norm)) return {};
  return Fail(fmt::format("--normal {} is no direction", fmt::join(normal, ",")));
}

Result<void> ReadBoxes(const part_alignment::Camera& camera, MeasureArguments& arguments) {
  procedure::RouteOptions& route = arguments.options.route;
  route.obstacles = TRY(ObstaclesOf(arguments.boxes));
  if (!arguments.boxes.travel.empty()) route.travel = TravelOf(arguments.boxes);
  route.camera_radius_mm = arguments.boxes.camera_radius_mm;
  route.camera_below_mm = part_alignment::ToolLength(camera, arguments.boxes.camera_below_mm);
  return {};
}

Result<int> RunMeasure(MeasureArguments arguments) {
  const Interrupt interrupt;
  const std::stop_token stop = interrupt.token();
  auto plan = TRY(files::ReadAlignmentFile(arguments.plan));
  arguments.options.book = TRY(part_alignment::MakeCodeBook(arguments.bits));
  TRY(ReadBoxes(plan.measurement.camera, arguments));
  TRY(CheckNormal(arguments.normal));
  AlignmentRecord record(arguments.out, plan);
  TRY(record.CheckPlace());
  machine::CameraOptions camera;
  camera.width_px = plan.measurement.camera.width_px;
  camera.height_px = plan.measurement.camera.height_px;
  const auto address = TRY(CameraAddressOf("--source", arguments.source));
  const auto source = machine::OpenCamera(address, camera, stop);
  if (!source) return tl::unexpected(procedure::NameStopReason(stop, source.error()));
  procedure::StillPictures pictures(**source, arguments.settle_s);
  procedure::MeasurementHooks shop;
  shop.take_picture = [&] { return pictures.Take(stop); };
  shop.keep_picture = [&](std::size_t view, const machine::CapturedFrame& picture) {
    return record.KeepPicture(view, picture);
  };
  shop.keep_observations = [&](const part_alignment::Measurement& so_far) {
    return record.KeepObservations(so_far);
  };
  shop.tell = [](const std::string& line) { fmt::print(stderr, "{}\n", line); };
  std::unique_ptr<machine::LinuxCnc> linuxcnc;
  if (!arguments.linuxcnc.address.empty()) {
    auto connected = ConnectLinuxCnc(arguments.linuxcnc, stop);
    if (!connected) return tl::unexpected(procedure::NameStopReason(stop, connected.error()));
    linuxcnc = std::move(*connected);
    shop.move_to = [&](const Eigen::Vector3d& mm) {
      return linuxcnc->MoveTo(mm, arguments.feed_mm_min, stop);
    };
    shop.stands_at = [&] {
      const bool c_axis = arguments.linuxcnc.options.c_holds_spindle;
      return StandsAt(*linuxcnc, c_axis ? std::optional(0.0) : std::nullopt, stop);
    };
  }
  auto outcome = procedure::MeasurePart(plan.measurement, arguments.options, shop);
  if (!outcome) {
    return tl::unexpected(record.Stopped(procedure::NameStopReason(stop, outcome.error()), {}));
  }
  if (linuxcnc && arguments.options.route.obstacles.empty()) {
    outcome->notices.push_back(
        "no --obstacle was given: nothing but the safe height kept the camera clear");
  }
  if (!(*source)->live() && pictures.Take(stop)) {
    outcome->notices.push_back(
        "there are more pictures than views: were they taken by this plan, in this order?");
  }
  return Finish(arguments, std::move(plan), *outcome, record);
}

void AddRoute(CLI::App& command, MeasureArguments& arguments) {
  constexpr const char* kGroup = "Route";
  procedure::RouteOptions& route = arguments.options.route;
  CLI::Option* safe = command
                          .add_option("--safe-z", route.safe_z_mm,
                                      "machine Z of the spindle at which it may cross everywhere")
                          ->check(NumberIn(-1e6, 1e6))
                          ->group(kGroup);
  command.get_option("--machine")->needs(safe);
  AddNumber(command, "--feed", arguments.feed_mm_min, "mm/min", 10.0, 1e5, kGroup);
  AddMachineBoxes(command, arguments.boxes, kGroup);
}

void AddReading(CLI::App& command, MeasureArguments& arguments) {
  constexpr const char* kGroup = "Pictures";
  command.add_option("--bits", arguments.bits, "of the targets' rings")
      ->check(CLI::IsMember(std::vector<int>{12, 14, 20}))
      ->capture_default_str()
      ->group(kGroup);
  command
      .add_option("--id-prefix", arguments.options.id_prefix,
                  "before the number in the ids of the plan, as in T7")
      ->group(kGroup);
  AddNumber(command, "--extra-sigma-px", arguments.options.extra_sigma_px,
            "of a centre, beside what the detector states", 0.0, 10.0, kGroup);
  command
      .add_option("--disc-radius", arguments.disc_radius_mm,
                  "mm, of the targets' discs; without it as they look in the pictures")
      ->check(NumberIn(0.0, 1000.0))
      ->group(kGroup);
  command
      .add_flag("--no-correction", arguments.no_correction,
                "leave the centres as they are found, not corrected for perspective")
      ->group(kGroup);
  command.add_option("--normal", arguments.normal, "of the targets, in the part's frame")
      ->expected(3)
      ->delimiter(',')
      ->capture_default_str()
      ->group(kGroup);
  AddNumber(command, "--settle", arguments.settle_s,
            "s between standing and the picture; more than the camera is late by", 0.0, 60.0,
            kGroup);
}

}  // namespace

void AddAlignMeasureCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "measure", "drive through the views, take and read the pictures, solve");
  const auto arguments = std::make_shared<MeasureArguments>();
  command
      ->add_option("plan", arguments->plan,
                   "as observations (docs/reference/formats.md); what it observed is not looked at")
      ->required();
  command
      ->add_option("--source", arguments->source,
                   "the camera: a folder of pictures in the order of the views, /dev/videoN, "
                   "aravis:ID, http://…")
      ->required();
  command->add_option("-o,--out", arguments->out, "where the dated folder is made")
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "JSON alone, without the text");
  AddReading(*command, *arguments);
  AddLinuxCncOptions(
      *command, "--machine",
      "what moves: session, the LinuxCNC that runs on this computer; without it nothing does",
      arguments->linuxcnc);
  AddRoute(*command, *arguments);
  OnRun(*command, exit_code, [arguments] { return RunMeasure(*arguments); });
}

}  // namespace trammel::app
