// trammel sim spindle: clamp a camera virtually, look at a part, leave pictures and the truth.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
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
#include "app/shop/sim_commands.h"
#include "app/shop/sim_spindle_traits.h"
#include "app/shop/sim_spindle_views.h"
#include "app/slow_work.h"
#include "files/new_file.h"
#include "image/png_writer.h"
#include "part_alignment/targets/code_book.h"
#include "sim/spindle/spindle_files.h"
#include "sim/spindle/spindle_scene.h"

namespace trammel::app {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180;
constexpr int kMostTarget = 100;

struct SimSpindleArguments {
  std::string out;
  sim::SpindleName name;
  std::string scene = "laboratory";
  double distance_mm = 300;
  std::string camera = "real";
  std::string views;
  bool half_turn = false;
  std::optional<double> clamp_angle_rad;
  bool no_pictures = false;
  int bits = 14;
  double dot_radius_mm = 2;
  std::string light = "white-on-black";
  bool plain_surface = false;
  bool littered = false;
  std::vector<std::string> hide;
  std::vector<std::string> settings;
};

Result<sim::SpindleSetup> SceneOf(const SimSpindleArguments& arguments) {
  if (!(arguments.distance_mm >= 50 && arguments.distance_mm <= 1000)) {
    return Fail(fmt::format("--distance {}: must be within 50 … 1000 mm", arguments.distance_mm));
  }
  sim::SpindleSetup setup;
  if (arguments.scene == "laboratory") {
    setup = sim::LaboratoryScene(arguments.distance_mm);
  } else if (arguments.scene == "industry") {
    setup = sim::IndustryScene(arguments.distance_mm);
  } else {
    return Fail("--scene " + arguments.scene.substr(0, 40) + ": must be laboratory or industry");
  }
  if (arguments.camera == "real") {
    setup.lens = setup.stated_lens = sim::AsRealCamera(setup.lens);
  } else if (arguments.camera != "table1") {
    return Fail("--camera " + arguments.camera.substr(0, 40) + ": must be real or table1");
  }
  if (!arguments.views.empty()) {
    auto stops = TRY(ReadSpindleStops(arguments.views, setup.machine));
    setup.stops = std::move(stops);
  }
  if (arguments.half_turn) {
    const std::vector<sim::SpindleStop> stops = setup.stops;
    for (sim::SpindleStop stop : stops) {
      stop.c_rad = std::numbers::pi;
      setup.stops.push_back(stop);
    }
  }
  return setup;
}

Result<sim::SpindleLight> LightOf(const std::string& name) {
  if (name == "white-on-black") return sim::SpindleLight{};
  if (name == "retro") return sim::RetroLight();
  if (name != "black-on-white") {
    return Fail("--light " + name.substr(0, 40) +
                ": must be white-on-black, black-on-white or retro");
  }
  sim::SpindleLight light;
  std::swap(light.white, light.dark);
  return light;
}

Result<std::vector<sim::RingPattern>> PatternsOf(const SimSpindleArguments& arguments,
                                                 const sim::SpindlePart& part) {
  sim::RingPattern pattern;
  pattern.dot_radius_mm = arguments.dot_radius_mm;
  pattern.ring_inner_mm = 2 * arguments.dot_radius_mm;
  pattern.ring_outer_mm = 3 * arguments.dot_radius_mm;
  pattern.ground_radius_mm = 3.75 * arguments.dot_radius_mm;
  std::vector<sim::RingPattern> patterns;
  if (arguments.bits == 0) {
    return std::vector<sim::RingPattern>(part.targets.size(), pattern);
  }
  const auto book = part_alignment::MakeCodeBook(arguments.bits);
  if (!book) return Fail("--bits: " + book.error().message);
  for (const sim::SpindleTarget& target : part.targets) {
    pattern.bits = book->bits;
    pattern.word = book->words.at(static_cast<std::size_t>(target.id - 1));
    patterns.push_back(pattern);
  }
  return patterns;
}

Result<std::vector<std::vector<sim::HiddenWedge>>> WedgesOf(const SimSpindleArguments& arguments,
                                                            const sim::SpindlePart& part) {
  std::vector<std::vector<sim::HiddenWedge>> wedges(part.targets.size());
  for (const std::string& text : arguments.hide) {
    constexpr double kTurn_deg = 360;
    const auto parsed = ParseToolShift("--hide", text, kMostTarget);
    if (!parsed || !(parsed->y_mm > 0 && parsed->y_mm <= kTurn_deg)) {
      return Fail(
          fmt::format("--hide {}: must be TARGET:FROM,EXTENT, for example 2:0,90, in degrees with "
                      "an extent of at most 360",
                      text.substr(0, 40)));
    }
    const std::size_t at = static_cast<std::size_t>(parsed->tool) - 1;
    if (parsed->tool < 1 || at >= wedges.size()) {
      return Fail(
          fmt::format("--hide {}: the part has targets 1 … {}", text.substr(0, 40), wedges.size()));
    }
    wedges[at].push_back({parsed->x_mm * kRadPerDeg, parsed->y_mm * kRadPerDeg, 0});
  }
  return wedges;
}

Result<void> WriteText(const std::string& text, const std::filesystem::path& path) {
  return files::WriteWholeFile(path, text, files::IfThere::kRefuse);
}

// Makes the folder before anything is drawn, so that a typing error costs no minute.
Result<void> MakeFolder(const std::filesystem::path& out) {
  std::error_code fault;
  if (std::filesystem::exists(out, fault)) {
    return Fail(fmt::format("--out {} exists already; nothing is overwritten: choose another name",
                            out.string()));
  }
  std::filesystem::create_directories(out, fault);
  if (fault) return Fail(fmt::format("--out {}: {}", out.string(), fault.message()));
  return {};
}

Result<void> SimulateSpindle(const SimSpindleArguments& arguments) {
  auto setup = TRY(SceneOf(arguments));
  sim::SpindlePicture like;
  const auto light = TRY(LightOf(arguments.light));
  like.light = light;
  if (!arguments.plain_surface) like.clutter = sim::ShopClutter();
  like.clutter.over_targets = arguments.littered;
  for (const std::string& text : arguments.settings) {
    TRY(SetSpindleTrait(text, setup, like));
  }
  TRY(sim::Validate(setup));
  const auto patterns = TRY(PatternsOf(arguments, setup.part));
  const auto wedges = TRY(WedgesOf(arguments, setup.part));

  sim::SpindleWorld world = sim::DrawSpindleWorld(setup, arguments.name);
  if (arguments.clamp_angle_rad) world.clamping.angle_rad = *arguments.clamp_angle_rad;
  const sim::SpindlePicture first = sim::PictureAt(world, 0, patterns, wedges, like);
  TRY(sim::Validate(first));

  const std::filesystem::path out = arguments.out;
  TRY(MakeFolder(out));
  // Whole targets only: what is nearer to the edge has no centre that can be measured.
  const double margin_px =
      patterns.front().ground_radius_mm * sim::FocalPx(setup.lens) / arguments.distance_mm;
  const auto observations = sim::ObservationsJson(world, arguments.name, margin_px);
  TRY(WriteText(observations, out / "observations.json"));
  const auto truth = sim::SpindleTruthJson(world, arguments.name, margin_px);
  TRY(WriteText(truth, out / "truth.json"));
  if (!arguments.no_pictures) {
    const SlowWork work(fmt::format("taking {} pictures", setup.stops.size()));
    const Random noise = sim::PicturesOf(arguments.name);
    for (std::size_t stop = 0; stop < setup.stops.size(); ++stop) {
      const auto page = TRY(
          sim::TakePicture(sim::PictureAt(world, stop, patterns, wedges, like), noise.Fork(stop)));
      const auto png = TRY(image::EncodePng(page.view(), page.dpi_x, page.dpi_y));
      TRY(files::WriteWholeFile(out / sim::PictureName(stop),
                                {reinterpret_cast<const char*>(png.data()), png.size()},
                                files::IfThere::kRefuse));
    }
    TRY(WriteText(sim::ViewsJson(world), out / "views.json"));
  }
  fmt::print("{}: {} views; the clamp angle is {:.6f} rad\n", arguments.out, setup.stops.size(),
             world.clamping.angle_rad);
  return {};
}

void AddPictureOptions(CLI::App& spindle, SimSpindleArguments& arguments) {
  spindle.add_flag("--no-pictures", arguments.no_pictures, "observations and truth only");
  spindle.add_option("--bits", arguments.bits, "of the targets' rings: 12, 14, 20, or 0 for none")
      ->check(CLI::IsMember({0, 12, 14, 20}))
      ->capture_default_str();
  spindle
      .add_option("--dot-radius", arguments.dot_radius_mm,
                  "of a target's disc in mm; the ring is at 2 … 3 of it")
      ->check(NumberIn(0.2, 20.0))
      ->capture_default_str();
  spindle.add_option("--light", arguments.light, "white-on-black, black-on-white or retro")
      ->capture_default_str();
  spindle.add_flag("--plain-surface", arguments.plain_surface, "nothing but targets on the part");
  spindle.add_flag("--littered", arguments.littered, "scratches and chips on the targets too");
  spindle.add_option("--hide", arguments.hide,
                     "TARGET:FROM,EXTENT: a wedge that lies on it, degrees counter-clockwise");
}

}  // namespace

