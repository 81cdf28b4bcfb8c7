// Virtual photos of other tools' patterns: lines and chevrons of drawn printers, filaments, plates
// and phones, named by their G-code. The renderer shares no model with the reader.
// TRAMMEL_STUDY_KEEP: folder in which photos and G-code are kept.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <numbers>
#include <string>
#include <utility>

#include "base/random.h"
#include "files/new_file.h"
#include "pressure_advance/commands/photo_analysis.h"
#include "pressure_advance/commands/photo_batch.h"
#include "pressure_advance/files/slicer_gcode.h"
#include "sim/photo/photo.h"
#include "sim/slicer_patterns/drawn_pattern_photo.h"
#include "support/study.h"
#include "support/temporary_folder.h"

namespace trammel::test {
namespace {

namespace fs = std::filesystem;

constexpr double kMs = 1000;

// Returns the answer of one drawn world, with the truth of the storage law that counts there.
StudyAnswer AnswerOf(const std::string& row, sim::PatternKind kind, std::uint64_t seed,
                     const sim::PatternPhotoOptions& options) {
  const auto world = sim::DrawPatternPhoto(kind, seed, options);
  EXPECT_TRUE(world.has_value()) << seed;
  const auto print = files::FindSlicerPatterns(world->gcode, "pattern.gcode");
  EXPECT_TRUE(print.has_value()) << seed << ": " << print.error().message;
  const TemporaryFolder folder;
  const char* keep = std::getenv("TRAMMEL_STUDY_KEEP");
  const fs::path kept = keep != nullptr ? fs::path(keep) : folder.path();
  const double truth = world->truth.corner_s.value_or(world->truth.pressure_advance_s);
  const std::string name = fmt::format("{}-{}-{:.4f}", row, seed, truth);
  const fs::path file = kept / (name + ".jpg");
  EXPECT_TRUE(sim::WriteJpegFile(world->photo, world->phone.jpeg_quality, file).has_value());
  EXPECT_TRUE(
      files::WriteWholeFile(kept / (name + ".gcode"), world->gcode, files::IfThere::kReplace)
          .has_value());
  StudyAnswer answer;
  answer.truth = {truth, truth};
  const auto run =
      app::AnalysePhoto(file, app::PhotoPlanOf(print->patterns.front(), print->printed_by));
  EXPECT_TRUE(run.has_value()) << seed;
  answer.measured = run->analysis.pressure_advance;
  return answer;
}

// Change of a drawn pattern, which is a row of its own.
using Change = std::function<void(sim::PatternOptions&)>;

void Study(const std::string& name, sim::PatternKind kind, const Change& change = {},
           const sim::PhotoDistortion& distortion = {}) {
  if (!RowIsWanted(name)) return;
  const StudySeeds seeds = SeedsOfStudy(20, 1000);
  sim::PatternPhotoOptions options;
  options.distortion = distortion;
  options.width_px =
      kind == sim::PatternKind::kOrcaLine || kind == sim::PatternKind::kMarlinLines ? 4032 : 2800;
  options.height_px = options.width_px * 3 / 4;
  const auto answers = RunSeeds(seeds, [&](std::uint64_t seed) {
    sim::PatternPhotoOptions own = options;
    if (change) {
      Random random(seed);
      own.pattern = sim::DrawPatternOptions(kind, random);
      change(*own.pattern);
    }
    return AnswerOf(name, kind, seed, own);
  });
  TallyOf(answers).Print(name, kMs);
  for (std::size_t i = 0; i < answers.size(); ++i) {
    const Measured& measured = answers[i].measured;
    const double truth = answers[i].truth.lo;
    if (measured.good()) {
      const Quantity& q = measured.quantity();
      fmt::print("  {} truth {:.4f} answer {:.4f} ({:.4f} to {:.4f}){}\n", seeds.first + i, truth,
                 q.value, q.interval95.lo, q.interval95.hi,
                 truth < q.interval95.lo || truth > q.interval95.hi ? " MISSED" : "");
    } else {
      fmt::print("  {} truth {:.4f} {}\n", seeds.first + i, truth, measured.reason());
    }
  }
}

TEST(PatternPhotoStudy, Photos) {
  using sim::PatternKind;
  using sim::PatternOptions;
  PrintStudyHead("ms");
  Study("orca-line", PatternKind::kOrcaLine);
  Study("marlin-lines", PatternKind::kMarlinLines);
  Study("orca-pattern", PatternKind::kOrcaPattern);
  Study("ellis", PatternKind::kEllis);
  Study("orca one bar", PatternKind::kOrcaLine, [](PatternOptions& o) { o.bars = 1; });
  Study("orca no bar", PatternKind::kOrcaLine, [](PatternOptions& o) { o.bars = 0; });
  Study("marlin no frame", PatternKind::kMarlinLines, [](PatternOptions& o) { o.frame = false; });
  Study("marlin to and fro", PatternKind::kMarlinLines,
        [](PatternOptions& o) { o.alternate = true; });
  sim::PhotoDistortion turned;
  turned.most_roll_rad = std::numbers::pi;
  turned.mirror_odds = 0.3;
  turned.crop_odds = 0.3;
  turned.shadow_odds = 0.5;
  Study("orca turned", PatternKind::kOrcaLine, {}, turned);
  Study("marlin turned", PatternKind::kMarlinLines, {}, turned);
}

// Ranges that people print, of every tool, direct drives and Bowden tubes.
constexpr std::array<std::array<double, 3>, 8> kRanges = {{{0, 0.08, 0.005},
                                                           {0, 0.1, 0.005},
                                                           {0.02, 0.06, 0.004},
                                                           {0.01, 0.05, 0.0025},
                                                           {0, 0.06, 0.002},
                                                           {0, 1, 0.05},
                                                           {0.3, 0.8, 0.05},
                                                           {0, 1.5, 0.05}}};

enum class NumbersRead { kRight, kNot, kWrong };

// Reads the printed numbers of one drawn world.
NumbersRead ReadNumbers(sim::PatternKind kind, std::uint64_t seed) {
  Random random(seed);
  sim::PatternOptions pattern = sim::DrawPatternOptions(kind, random);
  const auto& [start, end, step] = kRanges[random.Below(kRanges.size())];
  pattern.start_s = start;
  pattern.end_s = end;
  pattern.step_s = step;
  pattern.numbers = true;
  pattern.rotation_deg = 0;
  pattern.bed_x_mm = pattern.bed_y_mm = 300;
  sim::PatternPhotoOptions options;
  options.width_px = 2400;
  options.height_px = 1800;
  options.pattern = pattern;
  // The tools print the numbers at the first value: far below the answer they lack their strokes.
  const double reach = std::min(1.0, 0.02 / (end - start));
  options.least_share = 0.3 * reach;
  options.most_share = reach;
  options.least_exponent = 0.9;
  const auto world = sim::DrawPatternPhoto(kind, seed, options);
  EXPECT_TRUE(world.has_value()) << seed;
  const TemporaryFolder folder;
  const auto file = folder.path() / "photo.jpg";
  EXPECT_TRUE(sim::WriteJpegFile(world->photo, world->phone.jpeg_quality, file).has_value());
  app::PhotoPlan plan;
  plan.segments = {{0.25, 20}, {0.5, 100}, {0.25, 20}};
  plan.form = kind == sim::PatternKind::kOrcaLine || kind == sim::PatternKind::kMarlinLines
                  ? app::PatternForm::kLines
                  : app::PatternForm::kCorners;
  const auto run = app::AnalysePhoto(file, plan);
  EXPECT_TRUE(run.has_value()) << seed;
  const std::vector<double>& read = run->printed_s;
  // Lines with more gap than filament at one end are not counted; the others keep their values.
  const auto same = [](double a, double b) { return std::abs(a - b) < 1e-6; };
  const bool right = !std::ranges::search(world->values, read, same).empty();
  if (!right) {
    fmt::print("  {} {:g}:{:g}:{:g} {}\n", seed, start, end, step,
               read.empty() ? run->analysis.pressure_advance.reason()
                            : fmt::format("read as {:g} to {:g}, {} values MISREAD", read.front(),
                                          read.back(), read.size()));
  }
  return read.empty() ? NumbersRead::kNot : right ? NumbersRead::kRight : NumbersRead::kWrong;
}

// A number that is read must be right: which values were printed is asked for otherwise.
TEST(PatternPhotoStudy, PrintedNumbers) {
  const StudySeeds seeds = SeedsOfStudy(6, 2000);
  for (const auto& [name, kind] :
       {std::pair{"numbers of orca-line", sim::PatternKind::kOrcaLine},
        std::pair{"numbers of marlin-lines", sim::PatternKind::kMarlinLines},
        std::pair{"numbers of orca-pattern", sim::PatternKind::kOrcaPattern},
        std::pair{"numbers of ellis", sim::PatternKind::kEllis}}) {
    if (!RowIsWanted(name)) continue;
    int read = 0, not_read = 0, wrong = 0;
    for (int i = 0; i < seeds.count; ++i) {
      const NumbersRead one = ReadNumbers(kind, seeds.first + static_cast<std::uint64_t>(i));
      read += one == NumbersRead::kRight;
      not_read += one == NumbersRead::kNot;
      wrong += one == NumbersRead::kWrong;
    }
    fmt::print("{}: {} read, {} not, {} wrong\n", name, read, not_read, wrong);
    EXPECT_EQ(wrong, 0) << name;
  }
}

}  // namespace
}  // namespace trammel::test
