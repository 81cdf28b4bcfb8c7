// Spoolman, the store of filaments and spools, through the proxy of a printer's server.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "base/result.h"
#include "machine/moonraker/printer.h"
#include "machine/net/host_clock.h"
#include "machine/net/wait.h"

namespace trammel::machine {

/// The spool that is on the printer.
struct Spool {
  int id = 0;
  int filament_id = 0;
  std::string filament;  ///< "VENDOR NAME", what is there of both; at most 100 bytes, printable
  std::string material;  ///< "PLA", or empty
  bool archived = false;
};

/// What extra fields hang on.
enum class SpoolmanEntity { kFilament, kSpool };

/// A field that a user of Spoolman, or a program, has defined.
struct ExtraField {
  std::string key;   ///< [a-z0-9_]{1,64}
  std::string name;  ///< as Spoolman's pages show it
  std::string type;  ///< "float" or "text"
  std::string unit;  ///< may be empty
};

/// A value as Spoolman's texts hold it: JSON on one line, bytes that are no UTF-8 replaced.
[[nodiscard]] inline std::string FieldText(const nlohmann::json& value) {
  return value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

/// Calls wait, all of one object together within its limit, and 3 s more where it is to be found
/// out who hangs. Errors are kMachine: no answer, Spoolman away, an entity that is not there, an
/// answer of another form; or kInterrupted.
class Spoolman {
 public:
  /// The printer is not owned and outlives it.
  Spoolman(Printer& printer, const WaitLimit& limit)
      : printer_(printer), limit_(limit), deadline_s_(HostNow() + limit.time_limit_s) {}

  /// Whether the printer's server knows of a Spoolman at all; it may be away.
  [[nodiscard]] Result<bool> Known();

  /// The active spool; absent where none is set, or Spoolman is not known.
  [[nodiscard]] Result<std::optional<Spool>> ActiveSpool();

  /// Looks for a field. Errors also where it is there with another type, which Spoolman cannot
  /// change.
  [[nodiscard]] Result<bool> HasField(SpoolmanEntity entity, const ExtraField& field);
  /// Adds a field. REQUIRES that it is not there: Spoolman would redefine it.
  [[nodiscard]] Result<void> AddField(SpoolmanEntity entity, const ExtraField& field);

  /// What a field holds; absent where it holds nothing.
  [[nodiscard]] Result<std::optional<nlohmann::json>> Extra(SpoolmanEntity entity, int id,
                                                            const std::string& key);
  /// Sets one field, and reads it back. A Spoolman from 0.26 on leaves the others alone; before, it
  /// replaced all of them at once: they are read, sent again, and looked at afterwards. Errors also
  /// where this one reads otherwise then, one of the others is gone or, before 0.26, changed; they
  /// name whether it was written: `written` is then false (nothing was sent, or it was refused),
  /// true, or absent: nobody knows.
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
  bool was_refused_ = false;  ///< what was asked last: an answer came, and it was an error
};

}  // namespace trammel::machine
