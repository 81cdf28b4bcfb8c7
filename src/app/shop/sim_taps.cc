#include "app/shop/sim_taps.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>

namespace trammel::app {
namespace {

constexpr std::uint64_t kCellStream =
    0x7a9;  // of the seed's generator; laser and print have others

nlohmann::json TruthOf(const sim::ProbedTap& tap, std::size_t number) {
  nlohmann::json truth = {{"format", 1},
                          {"tap", number},
                          {"x_mm", tap.x_mm},
                          {"y_mm", tap.y_mm},
                          {"surface_z_mm", tap.surface_z_mm},
                          {"reported_z_mm", tap.reported_z_mm},
                          {"latency_s", tap.latency_s},
                          {"contact_z_mm", nullptr},
                          {"contact_time_s", nullptr}};
  if (!tap.truth) return truth;
  truth["contact_z_mm"] = tap.truth->contact_z_mm;
  truth["contact_time_s"] = tap.truth->contact_time_s;
  truth["touch_z_mm"] = tap.truth->touch_z_mm;
  truth["touch_time_s"] = tap.truth->touch_time_s;
  truth["snap_z_mm"] = tap.truth->snap_z_mm;
  truth["peak_force_g"] = tap.truth->peak_force_g;
  return truth;
}

}  // namespace

Result<std::optional<sim::LoadCellConfig>> LoadCellOf(const CellArguments& arguments,
                                                      std::uint64_t seed) {
  if (arguments.name.empty()) {
    if (arguments.truth.empty() && !arguments.bed_height_mm && !arguments.pulls_back) return {};
    return Fail("--tap-truth, --bed-height and --pull-back need --load-cell");
  }
  // Below the end stop, whatever the tilt, so that homing does not touch it.
  constexpr double kLowestMm = -0.15;
  constexpr double kHighestMm = -0.05;
  constexpr double kSteepest = 1e-4;
  Random random = Random(seed).Fork(kCellStream);
  sim::LoadCellConfig config;
  const sim::CellTraits drawn = sim::DrawCellTraits(random);
  if (arguments.name == "drawn") {
    config.cell = drawn;
  } else {
    const Result<sim::CellTraits> named = sim::CellByName(arguments.name);
    if (!named) return Fail("--load-cell: " + named.error().message + ", or drawn");
    config.cell = *named;
  }
  const double height_mm = random.Uniform(kLowestMm, kHighestMm);
  config.surface_z_mm = arguments.bed_height_mm.value_or(height_mm);
  config.tilt_x = random.Uniform(-kSteepest, kSteepest);
  config.tilt_y = random.Uniform(-kSteepest, kSteepest);
  config.pulls_back = arguments.pulls_back;
  config.seed = random.Bits();
  return config;
}

Result<TapTruthFile> TapTruthFile::Create(const std::string& path) {
  TapTruthFile file;
  file.file_.reset(std::fopen(path.c_str(), "wx"));
  if (!file.file_) {
    return Fail(
        fmt::format("cannot create the taps' truth {}: {}; choose a new file in a folder "
                    "that you may write to",
                    path, std::strerror(errno)));
  }
  return file;
}

void TapTruthFile::Write(const sim::VirtualKlipper& klipper, bool rest) {
  const std::vector<sim::ProbedTap>& taps = klipper.history().taps;
  for (; written_ < taps.size(); ++written_) {
    if (!rest && written_ + 1 == taps.size() && !taps[written_].truth) break;
    std::fputs((TruthOf(taps[written_], written_ + 1)
                    .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) +
                "\n")
                   .c_str(),
               file_.get());
  }
  std::fflush(file_.get());
}

}  // namespace trammel::app
