// The folder of a run, which is gone again where nothing came into it.
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"

namespace trammel::app {

class NewFolder {
 public:
  /// Makes the folder that was asked for, else recordings/pressure_advance-<UTC>.
  /// Errors: it is there and not empty; it cannot be made.
  [[nodiscard]] static Result<NewFolder> Make(const std::filesystem::path& asked_for);

  NewFolder(NewFolder&& other) noexcept;
  NewFolder& operator=(NewFolder&& other) noexcept;
  /// Removes what it made and what is still empty: a run that was refused leaves nothing behind.
  ~NewFolder();

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  NewFolder() = default;
  std::filesystem::path path_;
  std::vector<std::filesystem::path> made_;  // innermost first
};

}  // namespace trammel::app
