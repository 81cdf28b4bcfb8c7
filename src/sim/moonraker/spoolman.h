// A virtual Spoolman behind the virtual Moonraker: filaments, spools and their extra fields.
#pragma once

#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "sim/moonraker/rpc.h"

namespace trammel::sim {

/// Holds what a Spoolman holds, and refuses what it refuses. Thread-safe.
class VirtualSpoolman {
 public:
  enum class Fault {
    kNone,
    kAway,     ///< Moonraker has no connection to it
    kRubbish,  ///< its answers have another form
    kMeddled,  ///< another program changes a field between a write and the next look
  };

  /// Adds a filament and a spool of it, and makes that the active one.
  /// @param vendor  empty: none
  /// @returns the spool's number
  int AddSpool(const std::string& vendor, const std::string& name, const std::string& material);
  void Activate(std::optional<int> spool);
  void SetFault(Fault fault);
  /// Defines a field and, with a value, fills it in. @param entity  "filament" or "spool"
  void SetExtra(const std::string& entity, int id, const std::string& key, const std::string& type,
                const std::optional<std::string>& value);
  /// The text in a field; absent where there is none.
  [[nodiscard]] std::optional<std::string> Extra(const std::string& entity, int id,
                                                 const std::string& key) const;

  /// A method `server.spoolman.…` of Moonraker; absent where there is no such method.
  [[nodiscard]] std::optional<Answer> Call(const std::string& method, const Json& params);

 private:
  /// What Spoolman answers to one request of its own interface.
  struct Response {
    int status = 200;
    Json body;
  };
  [[nodiscard]] Response Serve(const std::string& method, const std::string& path,
                               const Json& body);
  [[nodiscard]] Response ServeFields(const std::string& method, const std::string& entity,
                                     const std::string& key, const Json& body);
  [[nodiscard]] Response Patch(const std::string& entity, int id, const Json& body);
  [[nodiscard]] Json Show(const std::string& entity, int id) const;

  mutable std::mutex mutex_;
  std::map<std::string, std::map<int, Json>> entities_ = {{"filament", {}}, {"spool", {}}};
  std::map<std::string, std::map<std::string, Json>> fields_ = {{"filament", {}}, {"spool", {}}};
  std::optional<int> active_;
  Fault fault_ = Fault::kNone;
};

}  // namespace trammel::sim
