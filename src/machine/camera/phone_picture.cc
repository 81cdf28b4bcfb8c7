#include "machine/camera/phone_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "machine/module/module.h"
#include "machine/net/file_bytes.h"

namespace trammel::machine {
namespace {

/// Returns the module that decodes a picture, by its first bytes; null if none is needed.
const ModuleName* ModuleFor(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kHead = 12;
  if (bytes.size() < kHead) return nullptr;
  const std::string_view head(reinterpret_cast<const char*>(bytes.data()), kHead);
  if (head.starts_with("RIFF") && head.substr(8) == "WEBP") return &kWebpModule;
  constexpr std::array<std::string_view, 6> kHeic = {"heic", "heix", "heim",
                                                     "heis", "mif1", "msf1"};
  const bool heic = head.substr(4, 4) == "ftyp" &&
                    std::find(kHeic.begin(), kHeic.end(), head.substr(8)) != kHeic.end();
  return heic ? &kHeifModule : nullptr;
}

}  // namespace

Result<Frame> DecodePhoto(std::span<const std::uint8_t> bytes, const ImageReadOptions& options) {
  const ModuleName* const name = ModuleFor(bytes);
  if (name == nullptr) {
    ImageReadOptions turned = options;
    turned.turn_by_exif = true;
    return DecodeImage(bytes, turned);
  }
  const auto module = LoadModule<PictureModule>(*name);
  if (!module) return Fail(fmt::format("{}; or convert it to JPEG or PNG", module.error().message));
  return (*module)->decode(bytes, options);
}

Result<Frame> ReadPhotoFile(const std::filesystem::path& path, const ImageReadOptions& options) {
  const auto named = [&](const Error& error) {
    return tl::unexpected(
        Error{error.kind, fmt::format("photo {}: {}", path.string(), error.message)});
  };
  const Result<std::vector<std::uint8_t>> bytes = ReadFileBytes(path, options.max_bytes);
  if (!bytes) return named(bytes.error());
  Result<Frame> frame = DecodePhoto(*bytes, options);
  if (!frame) return named(frame.error());
  return frame;
}

}  // namespace trammel::machine
