#include "panel/run_files.h"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <system_error>

#include "files/whole_file.h"
#include "service/job_record.h"

namespace trammel::panel {
namespace {

namespace fs = std::filesystem;

struct Servable {
  std::string_view name;
  const char* content_type;
  bool picture = true;
};
constexpr Servable kServable[] = {{service::kAnswerPicture, "image/png"},
                                  {"photo.png", "image/png"},
                                  {"response.png", "image/png"},
                                  {"profiles.png", "image/png"},
                                  {"height_maps.png", "image/png"},
                                  {"result.json", "application/json", false},
                                  {kSurveyTargets, "application/json", false},
                                  {kSurveyPoints, "text/csv; charset=utf-8", false},
                                  {kReport, "text/html; charset=utf-8", false}};

bool IsFile(const fs::path& path) {
  std::error_code gone;
  return fs::is_regular_file(fs::symlink_status(path, gone));
}

// Finds a file in a run's folder, or among its figures; empty: there is none.
fs::path PlaceOf(const fs::path& folder, const Servable& file) {
  const fs::path figures = folder / service::kFiguresFolder;
  std::error_code gone;
  const bool ours = file.picture && fs::is_directory(fs::symlink_status(figures, gone));
  if (ours && IsFile(figures / file.name)) return figures / file.name;
  return IsFile(folder / file.name) ? folder / file.name : fs::path();
}

// Returns the video that was written last; empty: there is none.
fs::path NewestVideo(const fs::path& folder) {
  fs::path newest;
  fs::file_time_type newest_time = fs::file_time_type::min();
  std::error_code error;
  for (fs::directory_iterator file(folder, error), end; !error && file != end;
       file.increment(error)) {
    std::error_code gone;
    if (file->path().extension() != ".avi" || !IsFile(file->path())) continue;
    const auto time = file->last_write_time(gone);
    if (gone || time < newest_time) continue;
    newest = file->path();
    newest_time = time;
  }
  return newest;
}

// Returns the last whole picture at the end of a video that is being written: a chunk of AVI is its
// name, "00dc", its size in four bytes and the picture.
std::string LastPicture(const fs::path& video) {
  constexpr std::uintmax_t kMaxTail = 4 << 20;  // several frames of 1080p
  constexpr std::string_view kName = "00dc";
  constexpr std::string_view kJpeg = "\xff\xd8\xff";
  constexpr std::size_t kHead = 8;
  std::error_code gone;
  const std::uintmax_t size = fs::file_size(video, gone);
  if (gone) return {};
  const std::uintmax_t tail = std::min(size, kMaxTail);
  std::ifstream stream(video, std::ios::binary);
  stream.seekg(static_cast<std::streamoff>(size - tail));
  std::string bytes(tail, '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(tail));
  bytes.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, stream.gcount())));
  for (std::size_t at = bytes.rfind(kName); at != std::string::npos && at > 0;
       at = bytes.rfind(kName, at - 1)) {
    const bool picture =
        at + kHead <= bytes.size() && bytes.compare(at + kHead, kJpeg.size(), kJpeg) == 0;
    if (!picture) continue;
    std::size_t length = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      length |= std::size_t{static_cast<unsigned char>(bytes[at + 4 + i])} << (8 * i);
    }
    if (length <= bytes.size() - at - kHead) return bytes.substr(at + kHead, length);
  }
  return {};
}

}  // namespace

std::optional<RunFile> ReadRunFile(const fs::path& recordings, const std::string& run,
                                   std::string_view name) {
  constexpr std::size_t kMaxBytes = 32 << 20;
  const auto folder = service::FolderOfRun(recordings, run);
  if (!folder) return std::nullopt;
  if (name == kNewestFrame) {
    std::string picture = LastPicture(NewestVideo(*folder));
    if (picture.empty()) return std::nullopt;
    return RunFile{"image/jpeg", std::move(picture)};
  }
  const auto file = std::ranges::find(kServable, name, &Servable::name);
  if (file == std::end(kServable)) return std::nullopt;
  const fs::path place = PlaceOf(*folder, *file);
  auto bytes = files::ReadNamedFile(place, kMaxBytes);
  if (place.empty() || !bytes) return std::nullopt;
  return RunFile{file->content_type, std::move(*bytes)};
}

void AddFiles(const fs::path& folder, nlohmann::json& answer) {
  answer["pictures"] = nlohmann::json::array();
  for (const Servable& file : kServable) {
    if (file.picture && !PlaceOf(folder, file).empty()) answer["pictures"].push_back(file.name);
  }
  answer["report"] = IsFile(folder / kReport) ? nlohmann::json(kReport) : nlohmann::json();
}

}  // namespace trammel::panel
