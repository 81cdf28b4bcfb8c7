#include "pressure_advance/files/print_footprint.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "base/file_kind.h"
#include "gcode/footprint_reader.h"

namespace trammel::files {

namespace fs = std::filesystem;

namespace {

constexpr std::uint64_t kMostBytes = std::uint64_t{4} << 30;
constexpr std::size_t kLongestLine = 65536;  // of a polygon; comments hold whole profiles

/// Lines out of pieces.
class LineReader {
 public:
  LineReader(const gcode::PlateArea& plate, double low_mm) : reader_(plate, low_mm) {}

  Result<void> Take(std::string_view piece) {
    while (!piece.empty()) {
      const std::size_t end = piece.find('\n');
      const std::string_view part = piece.substr(0, end);
      if (part.find('\0') != std::string_view::npos) {
        return Fail("holds bytes that no text has: export the print as plain G-code");
      }
      // Of a longer one the beginning tells whether it is a comment.
      line_ += part.substr(0, kLongestLine + 1 - std::min(line_.size(), kLongestLine + 1));
      if (end == std::string_view::npos) return {};
      if (auto done = End(); !done) return done;
      piece.remove_prefix(end + 1);
    }
    return {};
  }

  Result<void> End() {
    ++lines_;
    const std::size_t comment = line_.find(';');
    if (line_.size() > kLongestLine && comment == std::string::npos) {
      return Fail(
          fmt::format("line {} has more than {} characters: is it G-code?", lines_, kLongestLine));
    }
    auto done = reader_.Line(line_);
    line_.clear();
    return done;
  }

  Result<gcode::Footprint> Done() && { return std::move(reader_).Done(); }

 private:
  gcode::FootprintReader reader_;
  std::string line_;
  std::size_t lines_ = 0;
};

}  // namespace

Result<gcode::Footprint> ReadFootprint(const fs::path& path, const gcode::PlateArea& plate,
                                       double low_mm) {
  const auto fail = [&path](const std::string& why) {
    return Fail(fmt::format("{}: {}", path.string(), why));
  };
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (!fs::exists(status)) return fail("there is no such file; check the path");
  if (!fs::is_regular_file(status)) return fail("is no regular file");
  std::ifstream file(path, std::ios::binary);
  if (!file) return fail(fmt::format("cannot be opened: {}", std::strerror(errno)));
  LineReader lines(plate, low_mm);
  std::string piece(std::size_t{1} << 20, '\0');
  std::uint64_t read = 0;
  while (file) {
    file.read(piece.data(), static_cast<std::streamsize>(piece.size()));
    const std::string_view taken(piece.data(), static_cast<std::size_t>(file.gcount()));
    const auto kind = read == 0 ? KindByContent(taken) : std::nullopt;
    if (kind) {
      return fail(fmt::format("is {}{}, which is not read: export the print as plain G-code",
                              kind->name, kind->is_archive ? " (a 3MF is one)" : ""));
    }
    read += taken.size();
    if (read > kMostBytes) return fail("is larger than 4 GiB, which no print needs");
    if (auto done = lines.Take(taken); !done) return fail(done.error().message);
  }
  if (file.bad()) return fail(fmt::format("reading failed: {}", std::strerror(errno)));
  if (auto done = lines.End(); !done) return fail(done.error().message);
  auto print = std::move(lines).Done();
  if (!print) return fail(print.error().message);
  return print;
}

}  // namespace trammel::files
