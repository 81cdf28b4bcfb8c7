#include "app/study/study_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/number_range.h"
#include "app/option_values.h"
#include "app/study/study_figures.h"
#include "app/study/study_summary.h"
#include "app/study/study_world.h"
#include "base/parallel.h"
#include "files/new_file.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;

struct StudyArguments {
  int seed = 1000;
  int patterns = kPaperPatterns;
  std::vector<std::string> conditions;
  std::string shard = "1/1";
  std::string out = "study";
  bool report = false;
};

struct Shard {
  int index = 1;  // 1 … count
  int count = 1;
};

Result<Shard> ParseShard(const std::string& text) {
  constexpr int kMostShards = 1000;
  const std::vector<std::string_view> parts = Split(text, '/', 2);
  if (parts.size() == 2) {
    const auto index = ParseNumber<int>(parts[0]);
    const auto count = ParseNumber<int>(parts[1]);
    if (index && count && *index >= 1 && *index <= *count && *count <= kMostShards) {
      return Shard{*index, *count};
    }
  }
  return Fail(fmt::format("--shard {}: must be PART/PARTS, for example 2/8, with at most {} parts",
                          text.substr(0, 40), kMostShards));
}

Result<StudyOptions> OptionsOf(const StudyArguments& arguments) {
  StudyOptions options{arguments.seed, arguments.patterns, {}, arguments.out};
  for (const sim::Condition& condition : sim::AllConditions()) {
    const auto& asked = arguments.conditions;
    if (asked.empty() ||
        std::find(asked.begin(), asked.end(), sim::ToString(condition)) != asked.end()) {
      options.conditions.push_back(condition);
    }
  }
  for (const std::string& name : arguments.conditions) {
    const auto condition = sim::ParseCondition(name);
    if (!condition) return Fail("--condition: " + condition.error().message);
  }
  std::error_code error;
  fs::create_directories(options.folder, error);
  if (error) {
    return Fail(
        fmt::format("--out {}: the folder cannot be made: {}", arguments.out, error.message()));
  }
  return options;
}

// Runs this shard's prints on all processors; the first error is the answer.
Result<void> RunShard(const StudyOptions& options, const Shard& shard) {
  std::vector<StudyPrint> mine;
  const std::vector<StudyPrint> all = StudyPrints(options);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (static_cast<int>(i % static_cast<std::size_t>(shard.count)) == shard.index - 1) {
      mine.push_back(all[i]);
    }
  }
  std::mutex mutex;
  std::size_t done = 0;
  std::optional<Error> failed;
  ParallelFor(static_cast<int>(mine.size()), [&](int i) {
    {
      const std::lock_guard lock(mutex);
      if (failed) return;
    }
    const Result<void> run = RunStudyPrint(options, mine[static_cast<std::size_t>(i)]);
    const std::lock_guard lock(mutex);
    if (!run && !failed) failed = run.error();
    ++done;
    if (!failed && (done % 10 == 0 || done == mine.size())) {
      fmt::print(stderr, "{} of {} prints\n", done, mine.size());
    }
  });
  std::error_code ignored;
  fs::remove(options.folder / "work", ignored);  // only where no other shard has anything in it
  if (failed) return tl::unexpected(*failed);
  return {};
}

struct Collected {
  std::vector<StudySummary> summaries;
  std::size_t there = 0;
  std::size_t wanted = 0;
};

Result<Collected> Collect(const StudyOptions& options) {
  Collected collected;
  for (const sim::Condition& condition : options.conditions) {
    std::vector<StudyScan> scans;
    for (int pattern = 0; pattern < options.patterns; ++pattern) {
      auto scan = ReadStudyScan(options.folder, options.seed, condition, pattern);
      if (!scan) return tl::unexpected(scan.error());
      if (*scan) scans.push_back(**std::move(scan));
    }
    const auto validation = ReadStudyValidation(options.folder, options.seed, condition);
    if (!validation) return tl::unexpected(validation.error());
    collected.there += scans.size();
    collected.wanted += static_cast<std::size_t>(options.patterns);
    collected.summaries.push_back(Summarize(condition, std::move(scans), *validation));
  }
  return collected;
}

Result<void> WriteFigures(const StudyOptions& options, const std::vector<StudySummary>& summaries) {
  const std::vector<report::Figure> figures = StudyFigures(summaries);
  const auto write = [&](const std::string& name, const std::string& bytes) {
    return files::WriteWholeFile(options.folder / name, bytes, files::IfThere::kReplace);
  };
  for (const report::Figure& figure : figures) {
    auto png = write(figure.name + ".png", figure.canvas.ToPng(figure.png_scale));
    if (!png) return png;
    if (auto svg = write(figure.name + ".svg", figure.canvas.ToSvg()); !svg) return svg;
  }
  return write("study.html", StudyPage(summaries, figures, options.seed));
}

Result<void> Study(const StudyArguments& arguments) {
  const Result<Shard> shard = ParseShard(arguments.shard);
  if (!shard) return tl::unexpected(shard.error());
  const Result<StudyOptions> options = OptionsOf(arguments);
  if (!options) return tl::unexpected(options.error());
  if (!arguments.report) {
    if (auto run = RunShard(*options, *shard); !run) return run;
  }
  const Result<Collected> collected = Collect(*options);
  if (!collected) return tl::unexpected(collected.error());
  const auto& [summaries, there, wanted] = *collected;
  fmt::print("seed {}: {} of {} scans in {}\n", options->seed, there, wanted,
             options->folder.string());
  if (there < wanted && !arguments.report) {
    fmt::print("the other shards are to come; --report shows what is there\n");
    return {};
  }
  if (auto written = WriteFigures(*options, summaries); !written) return written;
  fmt::print("{}", SummaryText(summaries));
  return {};
}

}  // namespace

void AddPressureAdvanceStudy(CLI::App& pa, int& exit_code) {
  const auto arguments = std::make_shared<StudyArguments>();
  CLI::App* study = pa.add_subcommand(
      "study", "run the paper's study on virtual plates: 27 patterns in each of 12 conditions");
  study->add_option("--seed", arguments->seed, "names the whole study")
      ->check(NumberIn(0, 1e9))
      ->capture_default_str();
  study->add_option("--patterns", arguments->patterns, "prints for each plate and filament")
      ->check(NumberIn(1, 999))
      ->capture_default_str();
  study->add_option("--condition", arguments->conditions,
                    "only this PLATE-FILAMENT-LIGHT, for example matte-black-dark; repeatable");
  study
      ->add_option("--shard", arguments->shard,
                   "do only this part of the prints, for example 2/8, into the same --out")
      ->capture_default_str();
  study
      ->add_option("-o,--out", arguments->out,
                   "folder for one result a scan, figures and study.html; what is there already "
                   "is not done again")
      ->capture_default_str();
  study->add_flag("--report", arguments->report, "run nothing: show what is there");
  study->footer("Example: trammel pa study --patterns 3 --condition matte-black-dark --out study");
  study->callback([arguments, &exit_code] {
    const Result<void> done = Study(*arguments);
    exit_code = done ? kExitGood : PrintError(done.error());
  });
}

}  // namespace trammel::app
