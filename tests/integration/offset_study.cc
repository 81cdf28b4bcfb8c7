// Accuracy of tool offsets on virtual sheets: coverage and bias of the intervals, and answers under
// faults of machine, paper, scanner and phone. Prints the tables that docs/howto/tool-offset.md
// quotes.
//
// TRAMMEL_STUDY_SEEDS: sheets a row. TRAMMEL_STUDY_FIRST_SEED: the first row's first seed, 500000;
// the next row begins 1000 further on. Seeds below 1000 are for development: all rows share them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include "offset_world.h"
#include "photo_world.h"
#include "support/study.h"
#include "tool_offset/offset/analyse.h"
#include "tool_offset/reading/combine.h"

namespace trammel {
namespace {

using test::SeedsOfStudy;

/// Answers further off are of another place: legs are 0.75 mm apart. A coarse interval may hold
/// two.
constexpr double kWrong_mm = 0.5;
constexpr int kReference = 0;  ///< on trammel's own sheets

std::uint64_t SeedOf(int row, int sheet) {
  constexpr int kSeedsPerRow = 1000;
  const auto first = static_cast<int>(SeedsOfStudy(1, 500000).first);
  return static_cast<std::uint64_t>(first + (first < kSeedsPerRow ? 0 : kSeedsPerRow * row) +
                                    sheet);
}

/// All answers of one row.
struct Answers {
  Tally fine;
  Tally coarse;
  Tally backlash;
  int refused = 0;  ///< values, those of refused sheets among them
  int wrong = 0;
  std::map<std::string, int> reasons;

  void Add(const auto& tools, const sim::PrintedSheet& sheet, int reference) {
    for (const auto& tool : tools) {
      const auto truth = sim::OffsetOf(sheet, tool.tool, reference);
      if (!truth) continue;
      AddValue(tool.dx_mm, truth->x_mm, tool.coarse);
      AddValue(tool.dy_mm, truth->y_mm, tool.coarse);
    }
  }
  void Add(const tool_offset::SheetResult& result, const sim::PrintedSheet& sheet, int reference) {
    Add(result.tools, sheet, reference);
    backlash.Add(result.backlash_mm.x, sheet.backlash_mm[0]);
    backlash.Add(result.backlash_mm.y, sheet.backlash_mm[1]);
  }
  void Add(const SeenSheet& seen, int reference) {
    if (seen.result) return Add(*seen.result, seen.sheet, reference);
    refused += 2 * (static_cast<int>(seen.sheet.tools.size()) - 1);
    ++reasons[seen.result.error().message.substr(0, 60)];
  }

  void Print(const std::string& name) const {
    const auto cell = [](const Tally& tally) {
      if (tally.error_um.empty()) return std::string("0 | | | | |");
      return fmt::format("{} | {:+.2f} | {:.2f} | {:.2f} | {:.2f} | {:.1f} %",
                         tally.error_um.size(), tally.Mean(), tally.Quantile(0.95),
                         tally.Quantile(1), tally.MeanHalfWidth_um(), 100 * tally.Coverage());
    };
    fmt::print("| {} | {} | {} | {} | {} | {} |\n", name, cell(fine), cell(coarse), cell(backlash),
               refused, wrong);
    for (const auto& [reason, count] : reasons) fmt::print("    {} x {}\n", count, reason);
    std::fflush(stdout);
  }

