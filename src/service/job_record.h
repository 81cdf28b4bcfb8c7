// What the server stores of its jobs: their records, its state on disk, pictures of results.
#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"
#include "machine/moonraker/printer.h"
#include "measurement/history.h"
#include "service/job_kind.h"

namespace trammel::service {

// One run of a job: what is known of it while it goes on and afterwards.

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

// What a service keeps on disk of a printer: its last run, and the answer that waits for a
// decision.

struct KeptState {
  std::optional<RunRecord> run = {};
  std::optional<Proposal> proposal = {};
};

/// Where a printer's state lies (docs/reference/formats.md). @param address  plain, as locks are
/// named by it
[[nodiscard]] std::filesystem::path KeptStatePath(const std::filesystem::path& state_folder,
                                                  std::string_view address);

/// Replaces the file whole. Errors: kInput.
[[nodiscard]] Result<void> WriteKeptState(const std::filesystem::path& path,
                                          const KeptState& state);

/// Nothing of either where there is no such file. A run that had not ended is given back as
/// kUnknown. Errors: kInput where it cannot be read or holds what no service writes.
[[nodiscard]] Result<KeptState> ReadKeptState(const std::filesystem::path& path);

/// The same of a text; `file` names it in errors.
[[nodiscard]] Result<KeptState> ParseKeptState(std::string_view text, const std::string& file);

// Pictures of results, where front ends show them.

/// Beside printer.cfg, as front ends list it.
inline constexpr std::string_view kPictureFolder = "trammel";
/// In the folder of a run: the figure that shows its answer.
inline constexpr const char* kAnswerPicture = "answer.png";
inline constexpr std::size_t kMostPictures = 20;
inline constexpr std::size_t kMostPictureBytes = std::size_t{4} << 20;

/// Stores a run's picture, and removes the oldest of more than kMostPictures: only files with such
/// a name (run and ".png"). Where they cannot be listed or removed the picture stays, too.
/// @param run  its id. @param png  at most kMostPictureBytes.
/// Errors: kMachine: not stored; kInput: too large.
[[nodiscard]] Result<void> StorePicture(machine::Printer& printer, const std::string& run,
                                        std::string_view png, const machine::WaitLimit& limit);

/// Whether a name can be that of a run's picture.
[[nodiscard]] bool IsResultPicture(const std::string& name);

/// Reads a history with each printer under one name (procedure::PrinterName), whatever address its
/// results were measured over. Errors: those of files::ReadHistory.
[[nodiscard]] Result<files::History> ReadHistoryByPrinter(const std::filesystem::path& recordings,
                                                          files::HistoryQuery query);

}  // namespace trammel::service
