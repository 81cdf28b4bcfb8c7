// One scanner under SANE: its options by name, and what its statuses mean to a user.
#pragma once

#include <sane/sane.h>

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace trammel::machine {

/// Starts SANE. There is no way to end it: unloading drivers hangs where one of their threads was
/// cancelled in the loader, so that a process with SANE ends without.
[[nodiscard]] Result<void> StartSane();

/// REQUIRES SANE to be started. Valid until the next call.
[[nodiscard]] Result<std::span<const SANE_Device* const>> SaneDevices();

/// What failed, why, and what to do.
[[nodiscard]] Error SaneError(std::string_view tried, SANE_Status status);

/// An open scanner. Closed at the end of its life, a scan in progress cancelled.
class SaneDevice {
 public:
  [[nodiscard]] static Result<SaneDevice> Open(const std::string& name);
  SaneDevice(SaneDevice&& other) noexcept : handle_(other.handle_) { other.handle_ = nullptr; }
  SaneDevice(const SaneDevice&) = delete;
  SaneDevice& operator=(const SaneDevice&) = delete;
  ~SaneDevice();

  [[nodiscard]] SANE_Handle handle() const { return handle_; }

  /// Absent where the scanner has no such option, or it cannot be set now.
  struct Option {
    SANE_Int index = 0;
    const SANE_Option_Descriptor* descriptor = nullptr;
  };
  [[nodiscard]] std::optional<Option> Find(std::string_view name) const;

  /// Sets a number, in the option's own unit. Errors (kInput) name the values that it may have.
  /// @returns the value that the scanner took.
  [[nodiscard]] Result<double> SetNumber(const Option& option, double value) const;
  [[nodiscard]] Result<void> SetText(const Option& option, const std::string& value) const;
  /// By whatever type the option has: numbers, texts, yes and no.
  [[nodiscard]] Result<void> SetFromText(const Option& option, const std::string& value) const;

  /// The texts that the option may have; empty where it is free.
  [[nodiscard]] static std::vector<std::string> Choices(const Option& option);
  /// The largest number that it may have, where that is limited.
  [[nodiscard]] static std::optional<double> Largest(const Option& option);

 private:
  explicit SaneDevice(SANE_Handle handle) : handle_(handle) {}
  [[nodiscard]] Result<void> Control(const Option& option, void* value) const;

  SANE_Handle handle_ = nullptr;
};

}  // namespace trammel::machine
