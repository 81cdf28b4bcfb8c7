#include "part_alignment/commands/align_record.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <string_view>
#include <system_error>
#include <utility>

#include "app/provenance.h"
#include "files/new_file.h"

namespace trammel::app {

namespace fs = std::filesystem;

AlignmentRecord::AlignmentRecord(fs::path parent, files::AlignmentInput plan)
    : parent_(std::move(parent)), input_(std::move(plan)) {
  input_.pictures.clear();
}

Result<void> AlignmentRecord::CheckPlace() const {
  std::error_code error;
  if (!fs::is_directory(parent_, error)) {
    return Fail(fmt::format("{} is no folder; the pictures are to be kept there: make it",
                            parent_.string()));
  }
  if (access(parent_.c_str(), W_OK | X_OK) != 0) {
    return Fail(fmt::format("{} cannot be written to; the pictures are to be kept there",
                            parent_.string()));
  }
  return {};
}

Result<void> AlignmentRecord::MakeFolder() {
  if (!folder_.empty()) return {};
  const std::string name = app::RecordingName(measurement::Instrument::kPartAlignment);
  std::error_code error;
  constexpr int kMost = 100;
  for (int i = 1; i <= kMost; ++i) {
    const fs::path folder = parent_ / (i == 1 ? name : fmt::format("{}-{}", name, i));
    const bool made = fs::create_directory(folder, error);
    if (error) break;
    if (!made) continue;
    folder_ = folder;
    return {};
  }
  return Fail(fmt::format("no folder for the pictures can be made in {}: {}", parent_.string(),
                          error ? error.message() : "too many are there"));
}

Result<std::string> WritePicture(const fs::path& folder, std::size_t view,
                                 const machine::CapturedFrame& picture) {
  constexpr std::uint8_t kPngBegins = 0x89;
  const bool png = !picture.image.empty() && picture.image.front() == kPngBegins;
  std::string name = fmt::format("view-{:02}.{}", view + 1, png ? "png" : "jpg");
  const std::string_view bytes(reinterpret_cast<const char*>(picture.image.data()),
                               picture.image.size());
  TRY(files::WriteWholeFile(folder / name, bytes, files::IfThere::kReplace));
  return name;
}

Result<void> AlignmentRecord::KeepPicture(std::size_t view, const machine::CapturedFrame& picture) {
  TRY(MakeFolder());
  auto name = TRY(WritePicture(folder_, view, picture));
  input_.pictures.resize(std::max(input_.pictures.size(), view + 1));
  input_.pictures[view] = std::move(name);
  return {};
}

Result<void> AlignmentRecord::KeepObservations(const part_alignment::Measurement& so_far) {
  TRY(MakeFolder());
  input_.measurement = so_far;
  return files::WriteWholeFile(folder_ / "observations.json", files::AlignmentFileText(input_),
                               files::IfThere::kReplace);
}

Error AlignmentRecord::Stopped(const Error& error, const std::vector<std::string>& notices) const {
  if (folder_.empty()) return error;
  std::string text = error.message + "\n";
  for (const std::string& notice : notices) text += notice + "\n";
  // The first error is what counts; a full disk is likely to have been just that.
  const auto written =
      files::WriteWholeFile(folder_ / "stopped.txt", text, files::IfThere::kReplace);
  return {error.kind,
          fmt::format("{}; pictures taken ({}) and what was seen in them are kept in {}{}",
                      error.message, input_.pictures.size(), folder_.string(),
                      written ? "" : " (" + written.error().message + ")")};
}

std::vector<fs::path> AlignmentRecord::pictures() const {
  std::vector<fs::path> paths;
  for (const std::string& name : input_.pictures) {
    paths.push_back(name.empty() ? fs::path() : folder_ / name);
  }
  return paths;
}

}  // namespace trammel::app