void AddSimSpindle(CLI::App& parent, int& exit_code) {
  const auto arguments = std::make_shared<SimSpindleArguments>();
  CLI::App* spindle = parent.add_subcommand(
      "spindle", "clamp a virtual camera into a spindle and look at a part's targets");
  spindle->add_option("-o,--out", arguments->out, "new folder for pictures, observations and truth")
      ->required();
  // Without the checks CLI11 takes -1 for the largest number there is.
  spindle->add_option("--seed", arguments->name.seed, "names part and machine")
      ->check(SeedNumber())
      ->capture_default_str();
  spindle->add_option("--clamping", arguments->name.clamping, "which clamping of the camera")
      ->check(CLI::Range(0, 1'000'000))
      ->capture_default_str();
  spindle->add_option("--scene", arguments->scene, "laboratory (1.5 x 1 m) or industry (10 x 3 m)")
      ->capture_default_str();
  spindle->add_option("--distance", arguments->distance_mm, "from camera to target, mm")
      ->capture_default_str();
  spindle
      ->add_option("--camera", arguments->camera,
                   "real (along its +z) or table1 (along -z, as the paper prints it: mirrored)")
      ->capture_default_str();
  spindle->add_option("--views", arguments->views,
                      "a plan (align plan, align init): its places instead of the scene's own");
  spindle->add_flag("--half-turn", arguments->half_turn, "every stop again with C at 180 degrees");
  spindle
      ->add_option("--clamp-angle", arguments->clamp_angle_rad,
                   "rad; without it, drawn from the backlash")
      ->check(NumberIn(-3.2, 3.2));
  AddPictureOptions(*spindle, *arguments);
  spindle->add_option("--set", arguments->settings,
                      "NAME=NUMBER, may be given again; names: " + SpindleTraitNames());
  spindle->callback([arguments, &exit_code] {
    const Result<void> done = SimulateSpindle(*arguments);
    exit_code = done ? kExitGood : PrintError(done.error());
  });
}

}  // namespace trammel::app
