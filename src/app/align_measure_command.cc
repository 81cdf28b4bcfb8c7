// trammel align measure: drives through the planned views, takes and reads the pictures, solves,
// and leaves a dated folder.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "app/align_commands.h"
#include "app/align_reading.h"
#include "app/align_record.h"
#include "app/align_report.h"
#include "app/commands.h"
#include "app/interrupt.h"
#include "app/linuxcnc_options.h"
#include "procedure/align_measure.h"
#include "procedure/align_picture.h"
#include "report/alignment_text.h"

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
  std::vector<double> obstacles;
  std::vector<double> travel;
  procedure::MeasureOptions options;
  LinuxCncArguments linuxcnc;
  bool no_correction = false;
  bool json = false;
};

constexpr std::size_t kBoxNumbers = 6;

// Solves; then once more with the centres corrected for perspective, which needs a first answer for
// the tilts.
Result<part_alignment::Alignment> SolveTwice(const MeasureArguments& arguments,
                                             const MeasureOutcome& outcome,
                                             store::AlignmentInput& input) {
  part_alignment::SolveOptions options;
  options.unknowns = input.unknowns;
  options.inputs = input.inputs;
  auto first = SolveInput(input, options);
  if (!first || first->verdict != Verdict::kGood || arguments.no_correction) return first;
  const auto seen_mm = DiscRadius(input.measurement, *first, outcome.found);
  const double radius_mm = arguments.disc_radius_mm > 0 ? arguments.disc_radius_mm : seen_mm;
  CorrectCentres({{arguments.normal[0], arguments.normal[1], arguments.normal[2]}, radius_mm},
                 *first, input.measurement);
  auto second = SolveInput(input, options);
  constexpr double kAlike = 0.1;
  if (second && std::abs(seen_mm - radius_mm) > kAlike * seen_mm) {
    second->notices.push_back(fmt::format(
        "the discs look as if their radius were {:.2f} mm; --disc-radius says {:.2f}: their "
        "centres were corrected for what it says",
        seen_mm, radius_mm));
  }
  return second;
}

int Finish(const MeasureArguments& arguments, store::AlignmentInput input,
           const MeasureOutcome& outcome, AlignmentRecord& record) {
  input.measurement = outcome.measurement;
  auto alignment = SolveTwice(arguments, outcome, input);
  if (!alignment) return Report(record.Stopped(alignment.error(), outcome.notices));
  alignment->notices.insert(alignment->notices.end(), outcome.notices.begin(),
                            outcome.notices.end());
  const auto missing = MissingTargets(input, *alignment, outcome.found);
  alignment->notices.insert(alignment->notices.end(), missing.begin(), missing.end());
  // Once more, where the centres have been corrected since.
  if (auto kept = record.KeepObservations(input.measurement); !kept) return Report(kept.error());
  const report::AlignmentOutput output = OutputOf(input, std::move(*alignment));
  if (auto written = WriteAlignmentReport(record.folder(), output, record.pictures()); !written) {
    return Report(written.error());
  }
  std::fputs(report::ToJson(output).c_str(), stdout);
  if (!arguments.json) {
    fmt::print(stderr, "{}report     {}\n", report::AlignmentText(output),
               record.folder().string());
  }
  return output.alignment.verdict == Verdict::kGood ? kExitGood : kExitNotTrusted;
}

// Where the spindle stands, which has to be still and turned as the plan says.
Result<Eigen::Vector3d> StandsAt(machine::LinuxCnc& linuxcnc, bool c_axis,
                                 const std::stop_token& stop) {
  const auto state = linuxcnc.State(stop);
  if (!state) return tl::unexpected(state.error());
  if (!state->spindle_stopped) {
    return Fail("the spindle turns; stop it: a camera is to sit in it", ErrorKind::kSafety);
  }
  constexpr double kOriented_deg = 0.01;
  if (c_axis && std::abs(state->c_deg) > kOriented_deg) {
    return Fail(fmt::format("the spindle's axis C stands at {:.4f} degrees, and the plan has it at "
                            "0: turn it there",
                            state->c_deg),
                ErrorKind::kSafety);
  }
  return state->position_mm;
}

Result<void> CheckNormal(const std::vector<double>& normal) {
  const double norm = std::hypot(normal[0], normal[1], normal[2]);
  constexpr double kLeast = 1e-6;
  if (norm >= kLeast && std::isfinite(norm)) return {};
  return Fail(fmt::format("--normal {} is no direction", fmt::join(normal, ",")));
}

Result<void> ReadBoxes(MeasureArguments& arguments) {
  procedure::RouteOptions& route = arguments.options.route;
  const std::vector<double>& n = arguments.obstacles;
  if (n.size() % kBoxNumbers != 0) {
    return Fail("--obstacle takes six numbers: the least X, Y, Z and the most X, Y, Z");
  }
  for (std::size_t i = 0; i < n.size(); i += kBoxNumbers) {
    route.obstacles.push_back({{n[i], n[i + 1], n[i + 2]}, {n[i + 3], n[i + 4], n[i + 5]}});
  }
  const std::vector<double>& t = arguments.travel;
  if (t.empty()) return {};
  route.travel_least_mm = {t[0], t[1], t[2]};
  route.travel_most_mm = {t[3], t[4], t[5]};
  return {};
}

