// Guides through printing, scanning and setting; waits for new files in a folder.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "base/result.h"
#include "session/person.h"
#include "session/session.h"
#include "settings/scan_settings.h"
#include "tool_offset/files/offset_files.h"
#include "tool_offset/procedure/set_offsets.h"

namespace trammel::procedure {

/// The questions behind an answer, by their names.
inline constexpr const char* kApplyQuestion = "apply";
inline constexpr const char* kKeepQuestion = "keep";

struct ScanWait {
  std::filesystem::path folder;  ///< is watched
  std::int64_t since_s = 0;      ///< what lay there before the sheet was printed does not count
  /// Reads a file: whether it answers. An error says why it is none that can be read (a file of
  /// another sheet, no picture); kInterrupted ends the wait.
  std::function<Result<bool>(const std::filesystem::path&)> read;
  std::function<void(const std::string&)> say;
};

/// Waits for a scan of the sheet in the folder until one answers. Reports why another file does
/// not, once as long as it stays as it is. Errors: kInterrupted.
[[nodiscard]] Result<void> WaitForScan(Person& person, const ScanWait& wait);

/// Whether a file was written before: of an earlier print of the same sheet, whose number is the
/// same. A file that cannot be looked at was not.
[[nodiscard]] bool IsOlder(const std::filesystem::path& path, std::int64_t since_s);

/// The corrections of the offsets under which the sheet was printed. Tools whose offset was not
/// told have none.
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

/// Asks whether the offsets shall be set, until the next restart, and sets them. Errors: kSafety
/// where a tool has another offset now than when the sheet was printed; those of TakeTurn and
/// SetOffsets.
[[nodiscard]] Result<bool> SetWhereWanted(const Session& session, const OffsetSettling& settling,
                                          Person& person);
/// Asks whether what was set shall be kept, and keeps it. Errors: those of TakeTurn, KeepOffsets.
[[nodiscard]] Result<bool> KeepWhereWanted(const Session& session, const OffsetSettling& settling,
                                           Person& person);

/// Whether the run's file has been printed to its end, by what the printer still tells: for a run
/// that died while it printed. Errors (kMachine): the printer's.
[[nodiscard]] Result<bool> WasPrinted(const Session& session, const std::string& run);

/// Looks at the files of a folder, not of those below it. A file counts once it has stayed as it is
/// from one look to the next, and again whenever it has changed. Hidden files, and those that
/// browsers and file managers give other names at the end, do not count.
class ScanFolder {
 public:
  /// @param since_s  seconds since 1970: files that were there already and are older do not count
  ScanFolder(std::filesystem::path folder, std::int64_t since_s);

  struct Look {
    std::vector<std::filesystem::path> ready;    ///< since the last look, the oldest first
    std::vector<std::filesystem::path> growing;  ///< still being written, told once
  };
  /// At most kMostFiles are looked at. A folder that cannot be read has none.
  [[nodiscard]] Look Next();

  static constexpr std::size_t kMostFiles = 2000;

 private:
  /// By what a file is seen to have changed.
  struct Mark {
    std::uintmax_t bytes = 0;
    std::int64_t modified_ns = 0;
    bool operator==(const Mark&) const = default;
  };
  struct Known {
    Mark mark;
    bool told = false;     ///< as ready, or left out
    bool growing = false;  ///< told as such
  };

  std::filesystem::path folder_;
  std::int64_t since_s_ = 0;
  bool first_ = true;
  std::map<std::filesystem::path, Known> known_;
};

}  // namespace trammel::procedure
