#include "pressure_advance/procedure/pattern_photo.h"

#include <fmt/format.h>

#include <array>
#include <string_view>
#include <utility>

#include "machine/net/json_field.h"

namespace trammel::procedure {
namespace {

using nlohmann::json;

/// Of the folder's own pictures the last one, without its bytes.
Result<PatternPhoto> NewestPhoto(const Session& session,
                                 const std::function<bool(const std::string&)>& is_result) {
  auto photos = ListUploads(session, [&is_result](const std::string& name) {
    return !PictureEnding(name).empty() && !is_result(name);
  });
  if (!photos) return tl::unexpected(photos.error());
  if (!photos->empty()) {
    UploadedFile& newest = photos->back();
    PatternPhoto photo{std::move(newest.name), {}};
    if (newest.modified_s > 0) photo.stored_s = newest.modified_s;
    return photo;
  }
  return Fail(
      fmt::format("there is no photo in the folder {} beside the printer's configuration: upload "
                  "one there (JPEG, PNG, WebP or HEIC)",
                  kUploadFolder));
}

}  // namespace

std::optional<double> ServerTime_s(const Session& session) {
  constexpr double kTell_s = 3;  // also where somebody stops the program: of a print that has ended
  const auto told = session.printer.CallServer("machine.proc_stats", nullptr, {kTell_s, {}});
  const json* const times = told ? machine::Member(*told, "moonraker_stats") : nullptr;
  if (times == nullptr || !times->is_array() || times->empty()) return std::nullopt;
  return machine::Number(times->back(), "time");
}

std::string PictureEnding(const std::string& name) {
  constexpr std::array<std::string_view, 6> kEndings = {".jpg",  ".jpeg", ".png",
                                                        ".webp", ".heic", ".heif"};
  return EndingAmong(kEndings, name);
}

Result<PatternPhoto> DownloadPhoto(const Session& session, const std::string& name,
                                   const std::function<bool(const std::string&)>& is_result) {
  PatternPhoto photo{name, {}};
  if (name.empty()) {
    auto newest = TRY(NewestPhoto(session, is_result));
    photo = std::move(newest);
  } else if (PictureEnding(name).empty()) {
    return Fail(
        fmt::format("{}: must be the name of a picture (.jpg, .png, .webp, .heic) in the "
                    "folder {} beside the printer's configuration",
                    name, kUploadFolder));
  }
  auto bytes = TRY(DownloadUpload(session, photo.name, kMostPhotoBytes));
  photo.bytes = std::move(bytes);
  return photo;
}

}  // namespace trammel::procedure
