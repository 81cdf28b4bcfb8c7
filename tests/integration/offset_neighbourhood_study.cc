// What becomes of a sheet's answers around and past the ends of what it is made for: tools far off,
// and everything that printers, paper and scanners do wrong. Prints the tables that
// docs/tool-offset.md quotes.
//
// TRAMMEL_SHEETS_AROUND: sheets per row, 6 without it. TRAMMEL_SHEETS_ROWS: only rows whose name
// has it. TRAMMEL_SHEETS_SEED: the first seed. TRAMMEL_SHEETS_WHY: unless 0, what was refused and
// why. Reported figures are those of 500000 and on; development uses seeds below 1000.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>
#include <string>

#include "offset_world.h"

namespace trammel {
namespace {

constexpr std::uint64_t kReportedSeed = 500000;
/// Sheets that two rows share would tell the same twice.
constexpr std::uint64_t kSeedsPerRow = 1000;
/// No answer may be off by more, whatever it claims: an alias of the combs is 2 or 4 mm.
constexpr double kAlias_mm = 0.5;

/// All answers of one row.
struct Answers {
  Tally fine;
  Tally coarse;
  int values = 0;  ///< that a sheet without a fault would have
  int refused = 0;
  int without_sheet = 0;  ///< values of sheets that were refused as a whole
  int wrong = 0;          ///< off by more than kAlias_mm
  std::map<std::string, int> reasons;

  std::uint64_t seed = 0;  ///< of the sheet that is being added

