// trammel-sim scan, trammel-sim photo: print G-code virtually and record a scan or a photo of it.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/commands.h"
#include "app/option_values.h"
#include "app/slow_work.h"
#include "files/new_file.h"
#include "files/whole_file.h"
#include "sim/camera/scan_recorder.h"
#include "sim/commands/commands.h"
#include "sim/photo/photo.h"
#include "sim/print/plan_file.h"
#include "sim/print/printer.h"

namespace trammel::app {
namespace {

constexpr std::size_t kLargestGcode = 100'000'000;
constexpr std::size_t kLargestPlan = 10'000'000;

struct ScanArguments {
  std::string gcode;
  std::string plan;
  std::string condition = "matte-black-dark";
  bool all_conditions = false;
  std::uint64_t seed = 0;
  std::optional<double> pressure_advance_s;
  double flow_factor = 1;
  bool set_up = false;
  std::string frame = "1280x720";
  int pattern = 0;
  std::string out;
};

struct Size {
  int width_px = 0;
  int height_px = 0;
};

// "1280x720", within the given bounds.
Result<Size> ParseSize(const char* option, const std::string& text, const Size& largest) {
  const auto pair = ParseWholePair(text);
  if (pair && pair->first >= 64 && pair->first <= largest.width_px && pair->second >= 64 &&
      pair->second <= largest.height_px) {
    return Size{pair->first, pair->second};
  }
  return Fail(fmt::format("{} {}: must be WIDTHxHEIGHT within 64x64 ... {}x{}", option,
                          text.substr(0, 40), largest.width_px, largest.height_px));
}

Result<void> RecordConditions(const ScanArguments& arguments) {
  const Size frame =
      TRY(ParseSize("--frame", arguments.frame, {sim::kSensorWidthPx, sim::kSensorHeightPx}));
  std::vector<sim::Condition> conditions;
  if (arguments.all_conditions) {
    for (const sim::Condition& condition : sim::AllConditions()) conditions.push_back(condition);
  } else {
    const Result<sim::Condition> condition = sim::ParseCondition(arguments.condition);
    if (!condition) return Fail("--condition: " + condition.error().message);
    conditions.push_back(*condition);
  }
  const std::filesystem::path out = arguments.out;
  std::error_code ignored;
  if (std::filesystem::exists(out, ignored)) {
    return Fail(fmt::format("--out {} exists already; nothing is overwritten: choose another name",
                            arguments.out));
  }
  const std::string plan_text = TRY(files::ReadWholeFile(arguments.plan, kLargestPlan));
  const sim::Plan plan = TRY(sim::ParsePlan(plan_text, arguments.plan));
  sim::ScanOptions options = sim::ScanOptionsFor(plan);
  options.pattern = arguments.pattern;
  options.frame_width_px = frame.width_px;
  options.frame_height_px = frame.height_px;
  const std::string gcode = TRY(files::ReadWholeFile(arguments.gcode, kLargestGcode));
  const SlowWork work("printing and scanning");
  const Result<sim::Print> print = sim::PrintInWorld(
      gcode, arguments.seed, arguments.pressure_advance_s, {}, arguments.flow_factor);
  if (!print) return Fail(arguments.gcode + ": " + print.error().message);
  for (const std::string& note : print->notes) fmt::print(stderr, "note: {}\n", note);

  for (const sim::Condition& condition : conditions) {
    const std::string name = sim::ToString(condition);
    const std::filesystem::path folder = arguments.all_conditions ? out / name : out;
    Random random = sim::LaserRandom(arguments.seed, condition);
    const sim::LaserTraits optics = sim::DrawLaserTraits(condition, random);
    options.opaque_plate = arguments.set_up && condition.plate != sim::Plate::kPei;
    if (arguments.set_up) {
      Random set_up = random.Fork(2);
      options.set_up = sim::DrawSetUpScale(optics, set_up);
    }
    TRY(sim::RecordScan(print->bed, plan, condition, optics, options, random.Fork(1), folder));
    TRY(sim::WriteTruth(folder, print->truth, arguments.seed, name));
    fmt::print("{}\n", folder.string());
  }
  return {};
}

void AddSeed(CLI::App& command, std::uint64_t& seed) {
  // Without the check CLI11 takes -1 for the largest possible seed.
  command.add_option("--seed", seed, "names the whole world")
      ->check(SeedNumber())
      ->capture_default_str();
}

}  // namespace

void AddSimScan(CLI::App& parent, int& exit_code) {
  const auto arguments = std::make_shared<ScanArguments>();
  CLI::App* scan = parent.add_subcommand("scan", "print G-code virtually and record a laser scan");
  scan->add_option("gcode", arguments->gcode, "the file that the virtual printer prints")
      ->required();
  scan->add_option("--plan", arguments->plan, "the pattern's *.plan.json")->required();
  CLI::Option* condition =
      scan->add_option(
              "--condition", arguments->condition,
              "PLATE-FILAMENT-LIGHT: matte, textured or pei; black or white; ambient or dark")
          ->capture_default_str();
  scan->add_flag("--all-conditions", arguments->all_conditions,
                 "record the same print in all twelve, each in a folder of its own below --out")
      ->excludes(condition);
  AddSeed(*scan, arguments->seed);
  scan->add_option("--pressure-advance", arguments->pressure_advance_s,
                   "the truth in s; without it, the seed's, as for trammel-sim printer");
  scan->add_option("--flow-factor", arguments->flow_factor,
                   "delivered over commanded filament, 0.2 ... 2")
      ->capture_default_str();
  scan->add_flag("--set-up", arguments->set_up,
                 "state scale, angle and plate as a set-up would; else the scale is nominal");
  scan->add_option("--frame", arguments->frame, "size in px; smaller than the sensor is a window")
      ->capture_default_str();
  scan->add_option("--pattern", arguments->pattern, "which pattern of the plan")
      ->capture_default_str();
  scan->add_option("-o,--out", arguments->out, "new folder for the recording")->required();
  scan->callback([arguments, &exit_code] {
    const Result<void> done = RecordConditions(*arguments);
    exit_code = done ? kExitGood : PrintError(done.error());
  });
}

namespace {

struct PhotoArguments {
  std::string gcode;
  std::string scene = "natural-on-gold";
  std::string size = "1080x1920";
  std::uint64_t seed = 0;
  std::optional<double> pressure_advance_s;
  std::optional<double> exponent;
  bool phone = false;
  std::vector<std::string> settings;
  std::string truth;
  std::string out;
};

Result<sim::PhotoTraits> TraitsOf(const PhotoArguments& arguments, const sim::PhotoScene& scene,
                                  const Size& size, Random& random) {
  sim::PhotoTraits traits =
      arguments.phone ? sim::DrawPhonePhoto(scene, size.width_px, size.height_px, {}, random)
                      : sim::DrawPhotoTraits(scene, random);
  traits.width_px = size.width_px;
  traits.height_px = size.height_px;
  for (const std::string& text : arguments.settings) {
    const auto named = TRY(sim::ParseNamedValue("--set", text));
    if (!TRY(sim::SetNamed(sim::kPhotoNumbers, named, traits))) {
      return sim::NoSuchName("--set", text, sim::NamesOf(sim::kPhotoNumbers));
    }
  }
  return traits;
}

Result<void> WritePhotoTruth(const PhotoArguments& arguments, const sim::Print& print) {
  nlohmann::json truth = {{"format", 1},
                          {"kind", "photo_truth"},
                          {"pressure_advance_s", print.truth.pressure_advance_s},
                          {"tangent_s", print.truth.tangent_s},
                          {"corner_s", nullptr},
                          {"seed", arguments.seed},
                          {"scene", arguments.scene}};
  if (print.truth.corner_s) truth["corner_s"] = *print.truth.corner_s;
  for (const sim::CornerTruth& corner : print.truth.corners) {
    truth["corners"].push_back({{"speed_mm_s", corner.speed_mm_s},
                                {"acceleration_mm_s2", corner.acceleration_mm_s2},
                                {"pressure_advance_s", corner.pressure_advance_s},
                                {"tangent_s", corner.tangent_s},
                                {"corner_s", corner.corner_s},
                                {"x_mm", corner.x_mm},
                                {"y_mm", corner.y_mm}});
  }
  return files::WriteWholeFile(
      arguments.truth, truth.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n",
      files::IfThere::kRefuse);
}

Result<void> TakePhoto(const PhotoArguments& arguments) {
  const Result<sim::PhotoScene> scene = sim::ParsePhotoScene(arguments.scene);
  if (!scene) return Fail("--scene: " + scene.error().message);
  const Size size = TRY(ParseSize("--size", arguments.size, {20000, 20000}));
  std::error_code ignored;
  if (std::filesystem::exists(arguments.out, ignored)) {
    return Fail(fmt::format("--out {} exists already; nothing is overwritten: choose another name",
                            arguments.out));
  }
  const std::string gcode = TRY(files::ReadWholeFile(arguments.gcode, kLargestGcode));
  const SlowWork work("printing and taking the photo");
  const Result<sim::Print> print =
      sim::PrintInWorld(gcode, arguments.seed, arguments.pressure_advance_s, arguments.exponent);
  if (!print) return Fail(arguments.gcode + ": " + print.error().message);
  for (const std::string& note : print->notes) fmt::print(stderr, "note: {}\n", note);
  Random random = sim::PhotoRandom(arguments.seed);
  const sim::PhotoTraits traits = TRY(TraitsOf(arguments, *scene, size, random));
  const Frame photo = TRY(sim::RenderPhoto(print->bed, traits, random.Fork(1)));
  TRY(sim::WriteJpegFile(photo, traits.jpeg_quality, arguments.out));
  if (!arguments.truth.empty()) TRY(WritePhotoTruth(arguments, *print));
  fmt::print("{}: the truth is {:.5f} s\n", arguments.out, print->truth.pressure_advance_s);
  return {};
}

}  // namespace

void AddSimPhoto(CLI::App& parent, int& exit_code) {
  const auto arguments = std::make_shared<PhotoArguments>();
  CLI::App* photo = parent.add_subcommand("photo", "print G-code virtually and take a photo of it");
  photo->add_option("gcode", arguments->gcode, "the file that the virtual printer prints")
      ->required();
  photo
      ->add_option("--scene", arguments->scene,
                   "FILAMENT-on-PLATE or matte-FILAMENT-on-PLATE: natural, black, white, orange, "
                   "blue or grey; gold, dark, light, smooth-gold, glass or magnetic")
      ->capture_default_str();
  photo->add_option("--size", arguments->size, "of the photo, px")->capture_default_str();
  AddSeed(*photo, arguments->seed);
  photo->add_option("--pressure-advance", arguments->pressure_advance_s,
                    "the truth in s; without it, the seed's, as for trammel-sim printer");
  photo->add_option("--exponent", arguments->exponent,
                    "of the storage law, 0.2 ... 1; 1: the lag is the same at every flow; without "
                    "it, the seed's law");
  photo->add_flag("--phone", arguments->phone,
                  "a phone over the whole print, in place of a camera close to a small pattern");
  photo->add_option("--set", arguments->settings,
                    "NAME=NUMBER, one of the photo's traits, may be given again; names: " +
                        sim::NamesOf(sim::kPhotoNumbers));
  photo->add_option("--truth", arguments->truth, "new JSON file for the truth");
  photo->add_option("-o,--out", arguments->out, "new JPEG file")->required();
  photo->callback([arguments, &exit_code] {
    const Result<void> done = TakePhoto(*arguments);
    exit_code = done ? kExitGood : PrintError(done.error());
  });
}

}  // namespace trammel::app