Result<std::unique_ptr<machine::LinuxCnc>> ConnectMachine(const MeasureArguments& arguments,
                                                          const std::stop_token& stop) {
  const auto address = ParseLinuxCnc(arguments.linuxcnc);
  if (!address) return tl::unexpected(address.error());
  auto linuxcnc = machine::LinuxCnc::Connect(*address, stop);
  if (!linuxcnc) return linuxcnc;
  // Before the camera is waited for: what forbids a motion is said at once.
  if (auto ready = (*linuxcnc)->Prepare(true, stop); !ready) return tl::unexpected(ready.error());
  return linuxcnc;
}

int RunMeasure(MeasureArguments arguments) {
  const Interrupt interrupt;
  const std::stop_token stop = interrupt.token();
  auto plan = store::ReadAlignmentFile(arguments.plan);
  if (!plan) return Report(plan.error());
  auto book = part_alignment::MakeCodeBook(arguments.bits);
  if (!book) return Report(book.error());
  arguments.options.book = std::move(*book);
  if (auto read = ReadBoxes(arguments); !read) return Report(read.error());
  if (auto sound = CheckNormal(arguments.normal); !sound) return Report(sound.error());
  AlignmentRecord record(arguments.out, *plan);
  if (auto fit = record.CheckPlace(); !fit) return Report(fit.error());
  machine::CameraOptions camera;
  camera.width_px = plan->measurement.camera.width_px;
  camera.height_px = plan->measurement.camera.height_px;
  const auto source = machine::OpenCamera(arguments.source, camera, stop);
  if (!source) return Report(source.error());
  procedure::StillPictures pictures(**source, arguments.settle_s);
  procedure::MeasureShop shop;
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
    auto connected = ConnectMachine(arguments, stop);
    if (!connected) return Report(connected.error());
    linuxcnc = std::move(*connected);
    shop.move_to = [&](const Eigen::Vector3d& mm) {
      return linuxcnc->MoveTo(mm, arguments.feed_mm_min, stop);
    };
    shop.stands_at = [&] {
      return StandsAt(*linuxcnc, arguments.linuxcnc.options.c_holds_spindle, stop);
    };
  }
  auto outcome = procedure::MeasurePart(plan->measurement, arguments.options, shop);
  if (!outcome) return Report(record.Stopped(outcome.error(), {}));
  if (linuxcnc && arguments.obstacles.empty()) {
    outcome->notices.push_back(
        "no --obstacle was given: nothing but the safe height kept the camera clear");
  }
  if (!(*source)->live() && pictures.Take(stop)) {
    outcome->notices.push_back(
        "there are more pictures than views: were they taken by this plan, in this order?");
  }
  return Finish(arguments, std::move(*plan), *outcome, record);
}

void AddRoute(CLI::App& command, MeasureArguments& arguments) {
  constexpr const char* kGroup = "Route";
  procedure::RouteOptions& route = arguments.options.route;
  CLI::Option* safe = command
                          .add_option("--safe-z", route.safe_z_mm,
                                      "machine Z of the spindle at which it may cross everywhere")
                          ->group(kGroup);
  command.get_option("--machine")->needs(safe);
  command.add_option("--feed", arguments.feed_mm_min, "mm/min")
      ->check(CLI::Range(10.0, 1e5))
      ->capture_default_str()
      ->group(kGroup);
  command
      .add_option("--obstacle", arguments.obstacles,
                  "least X,Y,Z and most X,Y,Z of part or fixture; may be repeated")
      ->delimiter(',')
      ->group(kGroup);
  command
      .add_option("--travel", arguments.travel,
                  "of the spindle: the least X,Y,Z and the most X,Y,Z")
      ->expected(static_cast<int>(kBoxNumbers))
      ->delimiter(',')
      ->group(kGroup);
  command.add_option("--camera-radius", route.camera_radius_mm, "of what hangs in the spindle, mm")
      ->check(CLI::Range(0.0, 1e4))
      ->capture_default_str()
      ->group(kGroup);
  command
      .add_option("--camera-below", route.camera_below_mm,
                  "from the spindle's reference point to the camera's lower end, mm")
      ->check(CLI::Range(0.0, 1e4))
      ->capture_default_str()
      ->group(kGroup);
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
  command
      .add_option("--extra-sigma-px", arguments.options.extra_sigma_px,
                  "of a centre, beside what the detector states")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str()
      ->group(kGroup);
  command
      .add_option("--disc-radius", arguments.disc_radius_mm,
                  "mm, of the targets' discs; without it as they look in the pictures")
      ->check(CLI::Range(0.0, 1000.0))
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
  command
      .add_option("--settle", arguments.settle_s,
                  "s between standing and the picture; more than the camera is late by")
      ->check(CLI::Range(0.0, 60.0))
      ->capture_default_str()
      ->group(kGroup);
}

}  // namespace

void AddAlignMeasureCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "measure", "drive through the views, take and read the pictures, solve");
  const auto arguments = std::make_shared<MeasureArguments>();
  command
      ->add_option("plan", arguments->plan,
                   "as observations (docs/formats.md); what it observed is not looked at")
      ->required();
  command
      ->add_option("--source", arguments->source,
                   "the camera: a folder of pictures in the order of the views, /dev/videoN, "
                   "http://…")
      ->required();
  command->add_option("--out", arguments->out, "where the dated folder is made")
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "no words on standard error at the end");
  AddReading(*command, *arguments);
  AddLinuxCncOptions(*command, "--machine", "HOST[:PORT] of linuxcncrsh; without it nothing moves",
                     arguments->linuxcnc);
  AddRoute(*command, *arguments);
  command->callback([arguments, &exit_code] { exit_code = RunMeasure(*arguments); });
}

}  // namespace trammel::app