  void Add(const SeenSheet& seen) {
    int own = 0;
    for (const sim::SheetToolTruth& tool : seen.sheet.tools) own += tool.tool != 0 ? 2 : 0;
    values += own;
    if (!seen.result) {
      without_sheet += own;
      ++reasons["sheet: " + seen.result.error().message.substr(0, 60)];
      return;
    }
    for (const tool_offset::ToolReading& tool : seen.result->tools) {
      const auto truth = sim::OffsetOf(seen.sheet, tool.tool, 0);
      if (!truth) continue;
      AddValue(tool, tool.dx_mm, truth->x_mm);
      AddValue(tool, tool.dy_mm, truth->y_mm);
    }
  }
  void AddValue(const tool_offset::ToolReading& tool, const Measured& value, double truth_mm) {
    if (!value.good()) {
      ++refused;
      ++reasons[value.reason().substr(0, 70)];
      return;
    }
    (tool.coarse ? coarse : fine).Add(value, truth_mm);
    const double error_mm = value.quantity().value - truth_mm;
    wrong += std::abs(error_mm) > kAlias_mm ? 1 : 0;
    if (std::abs(error_mm) > kAlias_mm / 5) {
      ++reasons[fmt::format("T{} {} off by {:+.3f} mm, truth {:+.3f} mm, seed {}", tool.tool,
                            tool.coarse ? "coarse" : "fine", error_mm, truth_mm, seed)];
    }
  }
  static std::string Cell(const Tally& tally) {
    if (tally.error_um.empty()) return "0 | | |";
    return fmt::format("{} | {:.1f}, {:.1f} | {:.1f} | {:.0f} %", tally.error_um.size(),
                       tally.Quantile(0.95), tally.Quantile(1), tally.MeanHalfWidth_um(),
                       100 * tally.Coverage());
  }
  void Print(const std::string& name) const {
    fmt::print("| {} | {} | {} | {} | {} | {} | {} |\n", name, values, Cell(fine), Cell(coarse),
               refused, without_sheet, wrong);
    if (FromEnvironment("TRAMMEL_SHEETS_WHY", 0) != 0) {
      for (const auto& [reason, count] : reasons) fmt::print("    {} x {}\n", count, reason);
    }
    std::fflush(stdout);
  }
};

constexpr const char* kHead =
    "\n| world | values | fine | 95 %, worst (um) | interval | covered | coarse | 95 %, worst | "
    "interval | covered | refused | without a sheet | wrong by > 0.5 mm |\n"
    "|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";

using Change = std::function<void(Random&, sim::SheetMachine&, sim::SheetPaper&)>;
using ScanChange = std::function<void(Random&, sim::ScannerTraits&)>;

struct Row {
  std::string name;
  Change machine;
  ScanChange scanner;
};

PatternFile ThreeTools() {
  tool_offset::SheetSettings settings;
  settings.tools = {0, 1, 2};
  settings.filament.material = "pla";
  return WritePattern(settings);
}

/// @param number  of the row: every row has worlds of its own.
Answers See(const PatternFile& pattern, const Row& row, std::uint64_t number) {
  const std::uint64_t first = FromEnvironment("TRAMMEL_SHEETS_SEED", kReportedSeed) +
                              (FromEnvironment("TRAMMEL_SHEETS_SEED", kReportedSeed) < kSeedsPerRow
                                   ? 0
                                   : kSeedsPerRow * number);
  const std::uint64_t sheets = FromEnvironment("TRAMMEL_SHEETS_AROUND", 6);
  Answers answers;
  for (std::uint64_t i = 0; i < sheets; ++i) {
    answers.seed = first + i;
    Random random = Random(first + i).Fork(7'000'000);
    Random scan_random = random.Fork(1);
    answers.Add(SeeSheet(
        pattern, {first + i, 0, 0},
        [&](sim::SheetMachine& machine, sim::SheetPaper& paper) {
          if (row.machine) row.machine(random, machine, paper);
        },
        [&](sim::ScannerTraits& scanner) {
          if (row.scanner) row.scanner(scan_random, scanner);
        }));
  }
  return answers;
}

enum class Wanted { kNothingWrong, kEverything };

/// Prints the row unless only others were asked for.
/// @param wanted  kEverything: that every value is answered, too.
void Judge(const PatternFile& pattern, const Row& row, std::uint64_t number,
           Wanted wanted = Wanted::kNothingWrong) {
  const char* part = std::getenv("TRAMMEL_SHEETS_ROWS");
  if (part != nullptr && row.name.find(part) == std::string::npos) return;
  const Answers answers = See(pattern, row, number);
  answers.Print(row.name);
  EXPECT_EQ(answers.wrong, 0) << row.name;
  if (wanted == Wanted::kEverything) {
    EXPECT_EQ(answers.refused + answers.without_sheet, 0) << row.name;
  }
}

sim::PlaneMm Away(Random& random, double low_mm, double high_mm) {
  const double far_mm = random.Uniform(low_mm, high_mm);
  const double other_mm = random.Uniform(-far_mm, far_mm);
  const double sign = random.Below(2) == 0 ? 1 : -1;
  return random.Below(2) == 0 ? sim::PlaneMm{sign * far_mm, other_mm}
                              : sim::PlaneMm{other_mm, sign * far_mm};
}

Row Reach(double low_mm, double high_mm) {
  return {fmt::format("T1 {} to {} mm off", low_mm, high_mm),
          [=](Random& random, sim::SheetMachine& machine, sim::SheetPaper&) {
            machine.tools[1].offset_mm = Away(random, low_mm, high_mm);
          },
          {}};
}

TEST(OffsetNeighbourhood, AToolFarOffIsAnsweredRightOrRefusedByName) {
  const PatternFile pattern = ThreeTools();
  fmt::print("{}", kHead);
  std::uint64_t number = 0;
  for (int low = 0; low < 15; ++low) {
    Judge(pattern, Reach(low, low + 1), number++,
          low < 10 ? Wanted::kEverything : Wanted::kNothingWrong);
  }
}

TEST(OffsetNeighbourhood, ToolsFarOffTogetherWithWhatElseAMachineDoes) {
  const PatternFile pattern = ThreeTools();
  fmt::print("{}", kHead);
  std::uint64_t number = 20;
  for (const Row& row : {
           Row{"T1 and T2 up to 10 mm off",
               [](Random& random, sim::SheetMachine& machine, sim::SheetPaper&) {
                 machine.tools[1].offset_mm = Away(random, 0, 10);
                 machine.tools[2].offset_mm = Away(random, 0, 10);
               },
               {}},
           Row{"T1 up to 10 mm off, play up to 0.2 mm",
               [](Random& random, sim::SheetMachine& machine, sim::SheetPaper&) {
                 machine.tools[1].offset_mm = Away(random, 0, 10);
                 machine.backlash_mm = {random.Uniform(0, 0.2), random.Uniform(0, 0.2)};
               },
               {}},
           Row{"T1 up to 10 mm off, turned anyhow on the glass",
               [](Random& random, sim::SheetMachine& machine, sim::SheetPaper&) {
                 machine.tools[1].offset_mm = Away(random, 0, 10);
               },
               [](Random& random, sim::ScannerTraits& scanner) {
                 scanner.rotation_rad = random.Uniform(0, 2 * std::numbers::pi);
                 scanner.area_width_mm = scanner.area_height_mm = 0;
                 scanner.shift_x_mm = scanner.shift_y_mm = 0;
               }},
           Row{"T1 up to 10 mm off, seen aslant by 3 %",
               [](Random& random, sim::SheetMachine& machine, sim::SheetPaper&) {
                 machine.tools[1].offset_mm = Away(random, 0, 10);
               },
               [](Random& random, sim::ScannerTraits& scanner) {
                 scanner.perspective_x = random.Uniform(-0.03, 0.03);
                 scanner.perspective_y = random.Uniform(-0.03, 0.03);
               }},
           Row{"T1 does not print",
               [](Random&, sim::SheetMachine& machine, sim::SheetPaper&) {
                 machine.tools[1].prints = false;
               },
               {}},
           Row{"T1 15 to 25 mm off",
               [](Random& random, sim::SheetMachine& machine, sim::SheetPaper&) {
                 machine.tools[1].offset_mm = Away(random, 15, 25);
               },
               {}},
       }) {
    Judge(pattern, row, number++);
  }
}

// Next to each other on the sheet, the combs of T2 and T3 can stand in for each other.
TEST(OffsetNeighbourhood, NeighboursAmongFiveToolsAreAnsweredRightOrRefusedByName) {
  tool_offset::SheetSettings settings;
  settings.tools = {0, 1, 2, 3, 4};
  settings.filament.material = "pla";
  const PatternFile pattern = WritePattern(settings);
  fmt::print("{}", kHead);
  std::uint64_t number = 80;
  for (const double most_mm : {1.0, 3.0, 10.0, 15.0}) {
    const Row row{fmt::format("five tools, T2 and T3 up to {} mm off", most_mm),
                  [=](Random& random, sim::SheetMachine& machine, sim::SheetPaper&) {
                    machine.tools[2].offset_mm = Away(random, 0, most_mm);
                    machine.tools[3].offset_mm = Away(random, 0, most_mm);
                  },
                  {}};
    Judge(pattern, row, number++, most_mm <= 1 ? Wanted::kEverything : Wanted::kNothingWrong);
  }
}

PatternFile SomeTools(int count) {
  tool_offset::SheetSettings settings;
  settings.tools.clear();
  for (int tool = 0; tool < count; ++tool) settings.tools.push_back(tool);
  settings.filament.material = "pla";
  settings.printer.bed_size_x_mm = settings.printer.bed_size_y_mm = 300;
  return WritePattern(settings);
}

// Everything printed over everything: no tool's lines may be taken for another's.
TEST(OffsetNeighbourhood, AllToolsFarOffAreAnsweredRightOrRefusedByName) {
  fmt::print("{}", kHead);
  std::uint64_t number = 100;
  for (const int tools : {2, 3, 4, 5, 6, 7, 8}) {
    const PatternFile pattern = SomeTools(tools);
    for (const double most_mm : {10.0, 12.0, 15.0, 20.0}) {
      const Row row{fmt::format("{} tools, all up to {} mm off", tools, most_mm),
                    [=](Random& random, sim::SheetMachine& machine, sim::SheetPaper&) {
                      for (int tool = 1; tool < tools; ++tool) {
                        machine.tools[static_cast<std::size_t>(tool)].offset_mm =
                            Away(random, 0, most_mm);
                      }
                    },
                    {}};
      Judge(pattern, row, number++);
    }
  }
}

TEST(OffsetNeighbourhood, DefectsOfPrintPaperAndScannerAreReadOrRefusedByName) {
  const PatternFile pattern = ThreeTools();
  std::vector<Row> rows;
  for (const double share : {0.01, 0.02, 0.04, 0.08, 0.15, 0.3}) {
    rows.push_back({fmt::format("seen aslant by {:.0f} %", 100 * share),
                    {},
                    [=](Random& random, sim::ScannerTraits& scanner) {
                      const double angle = random.Uniform(0, 2 * std::numbers::pi);
                      scanner.perspective_x = share * std::cos(angle);
                      scanner.perspective_y = share * std::sin(angle);
                    }});
  }
  for (const int hairs : {1, 3, 10, 30}) {
    rows.push_back(
        {fmt::format("{} hair(s)", hairs),
         [=](Random&, sim::SheetMachine&, sim::SheetPaper& paper) { paper.hair_count = hairs; },
         {}});
  }
  for (const double taken_up_mm : {0.02, 0.05, 0.1, 0.2, 0.4, 0.8}) {
    rows.push_back({fmt::format("a fold that takes up {} mm", taken_up_mm),
                    [=](Random& random, sim::SheetMachine&, sim::SheetPaper& paper) {
                      // Somewhere through the middle of a bed of 220 mm.
                      paper.folds.push_back(
                          {{110 + random.Uniform(-30, 30), 110 + random.Uniform(-30, 30)},
                           random.Uniform(0, std::numbers::pi),
                           taken_up_mm,
                           random.Uniform(0.2, 3),
                           random.Uniform(0, 0.4)});
                    },
                    {}});
  }
  for (const double factor : {0.5, 0.7, 1.3, 1.5, 1.7, 2.0, 2.5}) {
    rows.push_back({fmt::format("lines {} times as wide", factor),
                    [=](Random&, sim::SheetMachine& machine, sim::SheetPaper&) {
                      for (sim::SheetTool& tool : machine.tools) tool.width_factor *= factor;
                    },
                    {}});
  }
  for (const double opacity : {0.5, 0.3, 0.15, 0.08, 0.04, 0.02, 0.01}) {
    rows.push_back({fmt::format("ink of all tools that lets {:.0f} % through", 100 - 100 * opacity),
                    [=](Random&, sim::SheetMachine& machine, sim::SheetPaper&) {
                      for (sim::SheetTool& tool : machine.tools) tool.opacity = opacity;
                    },
                    {}});
    rows.push_back({fmt::format("ink of T1 that lets {:.0f} % through", 100 - 100 * opacity),
                    [=](Random&, sim::SheetMachine& machine, sim::SheetPaper&) {
                      machine.tools[1].opacity = opacity;
                    },
                    {}});
  }
  for (const double share : {0.05, 0.1, 0.2, 0.4, 0.6, 0.8}) {
    rows.push_back({fmt::format("{:.0f} % of all lines missing", 100 * share),
                    [=](Random&, sim::SheetMachine& machine, sim::SheetPaper&) {
                      for (sim::SheetTool& tool : machine.tools) tool.missing_share = share;
                    },
                    {}});
    rows.push_back({fmt::format("{:.0f} % of T1's lines missing", 100 * share),
                    [=](Random&, sim::SheetMachine& machine, sim::SheetPaper&) {
                      machine.tools[1].missing_share = share;
                    },
                    {}});
  }
  fmt::print("{}", kHead);
  std::uint64_t number = 41;
  for (const Row& row : rows) Judge(pattern, row, number++);
}

}  // namespace
}  // namespace trammel
