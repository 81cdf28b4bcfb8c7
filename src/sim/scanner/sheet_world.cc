#include "sim/scanner/sheet_world.h"

#include <nlohmann/json.hpp>
#include <numbers>

namespace trammel::sim {
namespace {

constexpr std::uint64_t kMachine = 1;
constexpr std::uint64_t kSheets = 100'000;  // then one generator per sheet
constexpr std::uint64_t kScans = 10;        // then one per scan

Random SheetOf(const SheetName& name) { return Random(name.seed).Fork(kSheets + name.sheet); }
Random ScanOf(const SheetName& name) { return SheetOf(name).Fork(kScans + name.scan); }

}  // namespace

SheetMachine MachineOf(const SheetName& name, SheetScene scene) {
  Random random = Random(name.seed).Fork(kMachine);
  return DrawSheetMachine(scene, random);
}

SheetPaper PaperOf(const SheetName& name, SheetScene scene) {
  Random random = SheetOf(name).Fork(0);
  return DrawSheetPaper(scene, random);
}

Random PrintingOf(const SheetName& name) { return SheetOf(name).Fork(1); }

ScannerTraits ScannerOf(const SheetName& name, const PrintedSheet& sheet) {
  Random random = ScanOf(name).Fork(0);
  return DrawScannerTraits(sheet, random);
}

Random ScanningOf(const SheetName& name) { return ScanOf(name).Fork(1); }

std::string SheetTruthJson(const SheetName& name, const PrintedSheet& sheet, int reference,
                           const ScannerTraits& scanner, const PageFormat& format) {
  using Json = nlohmann::ordered_json;
  Json tools = Json::array();
  for (const SheetToolTruth& truth : sheet.tools) {
    if (truth.tool == reference) continue;
    const auto offset = OffsetOf(sheet, truth.tool, reference);
    tools.push_back({{"tool", truth.tool},
                     {"dx_mm", offset ? Json(offset->x_mm) : Json()},
                     {"dy_mm", offset ? Json(offset->y_mm) : Json()},
                     {"printed", truth.printed}});
  }
  const Json json = {{"format", 1},
                     {"seed", name.seed},
                     {"sheet", name.sheet},
                     {"scan", name.scan},
                     {"reference", reference},
                     {"tools", tools},
                     {"backlash_mm", {{"x", sheet.backlash_mm[0]}, {"y", sheet.backlash_mm[1]}}},
                     {"scanner",
                      {{"dpi", scanner.dpi},
                       {"width_px", format.width_px},
                       {"height_px", format.height_px},
                       {"rotation_deg", scanner.rotation_rad * 180 / std::numbers::pi},
                       {"mirrored", scanner.mirrored},
                       {"scale_x", scanner.scale_x},
                       {"scale_y", scanner.scale_y},
                       {"skew", scanner.skew}}}};
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace trammel::sim
