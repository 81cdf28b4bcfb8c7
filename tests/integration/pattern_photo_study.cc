// Virtual photos of other tools' patterns: lines and chevrons of drawn printers, filaments, plates
// and phones, named by their G-code. The renderer shares no model with the reader.
// TRAMMEL_STUDY_KEEP: folder in which photos and G-code are kept.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <numbers>
#include <string>

#include "files/new_file.h"
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

}  // namespace
}  // namespace trammel::test
