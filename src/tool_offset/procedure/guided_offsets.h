// Guides through printing, scanning and setting offsets; waits for new files in a folder.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "base/result.h"
#include "session/operator.h"
#include "session/session.h"
#include "settings/scan_settings.h"
#include "tool_offset/files/offset_files.h"
#include "tool_offset/procedure/set_offsets.h"

namespace trammel::procedure {

/// Names of the questions after a result.
inline constexpr const char* kApplyQuestion = "apply";
inline constexpr const char* kKeepQuestion = "keep";

struct ScanWait {
  std::filesystem::path folder;  ///< is watched
  std::int64_t since_s = 0;      ///< what lay there before the sheet was printed does not count
  /// Reads a file; true if it yields a result. An error is the reason why the file is unusable (a
  /// file of another sheet, no picture); kInterrupted ends the wait.
  std::function<Result<bool>(const std::filesystem::path&)> read;
  std::function<void(const std::string&)> say;
};

/// Waits for a scan of the sheet in the folder until one yields a result. Reports why another file
/// does not, once as long as the file is unchanged. Errors: kInterrupted.
[[nodiscard]] Result<void> WaitForScan(Operator& person, const ScanWait& wait);

/// True if a file is older, and thus of an earlier print of the same sheet with the same number.
/// False for an inaccessible file.
[[nodiscard]] bool IsOlder(const std::filesystem::path& path, std::int64_t since_s);

/// Returns the corrections of the offsets under which the sheet was printed. Skips tools whose
/// offset was unknown.
[[nodiscard]] std::vector<OffsetCorrection> CorrectionsOf(const files::StartRecord& record,
                                                          const files::OffsetFile& measured);

struct OffsetSettling {
  const settings::ScanSettings* settings = nullptr;  ///< REQUIRED; not owned
  std::filesystem::path state_folder;                ///< REQUIRED
  files::StartRecord record;
  std::vector<OffsetCorrection> corrections;
  SetOffsetsOptions setting;
};

// @returns whether it was done: not where the answer is no, nor where there is nobody to ask and no
// answer was given beforehand.

/// Asks whether to set the offsets until the next restart, and sets them. Errors: kSafety if a tool
/// has another offset now than when the sheet was printed; those of TakeTurn and SetOffsets.
[[nodiscard]] Result<bool> SetWhereWanted(const Session& session, const OffsetSettling& settling,
                                          Operator& person);
/// Asks whether to store the set offsets permanently, and stores them. Errors: those of TakeTurn,
/// KeepOffsets.
[[nodiscard]] Result<bool> KeepWhereWanted(const Session& session, const OffsetSettling& settling,
                                           Operator& person);

/// True if the printer still reports the run's file as completely printed: for a run that died
/// while it printed. Errors (kMachine): the printer's.
[[nodiscard]] Result<bool> WasPrinted(const Session& session, const std::string& run);

/// Finds new files in a folder, not in its subfolders. A file counts once it is unchanged between
/// two checks, and again after each change. Hidden files, and those that browsers and file managers
/// rename at the end, do not count.
class ScanFolder {
 public:
  /// @param since_s  seconds since 1970: files that were there already and are older do not count
  ScanFolder(std::filesystem::path folder, std::int64_t since_s);

  struct Look {
    std::vector<std::filesystem::path> ready;    ///< since the last look, the oldest first
    std::vector<std::filesystem::path> growing;  ///< still being written, told once
  };
  /// Checks at most kMaxFiles. An unreadable folder has none.
  [[nodiscard]] Look Next();

  static constexpr std::size_t kMaxFiles = 2000;

 private:
  /// Properties that show a file's change.
  struct Mark {
    std::uintmax_t bytes = 0;
    std::int64_t modified_ns = 0;
    bool operator==(const Mark&) const = default;
  };
  struct Known {
    Mark mark;
    bool told = false;     ///< true if reported or left out
    bool growing = false;  ///< told as such
  };

  std::filesystem::path folder_;
  std::int64_t since_s_ = 0;
  bool first_ = true;
  std::map<std::filesystem::path, Known> known_;
};

}  // namespace trammel::procedure
