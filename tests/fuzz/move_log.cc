// Batches of moves and of forces, a JSON text a line, as a printer streams them.
#include "machine/moonraker/move_log.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "fuzz.h"
#include "machine/moonraker/printer.h"
#include "machine/moonraker/tap_intake.h"

TRAMMEL_FUZZ_TARGET(move_log)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  constexpr std::size_t kCapacity = 50;
  machine::MoveLog log(kCapacity);
  machine::TapIntake intake({
      .on_tap = [](const nlohmann::json& tap,
                   double) { fuzz::Require(tap.is_object(), "a tap is an object"); },
      .on_firmware_z = [](double z_mm,
                          double) { fuzz::Require(std::isfinite(z_mm), "a height is finite"); },
      .on_call = [](const nlohmann::json&, double) {},
      .on_news =
          [](const std::string& news) { fuzz::Require(!news.empty(), "news say something"); },
  });
  std::string_view text = fuzz::Text(data, size);
  for (double now_s = 0; !text.empty(); now_s += 1) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.empty()) continue;
    const auto json = nlohmann::json::parse(line.substr(1), nullptr, false);
    switch (line[0]) {
      case 'm':
        log.Add(json);
        intake.TakeMoves(json, now_s);
        break;
      case 'f':
        intake.TakeForces(json, now_s);
        break;
      case 't':
        intake.TakeTap(json, now_s);
        break;
      case 's':
        intake.TakeStatus(json, now_s, false);
        break;
      case 'r':
        intake.Restart();
        break;
      case 'o':
        (void)machine::FirstLoadCell(json);
        break;
      default:
        intake.TakeLine(std::string(line), now_s);
    }
  }
  const auto moves = log.Overlapping(-1e300, 1e300);
  fuzz::Require(moves.size() <= kCapacity, "no more moves are kept than there is room for");
  (void)log.Reaches(0);
  return 0;
}
