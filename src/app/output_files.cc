#include "app/output_files.h"

#include <fmt/format.h>

#include <set>
#include <string>
#include <system_error>
#include <utility>

#include "app/provenance.h"
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
  // Checks that the figures' folder and all missing parents can be created: none may be another
  // kind of file.
  for (fs::path part = outputs.figures; !part.empty(); part = part.parent_path()) {
    if (fs::is_directory(part, ignored)) break;
    if (fs::exists(part, ignored)) {
      return Fail(fmt::format("--figures {}: {} is a file, not a folder; choose another name",
                              outputs.figures, part.string()));
    }
  }
  return {};
}

namespace {

/// Returns a unique name, even if two runs begin within one second.
fs::path NewRecordingName() {
  const std::string name = RecordingName(measurement::Instrument::kPressureAdvance);
  fs::path folder = fs::path("recordings") / name;
  std::error_code ignored;
  for (int number = 2; fs::exists(folder, ignored); ++number) {
    folder.replace_filename(fmt::format("{}-{}", name, number));
  }
  return folder;
}

Result<fs::path> MakeFolder(const fs::path& asked_for) {
  const fs::path folder = asked_for.empty() ? NewRecordingName() : asked_for;
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_empty(folder, error)) {
    return Fail(
        fmt::format("--out {}: is there and not empty; recordings are never overwritten: "
                    "choose another name",
                    folder.string()));
  }
  fs::create_directories(folder, error);
  if (error) {
    return Fail(
        fmt::format("--out {}: cannot make the folder: {}", folder.string(), error.message()));
  }
  return folder;
}

}  // namespace

Result<NewFolder> NewFolder::Make(const fs::path& asked_for) {
  NewFolder folder;
  // Missing parent folders can be listed only before the folder is made.
  std::vector<fs::path> missing;
  std::error_code ignored;
  const fs::path wanted = asked_for.empty() ? fs::path("recordings") : asked_for;
  for (fs::path above = wanted; !above.empty() && !fs::exists(above, ignored);
       above = above.parent_path()) {
    missing.push_back(above);
  }
  folder.path_ = TRY(MakeFolder(asked_for));
  if (asked_for.empty()) folder.made_.push_back(folder.path_);
  folder.made_.insert(folder.made_.end(), missing.begin(), missing.end());
  return folder;
}

NewFolder::NewFolder(NewFolder&& other) noexcept
    : path_(std::move(other.path_)), made_(std::exchange(other.made_, {})) {}

NewFolder& NewFolder::operator=(NewFolder&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(made_, other.made_);
  return *this;
}

NewFolder::~NewFolder() {
  std::error_code ignored;
  for (const fs::path& folder : made_) {
    if (fs::is_empty(folder, ignored)) fs::remove(folder, ignored);
  }
}

OutputFile OutputOf(const std::filesystem::path& path, const ResultFile& result) {
  return {path, files::ToJson(result.outcome, result.details)};
}

Result<void> KeepInRecording(const std::filesystem::path& folder, const ResultFile& result) {
  return files::KeepOutcome(folder, result.outcome, result.details);
}

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
