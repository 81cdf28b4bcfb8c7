#include "app/new_folder.h"

#include <fmt/format.h>

#include <string>
#include <system_error>
#include <utility>

#include "app/provenance.h"

namespace trammel::app {

namespace fs = std::filesystem;

namespace {

/// A name that no other has, also where two runs begin within one second.
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
  // Which of the folders above it are not there yet is known only before it is made.
  std::vector<fs::path> missing;
  std::error_code ignored;
  const fs::path wanted = asked_for.empty() ? fs::path("recordings") : asked_for;
  for (fs::path above = wanted; !above.empty() && !fs::exists(above, ignored);
       above = above.parent_path()) {
    missing.push_back(above);
  }
  auto made = TRY(MakeFolder(asked_for));
  folder.path_ = std::move(made);
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

}  // namespace trammel::app
