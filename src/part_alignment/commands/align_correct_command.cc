// trammel align correct: shims for the fixture, the work offset for the control, and the remainder.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "app/applied_result.h"
#include "app/commands.h"
#include "app/interrupt.h"
#include "part_alignment/commands/align_commands.h"
#include "part_alignment/commands/align_outputs.h"
#include "part_alignment/commands/machine_options.h"
#include "part_alignment/correction/control_text.h"
#include "part_alignment/correction/part_correction.h"
#include "part_alignment/files/alignment_result.h"
#include "part_alignment/report/correction_report.h"

namespace trammel::app {
namespace {

using part_alignment::Control;

struct CorrectArguments {
  std::string file;
  std::string control = "linuxcnc";
  std::string work_offset;
  std::string supports;
  bool after_shims = false;
  bool tilts = false;
  bool json = false;
  LinuxCncArguments linuxcnc;
};

Result<void> CorrectAtFixture(const CorrectArguments& arguments,
                              const files::AlignmentResult& result,
                              report::CorrectionOutput& output) {
  if (arguments.supports.empty()) return {};
  const auto file = TRY(files::ReadSupportsFile(arguments.supports));
  const geometry::Pose& measured = result.machine_from_part;
  // Without an ideal pose, the part is to be level, with its present rotation about Z.
  const Eigen::Vector3d ideal_rad =
      file.ideal_angles_rad.value_or(Eigen::Vector3d(0, 0, measured.angles_rad.z()));
  auto fixture =
      part_alignment::CorrectFixture(measured, file.supports, ideal_rad, file.ideal_translation_mm);
  if (!fixture) {
    return Fail(arguments.supports + ": " + fixture.error().message, fixture.error().kind);
  }
  for (const part_alignment::Support& support : file.supports) {
    output.points.push_back({"support " + support.id, support.part_mm});
  }
  output.fixture = std::move(*fixture);
  return {};
}

Result<void> CorrectAtControl(const CorrectArguments& arguments, report::CorrectionOutput& output) {
  const Control control = *part_alignment::ParseControl(arguments.control);
  const bool rows = control == Control::kHeidenhain;  // rows of its preset table
  const std::string slot_name =
      !arguments.work_offset.empty() ? arguments.work_offset : (rows ? "1" : "G54");
  const auto slot = TRY(part_alignment::ParseOffsetSlot(control, slot_name));
  output.control = control;
  output.slot = slot;
  output.tilts = arguments.tilts;
  output.after_shims = arguments.after_shims;
  output.offset = part_alignment::CorrectWorkOffset(output.pose(), output.points);
  if (!arguments.tilts) {
    TRY(part_alignment::CheckTilt(output.offset));
  }
  output.text = TRY(part_alignment::TextFor(control, slot, output.pose(), arguments.tilts));
  return {};
}

Result<void> Write(const CorrectArguments& arguments, const report::CorrectionOutput& output,
                   const std::optional<measurement::Outcome>& result) {
  const Interrupt interrupt;
  const auto options = TRY(ParseLinuxCnc(arguments.linuxcnc));
  auto machine = TRY(machine::LinuxCnc::Connect(options, interrupt.token()));
  const part_alignment::WorkOffset& offset = output.offset.offset;
  const auto before = TRY(machine->ReadOffsets(output.slot.number, interrupt.token()));
  if (result) {
    TRY(NoteBegun(
        {measurement::Instrument::kPartAlignment, *result, arguments.linuxcnc.address, {}},
        std::nullopt));
  }
  TRY(machine->WriteOffset(output.slot.number,
                           {offset.origin_mm, offset.rotation_z_rad * 180 / std::numbers::pi},
                           interrupt.token()));
  const Eigen::Vector3d& was = before.offset.origin_mm;
  const Eigen::Vector3d& is = offset.origin_mm;
  fmt::print(
      stderr,
      "changed    X {:.4f} -> {:.4f}, Y {:.4f} -> {:.4f}, Z {:.4f} -> {:.4f} mm, R {:.5f} -> "
      "{:.5f} degrees\n",
      was.x(), is.x(), was.y(), is.y(), was.z(), is.z(), before.offset.rotation_deg,
      offset.rotation_z_rad * 180 / std::numbers::pi);
  fmt::print(stderr, "written    {} of LinuxCNC at {}: read back and equal\n", output.slot.name,
             arguments.linuxcnc.address);
  return {};
}

Result<int> RunCorrect(const CorrectArguments& arguments) {
  if (!arguments.linuxcnc.address.empty() && arguments.control != "linuxcnc") {
    return Fail(
        "--write needs --control linuxcnc: take the lines to other "
        "controls yourself");
  }
  if (arguments.after_shims && arguments.supports.empty()) {
    return Fail("--after-shims needs --supports FILE");
  }
  auto result = TRY(files::ReadAlignmentResult(arguments.file));
  report::CorrectionOutput output;
  output.measured = result.machine_from_part;
  output.standard_uncertainty = result.standard_uncertainty;
  output.points = std::move(result.targets);
  output.notices = std::move(result.notices);
  TRY(CorrectAtFixture(arguments, result, output));
  TRY(CorrectAtControl(arguments, output));
  std::fputs((arguments.json ? report::ToJson(output) : report::CorrectionText(output)).c_str(),
             stdout);
  if (arguments.linuxcnc.address.empty()) return kExitGood;
  TRY(Write(arguments, output, result.result));
  if (result.result) {
    NoteApplied(
        {measurement::Instrument::kPartAlignment, *result.result, arguments.linuxcnc.address, {}});
  }
  return kExitGood;
}

}  // namespace

void AddAlignCorrectCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "correct", "shims for the fixture, the work offset for the control, and what is left over");
  const auto arguments = std::make_shared<CorrectArguments>();
  command
      ->add_option("file", arguments->file,
                   "what align solve --result kept or printed, or a measurement's folder")
      ->required();
  command->add_option("--control", arguments->control)
      ->check(CLI::IsMember(std::vector<std::string>{"linuxcnc", "siemens", "heidenhain", "fanuc"}))
      ->capture_default_str();
  command->add_option("--work-offset", arguments->work_offset,
                      "G54 (the default) …; Fanuc also \"G54.1 P1\" …; Heidenhain: the row of the "
                      "preset table, 1 without it");
  command->add_option(
      "--supports", arguments->supports,
      "where the part rests, and which way each support adjusts (docs/reference/formats.md)");
  command->add_flag("--after-shims", arguments->after_shims,
                    "the work offset of the part as the supports will have moved it");
  command->add_flag("--tilts", arguments->tilts,
                    "rotations about X and Y, too (Siemens, Heidenhain)");
  command->add_flag("--json", arguments->json, "one JSON object");
  AddLinuxCncOptions(
      *command, "--write",
      "set the work offset and read it back: session, the LinuxCNC that runs on this computer",
      arguments->linuxcnc);
  OnRun(*command, exit_code, [arguments] { return RunCorrect(*arguments); });
}

}  // namespace trammel::app
