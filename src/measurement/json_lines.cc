#include "measurement/json_lines.h"

#include <array>
#include <fstream>

namespace trammel::files {

namespace fs = std::filesystem;

std::uint64_t Fnv1a(std::string_view text) {
  std::uint64_t hash = 14695981039346656037U;
  for (const unsigned char c : text) hash = (hash ^ c) * 1099511628211U;
  return hash;
}

Result<LinesRead> ForEachLine(const fs::path& path, LinesRead from, const TakeLine& take) {
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (!fs::exists(status)) return Fail(path.string() + ": there is no such file; check the path");
  if (!fs::is_regular_file(status)) return Fail(path.string() + ": is not an ordinary file");
  std::ifstream file(path, std::ios::binary);
  if (!file || !file.seekg(static_cast<std::streamoff>(from.bytes))) {
    return Fail(path.string() + ": cannot be read");
  }
  LinesRead done = from;
  std::string line;
  bool too_long = false;
  std::size_t number = from.ended + 1;
  const auto end_line = [&] {
    if (too_long) {
      take(std::nullopt, number);
    } else if (!line.empty()) {
      take(line, number);
    }
    line.clear();
    too_long = false;
    ++number;
  };
  std::array<char, 1 << 16> piece{};
  while (file.read(piece.data(), piece.size()), file.gcount() > 0) {
    std::string_view rest(piece.data(), static_cast<std::size_t>(file.gcount()));
    done.bytes += rest.size();
    while (!rest.empty()) {
      const std::size_t end = rest.find('\n');
      const std::string_view part = rest.substr(0, end);
      too_long = too_long || line.size() + part.size() > kMostLineBytes;
      if (!too_long) line += part;
      rest.remove_prefix(part.size());
      if (end == std::string_view::npos) break;
      rest.remove_prefix(1);
      ++done.ended;
      end_line();
    }
  }
  if (file.bad()) return Fail(path.string() + ": reading failed");
  end_line();
  return done;
}

}  // namespace trammel::files
