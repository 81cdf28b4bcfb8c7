#include "image/exif.h"

#include <cstddef>

namespace trammel::image {
namespace {

/// Reads numbers in the structure's byte order; 0 beyond its end.
class Tiff {
 public:
  explicit Tiff(std::span<const std::uint8_t> bytes) : bytes_(bytes) {
    const bool little = Is('I');
    const bool big = Is('M');
    big_endian_ = big;
    valid_ = (little || big) && U16(2) == 42;
  }

  [[nodiscard]] bool valid() const { return valid_; }
  [[nodiscard]] std::size_t U16(std::size_t at) const { return Number(at, 2); }
  [[nodiscard]] std::size_t U32(std::size_t at) const { return Number(at, 4); }
  [[nodiscard]] std::size_t size() const { return bytes_.size(); }

 private:
  [[nodiscard]] bool Is(std::uint8_t order) const {
    return bytes_.size() >= 2 && bytes_[0] == order && bytes_[1] == order;
  }
  [[nodiscard]] std::size_t Number(std::size_t at, std::size_t count) const {
    if (at > bytes_.size() || count > bytes_.size() - at) return 0;
    std::size_t value = 0;
    for (std::size_t i = 0; i < count; ++i) {
      value = value << 8U | bytes_[at + (big_endian_ ? i : count - 1 - i)];
    }
    return value;
  }

  std::span<const std::uint8_t> bytes_;
  bool big_endian_ = false;
  bool valid_ = false;
};

constexpr std::size_t kShort = 3;
constexpr std::size_t kLong = 4;

/// Returns the value of a directory's first entry with this tag, if it is one number of the type;
/// else 0.
std::size_t Entry(const Tiff& exif, std::size_t directory, std::size_t tag, std::size_t type) {
  constexpr std::size_t kEntryBytes = 12;
  const std::size_t entries = exif.U16(directory);
  for (std::size_t i = 0; i < entries; ++i) {
    const std::size_t entry = directory + 2 + i * kEntryBytes;
    if (entry >= exif.size()) break;
    if (exif.U16(entry) != tag) continue;
    if (exif.U16(entry + 2) != type) return 0;
    return type == kShort ? exif.U16(entry + 8) : exif.U32(entry + 8);
  }
  return 0;
}

}  // namespace

int ExifOrientation(std::span<const std::uint8_t> tiff) {
  constexpr std::size_t kOrientation = 0x0112;
  const Tiff exif(tiff);
  if (!exif.valid()) return 1;
  const std::size_t value = Entry(exif, exif.U32(4), kOrientation, kShort);
  return value >= 1 && value <= 8 ? static_cast<int>(value) : 1;
}

std::optional<int> ExifFilmFocal_mm(std::span<const std::uint8_t> tiff) {
  constexpr std::size_t kCamera = 0x8769;  // the camera's own directory
  constexpr std::size_t kFocalIn35mmFilm = 0xa405;
  const Tiff exif(tiff);
  if (!exif.valid()) return std::nullopt;
  const std::size_t camera = Entry(exif, exif.U32(4), kCamera, kLong);
  const std::size_t focal_mm = camera == 0 ? 0 : Entry(exif, camera, kFocalIn35mmFilm, kShort);
  if (focal_mm == 0) return std::nullopt;
  return static_cast<int>(focal_mm);
}

}  // namespace trammel::image
