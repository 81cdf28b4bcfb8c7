// trammel-sim spindle: clamps a camera virtually, takes pictures of a part, and writes them with
// the truth.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/option_values.h"
#include "app/slow_work.h"
#include "base/result.h"
#include "files/json_object.h"
#include "files/new_file.h"
#include "image/png_writer.h"
#include "part_alignment/targets/code_book.h"
#include "sim/commands/commands.h"
#include "sim/print/named_number.h"
#include "sim/spindle/spindle_camera.h"
#include "sim/spindle/spindle_files.h"
#include "sim/spindle/spindle_world.h"

namespace trammel::app {

namespace {

/// Virtual spindle: machine, clamping, part, and the camera's image quality.
struct SpindleHall {
  sim::SpindleSetup setup;
  sim::SpindlePicture picture;
};

using SpindleNumber = sim::NamedNumber<SpindleHall>;
constexpr SpindleNumber kNumbers[] = {
    {"sigma-px", [](double v, auto& s) { s.setup.sigma_px = v; }, 0, 10},
    {"repeatability-mm", [](double v, auto& s) { s.setup.machine.repeatability_mm = v; }, 0, 1},
    {"scale-x", [](double v, auto& s) { s.setup.machine.scale[0] = v; }, -0.01, 0.01},
    {"scale-y", [](double v, auto& s) { s.setup.machine.scale[1] = v; }, -0.01, 0.01},
    {"scale-z", [](double v, auto& s) { s.setup.machine.scale[2] = v; }, -0.01, 0.01},
    {"square-xy-rad", [](double v, auto& s) { s.setup.machine.square_xy_rad = v; }, -0.01, 0.01},
    {"square-xz-rad", [](double v, auto& s) { s.setup.machine.square_xz_rad = v; }, -0.01, 0.01},
    {"square-yz-rad", [](double v, auto& s) { s.setup.machine.square_yz_rad = v; }, -0.01, 0.01},
    {"angle-rad", [](double v, auto& s) { s.setup.spread.angle_rad = v; }, 0, 0.5},
    {"eccentricity-mm", [](double v, auto& s) { s.setup.spread.eccentricity_mm = v; }, 0, 5},
    {"tilt-rad", [](double v, auto& s) { s.setup.spread.tilt_rad = v; }, 0, 0.1},
    {"misplaced-mm", [](double v, auto& s) { s.setup.part.misplaced_mm = v; }, 0, 100},
    {"misplaced-rad", [](double v, auto& s) { s.setup.part.misplaced_rad = v; }, 0, 0.5},
    {"temperature-c", [](double v, auto& s) { s.setup.part.temperature_c = v; }, -50, 150},
    {"expansion-per-k", [](double v, auto& s) { s.setup.part.expansion_per_k = v; }, 0, 1e-4},
    {"out-of-machine-mm", [](double v, auto& s) { s.setup.part.out_of_machine_mm = v; }, 0, 10},
    {"out-of-machine-scale", [](double v, auto& s) { s.setup.part.out_of_machine_scale = v; },
     -0.01, 0.01},
    {"white", [](double v, auto& s) { s.picture.light.white = v; }, 0, 1000},
    {"dark", [](double v, auto& s) { s.picture.light.dark = v; }, 0, 1000},
    {"surface", [](double v, auto& s) { s.picture.light.surface = v; }, 0, 255},
    {"hidden", [](double v, auto& s) { s.picture.light.hidden = v; }, 0, 1000},
    {"vignetting", [](double v, auto& s) { s.picture.light.vignetting = v; }, 0, 0.9},
    {"gradient", [](double v, auto& s) { s.picture.light.gradient = v; }, -1, 1},
    {"gradient-rad", [](double v, auto& s) { s.picture.light.gradient_rad = v; }, -10, 10},
    {"blur-px", [](double v, auto& s) { s.picture.optics.blur_px = v; }, 0, 20},
    {"motion-px", [](double v, auto& s) { s.picture.optics.motion_px = v; }, 0, 50},
    {"motion-rad", [](double v, auto& s) { s.picture.optics.motion_rad = v; }, -10, 10},
    {"read-noise", [](double v, auto& s) { s.picture.optics.read_noise = v; }, 0, 50},
    {"shot-noise", [](double v, auto& s) { s.picture.optics.shot_noise = v; }, 0, 10},
};

using sim::operator*;

constexpr std::size_t kMaxBytes = 100'000'000;
constexpr std::size_t kMaxViews = 1000;
constexpr double kSame = 1e-5;

// Returns the rotation about the spindle's axis from its frame at C = 0 to this one.
std::optional<double> AngleOf(const nlohmann::json& rows, const sim::SpindleMachine& machine) {
  const sim::Turn home = sim::SpindleTurn(machine, 0);
  sim::Turn turn = home;
  if (!rows.is_null()) {
    if (!rows.is_array() || rows.size() != 3) return std::nullopt;
    for (std::size_t i = 0; i < 3; ++i) {
      if (!rows[i].is_array() || rows[i].size() != 3) return std::nullopt;
      for (std::size_t j = 0; j < 3; ++j) {
        if (!rows[i][j].is_number()) return std::nullopt;
        turn[i][j] = rows[i][j].get<double>();
      }
    }
  }
  const sim::Turn inner = sim::Back(home) * turn;
  const double c_rad = std::atan2(inner[1][0], inner[0][0]);
  const sim::Turn meant = sim::SpindleTurn(machine, c_rad);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      if (!(std::abs(meant[i][j] - turn[i][j]) <= kSame)) return std::nullopt;
    }
  }
  return c_rad;
}

