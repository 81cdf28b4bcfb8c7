#include "offset_world.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <stdexcept>

#include "sim/sheet/sheet_gcode.h"
#include "tool_offset/sheet/sheet_gcode.h"

namespace trammel {

PatternFile WritePattern(const tool_offset::SheetSettings& settings) {
  PatternFile pattern{tool_offset::PlanSheet(settings), {}};
  pattern.gcode = tool_offset::WriteSheetGcode(pattern.plan).text;
  return pattern;
}

SeenSheet SeeSheet(const PatternFile& pattern, const sim::SheetName& name,
                   const std::function<void(sim::SheetMachine&, sim::SheetPaper&)>& machine_change,
                   const std::function<void(sim::ScannerTraits&)>& scanner_change,
                   sim::SheetScene scene) {
  sim::SheetSetup setup;
  setup.firmware = sim::GuessSheetFirmware(pattern.gcode);
  const auto program = sim::InterpretSheet(pattern.gcode, setup);
  if (!program) throw std::runtime_error(program.error().message);
  sim::SheetMachine machine = sim::MachineOf(name, scene);
  sim::SheetPaper paper = sim::PaperOf(name, scene);
  if (machine_change) machine_change(machine, paper);
  auto sheet = sim::PrintSheet(*program, machine, paper, sim::PrintingOf(name));
  if (!sheet) throw std::runtime_error(sheet.error().message);
  sim::ScannerTraits scanner = sim::ScannerOf(name, *sheet);
  if (scanner_change) scanner_change(scanner);
  const auto scanned = sim::ScanSheet(*sheet, scanner, sim::ScanningOf(name));
  if (!scanned) throw std::runtime_error(scanned.error().message);
  // The scanner has red, green, blue; pages have blue first.
  std::vector<std::uint8_t> samples = scanned->samples;
  const int channels = scanned->format.channels;
  for (std::size_t i = 0; channels == 3 && i + 2 < samples.size(); i += 3) {
    std::swap(samples[i], samples[i + 2]);
  }
  const PageView page = {samples.data(), scanned->format.width_px, scanned->format.height_px,
                         channels, static_cast<std::ptrdiff_t>(scanned->format.row_bytes())};
  return {std::move(*sheet), tool_offset::AnalyseSheet(page, pattern.plan)};
}

void Tally::Add(const Measured& measured, double truth_mm) {
  constexpr double kUm = 1000;
  if (!measured.good()) {
    ++missing;
    return;
  }
  const Quantity& q = measured.quantity();
  error_um.push_back(kUm * (q.value - truth_mm));
  half_width_um.push_back(kUm * 0.5 * (q.interval95.hi - q.interval95.lo));
  covered += q.interval95.lo <= truth_mm && truth_mm <= q.interval95.hi;
}

double Tally::Quantile(double share) const {
  std::vector<double> size;
  for (const double e : error_um) size.push_back(std::abs(e));
  std::sort(size.begin(), size.end());
  if (size.empty()) return 0;
  return size[static_cast<std::size_t>(share * static_cast<double>(size.size() - 1))];
}

double Tally::Coverage() const {
  return covered / std::max(1.0, static_cast<double>(error_um.size()));
}

double Tally::MeanHalfWidth_um() const {
  double sum = 0;
  for (const double half : half_width_um) sum += half;
  return sum / std::max(1.0, static_cast<double>(half_width_um.size()));
}

std::uint64_t FromEnvironment(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

}  // namespace trammel
