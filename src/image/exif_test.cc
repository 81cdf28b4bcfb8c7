#include "image/exif.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <vector>

namespace trammel::image {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::uint8_t kShort = 3;
constexpr std::uint8_t kLong = 4;

// A width, then the orientation, as cameras write them.
Bytes BigEndian(std::uint8_t orientation, std::uint8_t type = kShort) {
  return {'M', 'M', 0, 42, 0,    0, 0,    8, 0, 2, 1, 0, 0,           3, 0, 0, 0, 1, 0,
          80,  0,   0, 1,  0x12, 0, type, 0, 0, 0, 1, 0, orientation, 0, 0, 0, 0, 0, 0};
}
Bytes LittleEndian(std::uint8_t orientation) {
  return {'I',    'I', 42, 0, 8, 0, 0,           0, 1, 0, 0x12, 1,
          kShort, 0,   1,  0, 0, 0, orientation, 0, 0, 0, 0,    0};
}

TEST(Exif, FindsTheOrientationInBothByteOrders) {
  for (std::uint8_t orientation = 1; orientation <= 8; ++orientation) {
    EXPECT_EQ(ExifOrientation(BigEndian(orientation)), orientation);
    EXPECT_EQ(ExifOrientation(LittleEndian(orientation)), orientation);
  }
}

TEST(Exif, TakesWhatIsNoOrientationForNone) {
  for (const std::uint8_t value : Bytes{0, 9, 255}) EXPECT_EQ(ExifOrientation(BigEndian(value)), 1);
  EXPECT_EQ(ExifOrientation(BigEndian(6, kLong)), 1);
  EXPECT_EQ(ExifOrientation({}), 1);
  Bytes other = BigEndian(6);
  other[3] = 43;
  EXPECT_EQ(ExifOrientation(other), 1);
}

TEST(Exif, ReadsNothingBeyondTheEnd) {
  const Bytes whole = BigEndian(6);
  constexpr std::size_t kBehindTheValue = 32;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_EQ(ExifOrientation(cut), size < kBehindTheValue ? 1 : 6) << size;
  }
  for (const std::size_t at : {4U, 8U}) {  // the directory's place, and the number of its entries
    Bytes far = BigEndian(6);
    far[at] = far[at + 1] = 0xFF;
    const bool many_entries = at == 8U;
    EXPECT_EQ(ExifOrientation(far), many_entries ? 6 : 1) << at;
  }
}

// One entry that leads to the camera's own directory, whose only entry is the focal length.
Bytes Camera(std::uint8_t focal_mm, std::uint8_t directory = 26, std::uint8_t type = kShort) {
  return {'I',  'I', 42, 0,         8, 0, 0,        0, 1, 0, 0x69, 0x87, kLong, 0,    1,
          0,    0,   0,  directory, 0, 0, 0,        0, 0, 0, 0,    1,    0,     0x05, 0xa4,
          type, 0,   1,  0,         0, 0, focal_mm, 0, 0, 0, 0,    0,    0,     0};
}

TEST(Exif, FindsTheFocalLengthInTheCamerasOwnDirectory) {
  EXPECT_EQ(ExifFilmFocal_mm(Camera(48)), 48);
  EXPECT_EQ(ExifFilmFocal_mm(Camera(0)), std::nullopt);
  EXPECT_EQ(ExifFilmFocal_mm(Camera(48, 26, kLong)), std::nullopt);
  EXPECT_EQ(ExifFilmFocal_mm(Camera(48, 200)), std::nullopt);
  EXPECT_EQ(ExifFilmFocal_mm(LittleEndian(6)), std::nullopt);
  EXPECT_EQ(ExifFilmFocal_mm({}), std::nullopt);
}

}  // namespace
}  // namespace trammel::image
