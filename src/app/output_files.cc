#include "app/output_files.h"

#include <fmt/format.h>

#include <set>
#include <system_error>

#include "files/new_file.h"

namespace trammel::app {

Result<void> RefuseToOverwrite(const std::vector<std::filesystem::path>& paths, bool force) {
  std::set<std::filesystem::path> seen;
  for (const std::filesystem::path& path : paths) {
    std::error_code ignored;
    if (!seen.insert(std::filesystem::weakly_canonical(absolute(path), ignored)).second) {
      return Fail(fmt::format("{}: two outputs cannot be the same file", path.string()));
    }
    if (auto free = files::CheckTarget(path, files::ReplaceIf(force),
                                       "--force overwrites it, or name another");
        !free)
      return free;
  }
  return {};
}

Result<void> WriteOutputs(const std::vector<OutputFile>& outputs, bool force) {
  std::vector<std::filesystem::path> paths;
  for (const OutputFile& output : outputs) paths.push_back(output.path);
  if (auto free = RefuseToOverwrite(paths, force); !free) return free;
  for (const OutputFile& output : outputs) {
    auto written = files::WriteWholeFile(output.path, output.bytes, files::ReplaceIf(force));
    if (!written) return written;
  }
  return {};
}

}  // namespace trammel::app
