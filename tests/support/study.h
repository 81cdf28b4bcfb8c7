// Runs the rows of a study over many seeds and counts coverage, bias and refusals.
//
// TRAMMEL_STUDY_SEEDS: seeds a row; TRAMMEL_STUDY_FIRST_SEED: the first; TRAMMEL_STUDY_ROW: only
// rows whose name contains it. Seeds below 1000 are for development (CONVENTIONS.md).
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "base/measured.h"

namespace trammel::test {

struct StudySeeds {
  int count = 0;
  std::uint64_t first = 0;
};

/// Reads the seeds of the environment.
[[nodiscard]] StudySeeds SeedsOfStudy(int count, std::uint64_t first = 1000);

/// Returns whether TRAMMEL_STUDY_ROW selects a row.
[[nodiscard]] bool RowIsWanted(const std::string& name);

/// An answer beside the truth, which is an interval where more than one value is right.
struct StudyAnswer {
  Measured measured;
  Interval truth;
  std::vector<std::string> said = {};  ///< notices, for rows that count what is named
};

struct StudyTally {
  int runs = 0, answered = 0, held = 0;
  std::vector<double> error, half_width;

  void Add(const StudyAnswer& answer);
  void Add(const StudyTally& other);
  [[nodiscard]] double MeanError() const;
  [[nodiscard]] double RmsError() const;
  /// Answers whose error is at most `most`.
  [[nodiscard]] int Within(double most) const;
  /// Prints a row; errors and half widths times `scale`.
  void Print(const std::string& name, double scale) const;
};

/// Prints the columns' names.
void PrintStudyHead(const std::string& unit);

/// Runs one seed after the other on all processors. Prints nothing.
[[nodiscard]] std::vector<StudyAnswer> RunSeeds(
    const StudySeeds& seeds, const std::function<StudyAnswer(std::uint64_t)>& run);

[[nodiscard]] StudyTally TallyOf(const std::vector<StudyAnswer>& answers);

}  // namespace trammel::test
