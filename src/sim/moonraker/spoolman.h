// Virtual Spoolman behind the virtual Moonraker: filaments, spools and their extra fields.
#pragma once

#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "sim/moonraker/rpc.h"

namespace trammel::sim {

/// Stores and rejects the same data as a real Spoolman: messages and status codes are those of a
/// Spoolman 0.26.1 behind a Moonraker v0.10.0-31. Thread-safe.
class VirtualSpoolman {
 public:
  /// @param version  "0.26.1". Of a change of some extra fields the others are left alone by a
  /// spool since 0.22 and by a filament since 0.26; before, they are removed.
  explicit VirtualSpoolman(std::string version = "0.26.1") : version_(std::move(version)) {}

  enum class Fault {
    kNone,
    kAway,     ///< Moonraker has no connection to it
    kRubbish,  ///< answers have another format
    kMeddled,  ///< another program changes the field that was written before the next look
    kCrossed,  ///< another program changes another field, `note`, just before a write
  };

  /// Adds a filament with a spool and makes it the active one.
  /// @param vendor  empty: none
  /// @returns the spool's number, and the filament's
  int AddSpool(const std::string& vendor, const std::string& name, const std::string& material);
  /// Archives a spool, which remains active.
  void Archive(int spool);
  void Activate(std::optional<int> spool);
  void SetFault(Fault fault);
  /// Defines a field and, if given, sets its value. @param entity  "filament" or "spool"
  void SetExtra(const std::string& entity, int id, const std::string& key, const std::string& type,
                const std::optional<std::string>& value);
  /// Returns the text in a field; absent if there is none.
  [[nodiscard]] std::optional<std::string> Extra(const std::string& entity, int id,
                                                 const std::string& key) const;

  /// Calls a method `server.spoolman.…` of Moonraker. @returns false if there is no such method;
  /// replies to others, unless Spoolman hangs.
  bool Call(const std::string& method, const Json& params, const Reply& reply);

 private:
  /// Answer of Spoolman to one request of its own interface.
  struct Response {
    int status = 200;
    Json body;
  };
  [[nodiscard]] Response Serve(const std::string& method, const std::string& path,
                               const Json& body);
  [[nodiscard]] Response ServeFields(const std::string& method, const std::string& entity,
                                     const std::string& key, const Json& body);
  [[nodiscard]] Response Patch(const std::string& entity, int id, const Json& body);
  [[nodiscard]] Answer Proxy(const Json& params);
  [[nodiscard]] Json Show(const std::string& entity, int id) const;

  const std::string version_;
  mutable std::mutex mutex_;
  std::map<std::string, std::map<int, Json>> entities_ = {{"filament", {}}, {"spool", {}}};
  std::map<std::string, std::map<std::string, Json>> fields_ = {{"filament", {}}, {"spool", {}}};
  std::optional<int> active_;
  Fault fault_ = Fault::kNone;
};

}  // namespace trammel::sim