 private:
  void AddValue(const Measured& value, double truth_mm, bool of_combs) {
    if (!value.good()) {
      ++refused;
      ++reasons[value.reason().substr(0, 60)];
      return;
    }
    (of_combs ? coarse : fine).Add(value, truth_mm);
    const double error_mm = std::abs(value.quantity().value - truth_mm);
    const Interval& interval = value.quantity().interval95;
    wrong += error_mm > std::max(kWrong_mm, (interval.hi - interval.lo) / 2) ? 1 : 0;
  }
};

void PrintHead() {
  fmt::print("\n| um |");
  for (const char* what : {"offsets", "coarse", "backlash"}) {
    fmt::print(" {} | mean error | 95 % within | worst | interval, half | covered |", what);
  }
  fmt::print(" refused | wrong by > 0.5 mm |\n|");
  for (int column = 0; column < 1 + 3 * 6 + 2; ++column) fmt::print("---|");
  fmt::print("\n");
}

/// A kind of world, and how often it is looked at.
struct Row {
  std::string name;
  std::vector<PatternFile> patterns;  ///< used in turn
  int reference = kReference;
  std::function<void(Random&, sim::SheetMachine&, sim::SheetPaper&)> machine = {};
  std::function<void(int sheet, sim::ScannerTraits&)> scanner = {};
};

Answers See(const Row& row, int number, int sheets) {
  Answers answers;
  for (int i = 0; i < sheets; ++i) {
    const std::uint64_t seed = SeedOf(number, i);
    Random random = Random(seed).Fork(7'000'000);
    answers.Add(SeeSheet(
                    row.patterns[static_cast<std::size_t>(i) % row.patterns.size()], {seed, 0, 0},
                    [&](sim::SheetMachine& machine, sim::SheetPaper& paper) {
                      if (row.machine) row.machine(random, machine, paper);
                    },
                    [&](sim::ScannerTraits& scanner) {
                      if (row.scanner) row.scanner(i, scanner);
                    }),
                row.reference);
  }
  answers.Print(row.name);
  return answers;
}

/// Chance moves the coverage of 400 values by 1.1 % (1 sigma).
void ExpectCovered(const Tally& tally) {
  EXPECT_EQ(tally.missing, 0);
  const double chance = std::sqrt(0.95 * 0.05 / static_cast<double>(tally.error_um.size()));
  EXPECT_NEAR(tally.Coverage(), 0.95, 0.02 + 2 * chance);
}

/// Values of one sheet are partly correlated: allows four standard errors of the mean.
void ExpectUnbiased(const Tally& tally) {
  double squares = 0;
  for (const double um : tally.error_um) squares += um * um;
  const auto count = static_cast<double>(tally.error_um.size());
  EXPECT_LT(std::abs(tally.Mean()), 4 * std::sqrt(squares) / count);
}

void ExpectGood(const Answers& answers, double max_um) {
  constexpr double kMaxBacklash_um = 5;
  EXPECT_EQ(answers.refused + answers.wrong, 0);
  EXPECT_LE(answers.fine.Quantile(0.95), max_um);
  EXPECT_LE(answers.backlash.Quantile(0.95), kMaxBacklash_um);
  ExpectCovered(answers.fine);
  ExpectCovered(answers.backlash);
  ExpectUnbiased(answers.fine);
}

/// Removes the errors that no sheet can show: periodic ones of motors, pulleys and the scan bar.
void Steady(Random&, sim::SheetMachine& machine, sim::SheetPaper&) {
  machine.motor = machine.pulley = {};
}
void SteadyBar(int, sim::ScannerTraits& scanner) { scanner.bar.clear(); }

/// The same of an original sheet, whose combs are fine up to 0.7 mm along the print's own axes from
/// T2: offsets of up to 0.6 mm.
void SteadyOriginal(Random& random, sim::SheetMachine& machine, sim::SheetPaper& paper) {
  Steady(random, machine, paper);
  const double c = std::cos(sim::OriginalSheet{}.rotation_rad);
  const double s = std::sin(sim::OriginalSheet{}.rotation_rad);
  for (sim::SheetTool& tool : machine.tools) {
    const double u_mm = random.Uniform(-0.6, 0.6);
    const double v_mm = random.Uniform(-0.6, 0.6);
    tool.offset_mm = {c * u_mm - s * v_mm, s * u_mm + c * v_mm};
  }
  machine.tools[2].offset_mm = {};
}

/// All four turns, then the same mirrored, each with a few degrees more.
void EightWays(int sheet, sim::ScannerTraits& scanner) {
  const int way = sheet / 4 % 8;
  scanner.rotation_rad = way % 4 * std::numbers::pi / 2 + 0.01 * (sheet % 7 - 3);
  scanner.mirrored = way >= 4;
  scanner.area_width_mm = scanner.area_height_mm = 0;
  scanner.shift_x_mm = scanner.shift_y_mm = 0;
  scanner.bar.clear();
}

/// Original sheets of two to five tools against T2.
std::vector<PatternFile> Originals(bool with_control) {
  std::vector<PatternFile> patterns;
  for (int count = 2; count <= 5; ++count) {
    sim::OriginalSheet sheet;
    sheet.tools.resize(static_cast<std::size_t>(count));
    std::iota(sheet.tools.begin(), sheet.tools.end(), with_control ? 1 : 3);
    patterns.push_back(OriginalPattern(sheet));
  }
  return patterns;
}

// With 5 um of placement and 3.3 um of rough edges a leg, 2.0 um is the 95 % floor of our sheets.
// On an original one the control's own scatter is added.
TEST(OffsetStudy, IntervalsOfScansCoverOffsetsAndBacklash) {
  PrintHead();
  const int sheets = SeedsOfStudy(100).count;
  const std::vector<PatternFile> five = {SheetOfTools(5)};
  ExpectGood(See({"scan, five tools", five, 0, Steady, SteadyBar}, 0, sheets), 3);
  const Answers all =
      See({"the same, with periodic errors of drives and scan bar", five}, 1, sheets);
  EXPECT_EQ(all.refused + all.wrong, 0);
  EXPECT_GE(all.fine.Coverage(), 0.9);
  ExpectGood(See({"original sheet with its control", Originals(true), 2, SteadyOriginal, EightWays},
                 2, sheets),
             4.5);
  ExpectGood(
      See({"original sheet without a control", Originals(false), 2, SteadyOriginal, EightWays}, 3,
          sheets),
      3);
}

TEST(OffsetStudy, FourSheetsHalveTheErrors) {
  PrintHead();
  const PatternFile pattern = SheetOfTools(5);
  const int machines = SeedsOfStudy(100).count;
  Answers together;
  for (int i = 0; i < machines; ++i) {
    std::vector<std::vector<tool_offset::SheetResult>> sheets;
    sim::PrintedSheet printed;
    for (std::uint64_t sheet = 0; sheet < 4; ++sheet) {
      Random random(0);
      SeenSheet seen = SeeSheet(
          pattern, {SeedOf(4, i), sheet, 0},
          [&](auto& machine, auto& paper) { Steady(random, machine, paper); },
          [&](auto& scanner) { SteadyBar(0, scanner); });
      if (!seen.result) throw std::runtime_error(seen.result.error().message);
      sheets.push_back({std::move(*seen.result)});
      printed = std::move(seen.sheet);
    }
    together.Add(tool_offset::Combine(sheets).tools, printed, kReference);
  }
  together.Print("four sheets of a machine together");
  EXPECT_LE(together.fine.Quantile(0.95), 1.6);
  ExpectCovered(together.fine);
}

TEST(OffsetStudy, IntervalsOfPhotosCoverOffsetsAndBacklash) {
  PrintHead();
  tool_offset::SheetSettings settings;
  settings.tools = {0, 1, 2};
  settings.filament.material = "pla";
  settings.for_photo = true;
  const PatternFile pattern = WritePattern(settings);
  const int prints = SeedsOfStudy(100).count;
  Answers one;
  Answers two;
  for (int i = 0; i < prints; ++i) {
    const sim::SheetName name{SeedOf(5, i), 0, 0};
    const sim::PrintedSheet sheet = PrintPattern(pattern.gcode, name);
    sim::PhoneTraits phone = sim::DrawPhone(sheet, sim::ScanningOf(name).Fork(7));
    // Every tool's lines differ from the plan: two tools' by the stated 30 um and 0.2 px (1 sigma).
    for (double& height_mm : phone.extra_height_mm) height_mm /= std::numbers::sqrt2;
    for (double& colour_px : phone.tool_colour_px) colour_px /= std::numbers::sqrt2;
    std::vector<tool_offset::SheetResult> read;
    for (const std::uint64_t photo : {0U, 1U}) {
      if (photo == 1) phone = TakenAgain(sheet, phone, sim::ScanningOf(name).Fork(8));
      auto seen = SeePhoto(pattern, sheet, phone, name, photo);
      if (!seen) throw std::runtime_error(seen.error().message);
      read.push_back(std::move(*seen));
    }
    one.Add(read.front(), sheet, kReference);
    two.Add(tool_offset::JoinPhotos(pattern.plan, read), sheet, kReference);
  }
  one.Print("one photo");
  two.Print("two photos");
  ExpectGood(two, 5);
  EXPECT_LE(one.fine.Quantile(0.95), 7);
  // Lines more unlike than stated would be covered, too: one photo's intervals are wider than need
  // be.
  EXPECT_GE(one.fine.Coverage(), 0.93);
}

sim::PlaneMm Away(Random& random, double low_mm, double high_mm) {
  const double far_mm = random.Uniform(low_mm, high_mm);
  const double other_mm = random.Uniform(-far_mm, far_mm);
  const double sign = random.Below(2) == 0 ? 1 : -1;
  return random.Below(2) == 0 ? sim::PlaneMm{sign * far_mm, other_mm}
                              : sim::PlaneMm{other_mm, sign * far_mm};
}

/// A fault of machine and paper, of the size that its name has.
struct Fault {
  const char* name;
  std::vector<double> sizes;
  void (*set)(double size, Random&, sim::SheetMachine&, sim::SheetPaper&);
};

const std::array<Fault, 11> kFaults = {{
    {"T1 up to {} mm off",
     {1, 3, 10, 15, 25},
     [](double mm, Random& random, auto& machine, auto&) {
       machine.tools[1].offset_mm = Away(random, mm / 2, mm);
     }},
    {"all tools up to {} mm off",
     {1.5, 3, 10},
     [](double mm, Random& random, auto& machine, auto&) {
       for (std::size_t tool = 1; tool < machine.tools.size(); ++tool) {
         if (tool != 2) machine.tools[tool].offset_mm = Away(random, 0, mm);
       }
     }},
    {"backlash of {} mm",
     {0.12, 0.2},
     [](double mm, Random&, auto& machine, auto&) {
       machine.backlash_mm = {mm, mm / 2};
     }},
    {"placement noise of {} mm",
     {0.02, 0.04},
     [](double mm, Random&, auto& machine, auto&) { machine.leg_placement_mm = mm; }},
    {"lines {} times as wide",
     {0.5, 0.7, 1.5, 2},
     [](double factor, Random&, auto& machine, auto&) {
       for (sim::SheetTool& tool : machine.tools) tool.width_factor *= factor;
     }},
    {"ink of T1 that covers {}",
     {0.3, 0.1, 0.02},
     [](double part, Random&, auto& machine, auto&) { machine.tools[1].opacity = part; }},
    {"{} of T1's lines missing",
     {0.05, 0.2, 0.5},
     [](double share, Random&, auto& machine, auto&) { machine.tools[1].missing_share = share; }},
    {"{} of all lines broken",
     {0.2, 0.5},
     [](double share, Random&, auto& machine, auto&) {
       for (sim::SheetTool& tool : machine.tools) tool.broken_share = share;
     }},
    {"{} tools silent",
     {1},
     [](double, Random&, auto& machine, auto&) { machine.tools[1].prints = false; }},
    {"a fold that takes up {} mm",
     {0.05, 0.2, 0.8},
     [](double mm, Random& random, auto&, auto& paper) {
       paper.folds.push_back({{random.Uniform(-20, 20), random.Uniform(-20, 20)},
                              random.Uniform(0, std::numbers::pi),
                              mm,
                              1,
                              0.4});
     }},
    {"{} hairs",
     {3, 30},
     [](double count, Random&, auto&, auto& paper) { paper.hair_count = static_cast<int>(count); }},
}};

/// A fault of the scan, the same way.
struct ScanFault {
  const char* name;
  std::vector<double> sizes;
  void (*set)(double size, sim::ScannerTraits&);
};

const std::array<ScanFault, 4> kScanFaults = {{
    {"{} dpi", {1200, 300, 200, 100}, [](double dpi, auto& scanner) { scanner.dpi = dpi; }},
    {"seen aslant by {}",
     {0.01, 0.04, 0.15},
     [](double part, auto& scanner) {
       scanner.perspective_x = part;
       scanner.perspective_y = -part;
     }},
    {"cut off by {} mm", {20, 60}, [](double mm, auto& scanner) { scanner.crop_left_mm = mm; }},
    {"turned by {} rad",
     {0.5, 0.8},
     [](double rad, auto& scanner) {
       scanner.rotation_rad += rad;
       scanner.area_width_mm = scanner.area_height_mm = 0;
       scanner.shift_x_mm = scanner.shift_y_mm = 0;
     }},
}};

TEST(OffsetStudy, UnderFaultsAnswersAreRightOrRefused) {
  PrintHead();
  const int sheets = SeedsOfStudy(6).count;
  int number = 10;
  const std::vector<PatternFile> originals = Originals(true);
  for (const auto& [kind, patterns, reference] :
       {std::tuple{"", std::vector{SheetOfTools(3)}, 0}, {"original: ", originals, 2}}) {
    for (const Fault& fault : kFaults) {
      for (const double size : fault.sizes) {
        const Row row{kind + fmt::format(fmt::runtime(fault.name), size), patterns, reference,
                      [&](Random& random, auto& machine, auto& paper) {
                        fault.set(size, random, machine, paper);
                      }};
        EXPECT_EQ(See(row, number++, sheets).wrong, 0) << row.name;
      }
    }
    for (const ScanFault& fault : kScanFaults) {
      for (const double size : fault.sizes) {
        const Row row{kind + fmt::format(fmt::runtime(fault.name), size),
                      patterns,
                      reference,
                      {},
                      [&](int, auto& scanner) { fault.set(size, scanner); }};
        EXPECT_EQ(See(row, number++, sheets).wrong, 0) << row.name;
      }
    }
  }
  for (const int tools : {5, 8}) {
    for (const double max_mm : {10.0, 12.0}) {
      const Row row{fmt::format("{} tools, all up to {} mm off", tools, max_mm),
                    {SheetOfTools(tools)},
                    0,
                    [=](Random& random, sim::SheetMachine& machine, sim::SheetPaper&) {
                      for (int tool = 1; tool < tools; ++tool) {
                        machine.tools[static_cast<std::size_t>(tool)].offset_mm =
                            Away(random, 0, max_mm);
                      }
                    }};
      EXPECT_EQ(See(row, number++, sheets).wrong, 0) << row.name;
    }
  }
}

}  // namespace
}  // namespace trammel
