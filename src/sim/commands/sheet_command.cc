// trammel-sim sheet: prints a comb pattern virtually and scans the sheet.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/option_values.h"
#include "app/slow_work.h"
#include "base/result.h"
#include "files/new_file.h"
#include "files/whole_file.h"
#include "sim/commands/commands.h"
#include "sim/phone/phone_photo.h"
#include "sim/print/named_number.h"
#include "sim/scanner/scanner_page.h"
#include "sim/scanner/scanner_traits.h"
#include "sim/sheet/original_sheet.h"
#include "sim/sheet/sheet_gcode.h"
#include "sim/sheet/sheet_machine.h"
#include "sim/sheet/sheet_paper.h"

namespace trammel::app {

namespace {

void SetWrinkle(double amplitude_mm, sim::SheetPaper& paper) {
  const double share = 1 / std::sqrt(std::max<std::size_t>(1, paper.wrinkle.size()));
  for (sim::WrinkleWave& wave : paper.wrinkle) {
    wave.amplitude_mm = {amplitude_mm * share, amplitude_mm * share};
  }
}

// Returns the paper's only fold.
sim::PaperFold& FoldOf(sim::SheetPaper& paper) {
  if (paper.folds.empty()) paper.folds.emplace_back();
  return paper.folds.front();
}

constexpr double kDegree = std::numbers::pi / 180;

/// Machine and paper, which determine the print.
struct SheetWorld {
  sim::SheetMachine machine;
  sim::SheetPaper paper;
};

using SheetNumber = sim::NamedNumber<SheetWorld>;
template <double sim::SheetTool::*field>
void SetEachTool(double value, SheetWorld& world) {
  for (sim::SheetTool& tool : world.machine.tools) tool.*field = value;
}

constexpr SheetNumber kSheetNumbers[] = {
    {"backlash-x-um", [](double v, auto& w) { w.machine.backlash_mm[0] = v / 1000; }, 0, 1000},
    {"backlash-y-um", [](double v, auto& w) { w.machine.backlash_mm[1] = v / 1000; }, 0, 1000},
    {"leg-placement-um", [](double v, auto& w) { w.machine.leg_placement_mm = v / 1000; }, 0, 100},
    {"leg-width-um", [](double v, auto& w) { w.machine.leg_width_mm = v / 1000; }, 0, 100},
    {"roughness-um", [](double v, auto& w) { w.machine.edge_roughness_mm = v / 1000; }, 0, 100},
    {"roughness-mm", [](double v, auto& w) { w.machine.edge_correlation_mm = v; }, 0.05, 2},
    {"coupling-um", [](double v, auto& w) { w.machine.coupling_mm = v / 1000; }, 0, 500},
    {"motor-um",
     [](double v, auto& w) {
       for (sim::PeriodicError& error : w.machine.motor) error.amplitude_mm = v / 1000;
     },
     0, 200},
    {"pulley-um",
     [](double v, auto& w) {
       for (sim::PeriodicError& error : w.machine.pulley) error.amplitude_mm = v / 1000;
     },
     0, 200},
    {"start-bulge-um", [](double v, auto& w) { w.machine.start_bulge_mm = v / 1000; }, -300, 500},
    {"end-bulge-um", [](double v, auto& w) { w.machine.end_bulge_mm = v / 1000; }, -300, 500},
    {"wrinkle-um", [](double v, auto& w) { SetWrinkle(v / 1000, w.paper); }, 0, 1000},
    {"dirt", [](double v, auto& w) { w.paper.dirt_count = sim::WholeOf(v); }, 0, 10000},
    {"broken-share", SetEachTool<&sim::SheetTool::broken_share>, 0, 1},
    {"string-share", SetEachTool<&sim::SheetTool::string_share>, 0, 1},
    {"bead-height", [](double v, auto& w) { w.machine.bead_height_mm = v; }, 0.05, 1},
    {"filament-diameter", [](double v, auto& w) { w.machine.filament_diameter_mm = v; }, 0.5, 5},
    {"paper",
     [](double v, auto& w) {
       w.paper.reflectance = {v, v, v};
     },
     0, 1},
    {"width-factor", SetEachTool<&sim::SheetTool::width_factor>, 0.3, 3},
    {"opacity", SetEachTool<&sim::SheetTool::opacity>, 0.01, 1},
    {"missing-share", SetEachTool<&sim::SheetTool::missing_share>, 0, 1},
    {"hairs", [](double v, auto& w) { w.paper.hair_count = sim::WholeOf(v); }, 0, 100},
    {"fold-um", [](double v, auto& w) { FoldOf(w.paper).taken_up_mm = v / 1000; }, -1000, 1000},
    {"fold-deg", [](double v, auto& w) { FoldOf(w.paper).direction_rad = v * kDegree; }, -360, 360},
    {"fold-x-mm", [](double v, auto& w) { FoldOf(w.paper).through.x_mm = v; }, -1000, 1000},
    {"fold-y-mm", [](double v, auto& w) { FoldOf(w.paper).through.y_mm = v; }, -1000, 1000},
    {"fold-darkness", [](double v, auto& w) { FoldOf(w.paper).darkness = v; }, 0, 1},
};

using sim::ScannerTraits;
constexpr sim::NamedNumber<ScannerTraits> kScannerNumbers[] = {
    {"rotation-deg", [](double v, auto& s) { s.rotation_rad = v * kDegree; }, -360, 360},
    {"shift-x-mm", [](double v, auto& s) { s.shift_x_mm = v; }, -500, 500},
    {"shift-y-mm", [](double v, auto& s) { s.shift_y_mm = v; }, -500, 500},
    {"scale-x", [](double v, auto& s) { s.scale_x = v; }, 0.9, 1.1},
    {"scale-y", [](double v, auto& s) { s.scale_y = v; }, 0.9, 1.1},
    {"skew", [](double v, auto& s) { s.skew = v; }, -0.05, 0.05},
    {"bar-um",
     [](double v, auto& s) {
       for (sim::PeriodicError& error : s.bar) error.amplitude_mm = v / 1000;
     },
     0, 500},
    {"shadow", [](double v, auto& s) { s.shadow_strength = v; }, 0, 1},
    {"shadow-mm", [](double v, auto& s) { s.shadow_mm = v; }, 0, 1},
    {"blur-um", [](double v, auto& s) { s.blur_mm = v / 1000; }, 0, 500},
    {"noise", [](double v, auto& s) { s.noise = v; }, 0, 0.2},
    {"texture", [](double v, auto& s) { s.texture = v; }, 0, 0.2},
    {"gamma", [](double v, auto& s) { s.gamma = v; }, 0.5, 3},
    {"lamp-falloff", [](double v, auto& s) { s.lamp_falloff = v; }, 0, 0.5},
    {"cast-red", [](double v, auto& s) { s.cast[0] = v; }, 0.2, 1.2},
    {"cast-green", [](double v, auto& s) { s.cast[1] = v; }, 0.2, 1.2},
    {"cast-blue", [](double v, auto& s) { s.cast[2] = v; }, 0.2, 1.2},
    {"crop-top-mm", [](double v, auto& s) { s.crop_top_mm = v; }, 0, 500},
    {"crop-left-mm", [](double v, auto& s) { s.crop_left_mm = v; }, 0, 500},
    {"perspective-x", [](double v, auto& s) { s.perspective_x = v; }, -0.5, 0.5},
    {"perspective-y", [](double v, auto& s) { s.perspective_y = v; }, -0.5, 0.5},
};

std::string SettingNames() {
  return sim::NamesOf(kSheetNumbers) + ", " + sim::NamesOf(kScannerNumbers);
}

constexpr std::size_t kLargestGcode = 100'000'000;

struct SimSheetArguments {
  std::string gcode;
  std::vector<int> original;  // tools of the original generator's sheet; empty: none
  std::vector<std::string> original_offsets;
  bool original_repaired = false;
  std::string pattern_out;
  std::string out;
  std::string truth;
  sim::SheetName name;
  std::string scene = "black-on-white";
  bool ideal = false;
  // Machine.
  std::string firmware;
  std::string macros;
  std::string before;
  std::vector<std::string> tool_commands;
  std::vector<std::string> offsets;
  std::vector<std::string> stored;
  std::vector<int> missing;
  int reference = 0;
  // Scanner.
  double dpi = 600;
  std::vector<std::string> settings;
  bool mirrored = false;
  bool colour = false;
  int bits = 8;
  std::string says_dpi;
  // Phone instead of the scanner.
  bool photo = false;
  std::vector<std::string> photo_settings;
  int jpeg_quality = 90;
};

Result<std::string> ReadOptional(const std::string& path) {
  return path.empty() ? Result<std::string>{} : files::ReadWholeFile(path, kLargestGcode);
}

Result<sim::SheetSetup> SetupOf(const SimSheetArguments& arguments, const std::string& gcode) {
  sim::SheetSetup setup;
  setup.firmware = sim::GuessSheetFirmware(gcode);
  if (!arguments.firmware.empty()) {
    const auto firmware = sim::ParseSheetFirmware(arguments.firmware);
    if (!firmware) return Fail("--firmware: " + firmware.error().message);
    setup.firmware = *firmware;
  }
  for (const std::string& text : arguments.stored) {
    const auto shift = TRY(ParseToolShift("--stored", text, sim::kMaxSheetTools - 1));
    setup.stored[static_cast<std::size_t>(shift.tool)] = sim::PlaneMm{shift.x_mm, shift.y_mm};
  }
  const auto config = TRY(ReadOptional(arguments.macros));
  auto macros = sim::ParseSheetMacros(config);
  if (!macros) return Fail(arguments.macros + ": " + macros.error().message);
  setup.macros = std::move(*macros);
  setup.tool_commands = arguments.tool_commands;
  setup.before = TRY(ReadOptional(arguments.before));
  return setup;
}

// Returns the machine whose lines are off by --offset while its firmware has the stored offsets of
// --stored.
Result<sim::SheetMachine> MachineOf(const SimSheetArguments& arguments, sim::SheetScene scene,
                                    const sim::SheetSetup& setup) {
  sim::SheetMachine machine = sim::MachineOf(arguments.name, scene);
  if (arguments.ideal) {
    sim::SheetMachine ideal;
    ideal.backlash_mm = machine.backlash_mm;
    for (std::size_t i = 0; i < ideal.tools.size(); ++i) {
      ideal.tools[i].offset_mm = machine.tools[i].offset_mm;
      ideal.tools[i].ink = machine.tools[i].ink;
    }
    machine = ideal;
  }
  for (const std::string& text : arguments.offsets) {
    const auto shift = TRY(ParseToolShift("--offset", text, sim::kMaxSheetTools - 1));
    machine.tools[static_cast<std::size_t>(shift.tool)].offset_mm = {shift.x_mm, shift.y_mm};
  }
  const double sign = setup.firmware == sim::SheetFirmware::kKlipper ? -1 : 1;
  for (std::size_t tool = 0; tool < machine.tools.size(); ++tool) {
    if (!setup.stored[tool]) continue;
    machine.tools[tool].offset_mm.x_mm += sign * setup.stored[tool]->x_mm;
    machine.tools[tool].offset_mm.y_mm += sign * setup.stored[tool]->y_mm;
  }
  for (const int tool : arguments.missing) {
    machine.tools[static_cast<std::size_t>(tool)].prints = false;
  }
  return machine;
}

// Draws the original generator's sheet, and writes its G-code if requested.
Result<std::string> OriginalOf(const SimSheetArguments& arguments) {
  sim::OriginalSheet original;
  original.tools = arguments.original;
  original.reference = arguments.reference;
  original.repaired = arguments.original_repaired;
  if (!arguments.original_offsets.empty()) original.offsets.resize(original.tools.size());
  for (const std::string& text : arguments.original_offsets) {
    const auto shift =
        TRY(ParseToolShift("--original-offset", text, static_cast<int>(original.tools.size())));
    if (shift.tool < 1) {
      return Fail(fmt::format("--original-offset {}: places in the list of --original count from 1",
                              text.substr(0, 40)));
    }
    original.offsets[static_cast<std::size_t>(shift.tool) - 1] = {shift.x_mm, shift.y_mm};
  }
  std::string gcode = OriginalGcode(original);
  if (arguments.pattern_out.empty()) return gcode;
  TRY(files::WriteWholeFile(arguments.pattern_out, gcode, files::IfThere::kRefuse));
  return gcode;
}

Result<std::string> GcodeOf(const SimSheetArguments& arguments) {
  if (arguments.original.empty() == arguments.gcode.empty()) {
    return Fail("give either a G-code file or --original with its tools");
  }
  if (!arguments.original.empty()) return OriginalOf(arguments);
  if (!arguments.pattern_out.empty()) {
    return Fail("--pattern-out: writes the sheet of --original; give that, too");
  }
  return files::ReadWholeFile(arguments.gcode, kLargestGcode);
}

Result<sim::PrintedSheet> Print(const SimSheetArguments& arguments, sim::SheetScene scene) {
  const auto gcode = TRY(GcodeOf(arguments));
  const std::string source = arguments.original.empty() ? arguments.gcode : "the original sheet";
  const auto setup = TRY(SetupOf(arguments, gcode));
  SheetWorld world{TRY(MachineOf(arguments, scene, setup)), sim::PaperOf(arguments.name, scene)};
  if (arguments.ideal) {
    world.paper.wrinkle.clear();
    world.paper.dirt_count = 0;
  }
  for (const std::string& setting : arguments.settings) {
    const auto named = TRY(sim::ParseNamedValue("--set", setting));
    sim::ScannerTraits scanner;  // set up once the print is complete
    if (!TRY(sim::SetNamed(kSheetNumbers, named, world)) &&
        !TRY(sim::SetNamed(kScannerNumbers, named, scanner))) {
      return sim::NoSuchName("--set", setting, SettingNames());
    }
  }
  const auto program = sim::InterpretSheet(gcode, setup);
  if (!program) return Fail(source + ": " + program.error().message);
  for (const auto& [name, count] : program->ignored) {
    fmt::print(stderr, "note: skipped {} of {}, which the virtual machine does not know\n", count,
               name);
  }
  auto sheet =
      sim::PrintSheet(*program, world.machine, world.paper, sim::PrintingOf(arguments.name));
  if (!sheet) return Fail(source + ": " + sheet.error().message);
  return sheet;
}

Result<sim::ScannerTraits> ScannerFor(const SimSheetArguments& arguments,
                                      const sim::PrintedSheet& sheet) {
  sim::ScannerTraits scanner;
  if (!arguments.ideal && !sheet.strokes.empty()) {
    scanner = sim::ScannerOf(arguments.name, sheet);
  }
  scanner.dpi = arguments.dpi;
  scanner.mirrored = arguments.mirrored;
  scanner.colour = arguments.colour;
  scanner.bits = arguments.bits;
  const double drawn_rad = scanner.rotation_rad;
  for (const std::string& setting : arguments.settings) {
    TRY(sim::SetNamed(kScannerNumbers, TRY(sim::ParseNamedValue("--set", setting)), scanner));
  }
  if (scanner.rotation_rad != drawn_rad && !sheet.strokes.empty()) {
    scanner.area_width_mm = scanner.area_height_mm = 0;
    scanner.shift_x_mm = scanner.shift_y_mm = 0;
  }
  return scanner;
}

Result<sim::PageFileOptions> FileOptionsOf(const SimSheetArguments& arguments) {
  sim::PageFileOptions options;
  options.dpi = arguments.dpi;
  options.jpeg_quality = arguments.jpeg_quality;
  const std::string& says = arguments.says_dpi;
  if (says == "none") options.dpi.reset();
  if (says.empty() || says == "none") return options;
  options.dpi = ParseNumber<double>(says);
  if (options.dpi) return options;
  return Fail(fmt::format("--says-dpi {}: must be a number or none", says.substr(0, 40)));
}

// Returns the phone of this photo of the print. All photos of one print show the same paper and
// lines, and are taken by the same phone.
sim::PhoneTraits PhoneFor(const sim::SheetName& name, const sim::PrintedSheet& sheet) {
  sim::PhoneTraits phone = sim::DrawPhone(sheet, sim::ScanningOf(name).Fork(0));
  if (name.scan == 0) return phone;
  sim::SheetName first_name = name;
  first_name.scan = 0;
  const sim::PhoneTraits first = sim::DrawPhone(sheet, sim::ScanningOf(first_name).Fork(0));
  // Same size in the picture as drawn.
  phone.distance_mm *= first.focal_px / phone.focal_px;
  phone.focal_px = first.focal_px;
  phone.radial = first.radial;
  phone.tangential = first.tangential;
  phone.centre_x_px = first.centre_x_px;
  phone.centre_y_px = first.centre_y_px;
  phone.bow_mm = first.bow_mm;
  phone.bow_rad = first.bow_rad;
  phone.wave_mm = first.wave_mm;
  phone.extra_height_mm = first.extra_height_mm;
  phone.colour_px = first.colour_px;
  phone.tool_colour_px = first.tool_colour_px;
  return phone;
}

// Takes a phone's photo instead of a scan.
Result<void> Photograph(const SimSheetArguments& arguments, const sim::PrintedSheet& sheet) {
  sim::PhoneTraits phone;
  if (!arguments.ideal) phone = PhoneFor(arguments.name, sheet);
  for (const std::string& text : arguments.photo_settings) {
    const auto named = TRY(sim::ParseNamedValue("--photo-set", text));
    if (const auto set = sim::SetPhoneTrait(named.name, named.value, phone); !set) {
      return Fail("--photo-set " + set.error().message);
    }
  }
  const SlowWork work("taking the photo");
  const auto frame =
      TRY(sim::PhotographSheet(sheet, phone, sim::ScanningOf(arguments.name).Fork(1)));
  TRY(files::WriteWholeFile(arguments.out, sim::PhoneJpeg(frame, phone), files::IfThere::kRefuse));
  fmt::print("{}: {} x {} px\n", arguments.out, frame.width, frame.height);
  if (arguments.truth.empty()) return {};
  return files::WriteWholeFile(
      arguments.truth, sim::PhoneTruthJson(arguments.name, sheet, arguments.reference, phone),
      files::IfThere::kRefuse);
}

Result<void> SimulateSheet(const SimSheetArguments& arguments) {
  const auto scene = sim::ParseSheetScene(arguments.scene);
  if (!scene) return Fail("--scene: " + scene.error().message);
  for (const std::string& path : {arguments.out, arguments.truth, arguments.pattern_out}) {
    if (path.empty()) continue;
    TRY(files::CheckTarget(path, files::IfThere::kRefuse, "choose another name"));
  }
  const std::string ending = std::filesystem::path(arguments.out).extension().string();
  if (arguments.photo && ending != ".jpg" && ending != ".jpeg") {
    return Fail(fmt::format("--out {}: a phone writes .jpg", arguments.out));
  }
  if (!arguments.photo && !arguments.photo_settings.empty()) {
    return Fail("--photo-set: there is no phone without --photo");
  }
  const auto sheet = TRY(Print(arguments, *scene));
  for (const std::string& note : sheet.notes) fmt::print(stderr, "note: {}\n", note);
  if (arguments.photo) {
    if (sheet.strokes.empty()) return Fail("no tool printed: there is nothing to photograph");
    return Photograph(arguments, sheet);
  }
  const auto scanner = TRY(ScannerFor(arguments, sheet));
  const auto options = TRY(FileOptionsOf(arguments));
  const auto scan = TRY(sim::SheetScan::Lay(sheet, scanner));
  if (scan.cut_off()) fmt::print(stderr, "note: part of the print lies outside the scan\n");
  const SlowWork work("scanning the sheet");
  TRY(sim::WriteScan(scan, sim::ScanningOf(arguments.name), options, arguments.out));
  fmt::print("{}: {} x {} px\n", arguments.out, scan.format().width_px, scan.format().height_px);
  if (arguments.truth.empty()) return {};
  return files::WriteWholeFile(
      arguments.truth,
      sim::SheetTruthJson(arguments.name, sheet, arguments.reference, scanner, scan.format()),
      files::IfThere::kRefuse);
}

void AddOriginalOptions(CLI::App& sheet, SimSheetArguments& arguments) {
  sheet
      .add_option("--original", arguments.original,
                  "instead of a file: the sheet of the method's original generator with these "
                  "tools, for example 1,2,3,4,5 (--reference is its reference tool)")
      ->delimiter(',')
      ->expected(1, 5)
      ->check(CLI::Range(0, sim::kMaxSheetTools - 1));
  sheet.add_option("--original-offset", arguments.original_offsets,
                   "PLACE:X,Y in mm, an offset on purpose of a place in that list, counted from "
                   "1; as published, the last place's moves the whole print");
  sheet.add_flag("--original-repaired", arguments.original_repaired,
                 "such an offset moves the combs of its own place alone");
  sheet.add_option("--pattern-out", arguments.pattern_out, "new file for the original's G-code");
}

void AddMachineOptions(CLI::App& sheet, SimSheetArguments& arguments) {
  sheet.add_option("--firmware", arguments.firmware,
                   "klipper, marlin or reprapfirmware; without it, as the file says");
  sheet.add_option("--macros", arguments.macros, "printer.cfg with plain gcode_macros (Klipper)");
  sheet.add_option("--before", arguments.before, "G-code that the machine has run before");
  sheet.add_option("--tool-command", arguments.tool_commands,
                   "another command that selects a tool, for example \"PICK N={tool}\"");
  sheet.add_option("--offset", arguments.offsets,
                   "TOOL:X,Y in mm: where its lines land, instead of what the seed draws");
  sheet.add_option("--stored", arguments.stored,
                   "TOOL:X,Y in mm: what the firmware has stored while the offset is so");
  sheet.add_option("--reference", arguments.reference, "the tool that the truth counts from")
      ->check(CLI::Range(0, sim::kMaxSheetTools - 1))
      ->capture_default_str();
  sheet.add_option("--missing", arguments.missing, "a tool that prints nothing")
      ->check(CLI::Range(0, sim::kMaxSheetTools - 1));
}

void AddScannerOptions(CLI::App& sheet, SimSheetArguments& arguments) {
  sheet.add_option("--dpi", arguments.dpi, "of the scan")
      ->check(NumberIn(50.0, 4800.0))
      ->capture_default_str();
  sheet.add_option("--bits", arguments.bits, "per sample, 8 or 16")
      ->check(CLI::IsMember({8, 16}))
      ->capture_default_str();
  sheet.add_flag("--colour", arguments.colour, "red, green and blue instead of grey");
  sheet.add_flag("--mirrored", arguments.mirrored, "as by a faulty driver");
  sheet.add_option("--says-dpi", arguments.says_dpi, "what the file claims, or none");
  sheet.add_option("--jpeg-quality", arguments.jpeg_quality)->capture_default_str();
  sheet.add_flag("--photo", arguments.photo,
                 "a phone's photo instead of a scan (.jpg); --scan says which");
  sheet.add_option(
      "--photo-set", arguments.photo_settings,
      "NAME=NUMBER of the phone, may be given again; names: " + sim::PhoneTraitNames());
}

}  // namespace

void AddSimSheet(CLI::App& parent, int& exit_code) {
  const auto arguments = std::make_shared<SimSheetArguments>();
  CLI::App* sheet = parent.add_subcommand(
      "sheet", "print a comb pattern with several virtual tools and scan the paper");
  sheet->add_option("gcode", arguments->gcode, "the file that the virtual printer prints");
  AddOriginalOptions(*sheet, *arguments);
  sheet->add_option("-o,--out", arguments->out, "new .png or .jpg file")->required();
  sheet->add_option("--truth", arguments->truth, "new JSON file for what is true");
  // Without the checks CLI11 takes -1 for the largest possible number.
  sheet->add_option("--seed", arguments->name.seed, "names the machine")
      ->check(SeedNumber())
      ->capture_default_str();
  sheet->add_option("--sheet", arguments->name.sheet, "which print of that machine")
      ->check(CLI::Range(0, 9999))
      ->capture_default_str();
  sheet->add_option("--scan", arguments->name.scan, "which scan of that print")
      ->check(CLI::Range(0, 9999))
      ->capture_default_str();
  sheet
      ->add_option("--scene", arguments->scene,
                   "black-on-white, white-on-black or colours-on-white")
      ->capture_default_str();
  sheet->add_flag("--ideal", arguments->ideal,
                  "perfect lines, paper and scanner; only the seed's offsets and play");
  AddMachineOptions(*sheet, *arguments);
  AddScannerOptions(*sheet, *arguments);
  sheet->add_option("--set", arguments->settings,
                    "NAME=NUMBER, may be given again; names: " + SettingNames());
  sheet->callback([arguments, &exit_code] {
    const Result<void> done = SimulateSheet(*arguments);
    exit_code = done ? kExitGood : PrintError(done.error());
  });
}

}  // namespace trammel::app
