#include <fmt/format.h>

#include <string>

#include "app/study/study_figures.h"
#include "base/statistics.h"
#include "document/page.h"

namespace trammel::app {
namespace {

using report::Table;

std::string Digits(const std::optional<double>& value, double scale, int decimals) {
  return value ? fmt::format("{:.{}f}", *value * scale, decimals) : std::string("–");
}

std::string Pair(const std::string& ours, double theirs, int decimals) {
  return fmt::format("{} / {:.{}f}", ours, theirs, decimals);
}

std::string DeviationTable(const std::vector<StudySummary>& summaries) {
  Table table({{"condition", true},
               {"patterns"},
               {"scatter, ms"},
               {"within a step"},
               {"R²"},
               {"minimum, ms"},
               {"curves differ by up to"},
               {"improvement, %"}});
  for (const StudySummary& summary : summaries) {
    const PaperFigures paper = PaperOf(summary.condition);
    std::optional<double> improvement;
    if (summary.validation) improvement = ImprovementOf(*summary.validation);
    const auto& chosen = summary.deviation.value_s;
    table.Row(
        {sim::ToString(summary.condition), fmt::format("{}", summary.scans.size()),
         Pair(fmt::format("{:.1f}", 1e3 * StandardDeviation(chosen)), 1e3 * paper.chosen_sd_s, 1),
         fmt::format("{} of {}", summary.deviation.within_step, chosen.size()),
         Pair(Digits(summary.aggregate.r_squared, 1, 2), paper.r_squared, 2),
         Pair(Digits(summary.aggregate.cubic_minimum_s, 1e3, 0), 1e3 * paper.minimum_s, 0),
         Digits(summary.curve_factor, 1, 1) + " ×", Digits(improvement, 100, 0)});
  }
  return table.Html();
}

std::string ResponseTable(const std::vector<StudySummary>& summaries) {
  Table table({{"condition", true},
               {"good"},
               {"mean error, ms"},
               {"scatter, ms"},
               {"within a step"},
               {"in the 95 % interval"},
               {"R² of the line"}});
  for (const StudySummary& summary : summaries) {
    const auto& errors = summary.error_s;
    const std::size_t good = errors.size();
    table.Row({sim::ToString(summary.condition),
               fmt::format("{} of {}", good, summary.scans.size()),
               good > 0 ? fmt::format("{:.2f}", 1e3 * Mean(errors)) : "–",
               fmt::format("{:.2f}", 1e3 * StandardDeviation(errors)),
               fmt::format("{} of {}", summary.response.within_step, good),
               fmt::format("{} of {}", summary.covered, good),
               summary.line ? Digits(summary.line->r_squared, 1, 2) : "–"});
  }
  return table.Html();
}

}  // namespace

std::string StudyPage(const std::vector<StudySummary>& summaries,
                      const std::vector<report::Figure>& figures, int seed) {
  std::string page =
      report::PageBegin("The study of pressure advance", "The paper's study, run virtually");
  page += report::Card(
      "deviation",
      fmt::format("<p>Seed {}. Behind each stroke the paper's number; the improvement is {:.1f} % "
                  "in the paper.</p>",
                  seed, 100 * kPaperImprovement) +
          DeviationTable(summaries));
  page += report::Card("response", ResponseTable(summaries));
  for (const report::Figure& figure : figures) page += report::Card("", report::FigureHtml(figure));
  return page + report::PageEnd();
}

}  // namespace trammel::app
