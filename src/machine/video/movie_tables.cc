#include "machine/video/movie_tables.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

namespace trammel::machine {
namespace {

constexpr std::int64_t kMostOfTables = 4 << 20;  // a hundred thousand frames take half of it
constexpr std::uint64_t kMostEntries = 5'000'000;
constexpr int kMostBoxes = 10'000;

std::uint64_t BigEndian(const std::uint8_t* bytes, int count) {
  std::uint64_t value = 0;
  for (int i = 0; i < count; ++i) value = value << 8U | bytes[i];
  return value;
}

bool ReadAt(int fd, std::int64_t at, std::uint8_t* out, std::size_t size) {
  return pread(fd, out, size, at) == static_cast<ssize_t>(size);
}

/// How many entries a table states that begins with its name at `at`; 0 where it is none.
std::uint64_t EntriesAt(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  const std::string_view name(reinterpret_cast<const char*>(&bytes[at]), 4);
  std::size_t count_at = 8;  // behind name, version and flags
  if (name == "stsz" || name == "stz2") {
    count_at = 12;  // and the size of all samples
  } else if (name != "trun" && name != "stts" && name != "ctts" && name != "stsc") {
    return 0;
  }
  return at + count_at + 4 <= bytes.size() ? BigEndian(&bytes[at + count_at], 4) : 0;
}

/// Looks for tables wherever they stand: libav takes them at any level.
std::string InspectBox(const std::vector<std::uint8_t>& bytes, std::int64_t file_bytes,
                       std::uint64_t& samples) {
  for (std::size_t at = 0; at + 4 <= bytes.size(); ++at) {
    if (std::string_view(reinterpret_cast<const char*>(&bytes[at]), 4) == "cmov") {
      return "its tables are packed; record it as MJPEG in AVI";
    }
    const std::uint64_t entries = EntriesAt(bytes, at);
    samples += entries;
    const std::uint64_t most = std::min(kMostEntries, static_cast<std::uint64_t>(file_bytes));
    if (entries > most || samples > 8 * most) {
      return fmt::format(
          "its tables state {} entries, more than a recording of {} bytes has; copy it again or "
          "record it again",
          entries > most ? entries : samples, file_bytes);
    }
  }
  return {};
}

}  // namespace

std::string InspectMovieTables(int fd, std::int64_t file_bytes) {
  std::int64_t at = 0;
  std::int64_t tables = 0;
  std::uint64_t samples = 0;
  for (int boxes = 0; at + 8 <= file_bytes; ++boxes) {
    if (boxes == kMostBoxes) return "it has more than ten thousand parts; record it again";
    std::array<std::uint8_t, 16> head{};
    if (!ReadAt(fd, at, head.data(), 8)) return "it cannot be read to its end; copy it again";
    auto size = static_cast<std::int64_t>(BigEndian(head.data(), 4));
    if (size == 1) {
      if (!ReadAt(fd, at, head.data(), 16)) return "it ends early; copy it again";
      size = static_cast<std::int64_t>(BigEndian(&head[8], 8));
    }
    if (size == 0 || size > file_bytes - at) size = file_bytes - at;
    if (size < 8) return "its parts do not follow one another; copy it again";
    if (std::string_view(reinterpret_cast<const char*>(&head[4]), 4) != "mdat") {
      tables += size;
      if (tables > kMostOfTables) {
        return fmt::format(
            "its tables take more than {} MB; record one sweep per file, as MJPEG in AVI",
            kMostOfTables >> 20);
      }
      std::vector<std::uint8_t> bytes(static_cast<std::size_t>(size));
      if (!ReadAt(fd, at, bytes.data(), bytes.size())) return "it ends early; copy it again";
      if (std::string wrong = InspectBox(bytes, file_bytes, samples); !wrong.empty()) return wrong;
    }
    at += size;
  }
  return {};
}

}  // namespace trammel::machine