// Reads only the positions and rotations of a file of observations (docs/reference/formats.md).
Result<std::vector<sim::SpindleStation>> ReadSpindleStations(const std::filesystem::path& path,
                                                             const sim::SpindleMachine& machine) {
  const auto json = TRY(files::ReadJsonFile(path, kMaxBytes));
  files::JsonObject root(json, path.string());
  std::vector<sim::SpindleStation> stops;
  const nlohmann::json& views = root.List("views", 1, kMaxViews);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::string key = fmt::format("views[{}]", i);
    files::JsonObject view = root.Inner(views[i], key);
    const std::vector<double> at = view.Numbers("spindle_mm", 3, 3, {-1e6, 1e6});
    const nlohmann::json* rows = view.Find("spindle_rotation");
    const auto c_rad = AngleOf(rows != nullptr ? *rows : nlohmann::json(), machine);
    TRY(view.Faults());
    if (!c_rad) {
      return Fail(
          fmt::format("{}: {}.spindle_rotation: the virtual spindle turns about its own "
                      "axis alone",
                      path.string(), key));
    }
    stops.push_back({{at[0], at[1], at[2]}, *c_rad});
  }
  TRY(root.Faults());
  return stops;
}

constexpr double kRadPerDeg = std::numbers::pi / 180;
constexpr int kMaxTarget = 100;

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
    setup.stops = TRY(ReadSpindleStations(arguments.views, setup.machine));
  }
  if (arguments.half_turn) {
    const std::vector<sim::SpindleStation> stops = setup.stops;
    for (sim::SpindleStation stop : stops) {
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
    constexpr double kWidest_deg = 179;
    const auto parsed = ParseToolShift("--hide", text, kMaxTarget);
    if (!parsed || !(parsed->y_mm > 0 && parsed->y_mm <= kWidest_deg)) {
      return Fail(
          fmt::format("--hide {}: must be TARGET:FROM,EXTENT, for example 2:0,90, in degrees with "
                      "an extent of at most 179",
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

// Creates the folder before drawing, so that a typing error does not cost a minute.
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
  SpindleHall shop{TRY(SceneOf(arguments)), {}};
  sim::SpindleSetup& setup = shop.setup;
  sim::SpindlePicture& like = shop.picture;
  like.light = TRY(LightOf(arguments.light));
  if (!arguments.plain_surface) like.clutter = sim::ShopClutter();
  like.clutter.over_targets = arguments.littered;
  for (const std::string& text : arguments.settings) {
    const auto named = TRY(sim::ParseNamedValue("--set", text));
    if (!TRY(sim::SetNamed(kNumbers, named, shop))) {
      return sim::NoSuchName("--set", text, sim::NamesOf(kNumbers));
    }
  }
  TRY(sim::Validate(setup));
  const auto patterns = TRY(PatternsOf(arguments, setup.part));
  const auto wedges = TRY(WedgesOf(arguments, setup.part));

  sim::SpindleWorld world = sim::DrawSpindleWorld(setup, arguments.name);
  if (arguments.clamp_angle_rad) world.clamping.angle_rad = *arguments.clamp_angle_rad;
  const std::filesystem::path out = arguments.out;
  TRY(MakeFolder(out));
  // Whole targets only: the centre of one nearer to the edge cannot be measured.
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
  // Without the checks CLI11 takes -1 for the largest possible number.
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
                      "NAME=NUMBER, may be given again; names: " + sim::NamesOf(kNumbers));
  spindle->callback([arguments, &exit_code] {
    const Result<void> done = SimulateSpindle(*arguments);
    exit_code = done ? kExitGood : PrintError(done.error());
  });
}

}  // namespace trammel::app
