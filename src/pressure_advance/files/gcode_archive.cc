#include "pressure_advance/files/gcode_archive.h"

#include <fmt/format.h>
#include <zip.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "base/utf8.h"

namespace trammel::files {
namespace {

constexpr zip_int64_t kMostEntries = 10'000;  // a project has some files for each part and plate
constexpr std::size_t kMostPlates = 36;       // of Bambu Studio and OrcaSlicer

constexpr std::string_view kEnding = ".gcode";

struct Discard {
  void operator()(zip_t* archive) const { zip_discard(archive); }
  void operator()(zip_file_t* file) const { zip_fclose(file); }
};

tl::unexpected<Error> Damaged(const std::string& file, const std::string& why) {
  return Fail(
      fmt::format("{}: is not a whole archive ({}): write it again from the slicer", file, why));
}

Result<std::unique_ptr<zip_t, Discard>> Open(std::string_view bytes, const std::string& file) {
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* source = zip_source_buffer_create(bytes.data(), bytes.size(), 0, &error);
  zip_t* archive = source == nullptr ? nullptr : zip_open_from_source(source, ZIP_RDONLY, &error);
  const std::string why = archive == nullptr ? zip_error_strerror(&error) : "";
  if (archive == nullptr && source != nullptr) zip_source_free(source);
  zip_error_fini(&error);
  if (archive == nullptr) return Damaged(file, why);
  return std::unique_ptr<zip_t, Discard>(archive);
}

// Unpacks an entry. The size that the archive states for it may be wrong.
Result<std::string> Unpack(zip_t* archive, zip_uint64_t index, const std::string& file,
                           std::size_t left_bytes, std::size_t max_bytes) {
  const std::unique_ptr<zip_file_t, Discard> entry(zip_fopen_index(archive, index, 0));
  if (!entry) return Damaged(file, zip_strerror(archive));
  constexpr std::size_t kPiece = std::size_t{1} << 16;
  std::string text;
  while (true) {
    const std::size_t before = text.size();
    text.resize(before + kPiece);
    const zip_int64_t read = zip_fread(entry.get(), text.data() + before, kPiece);
    if (read < 0) return Damaged(file, zip_file_strerror(entry.get()));
    text.resize(before + static_cast<std::size_t>(read));
    if (read == 0) return text;
    if (text.size() > left_bytes) {
      return Fail(fmt::format(
          "{}: the plates up to it are larger than {} bytes: export the pattern's plate alone",
          file, max_bytes));
    }
  }
}

// Returns the name of a plate's file without folder and ending.
std::string NameOf(std::string_view entry) {
  constexpr std::size_t kMaxBytes = 60;
  entry.remove_prefix(entry.rfind('/') + 1);
  entry.remove_suffix(kEnding.size());
  return Utf8OrReplaced(entry, kMaxBytes);
}

}  // namespace

bool IsArchive(std::string_view bytes) { return bytes.starts_with("PK\x03\x04"); }

Result<std::vector<GcodePlate>> ReadGcodeArchive(std::string_view bytes, const std::string& file,
                                                 std::size_t max_bytes) {
  const auto archive = TRY(Open(bytes, file));
  const zip_int64_t entries = zip_get_num_entries(archive.get(), 0);
  if (entries > kMostEntries) {
    return Fail(fmt::format("{}: holds {} files, which no slicer's does", file, entries));
  }
  std::vector<std::pair<std::string, zip_uint64_t>> plates;
  for (zip_int64_t i = 0; i < entries; ++i) {
    const auto index = static_cast<zip_uint64_t>(i);
    const char* const name = zip_get_name(archive.get(), index, 0);
    if (name != nullptr && std::string_view(name).ends_with(kEnding)) {
      plates.emplace_back(name, index);
    }
  }
  if (plates.empty() || plates.size() > kMostPlates) {
    return Fail(fmt::format(
        "{}: holds {} plates of G-code: give the file that the slicer wrote for the printer "
        "(*.gcode or *.gcode.3mf), not the project",
        file, plates.size()));
  }
  // plate_10 follows plate_9.
  std::ranges::sort(plates, {},
                    [](const auto& plate) { return std::pair(plate.first.size(), plate.first); });
  std::vector<GcodePlate> found;
  std::size_t left_bytes = max_bytes;
  for (const auto& [name, index] : plates) {
    const std::string plate = fmt::format("{}, {}", file, name);
    found.push_back(
        {NameOf(name), TRY(Unpack(archive.get(), index, plate, left_bytes, max_bytes))});
    left_bytes -= found.back().gcode.size();
  }
  return found;
}

}  // namespace trammel::files
