#include "app/output_files.h"

#include <fmt/format.h>

#include <set>
#include <system_error>

namespace trammel::app {

Result<void> RefuseToOverwrite(const std::vector<std::filesystem::path>& paths, bool force) {
  std::set<std::filesystem::path> seen;
  for (const std::filesystem::path& path : paths) {
    std::error_code ignored;
    if (!seen.insert(std::filesystem::weakly_canonical(absolute(path), ignored)).second) {
      return Fail(fmt::format("{}: two outputs cannot be the same file", path.string()));
    }
    if (!force && std::filesystem::exists(path, ignored)) {
      return Fail(fmt::format("{}: is there already; --force overwrites it, --out names another",
                              path.string()));
    }
  }
  return {};
}

}  // namespace trammel::app
