#include "app/study/study_world.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "app/study/study_scan.h"
#include "base/random.h"
#include "files/new_file.h"
#include "pressure_advance/commands/analysis_run.h"
#include "pressure_advance/commands/validation.h"
#include "pressure_advance/files/plan_file.h"
#include "pressure_advance/laser/deviation.h"
#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_plan.h"
#include "pressure_advance/procedure/comparison.h"
#include "sim/camera/scan_recorder.h"
#include "sim/print/plan_file.h"
#include "sim/print/printer.h"
#include "sim/print/world.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using pressure_advance::PatternConfig;

// Streams of the study's seed.
enum Stream : std::uint64_t { kPrinter = 1, kPattern = 10'000, kComparison = 20'000 };

// So that the cubics' minima lie near the paper's: a cubic's minimum is no extruder's lag.
double TruthOf(sim::Filament filament) {
  return filament == sim::Filament::kBlack ? 0.0315 : 0.0335;
}

PatternConfig PaperPattern() {
  PatternConfig config;
  config.material = "abs";
  return config;
}

// What a printer and a scan need of a pattern, as files say it.
struct Job {
  std::string gcode;
  sim::Plan plan;
};

Result<Job> JobOf(const PatternConfig& config) {
  const auto layout = pressure_advance::LayOut(config);
  const auto plan = pressure_advance::MakePlan(layout, config, "pattern.gcode");
  auto read = sim::ParsePlan(files::FormatPlan(plan));
  if (!read) return tl::unexpected<Error>(read.error());
  Job job{pressure_advance::WriteGcode(layout, config), *std::move(read)};
  for (sim::PlannedLine& line : job.plan.lines) line.pattern = 0;  // all are scanned in one go
  return job;
}

std::uint64_t IndexOf(const StudyPrint& print) {
  return static_cast<std::uint64_t>(print.plate) * 2 + static_cast<std::uint64_t>(print.filament);
}

Result<sim::Print> PrintJob(const StudyOptions& options, const StudyPrint& print, const Job& job,
                            std::uint64_t stream) {
  const Random study(static_cast<std::uint64_t>(options.seed));
  Random printer = study.Fork(kPrinter + static_cast<std::uint64_t>(print.filament));
  Random random = study.Fork(stream);
  return sim::PrintGcode(job.gcode, sim::DrawTraits(TruthOf(print.filament), printer), random);
}

// A recording that goes with its analysis.
class Recording {
 public:
  explicit Recording(fs::path folder) : folder_(std::move(folder)) { Remove(); }
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;
  ~Recording() { Remove(); }
  [[nodiscard]] const fs::path& folder() const { return folder_; }

 private:
  void Remove() const {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  fs::path folder_;
};

// One rig for all scans of a condition; each scan meets other grain, speckle and noise.
Result<void> Record(const StudyOptions& options, const sim::Condition& condition, const Job& job,
                    const sim::Bed& bed, std::uint64_t stream, const fs::path& folder) {
  Random rig = sim::LaserEyeOf(static_cast<std::uint64_t>(options.seed), condition);
  const sim::LaserTraits eye = sim::DrawLaserTraits(condition, rig);
  sim::ScanOptions scan;
  scan.frame_width_px = 160;  // a window: what lies beyond is not read
  scan.frame_height_px = 120;
  return sim::RecordScan(bed, job.plan, condition, eye, scan, rig.Fork(stream), folder);
}

StudyScan ScanOf(const StudyOptions& options, const sim::Condition& condition, int pattern,
                 double truth_s, const pressure_advance::Analysis& analysis) {
  StudyScan scan{.seed = options.seed, .condition = condition, .pattern = pattern};
  scan.truth_s = truth_s;
  const auto& acceleration = analysis.response.acceleration;
  for (std::size_t i = 0; i < analysis.lines.size(); ++i) {
    scan.pressure_advances_s.push_back(analysis.lines[i].pressure_advance_s);
    const auto& scores = analysis.deviation.score_px;
    scan.score_px.push_back(i < scores.size() ? scores[i] : std::nullopt);
    const bool read = i < acceleration.excess_s.size() && i < acceleration.sigma_s.size() &&
                      acceleration.sigma_s[i] > 0;
    scan.excess_s.push_back(read ? std::optional(acceleration.excess_s[i]) : std::nullopt);
  }
  if (analysis.pressure_advance.good()) scan.response = analysis.pressure_advance.quantity();
  scan.reason = analysis.pressure_advance.reason();
  return scan;
}

Result<void> Validate(const StudyOptions& options, const StudyPrint& print,
                      const sim::Condition& condition, const StudyScan& scan) {
  const auto there = ReadStudyValidation(options.folder, options.seed, condition);
  if (!there) return tl::unexpected(there.error());
  const auto chosen =
      pressure_advance::ScoreByDeviation(scan.pressure_advances_s, scan.score_px).best_s;
  if (*there || !chosen || *chosen <= 0) return {};  // nothing to compare with no advance at all
  const auto config = procedure::ComparisonPattern(PaperPattern(), *chosen);
  if (!config) return tl::unexpected(config.error());
  const Result<Job> job = JobOf(*config);
  if (!job) return tl::unexpected(job.error());
  const std::uint64_t stream = kComparison + IndexOf(print);
  const auto printed = PrintJob(options, print, *job, stream);
  if (!printed) return tl::unexpected(printed.error());
  const Recording recording(options.folder / "work" / ValidationFileName(condition));
  auto recorded = Record(options, condition, *job, printed->bed, stream, recording.folder());
  if (!recorded) return recorded;
  const auto improvement = EvaluateComparison(recording.folder());
  if (!improvement) return tl::unexpected(improvement.error());
  const auto& control = improvement->control.deviation_px;
  const auto& calibrated = improvement->calibrated.deviation_px;
  if (!control || !calibrated) return {};
  return files::WriteWholeFile(
      options.folder / ValidationFileName(condition),
      FormatStudyValidation({options.seed, condition, *chosen, *control, *calibrated}),
      files::IfThere::kReplace);
}

// Prints once, however many lights ask for it.
class LazyPrint {
 public:
  LazyPrint(const StudyOptions& options, const StudyPrint& print)
      : options_(options), print_(print) {}

