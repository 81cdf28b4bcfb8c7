#include "app/output_files.h"

#include <fmt/format.h>

#include <set>
#include <system_error>
#include <utility>

#include "files/new_file.h"
#include "files/whole_file.h"
#include "measurement/outcome_file.h"

namespace trammel::app {

namespace fs = std::filesystem;

Result<void> RefuseToOverwrite(const std::vector<std::filesystem::path>& paths, bool force) {
  std::set<std::filesystem::path> seen;
  for (const std::filesystem::path& path : paths) {
    std::error_code ignored;
    if (!seen.insert(std::filesystem::weakly_canonical(absolute(path), ignored)).second) {
      return Fail(fmt::format("{}: two outputs cannot be the same file", path.string()));
    }
    TRY(files::CheckTarget(path, files::ReplaceIf(force),
                           "--force overwrites it, or name another"));
  }
  return {};
}

Result<void> WriteOutputs(const std::vector<OutputFile>& outputs, bool force) {
  std::vector<std::filesystem::path> paths;
  for (const OutputFile& output : outputs) paths.push_back(output.path);
  TRY(RefuseToOverwrite(paths, force));
  for (const OutputFile& output : outputs) {
    TRY(files::WriteWholeFile(output.path, output.bytes, files::ReplaceIf(force)));
  }
  return {};
}

Result<void> CheckOutputs(const ReportFiles& outputs) {
  std::error_code ignored;
  for (const auto& [option, name] :
       {std::pair{"--report", &outputs.report}, std::pair{"--result", &outputs.result}}) {
    if (name->empty()) continue;
    const fs::path path = *name;
    const fs::path folder = path.parent_path();
    if (!folder.empty() && !fs::is_directory(folder, ignored)) {
      return Fail(fmt::format("{} {}: there is no folder {}; make it first", option, *name,
                              folder.string()));
    }
    if (fs::is_directory(path, ignored)) {
      return Fail(fmt::format("{} {}: is a folder; name a file", option, *name));
    }
    if (auto free = RefuseToOverwrite({path}, outputs.force); !free) {
      return Fail(fmt::format("{} {}", option, free.error().message));
    }
  }
  if (!outputs.report.empty() && !outputs.result.empty() &&
      fs::absolute(outputs.report).lexically_normal() ==
          fs::absolute(outputs.result).lexically_normal()) {
    return Fail(fmt::format("--report and --result both name {}", outputs.result));
  }
  if (fs::exists(outputs.result, ignored)) {
    const auto text = files::ReadNamedFile(outputs.result, files::kMaxResultBytes);
    if (!text || !files::ParseOutcome(*text, outputs.result)) {
      return Fail(fmt::format(
          "--result {}: is there and holds no result, so --force does not replace it; choose "
          "another name",
          outputs.result));
    }
  }
  // The folder of the figures is made with all above it; none of them may be something else.
  for (fs::path part = outputs.figures; !part.empty(); part = part.parent_path()) {
    if (fs::is_directory(part, ignored)) break;
    if (fs::exists(part, ignored)) {
      return Fail(fmt::format("--figures {}: {} is a file, not a folder; choose another name",
                              outputs.figures, part.string()));
    }
  }
  return {};
}

}  // namespace trammel::app
