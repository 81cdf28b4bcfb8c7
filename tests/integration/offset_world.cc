#include "offset_world.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "base/statistics.h"
#include "sim/sheet/sheet_gcode.h"
#include "tool_offset/original/original_sheet.h"
#include "tool_offset/sheet/sheet_gcode.h"

namespace trammel {

PatternFile WritePattern(const tool_offset::SheetSettings& settings) {
  PatternFile pattern{tool_offset::PlanSheet(settings), {}};
  pattern.gcode = tool_offset::WriteSheetGcode(pattern.plan).text;
  return pattern;
}

PatternFile SheetOfTools(int count) {
  tool_offset::SheetSettings settings;
  settings.tools.resize(static_cast<std::size_t>(count));
  std::iota(settings.tools.begin(), settings.tools.end(), 0);
  settings.filament.material = "pla";
  settings.printer.bed_size_x_mm = settings.printer.bed_size_y_mm = 300;
  return WritePattern(settings);
}

PatternFile OriginalPattern(const sim::OriginalSheet& sheet) {
  PatternFile pattern{{}, sim::OriginalGcode(sheet)};
  const auto read = tool_offset::ReadOriginalGcode(pattern.gcode);
  if (!read) throw std::runtime_error(read.error().message);
  pattern.plan = tool_offset::PlanOriginal(*read);
  return pattern;
}

sim::PrintedSheet PrintPattern(const std::string& gcode, const sim::SheetName& name,
                               const MachineChange& change) {
  constexpr auto kScene = sim::SheetScene::kBlackOnWhite;
  sim::SheetSetup setup;
  setup.firmware = sim::GuessSheetFirmware(gcode);
  const auto program = sim::InterpretSheet(gcode, setup);
  if (!program) throw std::runtime_error(program.error().message);
  sim::SheetMachine machine = sim::MachineOf(name, kScene);
  sim::SheetPaper paper = sim::PaperOf(name, kScene);
  if (change) change(machine, paper);
  auto sheet = sim::PrintSheet(*program, machine, paper, sim::PrintingOf(name));
  if (!sheet) throw std::runtime_error(sheet.error().message);
  return std::move(*sheet);
}

SeenSheet SeeSheet(const PatternFile& pattern, const sim::SheetName& name,
                   const MachineChange& machine, const ScannerChange& scanner_change) {
  sim::PrintedSheet sheet = PrintPattern(pattern.gcode, name, machine);
  sim::ScannerTraits scanner = sim::ScannerOf(name, sheet);
  if (scanner_change) scanner_change(scanner);
  const auto scanned = sim::ScanSheet(sheet, scanner, sim::ScanningOf(name));
  if (!scanned) throw std::runtime_error(scanned.error().message);
  // The scanner has red, green, blue; pages have blue first.
  std::vector<std::uint8_t> samples = scanned->samples;
  const int channels = scanned->format.channels;
  for (std::size_t i = 0; channels == 3 && i + 2 < samples.size(); i += 3) {
    std::swap(samples[i], samples[i + 2]);
  }
  const PageView page = {samples.data(), scanned->format.width_px, scanned->format.height_px,
                         channels, static_cast<std::ptrdiff_t>(scanned->format.row_bytes())};
  return {std::move(sheet), tool_offset::AnalyseSheet(page, pattern.plan)};
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

double Tally::Mean() const { return error_um.empty() ? 0 : trammel::Mean(error_um); }

double Tally::Quantile(double share) const {
  std::vector<double> size;
  for (const double e : error_um) size.push_back(std::abs(e));
  return size.empty() ? 0 : trammel::Quantile(size, share);
}

double Tally::Coverage() const {
  return covered / std::max(1.0, static_cast<double>(error_um.size()));
}

double Tally::MeanHalfWidth_um() const {
  return half_width_um.empty() ? 0 : trammel::Mean(half_width_um);
}

}  // namespace trammel