  Result<StudyScan> Scan(const sim::Condition& condition) {
    if (!printed_) {
      Result<Job> job = JobOf(PaperPattern());
      if (!job) return tl::unexpected(job.error());
      auto printed = PrintJob(options_, print_, *job, Stream());
      if (!printed) return tl::unexpected(printed.error());
      job_ = *std::move(job);
      printed_ = *std::move(printed);
    }
    const std::string name = ScanFileName(condition, print_.pattern);
    const Recording recording(options_.folder / "work" / name);
    const auto recorded =
        Record(options_, condition, job_, printed_->bed, Stream(), recording.folder());
    if (!recorded) return tl::unexpected(recorded.error());
    const auto run = AnalyseRecording(recording.folder(), pressure_advance::Method::kResponse);
    if (!run) return tl::unexpected(run.error());
    const StudyScan scan = ScanOf(options_, condition, print_.pattern,
                                  printed_->truth.pressure_advance_s, run->analysis);
    const auto written = files::WriteWholeFile(options_.folder / name, FormatStudyScan(scan),
                                               files::IfThere::kReplace);
    if (!written) return tl::unexpected(written.error());
    return scan;
  }

 private:
  [[nodiscard]] std::uint64_t Stream() const {
    return kPattern + static_cast<std::uint64_t>(print_.pattern) * 6 + IndexOf(print_);
  }

  const StudyOptions& options_;
  const StudyPrint& print_;
  Job job_;
  std::optional<sim::Print> printed_;
};

}  // namespace

std::vector<StudyPrint> StudyPrints(const StudyOptions& options) {
  std::vector<StudyPrint> prints;
  for (int pattern = 0; pattern < options.patterns; ++pattern) {
    for (const sim::Condition& condition : options.conditions) {
      const auto same = [&](const StudyPrint& print) {
        return print.plate == condition.plate && print.filament == condition.filament &&
               print.pattern == pattern;
      };
      if (std::any_of(prints.begin(), prints.end(), same)) continue;
      prints.push_back({condition.plate, condition.filament, pattern});
    }
  }
  return prints;
}

Result<void> RunStudyPrint(const StudyOptions& options, const StudyPrint& print) {
  LazyPrint printed(options, print);
  for (const sim::Condition& condition : options.conditions) {
    if (condition.plate != print.plate || condition.filament != print.filament) continue;
    auto there = ReadStudyScan(options.folder, options.seed, condition, print.pattern);
    if (!there) return tl::unexpected(there.error());
    if (!*there) {
      auto scan = printed.Scan(condition);
      if (!scan) return tl::unexpected(scan.error());
      *there = *std::move(scan);
    }
    if (print.pattern > 0) continue;
    if (auto validated = Validate(options, print, condition, **there); !validated) return validated;
  }
  return {};
}

}  // namespace trammel::app
