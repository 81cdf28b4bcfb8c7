// One run of a job: what is known of it while it goes on and afterwards.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "service/job_kind.h"

namespace trammel::service {

/// How a run ended.
enum class RunEnd {
  kNone,     ///< it goes on
  kDone,     ///< with a result, whatever its verdict, or with nothing to measure
  kFailed,   ///< the message says why
  kStopped,  ///< on request
  kUnknown,  ///< the service ended first; the printer's state is the next run's to look at
};

[[nodiscard]] std::string_view ToString(RunEnd end);

/// The job that sets an answer which waits.
inline constexpr const char* kApply = "apply";

struct RunRecord {
  std::string id;   ///< names the run and its folder: letters, digits, _ and -, 1 … 64 of them
  std::string job;  ///< the kind's name, or "apply"
  Arguments arguments = {};
  std::string folder = {};   ///< of its recording, or of the result that it applies
  std::string started = {};  ///< UTC, ISO 8601
  std::string ended = {};    ///< likewise; empty: it goes on
  std::string phase = "starting";
  std::string message = {};                ///< the last that it said, or its end in words
  std::optional<double> progress = {};     ///< of the phase, 0 … 1
  std::optional<double> remaining_s = {};  ///< of the step
  RunEnd end = RunEnd::kNone;
  std::string verdict = {};  ///< of its result, as in JSON; empty: none

  [[nodiscard]] bool complete() const { return end != RunEnd::kNone; }
};

/// As `status` and the run's events have it.
[[nodiscard]] nlohmann::json JsonOf(const RunRecord& run);

/// "20260102T030405Z" of "2026-01-02T03:04:05Z": for names of files.
[[nodiscard]] std::string CompactUtc(std::string utc);

/// Whether a text can be a run's id.
[[nodiscard]] bool IsRunId(std::string_view text);

/// An answer that nobody has decided on yet.
struct Proposal {
  std::string run;
  std::string job;
  std::string folder;
  Arguments arguments = {};
};

}  // namespace trammel::service
