#include "fault_scenario.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <exception>
#include <nlohmann/json.hpp>
#include <sstream>

namespace trammel::test {
namespace {

namespace fs = std::filesystem;

std::optional<double> NumberOf(const nlohmann::json& object, const char* key) {
  if (!object.contains(key) || !object[key].is_number()) return {};
  return object[key].get<double>();
}

// Computes the time from trammel's end to the laser's last switch-off.
double LaserOnAfter(const MachineShop& shop, double end_s) {
  double off_s = 0;
  bool on = false;
  shop.With([&](sim::VirtualKlipper& klipper) {
    on = sim::ValueAt(klipper.history(), "output_pin LASER", end_s, 0) > 0;
    for (const sim::Change& change : klipper.history().changes) {
      if (change.name == "output_pin LASER" && change.time_s > end_s) {
        if (change.value > 0) on = true;
        if (change.value == 0) off_s = change.time_s;
      }
    }
  });
  return on ? std::max(0.0, off_s - end_s) : 0;
}

void PlayIn(MachineShop& shop, const Scenario& scenario, Outcome& outcome) {
  if (scenario.before) scenario.before(shop);
  outcome.before = shop.Look();
  std::vector<std::string> words = scenario.arguments;
  if (words.empty()) words = {"pa", "calibrate", "--out", "rec", "--printer"};
  if (words.back() == "--printer") words.push_back(shop.address());
  const auto process = std::make_unique<TrammelProcess>(words, shop.folder(), scenario.limits);
  try {
    if (scenario.strike) scenario.strike(shop, *process);
  } catch (const std::exception& failure) {
    outcome.problem = failure.what();
  }
  outcome.end = process->Wait();
  const double end_s = shop.MachineTime();
  try {
    if (scenario.after) scenario.after(shop, outcome);
  } catch (const std::exception& failure) {
    outcome.problem = failure.what();
  }
  outcome.faulty = shop.Faulty(outcome.before, scenario.patience_s);
  outcome.after = shop.Look();
  outcome.laser_on_s = LaserOnAfter(shop, end_s);
  outcome.recording = LookAtRecording(shop);
}

}  // namespace

const char* const kWorkedWith =
    "SET_PRESSURE_ADVANCE ADVANCE=0.055 SMOOTH_TIME=0.03\n"
    "SET_VELOCITY_LIMIT VELOCITY=444 ACCEL=7777 SQUARE_CORNER_VELOCITY=6 MINIMUM_CRUISE_RATIO=0.4\n"
    "M140 S32\nG91\nM83\nM221 S97";

namespace {

// Frames that a .times file says are in its video.
int LoggedFrames(const fs::path& times) {
  std::istringstream text(ReadWhole(times));
  int frames = 0;
  for (std::string line; std::getline(text, line);) {
    frames += !line.empty() && line[0] >= '0' && line[0] <= '9';
  }
  return frames;
}

// JPEGs that are whole in an AVI, in the order of its chunks, whatever its headers and index say.
int KeptFrames(const fs::path& video) {
  const std::string bytes = ReadWhole(video);
  int frames = 0;
  for (std::size_t at = bytes.find("00dc", bytes.find("movi"));
       at != std::string::npos && at + 8 < bytes.size();) {
    std::uint32_t size = 0;
    std::memcpy(&size, bytes.data() + at + 4, 4);
    const std::size_t end = at + 8 + size;
    if (bytes.compare(at, 4, "00dc") != 0 || end > bytes.size()) break;
    frames += bytes.compare(at + 8, 2, "\xff\xd8") == 0;
    at = end + size % 2;
  }
  return frames;
}

}  // namespace

RecordingLook LookAtRecording(const MachineShop& shop) {
  RecordingLook look;
  const fs::path folder = shop.folder() / "rec";
  std::error_code ignored;
  look.folder = fs::exists(folder, ignored);
  while (fs::exists(folder / ("line" + std::to_string(look.videos) + ".avi"), ignored)) {
    const fs::path video = folder / ("line" + std::to_string(look.videos) + ".avi");
    const int told = LoggedFrames(video.string() + ".times");
    look.told_frames += told;
    look.kept_frames += std::min(told, KeptFrames(video));
    ++look.videos;
  }
  const auto sweeps = nlohmann::json::parse(ReadWhole(folder / "sweeps.json"), nullptr, false);
  if (sweeps.is_object()) {
    look.sweeps = static_cast<int>(sweeps["sweeps"].size() + sweeps["swept_again"].size());
  }
  look.scan = fs::exists(folder / "scan.json", ignored);
  if (!look.scan && !sweeps.is_object()) return look;
  const ProcessEnd end = shop.Run({"pa", "analyze", "rec", "--json"});
  look.exit_code = end.exit_code;
  look.said = end.standard_error;
  const auto answer = nlohmann::json::parse(end.standard_output, nullptr, false);
  if (!answer.is_object()) return look;
  look.verdict = answer.value("verdict", "");
  look.said = answer.value("reason", "");
  for (const auto& notice : answer["notices"]) look.notices.push_back(notice.get<std::string>());
  look.value_s = NumberOf(answer, "pressure_advance_s");
  if (look.value_s && answer["interval95_s"].is_array()) {
    look.low_s = answer["interval95_s"][0].get<double>();
    look.high_s = answer["interval95_s"][1].get<double>();
  }
  return look;
}

Outcome Play(const Scenario& scenario) {
  Outcome outcome;
  try {
    ShopOptions options;
    if (scenario.prepare) scenario.prepare(options);
    MachineShop shop(options);
    PlayIn(shop, scenario, outcome);
  } catch (const std::exception& failure) {
    outcome.problem = failure.what();
  }
  return outcome;
}

}  // namespace trammel::test
