// trammel-sim mill: simulates a milling machine with a camera in its spindle, over a printed board.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/option_values.h"
#include "files/json_object.h"
#include "files/new_file.h"
#include "sim/commands/commands.h"
#include "sim/print/named_number.h"
#include "sim/spindle/mill.h"
#include "sim/spindle/mill_camera.h"

namespace trammel::app {
namespace {

struct SimMillArguments {
  std::string sheet;
  std::optional<int> join;
  std::uint64_t seed = 0;
  int port = 0;
  int camera_port = 0;
  std::string frame = "2592x1944";
  std::vector<double> start_mm;
  std::vector<double> travel_mm;
  std::vector<double> camera_mm;
  double hurry = 1;
  std::vector<std::string> faults;
  std::string truth;
  std::optional<double> for_s;
};

struct Switches {
  sim::MillFaults mill;
  sim::MillCameraOptions camera;
};

constexpr sim::NamedNumber<Switches> kSwitches[] = {
    {"not-homed", [](double v, Switches& s) { s.mill.not_homed = v != 0; }},
    {"spindle-turns", [](double v, Switches& s) { s.mill.spindle_turns = v != 0; }},
    {"estop-at-move", [](double v, Switches& s) { s.mill.estop_at_move = sim::WholeOf(v); }},
    {"silent-at-move", [](double v, Switches& s) { s.mill.silent_at_move = sim::WholeOf(v); }},
    {"refused-at-move", [](double v, Switches& s) { s.mill.refused_at_move = sim::WholeOf(v); }},
    {"dark-beyond-x", [](double v, Switches& s) { s.camera.dark_beyond_x_mm = v; }},
};

// Reads marks and codes written by `align targets --layout`; plain discs are not printed.
Result<void> ReadSheet(const std::string& path, sim::BoardSetup& setup,
                       std::vector<sim::RingPattern>& patterns, std::vector<int>& numbers) {
  constexpr std::size_t kMaxBytes = 20'000'000;
  constexpr std::size_t kMaxMarks = 300;
  const auto json = TRY(files::ReadJsonFile(path, kMaxBytes));
  files::JsonObject root(json, path);
  sim::RingPattern pattern;
  pattern.bits = root.Integer("bits", {12, 20});
  pattern.dot_radius_mm = root.Number("radius_mm", {0.2, 20});
  pattern.ring_inner_mm = 2 * pattern.dot_radius_mm;
  pattern.ring_outer_mm = 3 * pattern.dot_radius_mm;
  pattern.ground_radius_mm = 3.7 * pattern.dot_radius_mm;
  std::array<double, 2> middle = {};
  for (const nlohmann::json& entry : root.List("targets", 1, kMaxMarks)) {
    files::JsonObject object = root.Inner(entry, fmt::format("targets[{}]", patterns.size()));
    const nlohmann::json* number = object.Find("number");
    if (number == nullptr || !number->is_number_integer()) continue;
    numbers.push_back(object.Integer("number", {1, 1'000'000}));
    pattern.word = static_cast<std::uint32_t>(object.Integer("word", {0, 0xFFFFF}));
    patterns.push_back(pattern);
    setup.sheet.places_mm.push_back(
        {object.Number("x_mm", {0, 10'000}), -object.Number("y_mm", {0, 10'000})});
    TRY(object.Faults());
    for (std::size_t i = 0; i < 2; ++i) middle[i] += setup.sheet.places_mm.back()[i];
  }
  TRY(root.Faults());
  if (patterns.size() < 4) return Fail(path + ": has fewer than 4 marks with codes");
  for (auto& place : setup.sheet.places_mm) {
    for (std::size_t i = 0; i < 2; ++i)
      place[i] -= middle[i] / static_cast<double>(patterns.size());
  }
  return {};
}

// Returns the marks nearest to the sheet's four corners, by their index in the list from 1.
std::vector<int> CornersOf(const sim::BoardSheet& sheet) {
  std::set<int> corners;
  for (const auto& [x, y] :
       {std::pair{1, 1}, std::pair{1, -1}, std::pair{-1, 1}, std::pair{-1, -1}}) {
    int best = 0;
    for (std::size_t i = 0; i < sheet.places_mm.size(); ++i) {
      const auto reach = [&](std::size_t k) {
        return x * sheet.places_mm[k][0] + y * sheet.places_mm[k][1];
      };
      if (reach(i) > reach(static_cast<std::size_t>(best))) best = static_cast<int>(i);
    }
    corners.insert(best + 1);
  }
  return {corners.begin(), corners.end()};
}

// Returns the same lens with a sensor of fewer, larger pixels.
Result<sim::SpindleLens> LensOf(const SimMillArguments& arguments) {
  sim::SpindleLens lens = sim::AsRealCamera({});
  const auto size = ParseWholePair(arguments.frame);
  if (!size || size->first < 64 || size->first > 20'000 ||
      std::abs(size->first * 3 - size->second * 4) > 3) {
    return Fail(fmt::format("--frame {}: must be WIDTHxHEIGHT of 4 : 3, for example 1296x972",
                            arguments.frame.substr(0, 40)));
  }
  const double times = static_cast<double>(lens.width_px) / size->first;
  lens.width_px = size->first;
  lens.height_px = size->second;
  lens.pixel_pitch_mm *= times;
  for (double& offset : lens.principal_offset_px) offset /= times;
  lens.k1 *= times * times;
  lens.k2 *= std::pow(times, 4);
  lens.p1 *= times;
  lens.p2 *= times;
  if (!arguments.camera_mm.empty()) {
    lens.offset_mm = {arguments.camera_mm[0], arguments.camera_mm[1], arguments.camera_mm[2]};
  }
  return lens;
}

Result<void> ServeMill(const SimMillArguments& arguments) {
  if (arguments.join) return sim::JoinMill(*arguments.join);
  if (arguments.sheet.empty()) {
    return Fail("--sheet is missing: the board's layout, as align targets --layout left it");
  }
  Switches switches;
  for (const std::string& fault : arguments.faults) {
    if (!TRY(sim::SetNamed(kSwitches, TRY(sim::ParseNamedValue("--fault", fault)), switches))) {
      return sim::NoSuchName("--fault", fault, sim::NamesOf(kSwitches));
    }
  }
  sim::MillOptions options;
  options.hurry = arguments.hurry;
  options.faults = switches.mill;
  const std::vector<double>& travel = arguments.travel_mm;
  if (!travel.empty()) {
    options.travel_low_mm = {travel[0], travel[1], travel[2]};
    options.travel_high_mm = {travel[3], travel[4], travel[5]};
  }
  const std::vector<double>& start = arguments.start_mm;
  if (!start.empty()) options.start_mm = {start[0], start[1], start[2]};
  sim::BoardSetup setup;
  setup.lens = TRY(LensOf(arguments));
  std::vector<int> numbers;
  TRY(ReadSheet(arguments.sheet, setup, switches.camera.patterns, numbers));
  setup.touched = CornersOf(setup.sheet);
  setup.stops = {{options.start_mm, 0}};
  sim::BoardWorld world = sim::DrawBoardWorld(setup, arguments.seed);
  for (sim::BoardTouchStation& touch : world.touches) {
    touch.mark = numbers[static_cast<std::size_t>(touch.mark - 1)];
  }
  if (!arguments.truth.empty()) {
    TRY(files::WriteWholeFile(arguments.truth, sim::MillTruthJson(world), files::IfThere::kRefuse));
  }
  sim::SpindleLight& light = switches.camera.like.light;
  light.white = 30;  // black prints on white paper
  light.dark = 205;
  light.surface = 190;
  light.vignetting = 0.2;
  switches.camera.port = arguments.camera_port;
  const EndOfServing end;
  const auto mill = std::make_shared<sim::VirtualMill>(options);
  const auto camera = TRY(sim::MillCamera::Start(switches.camera, std::move(world), mill));
  const auto server = TRY(sim::MillServer::Start(arguments.port, mill));
  std::error_code fault;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", fault);
  fmt::print("machine session:{} mill --join {}\ncamera http://127.0.0.1:{}/stream\n",
             fault ? "trammel-sim" : program.string(), server->port(), camera->port());
  std::fflush(stdout);
  end.Wait(arguments.for_s);
  return {};
}

}  // namespace

void AddSimMill(CLI::App& parent, int& exit_code) {
  const auto arguments = std::make_shared<SimMillArguments>();
  CLI::App* mill = parent.add_subcommand(
      "mill", "be a milling machine with a camera in its spindle, over a printed board");
  mill->add_option("--sheet", arguments->sheet,
                   "the board's layout, as align targets --layout left it");
  mill->add_option("--join", arguments->join,
                   "speak for the mill on that port instead: --machine 'session:trammel-sim mill "
                   "--join PORT'")
      ->check(CLI::Range(1, 65535));
  mill->add_option("--seed", arguments->seed, "names print, machine and pictures")
      ->check(SeedNumber())
      ->capture_default_str();
  mill->add_option("--port", arguments->port, "of the machine on 127.0.0.1; 0 takes a free one")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  mill->add_option("--camera-port", arguments->camera_port, "of its camera; 0 takes a free one")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  mill->add_option("--frame", arguments->frame, "size of the camera's pictures in px, 4 : 3")
      ->capture_default_str();
  mill->add_option("--start", arguments->start_mm,
                   "where the spindle stands at first: X,Y,Z mm; left out: 600,400,520, which is "
                   "200 mm above the board's middle")
      ->expected(3)
      ->delimiter(',');
  mill->add_option("--travel", arguments->travel_mm,
                   "least X,Y,Z and most X,Y,Z; left out: 0,0,0,1200,800,1000")
      ->expected(6)
      ->delimiter(',');
  mill->add_option("--camera-place", arguments->camera_mm,
                   "of the camera in its taper: X,Y,Z mm; left out: -2.139,0.301,-320.3")
      ->expected(3)
      ->delimiter(',');
  mill->add_option("--hurry", arguments->hurry, "how many times faster than asked it moves")
      ->check(NumberIn(0.01, 1000.0))
      ->capture_default_str();
  mill->add_option("--fault", arguments->faults,
                   "NAME=NUMBER, may be given again; names: " + sim::NamesOf(kSwitches));
  mill->add_option("--truth", arguments->truth,
                   "new file for what camera and board really are, with four marks touched in Z");
  mill->add_option("--for", arguments->for_s, "s after which it ends by itself")
      ->check(NumberIn(0.0, 1e6));
  mill->callback([arguments, &exit_code] {
    const Result<void> done = ServeMill(*arguments);
    exit_code = done ? kExitGood : PrintError(done.error());
  });
}

}  // namespace trammel::app
