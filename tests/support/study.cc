#include "support/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "base/parallel.h"
#include "base/statistics.h"

namespace trammel::test {
namespace {

std::uint64_t FromEnvironment(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

}  // namespace

StudySeeds SeedsOfStudy(int count, std::uint64_t first) {
  const auto seeds = FromEnvironment("TRAMMEL_STUDY_SEEDS", static_cast<std::uint64_t>(count));
  return {std::max(1, static_cast<int>(seeds)), FromEnvironment("TRAMMEL_STUDY_FIRST_SEED", first)};
}

bool RowIsWanted(const std::string& name) {
  const char* only = std::getenv("TRAMMEL_STUDY_ROW");
  return only == nullptr || name.find(only) != std::string::npos;
}

void StudyTally::Add(const StudyAnswer& answer) {
  ++runs;
  if (!answer.measured.good()) return;
  ++answered;
  const Quantity& q = answer.measured.quantity();
  held += q.interval95.lo <= answer.truth.hi && answer.truth.lo <= q.interval95.hi;
  error.push_back(q.value - std::clamp(q.value, answer.truth.lo, answer.truth.hi));
  half_width.push_back((q.interval95.hi - q.interval95.lo) / 2);
}

void StudyTally::Add(const StudyTally& other) {
  runs += other.runs, answered += other.answered, held += other.held;
  error.insert(error.end(), other.error.begin(), other.error.end());
  half_width.insert(half_width.end(), other.half_width.begin(), other.half_width.end());
}

double StudyTally::MeanError() const { return error.empty() ? 0 : Mean(error); }

double StudyTally::RmsError() const {
  double squares = 0;
  for (const double one : error) squares += one * one;
  return error.empty() ? 0 : std::sqrt(squares / static_cast<double>(error.size()));
}

int StudyTally::Within(double most) const {
  return static_cast<int>(
      std::count_if(error.begin(), error.end(), [&](double one) { return std::abs(one) <= most; }));
}

void StudyTally::Print(const std::string& name, double scale) const {
  fmt::print("{:<34} {:>5}/{:<5} {:>6.1f} % {:>8.3f} {:>7.3f} {:>7.3f}\n", name, answered, runs,
             100.0 * held / std::max(1, answered), scale * MeanError(), scale * RmsError(),
             half_width.empty() ? 0 : scale * Mean(half_width));
  std::fflush(stdout);
}

void PrintStudyHead(const std::string& unit) {
  fmt::print("\n{:<34} {:>11} {:>8} {:>8} {:>7} {:>7}\n", "errors and half widths in " + unit,
             "answered", "held", "bias", "rms", "half");
}

std::vector<StudyAnswer> RunSeeds(const StudySeeds& seeds,
                                  const std::function<StudyAnswer(std::uint64_t)>& run) {
  std::vector<StudyAnswer> answers(static_cast<std::size_t>(seeds.count));
  ParallelFor(seeds.count, [&](int i) {
    answers[static_cast<std::size_t>(i)] = run(seeds.first + static_cast<std::uint64_t>(i));
  });
  return answers;
}

StudyTally TallyOf(const std::vector<StudyAnswer>& answers) {
  StudyTally tally;
  for (const StudyAnswer& answer : answers) tally.Add(answer);
  return tally;
}

}  // namespace trammel::test
