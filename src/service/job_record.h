// Records of the server's jobs, its state on disk, pictures of results.
#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"
#include "machine/moonraker/printer.h"
#include "service/job_kind.h"

namespace trammel::service {

// One run of a job: its state during the run and afterwards.

enum class RunEnd {
  kNone,     ///< it goes on
  kDone,     ///< with a result of any verdict, or with nothing to measure
  kFailed,   ///< the message says why
  kStopped,  ///< on request
  kUnknown,  ///< the service ended first; the printer's state is the next run's to look at
};

[[nodiscard]] std::string_view ToString(RunEnd end);

/// Job that sets a pending answer.
inline constexpr const char* kApply = "apply";
/// Job that sets back what was set last.
inline constexpr const char* kUndo = "undo";

struct RunRecord {
  std::string id;   ///< names the run and its folder: letters, digits, _ and -, 1 … 64 of them
  std::string job;  ///< the kind's name, "apply" or "undo"
  Arguments arguments = {};
  bool looks = false;        ///< its command records by a camera
  std::string folder = {};   ///< of the recording or the applied result
  std::string started = {};  ///< UTC, ISO 8601
  std::string ended = {};    ///< likewise; empty: it goes on
  std::string phase = "starting";
  std::string message = {};                ///< the last that it said, or its end in words
  std::optional<double> progress = {};     ///< progress of the phase, 0 … 1
  std::optional<double> remaining_s = {};  ///< for the current step
  RunEnd end = RunEnd::kNone;
  std::string verdict = {};  ///< result's verdict as in JSON; empty: none

  [[nodiscard]] bool complete() const { return end != RunEnd::kNone; }
};

/// Returns the form in `status` and the run's events.
[[nodiscard]] nlohmann::json JsonOf(const RunRecord& run);

/// "20260102T030405Z" of "2026-01-02T03:04:05Z": for names of files.
[[nodiscard]] std::string CompactUtc(std::string utc);

[[nodiscard]] bool IsRunId(std::string_view text);

/// Returns the folder of a run. Errors (kInput): no run's name, or no folder (a link is none).
[[nodiscard]] Result<std::filesystem::path> FolderOfRun(const std::filesystem::path& recordings,
                                                        const std::string& run);

/// Answer that is not yet accepted or dismissed.
struct Proposal {
  std::string run;
  std::string job;
  std::string folder;
  Arguments arguments = {};
};

// State of a printer on a service's disk: its last run, and the answer pending a decision.

struct KeptState {
  std::optional<RunRecord> run = {};
  std::optional<Proposal> proposal = {};
};

/// Returns the path of a printer's state (docs/reference/formats.md). @param address  plain, as in
/// the names of locks
[[nodiscard]] std::filesystem::path KeptStatePath(const std::filesystem::path& state_folder,
                                                  std::string_view address);

/// Replaces the whole file. Errors: kInput.
[[nodiscard]] Result<void> WriteKeptState(const std::filesystem::path& path,
                                          const KeptState& state);

/// Reads the state; empty if there is no such file. A run that had not ended becomes kUnknown.
/// Errors: kInput if it cannot be read or contains data that no service writes.
[[nodiscard]] Result<KeptState> ReadKeptState(const std::filesystem::path& path);

/// Parses the same from text; `file` names it in errors.
[[nodiscard]] Result<KeptState> ParseKeptState(std::string_view text, const std::string& file);

// Pictures of results, for display in front ends.

/// Folder beside printer.cfg, as listed by front ends.
inline constexpr std::string_view kPictureFolder = "trammel";
/// Figure of the answer, in the folder of a run.
inline constexpr const char* kAnswerPicture = "answer.png";
/// Folder of all figures, in the folder of a run: a picture beside result.json would count as a
/// photo.
inline constexpr const char* kFiguresFolder = "figures";
inline constexpr std::size_t kMaxPictures = 20;
inline constexpr std::size_t kMaxPictureBytes = std::size_t{4} << 20;

/// Stores a run's picture, and removes the oldest of more than kMaxPictures: only files with such
/// a name (run and ".png"). If they cannot be listed or removed, the picture still remains.
/// @param run  its id. @param png  at most kMaxPictureBytes.
/// Errors: kMachine: not stored; kInput: too large.
[[nodiscard]] Result<void> StorePicture(machine::Printer& printer, const std::string& run,
                                        std::string_view png, const machine::WaitLimit& limit);

/// True if a name can be that of a run's picture.
[[nodiscard]] bool IsResultPicture(const std::string& name);

}  // namespace trammel::service
