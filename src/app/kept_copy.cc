#include "app/kept_copy.h"

#include <fmt/format.h>

#include <system_error>

#include "files/whole_file.h"

namespace trammel::app {

namespace fs = std::filesystem;

Result<fs::path> FindKeptCopy(const fs::path& recordings, std::span<const std::string> names,
                              std::string_view bytes) {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(recordings, error)) {
    for (const std::string& name : names) {
      const fs::path earlier = entry.path() / name;
      std::error_code ignored;
      if (fs::file_size(earlier, ignored) != bytes.size()) continue;
      const auto kept = files::ReadWholeFile(earlier, bytes.size());
      if (kept && *kept == bytes) return entry.path();
    }
  }
  if (error) return Fail(fmt::format("{}: {}", recordings.string(), error.message()));
  return fs::path();
}

}  // namespace trammel::app
