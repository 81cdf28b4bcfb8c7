// Spoolman, the database of filaments and spools, through the proxy of a printer's server.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "base/result.h"
#include "machine/moonraker/printer.h"
#include "machine/net/host_clock.h"
#include "machine/net/wait.h"

namespace trammel::machine {

/// Spool on the printer.
struct Spool {
  int id = 0;
  int filament_id = 0;
  std::string filament;  ///< "VENDOR NAME", what is there of both; at most 100 bytes, printable
  std::string material;  ///< "PLA", or empty
  bool archived = false;
};

/// Entity that has extra fields.
enum class SpoolmanEntity { kFilament, kSpool };

/// Custom field, defined by a user of Spoolman or a program.
struct ExtraField {
  std::string key;   ///< [a-z0-9_]{1,64}
  std::string name;  ///< as displayed by Spoolman
  std::string type;  ///< "float" or "text"
  std::string unit;  ///< may be empty
};

/// Returns a value as in Spoolman's texts: JSON on one line, bytes that are no UTF-8 replaced.
[[nodiscard]] inline std::string FieldText(const nlohmann::json& value) {
  return value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

/// Calls block; all calls of one object share its limit, plus 3 s to find the cause of a hang.
/// Errors are kMachine: no answer, Spoolman unreachable, a missing entity, an answer of another
/// form; or kInterrupted.
class Spoolman {
 public:
  /// The printer is not owned and must outlive this object.
  Spoolman(Printer& printer, const WaitLimit& limit)
      : printer_(printer), limit_(limit), deadline_s_(HostNow() + limit.time_limit_s) {}

  /// True if the printer's server is configured for a Spoolman, which may be offline.
  [[nodiscard]] Result<bool> Known();

  /// Returns the active spool; absent if none is set, or Spoolman is not configured.
  [[nodiscard]] Result<std::optional<Spool>> ActiveSpool();

  /// True if the field exists. Errors also if it has another type, which Spoolman cannot change.
  [[nodiscard]] Result<bool> HasField(SpoolmanEntity entity, const ExtraField& field);
  /// Adds a field. REQUIRES that it does not exist: Spoolman would redefine it.
  [[nodiscard]] Result<void> AddField(SpoolmanEntity entity, const ExtraField& field);

  /// Returns the value of a field; absent if it is empty.
  [[nodiscard]] Result<std::optional<nlohmann::json>> Extra(SpoolmanEntity entity, int id,
                                                            const std::string& key);
  /// Sets one field and reads it back. Spoolman from 0.26 on does not change the other fields;
  /// before, it replaced all at once, so they are read, sent again and checked. Errors also if the
  /// field reads otherwise afterwards, another field is gone or, before 0.26, changed. `written` is
  /// then false (nothing was sent, or it was rejected), true, or absent: unknown.
  [[nodiscard]] Result<void> SetExtra(SpoolmanEntity entity, int id, const std::string& key,
                                      const nlohmann::json& value, std::optional<bool>& written);

 private:
  [[nodiscard]] Result<nlohmann::json> Ask(const char* method, const std::string& path,
                                           std::optional<nlohmann::json> body = {});
  [[nodiscard]] Error NotAnswered(const char* method, const std::string& path, Error error);
  [[nodiscard]] Result<nlohmann::json> Extras(SpoolmanEntity entity, int id);
  [[nodiscard]] Result<bool> LeavesOthersAlone();

  Printer& printer_;
  [[nodiscard]] WaitLimit Left() const;

  WaitLimit limit_;
  double deadline_s_;         ///< host clock
  bool was_refused_ = false;  ///< true if the last request was answered by an error
};

}  // namespace trammel::machine
