// Small files that ask for much: each must be refused in little memory and time, by its cause.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <jpeglib.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "machine/page/page_file.h"
#include "support/little_memory.h"
#include "support/sanitized.h"
#include "support/temporary_folder.h"

namespace trammel::machine {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::HasSubstr;

std::string BigEndian(std::uint32_t value) {
  return {static_cast<char>(value >> 24U), static_cast<char>(value >> 16U),
          static_cast<char>(value >> 8U), static_cast<char>(value)};
}

std::string LittleEndian(std::uint32_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text.push_back(static_cast<char>(value >> (8U * i)));
  return text;
}

// Of a chunk of a PNG.
std::uint32_t CheckSum(const std::string& text) {
  std::uint32_t sum = 0xFFFFFFFF;
  for (const char c : text) {
    sum ^= static_cast<std::uint8_t>(c);
    for (int bit = 0; bit < 8; ++bit) sum = (sum >> 1U) ^ ((sum & 1U) != 0 ? 0xEDB88320U : 0U);
  }
  return ~sum;
}

class PageBombs : public testing::Test {
 protected:
  std::string Refusal(const std::string& name, const std::string& bytes) {
    const std::string path = folder_.path() / name;
    test::WriteWhole(path, bytes);
    return RefusalOf(path);
  }
  static std::string RefusalOf(const std::filesystem::path& path) {
    return test::WithLittleMemory([&] {
      const auto pages = ReadPages(path);
      return pages ? std::string("read") : pages.error().message;
    });
  }

 private:
  test::TemporaryFolder folder_;
};

TEST_F(PageBombs, APngHeaderAloneTakesNoMemory) {
  for (const char interlaced : {'\0', '\1'}) {
    std::string header = "IHDR" + BigEndian(63000) + BigEndian(63000) + "\x08\x02";
    header += std::string(2, '\0') + interlaced;
    std::string png = "\x89PNG\r\n\x1A\n" + BigEndian(13) + header + BigEndian(CheckSum(header));
    png += BigEndian(12) + "IDAT" + std::string(16, 'x') + BigEndian(0) + "IEND\xAE\x42\x60\x82";
    EXPECT_THAT(Refusal("a.png", png),
                AllOf(HasSubstr("63000 x 63000 px"), HasSubstr("bytes can hold")));
  }
}

TEST_F(PageBombs, ATiffHeaderAloneTakesNoMemory) {
  constexpr std::uint32_t kShort = 3;
  constexpr std::uint32_t kLong = 4;
  for (const std::uint32_t compression : {1U, 5U, 7U, 8U, 32773U}) {
    for (const std::uint32_t photometric : {2U, 6U}) {
      struct Entry {
        std::uint32_t tag, type, value;
      };
      const std::array<Entry, 10> entries = {{{256, kLong, 63000},
                                              {257, kLong, 63000},
                                              {258, kShort, 8},
                                              {259, kShort, compression},
                                              {262, kShort, photometric},
                                              {273, kLong, 200},
                                              {277, kShort, 3},
                                              {278, kLong, 63000},
                                              {279, kLong, 100},
                                              {284, kShort, 1}}};
      std::string tiff = "II*" + std::string(1, '\0') + LittleEndian(8, 4);
      tiff += LittleEndian(entries.size(), 2);
      for (const Entry& entry : entries) {
        tiff += LittleEndian(entry.tag, 2) + LittleEndian(entry.type, 2) + LittleEndian(1, 4) +
                LittleEndian(entry.value, 4);
      }
      tiff.resize(300);
      EXPECT_THAT(Refusal("a.tif", tiff),
                  AllOf(HasSubstr("63000 x 63000 px"), HasSubstr("300 bytes can hold")))
          << compression;
    }
  }
}

// A grey progressive JPEG whose last scan comes so many times.
std::string ManyScans(int times) {
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  unsigned char* out = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&jpeg, &out, &size);
  jpeg.image_width = 64;
  jpeg.image_height = 64;
  jpeg.input_components = 1;
  jpeg.in_color_space = JCS_GRAYSCALE;
  jpeg_set_defaults(&jpeg);
  jpeg_simple_progression(&jpeg);
  jpeg_start_compress(&jpeg, TRUE);
  std::array<JSAMPLE, 64> row{};
  JSAMPROW rows[] = {row.data()};
  for (int y = 0; y < 64; ++y) jpeg_write_scanlines(&jpeg, rows, 1);
  jpeg_finish_compress(&jpeg);
  std::string bytes(reinterpret_cast<const char*>(out), size);
  jpeg_destroy_compress(&jpeg);
  std::free(out);
  const std::size_t last = bytes.rfind("\xFF\xDA");
  const std::string scan = bytes.substr(last, bytes.size() - 2 - last);
  std::string many = bytes.substr(0, last);
  for (int i = 0; i < times; ++i) many += scan;
  return many + "\xFF\xD9";
}

