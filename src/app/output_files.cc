#include "app/output_files.h"

#include <fmt/format.h>

#include <system_error>

namespace trammel::app {

Result<void> RefuseToOverwrite(const std::vector<std::filesystem::path>& paths, bool force) {
  if (force) return {};
  for (const std::filesystem::path& path : paths) {
    std::error_code ignored;
    if (std::filesystem::exists(path, ignored)) {
      return Fail(fmt::format("{}: is there already; --force overwrites it, --out names another",
                              path.string()));
    }
  }
  return {};
}

}  // namespace trammel::app
