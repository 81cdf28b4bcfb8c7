// Virtual photos of other tools' patterns: lines and chevrons of drawn printers, filaments, plates
// and phones, named by their G-code. The renderer shares no model with the reader.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <string>

#include "pressure_advance/commands/photo_batch.h"
#include "pressure_advance/files/slicer_gcode.h"
#include "sim/photo/photo.h"
#include "sim/slicer_patterns/drawn_pattern_photo.h"
#include "support/study.h"
#include "support/temporary_folder.h"

namespace trammel::test {
namespace {

constexpr double kMs = 1000;

// Returns the answer of one drawn world, with the truth of the storage law that counts there.
StudyAnswer AnswerOf(sim::PatternKind kind, std::uint64_t seed,
                     const sim::PatternPhotoOptions& options) {
  const auto world = sim::DrawPatternPhoto(kind, seed, options);
  EXPECT_TRUE(world.has_value()) << seed;
  const auto print = files::FindSlicerPatterns(world->gcode, "pattern.gcode");
  EXPECT_TRUE(print.has_value()) << seed << ": " << print.error().message;
  const TemporaryFolder folder;
  const auto file = folder.path() / "photo.jpg";
  EXPECT_TRUE(sim::WriteJpegFile(world->photo, world->phone.jpeg_quality, file).has_value());
  const double truth = world->truth.corner_s.value_or(world->truth.pressure_advance_s);
  StudyAnswer answer;
  answer.truth = {truth, truth};
  const auto run =
      app::AnalysePhoto(file, app::PhotoPlanOf(print->patterns.front(), print->printed_by));
  EXPECT_TRUE(run.has_value()) << seed;
  answer.measured = run->analysis.pressure_advance;
  return answer;
}

void Study(const std::string& name, sim::PatternKind kind) {
  if (!RowIsWanted(name)) return;
  const StudySeeds seeds = SeedsOfStudy(20, 1000);
  sim::PatternPhotoOptions options;
  options.width_px =
      kind == sim::PatternKind::kOrcaLine || kind == sim::PatternKind::kMarlinLines ? 4032 : 2800;
  options.height_px = options.width_px * 3 / 4;
  const auto answers =
      RunSeeds(seeds, [&](std::uint64_t seed) { return AnswerOf(kind, seed, options); });
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
  PrintStudyHead("ms");
  Study("orca-line", sim::PatternKind::kOrcaLine);
  Study("marlin-lines", sim::PatternKind::kMarlinLines);
  Study("orca-pattern", sim::PatternKind::kOrcaPattern);
  Study("ellis", sim::PatternKind::kEllis);
}

}  // namespace
}  // namespace trammel::test