TEST_F(PageBombs, AJpegOfThousandsOfScansIsRefusedByTheirNumber) {
  EXPECT_THAT(Refusal("a.jpg", ManyScans(5000)),
              AllOf(HasSubstr("500"), HasSubstr("scans, and at most 100 are read")));
}

TEST_F(PageBombs, AJpegThatStatesMoreThanItHoldsIsRefused) {
  std::string jpeg = ManyScans(1);
  std::size_t frame = jpeg.find("\xFF\xC2");
  ASSERT_NE(frame, std::string::npos);
  for (std::size_t i = 0; i < 4; ++i) jpeg[frame + 5 + i] = i % 2 == 0 ? '\xFF' : '\xDC';
  EXPECT_THAT(Refusal("a.jpg", jpeg),
              AllOf(HasSubstr("65500 x 65500 px"), HasSubstr("bytes can hold")));
  // Decoders look for the next marker behind FF 00; a walk by lengths would step over it.
  jpeg.insert(2, std::string("\xFF\x00\x00\x08", 4));
  EXPECT_THAT(Refusal("b.jpg", jpeg), HasSubstr("does not state a size"));
}

TEST_F(PageBombs, APdfMayNotUnpackWithoutEnd) {
  if (test::kSanitized) GTEST_SKIP() << "decoders get no bound on addresses here";
  // Rows of four gigabytes, in the table of the file's own objects.
  const std::string stream(120, 'x');
  EXPECT_THAT(
      Refusal("a.pdf",
              fmt::format("%PDF-1.5\n5 0 obj\n<< /Type /XRef /Size 6 /W [1 2 1] /Root 1 0 R "
                          "/DecodeParms << /Predictor 12 /Columns 2147483647 /Colors 4 "
                          "/BitsPerComponent 16 >> /Filter /FlateDecode /Length {} "
                          ">>\nstream\n{}\nendstream\nendobj\nstartxref\n9\n%%EOF\n",
                          stream.size(), stream)),
      HasSubstr("unpacking it takes more than 256 MB"));
}

TEST_F(PageBombs, TheRealOnesAreRefusedInLittleMemoryAndTime) {
  if (test::kSanitized) GTEST_SKIP() << "decoders get no bound on addresses here";
  const char* data = std::getenv("TRAMMEL_TEST_DATA");
  const std::filesystem::path bombs =
      std::filesystem::path(data != nullptr ? data : "") / "hostile" / "bombs";
  if (data == nullptr || !std::filesystem::is_directory(bombs)) {
    GTEST_SKIP() << "set TRAMMEL_TEST_DATA to the folder with hostile/bombs/";
  }
  int seen = 0;
  for (const auto& entry : std::filesystem::directory_iterator(bombs)) {
    if (entry.path().extension() == ".gcode") continue;
    const std::string said = RefusalOf(entry.path());
    EXPECT_THAT(said, AllOf(HasSubstr("said: page "), HasSubstr(entry.path().filename().string())));
    if (entry.path().extension() == ".pdf") {
      // One of them draws nothing, so that its picture is not looked at.
      EXPECT_THAT(said, AnyOf(HasSubstr("unpacking it takes more"), HasSubstr("no picture")));
    }
    ++seen;
    RecordProperty(entry.path().filename().string(), said);
  }
  EXPECT_GE(seen, 8);
}

}  // namespace
}  // namespace trammel::machine
