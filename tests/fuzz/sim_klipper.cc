// Scripts that clients send to the virtual Klipper, parted by empty lines.
#include <cmath>

#include "fuzz.h"
#include "sim/klipper/command_line.h"
#include "sim/klipper/config.h"
#include "sim/klipper/machine.h"

namespace {

using namespace trammel;

sim::KlipperConfig Config() {
  sim::KlipperConfig config = sim::DefaultKlipperConfig();
  config.load_cell.emplace();
  sim::AddTapMacros(config);
  config.tools.resize(2);
  // So quick that homing and heating end while an input lasts.
  config.physical_start_mm = {1, 1, 1};
  config.homing_speed_mm_s = {500, 500, 100};
  config.nozzle.rate_c_s = config.bed.rate_c_s = 2000;
  config.nozzle.settle_s = config.bed.settle_s = 0.01;
  config.restart_s = 0.1;
  return config;
}

}  // namespace

TRAMMEL_FUZZ_TARGET(sim_klipper)(const std::uint8_t* data, std::size_t size) {
  static const sim::KlipperConfig config = Config();
  sim::VirtualKlipper klipper(config, {});
  constexpr double kTick_s = 0.12;
  constexpr int kMostScripts = 8;
  double now_s = kTick_s;
  klipper.Advance(now_s);
  std::string_view text = fuzz::Text(data, size);
  for (int i = 0; i < kMostScripts && !text.empty(); ++i) {
    const std::size_t end = std::min(text.find("\n\n"), text.size());
    const std::string script(text.substr(0, end));
    text.remove_prefix(std::min(end + 2, text.size()));
    klipper.files()["job.gcode"] = script;
    (void)klipper.RunScript(script);
    klipper.Advance(now_s += kTick_s);
    for (const sim::KlipperEvent& event : klipper.TakeEvents()) {
      fuzz::Require(!event.error || !event.error->empty(), "a script that fails says why");
    }
  }
  const sim::HeadState head = klipper.TrueHead(now_s);
  (void)head;
  return 0;
}
